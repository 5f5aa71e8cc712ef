//! Collects steps and merges adjacent ones.

use crate::{
    decode::binary::Op,
    schema::{Dialect, NumberType, SchemaError},
};

/// Steps under construction.
#[derive(Default)]
pub(super) struct Block {
    pub(super) steps: Vec<Op>,
    /// Steps after the last read can be dropped.
    read_up_to: usize,
    /// The first field that cannot be skipped, and its position among the steps.
    pub(super) barrier: Option<(usize, String)>,
}

impl Block {
    /// Skips numbers; without padding, a run of numbers of any size is one step.
    pub(super) fn skip(&mut self, number: NumberType, count: u32, dialect: Dialect) {
        let bytes = number.bytes().saturating_mul(count as usize);
        let alignment = match dialect {
            Dialect::Ros2 => number.bytes(),
            Dialect::Ros1 => 1,
        };
        self.skip_bytes(alignment, bytes);
    }

    fn skip_bytes(&mut self, alignment: usize, bytes: usize) {
        // A run that starts at a multiple of its alignment determines the padding after it. Reading
        // steps are never merged into a skip.
        if self.steps.len() > self.read_up_to
            && let Some(Op::Skip {
                alignment: of_run,
                bytes: run,
            }) = self.steps.last_mut()
            && alignment <= *of_run
        {
            let padded = run
                .checked_next_multiple_of(alignment)
                .unwrap_or(usize::MAX);
            *run = padded.saturating_add(bytes);
            return;
        }
        self.steps.push(Op::Skip { alignment, bytes });
    }

    pub(super) fn read(&mut self, step: Op) {
        self.steps.push(step);
        self.read_up_to = self.steps.len();
    }

    /// Adjacent numbers of one type that go into consecutive slots become one step.
    pub(super) fn read_number(&mut self, number: NumberType, slot: usize) {
        if self.steps.len() == self.read_up_to
            && let Some(Op::Numbers {
                number: before,
                slot: first,
                count,
            }) = self.steps.last_mut()
            && *before == number
            && *first + *count == slot
        {
            *count += 1;
            return;
        }
        self.read(Op::Numbers {
            number,
            slot,
            count: 1,
        });
    }

    pub(super) fn up_to_last_read(mut self) -> Result<Vec<Op>, SchemaError> {
        match self.barrier {
            Some((at, field)) if at < self.read_up_to => Err(SchemaError::WideString { field }),
            _ => {
                self.steps.truncate(self.read_up_to);
                Ok(self.steps)
            }
        }
    }
}

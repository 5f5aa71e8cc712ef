//! Walks consecutive records in memory: the content of a chunk.

use std::ops::{ControlFlow, Range};

use tipwatch_language::{message, told};

use super::{
    grammar::{Frame, Grammar, Kind},
    parsed::MessageRecord,
    visitor::{Next, Visitor},
};

/// Counts of the messages in a sequence of records, and of its damage.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) messages: u64,
    undefined_channel: u64,
    unreadable: u64,
    contradictory: u64,
    /// Ranges of bytes that are not records.
    gaps: Vec<Range<usize>>,
    /// Log times of the first and the last message.
    pub(super) span_ns: Option<(i64, i64)>,
}

impl Tally {
    /// Walks verified records.
    pub(super) fn walk_intact<G: Grammar, V: Visitor>(
        &mut self,
        content: &[u8],
        visitor: &mut V,
    ) -> ControlFlow<()> {
        let mut rest = content;
        while !rest.is_empty() {
            let Some((kind, record, next)) = G::split(rest) else {
                self.gaps.push(content.len() - rest.len()..content.len());
                break;
            };
            rest = next;
            self.record::<G, V>(kind, record, visitor)?;
        }
        ControlFlow::Continue(())
    }

    /// Walks unverified records: each must be followed by another one, else the next is searched
    /// for.
    pub(super) fn walk_unverified<G: Grammar, V: Visitor>(
        &mut self,
        content: &[u8],
        visitor: &mut V,
    ) -> ControlFlow<()> {
        let mut at = 0;
        let mut frame = frame_at::<G>(content, at);
        while at < content.len() {
            let Some(current) = frame else {
                let next = self.next_record::<G, V>(content, at + 1..content.len(), visitor);
                (at, frame) = self.resume::<G>(content, at, next.unwrap_or(content.len()));
                continue;
            };
            // The frame fits into memory, so its length does too.
            let end = at + current.length_bytes as usize;
            let following = frame_at::<G>(content, end);
            let is_followed = following.is_some() || end == content.len();
            if !is_followed
                && !current.is_certain
                && let Some(inner) = self.next_record::<G, V>(content, at + 1..end, visitor)
            {
                // The length is wrong: another record begins inside.
                (at, frame) = self.resume::<G>(content, at, inner);
                continue;
            }
            let record = content.get(at..end).unwrap_or_default();
            self.record::<G, V>(current.kind, record, visitor)?;
            (at, frame) = (end, following);
        }
        ControlFlow::Continue(())
    }

    /// Notes a gap and resumes behind it.
    fn resume<G: Grammar>(
        &mut self,
        content: &[u8],
        from: usize,
        to: usize,
    ) -> (usize, Option<Frame>) {
        self.gaps.push(from..to);
        (to, frame_at::<G>(content, to))
    }

    /// The first position of a record that is certain, is followed by another one, or is a likely
    /// message.
    fn next_record<G: Grammar, V: Visitor>(
        &self,
        content: &[u8],
        mut places: Range<usize>,
        visitor: &V,
    ) -> Option<usize> {
        let near_ns = self.span_ns.map(|(_, last_ns)| last_ns);
        places.find(|&at| {
            frame_at::<G>(content, at).is_some_and(|frame| {
                let end = at + frame.length_bytes as usize;
                let likely = || {
                    let message = G::message(content.get(at..end)?)?;
                    Some(visitor.is_likely(&message, near_ns))
                };
                frame.is_unmistakable
                    || end == content.len()
                    || frame_at::<G>(content, end).is_some()
                    || frame.kind == Kind::Message && likely() == Some(true)
            })
        })
    }

    pub(super) fn record<G: Grammar, V: Visitor>(
        &mut self,
        kind: Kind,
        record: &[u8],
        visitor: &mut V,
    ) -> ControlFlow<()> {
        match kind {
            Kind::Message => match G::message(record) {
                Some(message) => self.message(&message, visitor)?,
                None => self.unreadable += 1,
            },
            Kind::Definition => {
                let mut contradictory = 0;
                let is_read = G::definition(record, &mut |definition| {
                    contradictory += u64::from(!visitor.definition(&definition));
                });
                self.contradictory += contradictory;
                self.unreadable += u64::from(!is_read);
            }
            Kind::Unknown => self.unreadable += 1,
            Kind::Chunk | Kind::Index | Kind::End | Kind::Other => {}
        }
        ControlFlow::Continue(())
    }

    #[inline]
    fn message<V: Visitor>(
        &mut self,
        message: &MessageRecord<'_>,
        visitor: &mut V,
    ) -> ControlFlow<()> {
        self.messages += 1;
        let time_ns = message.log_time_ns;
        self.span_ns = Some((self.span_ns.map_or(time_ns, |span| span.0), time_ns));
        match visitor.message(message) {
            Next::Continue => ControlFlow::Continue(()),
            Next::Stop => ControlFlow::Break(()),
            Next::UndefinedChannel => {
                self.undefined_channel += 1;
                ControlFlow::Continue(())
            }
        }
    }

    /// The number of problems.
    pub(super) fn problems(&self) -> u64 {
        self.undefined_channel + self.unreadable + self.contradictory + self.gaps.len() as u64
    }

    pub(super) fn gaps(&self) -> &[Range<usize>] {
        &self.gaps
    }

    pub(super) fn reason(&self) -> Option<String> {
        let gap_bytes: usize = self.gaps.iter().map(Range::len).sum();
        let counted = [
            (
                self.undefined_channel,
                message!("messages of undefined channels"),
            ),
            (self.unreadable, message!("unreadable records")),
            (
                self.contradictory,
                message!("contradictory definitions of a channel (the first is kept)"),
            ),
            (
                gap_bytes as u64,
                message!("bytes of content that are not records"),
            ),
        ];
        let found = counted.iter().filter(|(count, _)| *count > 0);
        let parts: Vec<String> = found
            .map(|(count, what)| format!("{count} {}", told(what)))
            .collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}

/// The record at the front of `bytes`, if it ends within them.
fn fitting_frame<G: Grammar>(bytes: &[u8]) -> Option<Frame> {
    let head = bytes.get(..G::HEAD_BYTES.min(bytes.len()))?;
    let frame = G::frame(head)?;
    let fits = frame.kind != Kind::Unknown && frame.length_bytes <= bytes.len() as u64;
    fits.then_some(frame)
}

fn frame_at<G: Grammar>(content: &[u8], at: usize) -> Option<Frame> {
    content.get(at..).and_then(fitting_frame::<G>)
}

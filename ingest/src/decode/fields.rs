//! The values that a layout reads from a message.

use std::ops::Range;

/// The values of one message, in the order of the layout's paths. Reuse one instance for all
/// messages, so that decoding does not allocate.
///
/// The kind of field at a path determines which accessor applies. The others return NaN or nothing.
#[derive(Debug, Clone, Default)]
pub struct Fields {
    /// Single numbers, stored separately, so that adjacent ones are copied as one block.
    pub(crate) singles: Vec<f64>,
    pub(crate) slots: Vec<Slot>,
}

/// Values of paths that do not lead to a single number.
#[derive(Debug, Clone, Default)]
pub(crate) struct Slot {
    pub(crate) numbers: Vec<f64>,
    pub(crate) text: Vec<u8>,
    pub(crate) texts: Texts,
    /// Strings of the current message, before comparison with the previous one.
    incoming: Texts,
}

/// A list of strings in encoded form, because it usually equals that of the previous message.
#[derive(Debug, Clone, Default)]
pub(crate) struct Texts {
    pub(crate) encoded: Vec<u8>,
    pub(crate) big_endian: bool,
    /// Whether `encoded` is a complete list as found in a message.
    pub(crate) is_whole: bool,
    pub(crate) items: Vec<Range<usize>>,
    pub(crate) revision: u64,
}

impl Texts {
    pub(crate) fn clear(&mut self) {
        self.encoded.clear();
        self.items.clear();
        self.is_whole = false;
        self.revision += 1;
    }

    /// Adds a single string.
    pub(crate) fn collect(&mut self, text: &[u8]) {
        let start = self.encoded.len();
        self.encoded.extend_from_slice(text);
        self.items.push(start..self.encoded.len());
    }
}

impl Fields {
    /// No values yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// The number at a path.
    #[inline]
    pub fn number(&self, path_index: usize) -> f64 {
        self.singles.get(path_index).copied().unwrap_or(f64::NAN)
    }

    /// All numbers of the array at a path.
    #[inline]
    pub fn numbers(&self, path_index: usize) -> &[f64] {
        self.slots
            .get(path_index)
            .map(|slot| slot.numbers.as_slice())
            .unwrap_or_default()
    }

    /// The bytes of the string at a path, without the closing zero.
    pub fn text(&self, path_index: usize) -> &[u8] {
        self.slots
            .get(path_index)
            .map(|slot| slot.text.as_slice())
            .unwrap_or_default()
    }

    /// The strings of the array at a path.
    pub fn texts(&self, path_index: usize) -> impl Iterator<Item = &[u8]> {
        let texts = self.slots.get(path_index).map(|slot| &slot.texts);
        texts.into_iter().flat_map(|texts| {
            let item = |range: &Range<usize>| texts.encoded.get(range.clone()).unwrap_or_default();
            texts.items.iter().map(item)
        })
    }

    /// Changes whenever the strings at a path differ from those of the previous message.
    #[inline]
    pub fn texts_revision(&self, path_index: usize) -> u64 {
        self.slots
            .get(path_index)
            .map_or(0, |slot| slot.texts.revision)
    }

    /// Clears the previous message; needed where an encoding may omit fields.
    pub(crate) fn begin(&mut self, path_count: usize) {
        self.prepare(path_count);
        self.singles.fill(f64::NAN);
        for slot in &mut self.slots {
            slot.numbers.clear();
            slot.text.clear();
            slot.incoming.clear();
        }
    }

    /// Clears the values at one path.
    pub(crate) fn forget(&mut self, path_index: usize) {
        if let Some(single) = self.singles.get_mut(path_index) {
            *single = f64::NAN;
        }
        if let Some(slot) = self.slots.get_mut(path_index) {
            slot.numbers.clear();
            slot.text.clear();
            if !slot.texts.items.is_empty() {
                slot.texts.clear();
            }
        }
    }

    /// Ends a message after [`begin`](Self::begin).
    pub(crate) fn end(&mut self) {
        for Slot {
            texts, incoming, ..
        } in &mut self.slots
        {
            if (&texts.encoded, &texts.items) != (&incoming.encoded, &incoming.items) {
                std::mem::swap(&mut texts.encoded, &mut incoming.encoded);
                std::mem::swap(&mut texts.items, &mut incoming.items);
                texts.is_whole = false;
                texts.revision += 1;
            }
        }
    }

    /// Stores the number at a path, or one of an array.
    pub(crate) fn take_number(&mut self, path_index: usize, number: f64, is_in_array: bool) {
        if is_in_array {
            if let Some(slot) = self.slots.get_mut(path_index) {
                slot.numbers.push(number);
            }
        } else if let Some(single) = self.singles.get_mut(path_index) {
            *single = number;
        }
    }

    /// Stores the string at a path, or one of an array.
    pub(crate) fn take_text(&mut self, path_index: usize, text: &[u8], is_in_array: bool) {
        let Some(slot) = self.slots.get_mut(path_index) else {
            return;
        };
        if is_in_array {
            slot.incoming.collect(text);
        } else {
            slot.text.clear();
            slot.text.extend_from_slice(text);
        }
    }

    /// Reads a message of an array that has a value at each of these paths: their arrays then have one more each. A number that
    /// the message lacks is NaN, a string is empty, and of several the last one counts. Else the values of all that follow would be
    /// taken for those of their neighbours.
    pub(crate) fn element<E>(
        &mut self,
        path_indices: &[usize],
        read: impl FnOnce(&mut Self) -> Result<(), E>,
    ) -> Result<(), E> {
        let counts = |&at: &usize| {
            let slot = self.slots.get(at);
            slot.map_or([0; 2], |slot| {
                [slot.numbers.len(), slot.incoming.items.len()]
            })
        };
        let before: Vec<[usize; 2]> = path_indices.iter().map(counts).collect();
        read(self)?;
        for (&at, [numbers, texts]) in path_indices.iter().zip(before) {
            let Some(Slot {
                numbers: all,
                incoming,
                ..
            }) = self.slots.get_mut(at)
            else {
                continue;
            };
            match all.len() > numbers {
                true => drop(all.drain(numbers..all.len() - 1)),
                false => all.push(f64::NAN),
            }
            match incoming.items.len() > texts {
                true => drop(incoming.items.drain(texts..incoming.items.len() - 1)),
                false => incoming.collect(b""),
            }
        }
        Ok(())
    }

    /// The numbers of consecutive paths.
    #[inline]
    pub(crate) fn neighbours(&self, first: usize, count: usize) -> &[f64] {
        self.singles.get(first..first + count).unwrap_or_default()
    }

    /// Allocates slots for `count` paths.
    #[inline]
    pub(crate) fn prepare(&mut self, path_count: usize) {
        if self.slots.len() != path_count {
            self.slots.resize_with(path_count, Slot::default);
            self.singles.resize(path_count, f64::NAN);
        }
    }
}

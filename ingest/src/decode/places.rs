//! Positions of the numbers of a message: in the next messages of a topic they are usually at the same offsets.
//!
//! Steps find the offsets by following every length in a message. Two messages of the same length whose lengths and
//! strings are equal, too, have all numbers at the same offsets, and decoding one fails where decoding the other does.

use std::ops::Range;

use super::binary::{self, Count, Cursor, Op};
use crate::schema::{Dialect, NumberType};

/// Bytes between two fields that are at most padding.
const MOST_PADDING_BYTES: usize = 7;

/// The encapsulation of CDR whose numbers are in little-endian order.
const LITTLE_ENDIAN: &[u8] = &[0, 1];

/// The numbers by path, and the ranges that determine where they are.
type Found = (Vec<Option<NumberPlace>>, Vec<Range<usize>>);

/// Positions of the numbers of a message.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    message_bytes: usize,
    encapsulation: &'static [u8],
    /// The lengths and strings in the message, each with its offset.
    determining: Vec<(usize, Vec<u8>)>,
    /// Numbers by path; `None` for strings.
    numbers: Vec<Option<NumberPlace>>,
}

/// Position of consecutive numbers of one type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NumberPlace {
    pub(crate) number: NumberType,
    pub(crate) offset: usize,
    pub(crate) count: usize,
}

impl Places {
    /// The places in a message that the steps decode; `None` if they depend on more than its lengths, or for numbers in
    /// big-endian order.
    pub(super) fn of(
        steps: &[Op],
        dialect: Dialect,
        message: &[u8],
        path_count: usize,
    ) -> Option<Self> {
        let (encapsulation, start) = match dialect {
            Dialect::Ros2 => (LITTLE_ENDIAN, binary::ENCAPSULATION_BYTES),
            Dialect::Ros1 => (&[][..], 0),
        };
        let data = message.get(start..)?;
        if !message.starts_with(encapsulation) {
            return None;
        }
        let (numbers, determining) = match dialect {
            Dialect::Ros2 => Finder::<true>::find(steps, data, path_count),
            Dialect::Ros1 => Finder::<false>::find(steps, data, path_count),
        }?;
        let bytes = |range: Range<usize>| Some((range.start, message.get(range)?.to_vec()));
        Some(Self {
            message_bytes: message.len(),
            encapsulation,
            determining: determining.into_iter().map(bytes).collect::<Option<_>>()?,
            numbers,
        })
    }

    /// Whether the numbers of another message are at these places.
    #[inline]
    pub(crate) fn are_those_of(&self, message: &[u8]) -> bool {
        let is_equal = |(offset, bytes): &(usize, Vec<u8>)| {
            let rest = message.get(*offset..);
            rest.is_some_and(|rest| rest.starts_with(bytes))
        };
        message.len() == self.message_bytes
            && message.starts_with(self.encapsulation)
            && self.determining.iter().all(is_equal)
    }

    /// Returns the position of the numbers of a path.
    pub(crate) fn numbers(&self, path_index: usize) -> Option<NumberPlace> {
        *self.numbers.get(path_index)?
    }
}

impl NumberPlace {
    /// Returns the position of some of the numbers; `None` if the place does not have them all.
    pub(crate) fn part(self, range: Range<usize>) -> Option<Self> {
        (range.start <= range.end && range.end <= self.count).then(|| Self {
            offset: self.offset + range.start * self.number.bytes(),
            count: range.len(),
            ..self
        })
    }

    /// Reads the first of the numbers in a message; NaN if the message ends before it.
    #[inline]
    pub(crate) fn first_in(self, message: &[u8]) -> f64 {
        let bytes = message.get(self.offset..).unwrap_or_default();
        binary::number_from::<false>(self.number, bytes)
    }
}

/// Walks through a message as decoding does.
struct Finder<'a, const CDR: bool> {
    cursor: Cursor<'a, false, CDR>,
    numbers: Vec<Option<NumberPlace>>,
    determining: Vec<Range<usize>>,
    /// Whether no number was passed since the last length or string.
    is_adjacent: bool,
}

impl<'a, const CDR: bool> Finder<'a, CDR> {
    /// Offset of the data within the message.
    const START: usize = Cursor::<'a, false, CDR>::START;

    /// Finds the numbers by path, and the bytes that determine their positions.
    fn find(steps: &[Op], data: &'a [u8], path_count: usize) -> Option<Found> {
        let mut finder = Self {
            cursor: Cursor { data, position: 0 },
            numbers: vec![None; path_count],
            determining: Vec::new(),
            is_adjacent: false,
        };
        finder.follow(steps)?;
        Some((finder.numbers, finder.determining))
    }

    fn follow(&mut self, steps: &[Op]) -> Option<()> {
        for step in steps {
            match step {
                Op::Skip { alignment, bytes } => {
                    self.cursor.align(*alignment);
                    self.cursor.take(*bytes).ok()?;
                    self.is_adjacent = false;
                }
                Op::SkipSequence { number } => {
                    self.array(*number, Count::InMessage)?;
                }
                Op::SkipTexts { count } | Op::Texts { count, .. } => self.texts(*count)?,
                Op::Text { .. } => self.texts(Count::Fixed(1))?,
                Op::Numbers {
                    number,
                    slot,
                    count,
                } => {
                    let all = self.array(*number, Count::Fixed(*count))?;
                    for index in 0..*count {
                        *self.numbers.get_mut(slot + index)? = all.part(index..index + 1);
                    }
                }
                Op::NumberArray {
                    number,
                    count,
                    whole,
                    elements,
                } => {
                    let all = self.array(*number, *count)?;
                    if let Some(whole) = whole {
                        *self.numbers.get_mut(*whole)? = Some(all);
                    }
                    for element in elements {
                        let one = all.part(element.index..element.index.checked_add(1)?)?;
                        *self.numbers.get_mut(element.slot)? = Some(one);
                    }
                }
                Op::Repeat { .. }
                | Op::RepeatExcept { .. }
                | Op::CollectNumber { .. }
                | Op::CollectText { .. } => {
                    return None;
                }
            }
        }
        Some(())
    }

    fn array(&mut self, number: NumberType, count: Count) -> Option<NumberPlace> {
        let count = match count {
            Count::Fixed(count) => count,
            Count::InMessage => {
                self.cursor.align(4);
                let from = self.cursor.position;
                let count = self.cursor.count(count, number.bytes()).ok()?;
                self.determined_by(from);
                count
            }
        };
        let bytes = self.cursor.array(number, count).ok()?;
        self.is_adjacent = false;
        Some(NumberPlace {
            number,
            offset: Self::START + self.cursor.position - bytes.len(),
            count,
        })
    }

    fn texts(&mut self, count: Count) -> Option<()> {
        self.cursor.align(4);
        let from = self.cursor.position;
        for _ in 0..self.cursor.count(count, 4).ok()? {
            self.cursor.text_place().ok()?;
        }
        self.determined_by(from);
        Some(())
    }

    /// Notes that everything from here to the cursor determines where the rest is.
    fn determined_by(&mut self, from: usize) {
        let range = Self::START + from..Self::START + self.cursor.position;
        match self.determining.last_mut() {
            Some(last) if self.is_adjacent && range.start <= last.end + MOST_PADDING_BYTES => {
                last.end = range.end;
            }
            _ => self.determining.push(range),
        }
        self.is_adjacent = true;
    }
}

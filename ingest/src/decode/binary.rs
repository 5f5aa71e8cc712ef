//! Executes the steps of a layout on one binary message: CDR (Common Data Representation) of either
//! byte order, or ROS 1.
//!
//! CDR aligns values to multiples of their size, counted from the end of the four-byte
//! encapsulation header, and terminates strings with a zero. ROS 1 does neither. Every length is
//! checked against the message before it is followed or allocated.

use std::ops::Range;

use super::{
    error::DecodeError,
    fields::{Fields, Texts},
};
use crate::schema::NumberType;

pub(super) const ENCAPSULATION_BYTES: usize = 4;

/// The number of elements of an array.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Count {
    Fixed(usize),
    /// Encoded before the elements.
    InMessage,
}

/// One element of an array and its slot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Element {
    pub(crate) index: usize,
    pub(crate) slot: usize,
}

/// The steps for one message in an array.
#[derive(Debug, Clone)]
pub(crate) struct Pick {
    pub(crate) index: usize,
    pub(crate) body: Vec<Op>,
}

/// One step through a message.
#[derive(Debug, Clone)]
pub(crate) enum Op {
    Skip {
        alignment: usize,
        bytes: usize,
    },
    SkipSequence {
        number: NumberType,
    },
    SkipTexts {
        count: Count,
    },
    /// `count` numbers into consecutive slots from `slot`.
    Numbers {
        number: NumberType,
        slot: usize,
        count: usize,
    },
    NumberArray {
        number: NumberType,
        count: Count,
        whole: Option<usize>,
        elements: Vec<Element>,
    },
    Text {
        slot: usize,
    },
    Texts {
        count: Count,
        slot: usize,
    },
    /// The same steps for each message in an array.
    Repeat {
        count: Count,
        body: Vec<Op>,
    },
    /// The same steps for each message in an array, but others for some.
    RepeatExcept {
        count: Count,
        body: Vec<Op>,
        picks: Vec<Pick>,
        /// Slots for the values of the picked messages; cleared first, because the array may be shorter.
        slots: Vec<usize>,
    },
    CollectNumber {
        number: NumberType,
        slot: usize,
    },
    CollectText {
        slot: usize,
    },
}

/// Executes all steps on one ROS 1 message.
#[inline]
pub(crate) fn run_ros1(steps: &[Op], data: &[u8], fields: &mut Fields) -> Result<(), DecodeError> {
    Cursor::<false, false> { data, position: 0 }.steps(steps, fields)
}

/// Executes all steps on one CDR message.
#[inline]
pub(crate) fn run_cdr(steps: &[Op], cdr: &[u8], fields: &mut Fields) -> Result<(), DecodeError> {
    let Some((encapsulation, data)) = cdr.split_first_chunk::<ENCAPSULATION_BYTES>() else {
        return Err(DecodeError::TooShort {
            offset: 0,
            needed_bytes: ENCAPSULATION_BYTES,
            available_bytes: cdr.len(),
        });
    };
    match u16::from_be_bytes([encapsulation[0], encapsulation[1]]) {
        0x0000 => Cursor::<true, true> { data, position: 0 }.steps(steps, fields),
        0x0001 => Cursor::<false, true> { data, position: 0 }.steps(steps, fields),
        found => Err(DecodeError::Encapsulation {
            found,
            name: encapsulation_name(found),
        }),
    }
}

fn encapsulation_name(encapsulation: u16) -> &'static str {
    match encapsulation {
        0x0002 | 0x0003 => "PL_CDR",
        0x0006..=0x0009 => "XCDR2",
        0x000a | 0x000b => "PL_CDR2",
        // The first bytes of a zstd frame.
        0x28b5 => "a zstd-compressed message",
        _ => "unknown",
    }
}

/// A position in the data, in CDR after the encapsulation header. It may lie beyond the end, where
/// every read fails.
pub(super) struct Cursor<'a, const BIG_ENDIAN: bool, const CDR: bool> {
    pub(super) data: &'a [u8],
    pub(super) position: usize,
}

impl<'a, const BIG_ENDIAN: bool, const CDR: bool> Cursor<'a, BIG_ENDIAN, CDR> {
    /// Offset of the data within the message.
    pub(super) const START: usize = if CDR { ENCAPSULATION_BYTES } else { 0 };

    fn steps(&mut self, steps: &[Op], fields: &mut Fields) -> Result<(), DecodeError> {
        for step in steps {
            match step {
                Op::Skip { alignment, bytes } => {
                    self.align(*alignment);
                    self.take(*bytes)?;
                }
                Op::SkipSequence { number } => {
                    let count = self.count(Count::InMessage, number.bytes())?;
                    self.array(*number, count)?;
                }
                Op::SkipTexts { count } => {
                    for _ in 0..self.count(*count, 4)? {
                        self.text()?;
                    }
                }
                Op::Numbers {
                    number,
                    slot,
                    count,
                } => {
                    let bytes = self.array(*number, *count)?;
                    if let Some(targets) = fields.singles.get_mut(*slot..*slot + *count) {
                        put_numbers::<BIG_ENDIAN>(*number, bytes, targets);
                    }
                }
                Op::NumberArray {
                    number,
                    count,
                    whole,
                    elements,
                } => {
                    self.number_array(*number, *count, *whole, elements, fields)?;
                }
                Op::Text { slot } => {
                    let text = self.text()?;
                    if let Some(slot) = fields.slots.get_mut(*slot) {
                        slot.text.clear();
                        slot.text.extend_from_slice(text);
                    }
                }
                Op::Texts { count, slot } => {
                    if let Some(slot) = fields.slots.get_mut(*slot) {
                        self.texts(*count, &mut slot.texts)?;
                    }
                }
                Op::Repeat { count, body } => {
                    // Every message takes at least one byte, so the count bounds the work.
                    for _ in 0..self.count(*count, 1)? {
                        self.steps(body, fields)?;
                    }
                }
                Op::RepeatExcept {
                    count,
                    body,
                    picks,
                    slots,
                } => {
                    slots.iter().for_each(|slot| fields.forget(*slot));
                    for index in 0..self.count(*count, 1)? {
                        let pick = picks.iter().find(|pick| pick.index == index);
                        self.steps(pick.map_or(body, |pick| &pick.body), fields)?;
                    }
                }
                Op::CollectNumber { number, slot } => {
                    let bytes = self.array(*number, 1)?;
                    if let Some(slot) = fields.slots.get_mut(*slot) {
                        slot.numbers.push(number_from::<BIG_ENDIAN>(*number, bytes));
                    }
                }
                Op::CollectText { slot } => {
                    let text = self.text()?;
                    if let Some(slot) = fields.slots.get_mut(*slot) {
                        slot.texts.collect(text);
                    }
                }
            }
        }
        Ok(())
    }

    #[inline]
    pub(super) fn align(&mut self, alignment: usize) {
        if !CDR {
            return;
        }
        // The alignment is a power of two up to eight, so the position is at most slightly beyond
        // the data.
        self.position = (self.position + alignment - 1) & !(alignment - 1);
    }

    #[inline]
    pub(super) fn take(&mut self, bytes: usize) -> Result<&'a [u8], DecodeError> {
        match self
            .data
            .get(self.position..)
            .and_then(|rest| rest.get(..bytes))
        {
            Some(taken) => {
                self.position += bytes;
                Ok(taken)
            }
            None => Err(self.too_short(bytes)),
        }
    }

    #[cold]
    fn too_short(&self, needed_bytes: usize) -> DecodeError {
        DecodeError::TooShort {
            offset: self.position + Self::START,
            needed_bytes,
            available_bytes: self.data.len().saturating_sub(self.position),
        }
    }

    #[inline]
    fn u32(&mut self) -> Result<u32, DecodeError> {
        self.align(4);
        let rest = self
            .data
            .get(self.position..)
            .and_then(<[u8]>::first_chunk::<4>);
        let Some(bytes) = rest else {
            return Err(self.too_short(4));
        };
        self.position += 4;
        Ok(if BIG_ENDIAN {
            u32::from_be_bytes(*bytes)
        } else {
            u32::from_le_bytes(*bytes)
        })
    }

    /// Reads the number of elements, each of which takes at least `element_bytes`.
    #[inline]
    pub(super) fn count(
        &mut self,
        count: Count,
        element_bytes: usize,
    ) -> Result<usize, DecodeError> {
        let count = match count {
            Count::Fixed(count) => return Ok(count),
            Count::InMessage => self.u32()? as usize,
        };
        let available_bytes = self.data.len().saturating_sub(self.position);
        if count > available_bytes / element_bytes {
            let offset = (self.position + Self::START).saturating_sub(4);
            return Err(DecodeError::ImpossibleCount {
                offset,
                count,
                available_bytes,
            });
        }
        Ok(count)
    }

    /// The bytes of an array. An empty array has no padding before it.
    #[inline]
    pub(super) fn array(
        &mut self,
        number: NumberType,
        count: usize,
    ) -> Result<&'a [u8], DecodeError> {
        if count == 0 {
            return Ok(&[]);
        }
        self.align(number.bytes());
        self.take(number.bytes().saturating_mul(count))
    }

    #[inline]
    fn text(&mut self) -> Result<&'a [u8], DecodeError> {
        let place = self.text_place()?;
        Ok(self.data.get(place).unwrap_or_default())
    }

    /// The range of a string, without the terminating zero of CDR.
    #[inline]
    pub(super) fn text_place(&mut self) -> Result<Range<usize>, DecodeError> {
        let bytes = self.count(Count::InMessage, 1)?;
        let start = self.position;
        let closing = usize::from(self.take(bytes)?.ends_with(&[0]) && CDR);
        Ok(start..start + bytes - closing)
    }

    #[inline]
    fn number_array(
        &mut self,
        number: NumberType,
        count: Count,
        whole: Option<usize>,
        elements: &[Element],
        fields: &mut Fields,
    ) -> Result<(), DecodeError> {
        let count = self.count(count, number.bytes())?;
        let bytes = self.array(number, count)?;
        if let Some(slot) = whole.and_then(|slot| fields.slots.get_mut(slot)) {
            slot.numbers.clear();
            extend_numbers::<BIG_ENDIAN>(number, bytes, &mut slot.numbers);
        }
        for element in elements {
            let start = element.index.saturating_mul(number.bytes());
            let one = bytes.get(start..).unwrap_or_default();
            if let Some(target) = fields.singles.get_mut(element.slot) {
                *target = number_from::<BIG_ENDIAN>(number, one);
            }
        }
        Ok(())
    }

    /// A list of strings. It usually equals that of the previous message byte by byte; then its end
    /// is known without parsing.
    #[inline]
    fn texts(&mut self, count: Count, texts: &mut Texts) -> Result<(), DecodeError> {
        self.align(4);
        let start = self.position;
        let rest = self.data.get(start..).unwrap_or_default();
        let is_known = texts.is_whole && texts.big_endian == BIG_ENDIAN;
        if is_known && rest.starts_with(&texts.encoded) {
            self.position = start + texts.encoded.len();
            return Ok(());
        }
        self.new_texts(count, texts, start)
    }

    #[cold]
    fn new_texts(
        &mut self,
        count: Count,
        texts: &mut Texts,
        start: usize,
    ) -> Result<(), DecodeError> {
        texts.clear();
        for _ in 0..self.count(count, 4)? {
            let place = self.text_place()?;
            texts.items.push(place.start - start..place.end - start);
        }
        let encoded = self.data.get(start..self.position).unwrap_or_default();
        texts.encoded.extend_from_slice(encoded);
        texts.big_endian = BIG_ENDIAN;
        texts.is_whole = true;
        Ok(())
    }
}

/// Decodes one number from `bytes` for each target.
#[inline]
fn put_numbers<const BIG_ENDIAN: bool>(number: NumberType, bytes: &[u8], targets: &mut [f64]) {
    if number == NumberType::F64 {
        let (doubles, _) = bytes.as_chunks();
        for (target, double) in targets.iter_mut().zip(doubles) {
            *target = double_from::<BIG_ENDIAN>(double);
        }
        return;
    }
    for (target, one) in targets.iter_mut().zip(bytes.chunks_exact(number.bytes())) {
        *target = number_from::<BIG_ENDIAN>(number, one);
    }
}

/// Appends all numbers in `bytes`.
#[inline]
fn extend_numbers<const BIG_ENDIAN: bool>(
    number: NumberType,
    bytes: &[u8],
    numbers: &mut Vec<f64>,
) {
    // By far the most common case; handled separately so that it compiles to a copy.
    if number == NumberType::F64 {
        let (doubles, _) = bytes.as_chunks();
        numbers.extend(doubles.iter().map(double_from::<BIG_ENDIAN>));
        return;
    }
    let one_by_one = bytes.chunks_exact(number.bytes());
    numbers.extend(one_by_one.map(|one| number_from::<BIG_ENDIAN>(number, one)));
}

#[inline]
fn double_from<const BIG_ENDIAN: bool>(bytes: &[u8; 8]) -> f64 {
    if BIG_ENDIAN {
        f64::from_be_bytes(*bytes)
    } else {
        f64::from_le_bytes(*bytes)
    }
}

/// Reads the number at the front of `bytes`; NaN if there are too few bytes.
#[inline]
pub(super) fn number_from<const BIG_ENDIAN: bool>(number: NumberType, bytes: &[u8]) -> f64 {
    macro_rules! read {
        ($kind:ty) => {
            bytes.first_chunk().map_or(f64::NAN, |bytes| {
                let value = if BIG_ENDIAN {
                    <$kind>::from_be_bytes(*bytes)
                } else {
                    <$kind>::from_le_bytes(*bytes)
                };
                // Integers beyond 2^53 are rounded; stamps consist of two smaller ones.
                value as f64
            })
        };
    }
    match number {
        NumberType::Bool => bytes
            .first()
            .map_or(f64::NAN, |&byte| f64::from(u8::from(byte != 0))),
        NumberType::I8 => read!(i8),
        NumberType::U8 => read!(u8),
        NumberType::I16 => read!(i16),
        NumberType::U16 => read!(u16),
        NumberType::I32 => read!(i32),
        NumberType::U32 => read!(u32),
        NumberType::I64 => read!(i64),
        NumberType::U64 => read!(u64),
        NumberType::F32 => read!(f32),
        NumberType::F64 => read!(f64),
    }
}

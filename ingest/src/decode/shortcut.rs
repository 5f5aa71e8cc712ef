//! Copies the values of a sample from where they were in an earlier message.

use super::{
    attitude::{given_attitude, gives_attitude},
    places::{NumberPlace, Places},
};
use crate::schema::NumberType;

/// The offset of a value that the message lacks: no message is as long.
const NOWHERE: usize = usize::MAX;
/// The values of an attitude, the last ones of a sample.
const ATTITUDE: usize = 4;

/// Where the values of a sample are in messages like one that was decoded.
#[derive(Debug, Clone)]
pub(super) struct Shortcut {
    places: Places,
    /// Seconds and nanoseconds.
    stamp: [NumberPlace; 2],
    /// Offsets of doubles, in the order of the values.
    values: Vec<usize>,
    attitude: Attitude,
}

/// The number that marks that there is no attitude.
#[derive(Debug, Clone, Copy)]
pub(super) enum Attitude {
    /// The sample has no such values.
    None,
    Unmarked,
    MarkedBy(NumberPlace),
}

impl Shortcut {
    /// To values at these places, `None` for one that is lacking. Itself `None` if any of them is not a double.
    pub(super) fn new(
        places: Places,
        stamp: [NumberPlace; 2],
        values: impl Iterator<Item = Option<NumberPlace>>,
        attitude: Attitude,
    ) -> Option<Self> {
        let offset = |place: Option<NumberPlace>| match place {
            Some(place) => (place.number == NumberType::F64).then_some(place.offset),
            None => Some(NOWHERE),
        };
        Some(Self {
            places,
            stamp,
            values: values.map(offset).collect::<Option<_>>()?,
            attitude,
        })
    }

    /// Appends the values of a message and returns seconds and nanoseconds of its stamp; `None` if it is not like the
    /// one that was decoded.
    #[inline]
    pub(super) fn append_values(&self, message: &[u8], values: &mut Vec<f64>) -> Option<[f64; 2]> {
        if !self.places.are_those_of(message) {
            return None;
        }
        let double = |offset: &usize| {
            let bytes = message.get(*offset..).and_then(<[u8]>::first_chunk);
            bytes.map_or(f64::NAN, |bytes| f64::from_le_bytes(*bytes))
        };
        values.extend(self.values.iter().map(double));
        let is_given = match self.attitude {
            Attitude::MarkedBy(mark) => gives_attitude(mark.first_in(message)),
            Attitude::None | Attitude::Unmarked => true,
        };
        if !matches!(self.attitude, Attitude::None)
            && let Some(attitude) = values.last_chunk_mut::<ATTITUDE>()
        {
            *attitude = given_attitude(*attitude, is_given);
        }
        Some(self.stamp.map(|place| place.first_in(message)))
    }
}

/// Decides when a new shortcut is worth its costs: messages of two writers in turn would make one each time.
#[derive(Debug, Clone)]
pub(super) struct Credit(u32);

impl Credit {
    /// Messages that must have taken a shortcut for each new one.
    const PRICE: u32 = 16;
    const MOST: u32 = 1024;

    #[inline]
    pub(super) fn earn(&mut self) {
        self.0 = (self.0 + 1).min(Self::MOST);
    }

    pub(super) fn spend(&mut self) -> bool {
        match self.0.checked_sub(Self::PRICE) {
            Some(rest) => {
                self.0 = rest;
                true
            }
            None => false,
        }
    }
}

impl Default for Credit {
    fn default() -> Self {
        Self(4 * Self::PRICE)
    }
}

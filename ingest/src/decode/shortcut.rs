//! Copies the values of a sample from where they were in an earlier message.

use super::{
    attitude::{given_attitude, given_vector, is_given},
    places::{NumberPlace, Places},
};
use crate::schema::NumberType;

/// The offset of a value that the message lacks: no message is as long.
const NOWHERE: usize = usize::MAX;
/// The values of an attitude, the last ones of a sample.
const ATTITUDE: usize = 4;
/// The values of an IMU: specific force, angular velocity, attitude.
const IMU: usize = 10;

/// Positions of the values of a sample in messages like one that was decoded.
#[derive(Debug, Clone)]
pub(super) struct Shortcut {
    places: Places,
    /// Seconds and nanoseconds.
    stamp: [NumberPlace; 2],
    /// Offsets of doubles, in the order of the values.
    values: Vec<usize>,
    marks: Marks,
}

/// The numbers that mark which quantities a message does not give.
#[derive(Debug, Clone, Copy)]
pub(super) enum Marks {
    /// The sample has no attitude.
    None,
    /// The sample has an attitude, and no number marks it as absent.
    NoneOfAttitude,
    /// Marks of specific force, angular velocity and attitude, in this order.
    Imu([NumberPlace; 3]),
}

impl Shortcut {
    /// Returns a shortcut to values at these places, `None` for a value that is lacking. Itself `None` if any of them is not a
    /// double.
    pub(super) fn new(
        places: Places,
        stamp: [NumberPlace; 2],
        values: impl Iterator<Item = Option<NumberPlace>>,
        marks: Marks,
    ) -> Option<Self> {
        let offset = |place: Option<NumberPlace>| match place {
            Some(place) => (place.number == NumberType::F64).then_some(place.offset),
            None => Some(NOWHERE),
        };
        Some(Self {
            places,
            stamp,
            values: values.map(offset).collect::<Option<_>>()?,
            marks,
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
        let mut has_attitude = true;
        if let Marks::Imu(marks) = self.marks
            && let Some(of_sample) = values.last_chunk_mut::<IMU>()
        {
            let [force, turning, attitude] = marks.map(|mark| is_given(mark.first_in(message)));
            let [fx, fy, fz, wx, wy, wz, ..] = *of_sample;
            let [fx, fy, fz] = given_vector([fx, fy, fz], force);
            let [wx, wy, wz] = given_vector([wx, wy, wz], turning);
            of_sample[..IMU - ATTITUDE].copy_from_slice(&[fx, fy, fz, wx, wy, wz]);
            has_attitude = attitude;
        }
        if !matches!(self.marks, Marks::None)
            && let Some(attitude) = values.last_chunk_mut::<ATTITUDE>()
        {
            *attitude = given_attitude(*attitude, has_attitude);
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

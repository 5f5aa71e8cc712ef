//! Writes derivatives in the order of the parameters.

use nalgebra::Vector3;

use crate::number::Real;

/// Writes derivatives one after the other, in the order of [`Parameter::all`](crate::machine::Parameter::all).
pub(super) struct Writer<'a, T> {
    pub(super) rest: &'a mut [T],
}

impl<T: Real> Writer<'_, T> {
    #[inline(always)]
    pub(super) fn write<const N: usize>(&mut self, values: [T; N]) {
        if let Some((places, rest)) = std::mem::take(&mut self.rest).split_first_chunk_mut() {
            *places = values;
            self.rest = rest;
        }
    }

    #[inline(always)]
    pub(super) fn vector(&mut self, vector: &Vector3<T>) {
        self.write([vector.x, vector.y, vector.z]);
    }
}

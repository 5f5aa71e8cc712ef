//! Deviation of the loads from the optimal ones.

use crate::number::Real;

/// (110): sigma = 1/2 sum (OTF_i - OTF_opt,i)^2 (N^2), the squared distance of the loads from the optimal ones (N).
pub fn sigma<T: Real>(otf: impl Iterator<Item = T>, optimal: impl Iterator<Item = T>) -> T {
    let mut sum = T::zero();
    for (otf, optimal) in otf.zip(optimal) {
        let off = otf - optimal;
        sum += off * off;
    }
    sum * T::constant(0.5)
}

//! Interpolation between two states.

use crate::estimation::white_jerk::{ChannelState, step};

/// The quintic through two position-velocity-acceleration states: the model's mean between two known states.
pub(super) struct Quintic {
    /// Time since the first jet and between both (s).
    t: f64,
    h: f64,
}

impl Quintic {
    pub(super) fn new(t: f64, h: f64) -> Self {
        Self { t, h }
    }

    /// Time since the first state as a share of that between both.
    pub(super) fn share(&self) -> f64 {
        self.t / self.h
    }

    /// The Taylor series of the first state plus c3 s^3 + c4 s^4 + c5 s^5, s = t / h, with coefficients that
    /// meet the second state.
    pub(super) fn blend(&self, from: &ChannelState, to: &ChannelState) -> ChannelState {
        let (t, h) = (self.t, self.h);
        let ahead = step(from, h);
        let (e0, e1, e2) = (
            to[0] - ahead[0],
            (to[1] - ahead[1]) * h,
            (to[2] - ahead[2]) * h * h,
        );
        let (c3, c4, c5) = (
            10.0 * e0 - 4.0 * e1 + 0.5 * e2,
            -15.0 * e0 + 7.0 * e1 - e2,
            6.0 * e0 - 3.0 * e1 + 0.5 * e2,
        );
        let s = self.share();
        let (s2, taylor) = (s * s, step(from, t));
        [
            taylor[0] + s2 * s * (c3 + s * (c4 + s * c5)),
            taylor[1] + s2 * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)) / h,
            taylor[2] + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)) / (h * h),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quintic_interpolation_reproduces_a_quintic() {
        let jet = |t: f64| {
            [
                t.powi(5) - 2.0 * t.powi(3) + t,
                5.0 * t.powi(4) - 6.0 * t * t + 1.0,
                20.0 * t.powi(3) - 12.0 * t,
            ]
        };
        for t in [0.0, 0.1, 0.25, 0.4] {
            let found = Quintic::new(t, 0.4).blend(&jet(0.3), &jet(0.7));
            for (i, truth) in jet(0.3 + t).iter().enumerate() {
                assert!((found[i] - truth).abs() < 1e-12, "{t}: {found:?}");
            }
        }
    }
}

//! Reads the smoothed estimates of a filter between its samples.

use crate::estimation::held::{held, is_dense};
use crate::estimation::history::History;
use crate::estimation::reading::{FilterStatus, Reading};
use crate::estimation::white_jerk::{Channel, ChannelState, Matrix, seconds, step};

/// Reads a smoothed history at increasing times.
pub(super) struct HistoryReader<'a> {
    history: &'a History,
    max_gap_ns: i64,
    /// Whether the filter has samples after the history, across a gap.
    goes_on: bool,
    /// Index of the first sample after the last time read.
    next: usize,
}

impl<'a> HistoryReader<'a> {
    pub(super) fn new(history: &'a History, max_gap_ns: i64, goes_on: bool) -> Self {
        Self {
            history,
            max_gap_ns,
            goes_on,
            next: 0,
        }
    }

    /// Reads the estimates at a time. Between two samples of one segment, the expected state is the quintic through both; beyond
    /// either end, for up to half the longest gap, the Taylor series at that end.
    pub(super) fn read(&mut self, time_ns: i64, channels: &mut [Channel]) -> Reading {
        let stamps = self.history.stamps_ns();
        while self.next < stamps.len() && stamps[self.next] <= time_ns {
            self.next += 1;
        }
        let at = |k: usize| self.history.jets(k);
        let covariance_at = |k: usize| *self.history.covariance(k);
        let before = self.next.checked_sub(1);
        let after = Some(self.next).filter(|&k| k < stamps.len());
        let near = |k: usize| stamps[k].abs_diff(time_ns) <= self.max_gap_ns.unsigned_abs() / 2;
        let covariance = match (before, after) {
            (Some(a), _) if stamps[a] == time_ns => {
                for (channel, jet) in channels.iter_mut().zip(at(a)) {
                    channel.jet = *jet;
                }
                covariance_at(a)
            }
            (Some(a), Some(b)) if stamps[b].saturating_sub(stamps[a]) <= self.max_gap_ns => {
                let weights =
                    Quintic::new(seconds(time_ns - stamps[a]), seconds(stamps[b] - stamps[a]));
                for (channel, (from, to)) in channels.iter_mut().zip(at(a).iter().zip(at(b))) {
                    channel.jet = weights.blend(from, to);
                }
                between(&covariance_at(a), &covariance_at(b), weights.share())
            }
            (Some(a), None) if near(a) && !self.goes_on => {
                extrapolate(channels, at(a), seconds(time_ns - stamps[a]));
                covariance_at(a)
            }
            (None, Some(b)) if near(b) => {
                extrapolate(channels, at(b), seconds(time_ns - stamps[b]));
                covariance_at(b)
            }
            _ => return Reading::NOTHING,
        };
        Reading {
            standing: FilterStatus::Known,
            covariance,
        }
    }
}

impl HistoryReader<'_> {
    /// Reads the estimates at a time; where samples are too far apart to show motion, the last one up to `hold_ns` ago is held at
    /// rest.
    pub(super) fn read_or_hold(
        &mut self,
        time_ns: i64,
        hold_ns: i64,
        channels: &mut [Channel],
    ) -> Reading {
        let reading = self.read(time_ns, channels);
        let stamps = self.history.stamps_ns();
        match self.next.checked_sub(1) {
            Some(before) if !is_dense(stamps, before, time_ns, self.max_gap_ns) => {
                held(self.history, before, time_ns, hold_ns, channels)
            }
            _ => reading,
        }
    }

    /// Whether the time last read is that of a sample.
    pub(super) fn was_at_sample(&self, time_ns: i64) -> bool {
        let before = self.next.checked_sub(1);
        before.is_some_and(|before| self.history.stamps_ns()[before] == time_ns)
    }

    /// Whether samples around the time last read show motion.
    pub(super) fn was_dense(&self, time_ns: i64) -> bool {
        let stamps = self.history.stamps_ns();
        let before = self.next.checked_sub(1);
        before.is_none_or(|before| is_dense(stamps, before, time_ns, self.max_gap_ns))
    }
}

/// Linear interpolation of the covariance between two samples.
fn between(a: &Matrix, b: &Matrix, share: f64) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + share * (b[i][j] - a[i][j])))
}

fn extrapolate(channels: &mut [Channel], from: &[ChannelState], dt: f64) {
    for (channel, from) in channels.iter_mut().zip(from) {
        channel.jet = step(from, dt);
    }
}

/// The quintic through two position-velocity-acceleration states: the model's mean between two known states.
struct Quintic {
    /// Time since the first jet and between both (s).
    t: f64,
    h: f64,
}

impl Quintic {
    fn new(t: f64, h: f64) -> Self {
        Self { t, h }
    }

    /// Time since the first state as a share of that between both.
    fn share(&self) -> f64 {
        self.t / self.h
    }

    /// The Taylor series of the first state plus c3 s^3 + c4 s^4 + c5 s^5, s = t / h, with coefficients that
    /// meet the second state.
    fn blend(&self, from: &ChannelState, to: &ChannelState) -> ChannelState {
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

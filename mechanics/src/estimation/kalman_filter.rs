//! Kalman filter of the channels that one sensor measures together.
//!
//! Each channel has a position-velocity-acceleration state, driven by white jerk of spectral density q.
//! With F(dt) the Taylor step:
//!
//! ```text
//!     predict:  x = F x,  P = F P F' + Q(dt)
//!     update:   K = P h / (h' P h + r),  x = x + K (z - h' x),  P = P - K h' P
//! ```
//! The covariance P depends only on the stamps, so all channels share it and the gains.

use crate::state::SampleError;

/// Position-velocity-acceleration state of a channel: value, first and second time derivative.
pub(crate) type ChannelState = [f64; 3];

/// Covariance of such a state, or a gain.
pub(crate) type Matrix = [[f64; 3]; 3];

/// Initial standard deviation of a channel's derivatives, as multiples of the process noise.
const INITIAL_SPREAD: f64 = 10.0;

/// Variance added to one sample because it is less credible.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Doubt {
    pub(crate) value_variance: f64,
    pub(crate) rate_variance: f64,
}

/// Model of a group of channels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilterModel {
    /// Variance of a measured value.
    pub(crate) value_variance: f64,
    /// Variance of a measured velocity.
    pub(crate) rate_variance: f64,
    /// Spectral density q of the jerk: growth of the acceleration's variance per second.
    pub(crate) density: f64,
    /// Samples further apart than this belong to different segments (ns).
    pub(crate) max_gap_ns: i64,
}

/// Filter state after the last sample, and the earlier steps where a smoother needs them.
#[derive(Debug, Clone)]
pub(crate) struct KalmanFilter {
    model: FilterModel,
    covariance: Matrix,
    jets: Vec<ChannelState>,
    last_ns: Option<i64>,
    started_ns: i64,
    history: Option<History>,
}

/// All steps of the filter.
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    pub(super) stamps_ns: Vec<i64>,
    /// States of all channels, step by step: filtered, and smoothed after [`KalmanFilter::smoothed`].
    pub(super) jets: Vec<ChannelState>,
    /// Smoother gain of each step, which propagates the next step's correction backwards; zero where the next
    /// step starts a new segment.
    gains: Vec<Matrix>,
    /// Covariance of each step, shared by all channels: filtered, and smoothed with the states.
    pub(super) covariances: Vec<Matrix>,
    /// Spectral density q of the jerk.
    density: f64,
}

impl KalmanFilter {
    pub(crate) fn new(model: FilterModel, channels: usize, keeps_history: bool) -> Self {
        Self {
            model,
            covariance: [[0.0; 3]; 3],
            jets: vec![[0.0; 3]; channels],
            last_ns: None,
            started_ns: i64::MIN,
            history: keeps_history.then(|| History {
                density: model.density,
                ..History::default()
            }),
        }
    }

    pub(super) fn channels(&self) -> usize {
        self.jets.len()
    }

    /// Stamp of the last sample.
    pub(super) fn last_ns(&self) -> Option<i64> {
        self.last_ns
    }

    /// Stamp of the first sample after the start or the last gap.
    pub(super) fn started_ns(&self) -> i64 {
        self.started_ns
    }

    /// Updates the filter with a sample, `doubt` added to the variances of its values and velocities. `rates`
    /// are used only if all are finite.
    pub(crate) fn push(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        rates: Option<&[f64]>,
        doubt: Doubt,
    ) -> Result<(), SampleError> {
        if self.last_ns.is_some_and(|last| stamp_ns <= last) {
            return Err(SampleError::NotLater);
        }
        if !values.iter().all(|v| v.is_finite()) {
            return Err(SampleError::NotFinite);
        }
        let rates = rates.filter(|rates| rates.iter().all(|r| r.is_finite()));
        match self
            .last_ns
            .map(|last| stamp_ns.saturating_sub(last))
            .filter(|&step| step <= self.model.max_gap_ns)
        {
            Some(step_ns) => self.follow(step_ns, values, rates, doubt),
            None => self.start(stamp_ns, values, rates, doubt),
        }
        self.last_ns = Some(stamp_ns);
        if let Some(history) = &mut self.history {
            history.stamps_ns.push(stamp_ns);
            history.jets.extend_from_slice(&self.jets);
            history.gains.push([[0.0; 3]; 3]);
            history.covariances.push(self.covariance);
        }
        Ok(())
    }

    /// Covariance predicted to a stamp close to the last sample.
    pub(crate) fn covariance_at(&self, stamp_ns: i64) -> Matrix {
        let ahead = stamp_ns.saturating_sub(self.last_ns.unwrap_or(stamp_ns));
        predicted(&self.covariance, seconds(ahead), self.model.density)
    }

    /// State of a channel extrapolated to a stamp close to the last sample, by its Taylor series.
    pub(crate) fn at(&self, channel: usize, stamp_ns: i64) -> ChannelState {
        let last = self.last_ns.unwrap_or(stamp_ns);
        step(&self.jets[channel], seconds(stamp_ns.saturating_sub(last)))
    }

    fn start(&mut self, stamp_ns: i64, values: &[f64], rates: Option<&[f64]>, doubt: Doubt) {
        self.started_ns = stamp_ns;
        let spread = INITIAL_SPREAD * INITIAL_SPREAD * self.model.density;
        let rate_variance = if rates.is_some() {
            self.model.rate_variance + doubt.rate_variance
        } else {
            spread
        };
        self.covariance = [
            [self.model.value_variance + doubt.value_variance, 0.0, 0.0],
            [0.0, rate_variance, 0.0],
            [0.0, 0.0, spread],
        ];
        for (channel, jet) in self.jets.iter_mut().enumerate() {
            *jet = [
                values[channel],
                rates.map_or(0.0, |rates| rates[channel]),
                0.0,
            ];
        }
    }

    fn follow(&mut self, step_ns: i64, values: &[f64], rates: Option<&[f64]>, doubt: Doubt) {
        let dt = seconds(step_ns);
        let filtered = self.covariance;
        self.covariance = predicted(&filtered, dt, self.model.density);
        if let Some(history) = &mut self.history
            && let Some(gain) = history.gains.last_mut()
        {
            *gain = smoother_gain(&filtered, &self.covariance, dt);
        }
        for jet in &mut self.jets {
            *jet = step(jet, dt);
        }
        self.update(0, self.model.value_variance + doubt.value_variance, values);
        if let Some(rates) = rates {
            self.update(1, self.model.rate_variance + doubt.rate_variance, rates);
        }
    }

    /// Updates every channel with a measurement of the component `measured` of its state.
    fn update(&mut self, measured: usize, variance: f64, values: &[f64]) {
        let row = self.covariance[measured];
        let innovation_variance = row[measured] + variance;
        let gain = row.map(|p| p / innovation_variance);
        for i in 0..3 {
            for j in 0..3 {
                self.covariance[i][j] -= gain[i] * row[j];
            }
        }
        for (jet, value) in self.jets.iter_mut().zip(values) {
            let innovation = value - jet[measured];
            for i in 0..3 {
                jet[i] += gain[i] * innovation;
            }
        }
    }

    /// Smooths the whole history, from the last step to the first (Rauch-Tung-Striebel):
    /// `x_k = x_k + G_k (x_(k+1) - F x_k)` and `P_k = P_k + G_k (P_(k+1) - P_(k+1|k)) G_k'`.
    pub(super) fn smoothed(self) -> History {
        let channels = self.jets.len();
        let mut history = self.history.unwrap_or_default();
        for k in (0..history.stamps_ns.len().saturating_sub(1)).rev() {
            let dt = seconds(history.stamps_ns[k + 1].saturating_sub(history.stamps_ns[k]));
            let gain = history.gains[k];
            let (before, after) = history.jets.split_at_mut((k + 1) * channels);
            for (jet, next) in before[k * channels..].iter_mut().zip(&after[..channels]) {
                let ahead = step(jet, dt);
                let correction: ChannelState = std::array::from_fn(|i| next[i] - ahead[i]);
                for i in 0..3 {
                    jet[i] += gain[i][0] * correction[0]
                        + gain[i][1] * correction[1]
                        + gain[i][2] * correction[2];
                }
            }
            history.smooth_covariance(k, dt);
        }
        history
    }
}

impl History {
    fn smooth_covariance(&mut self, k: usize, dt: f64) {
        let gain = self.gains[k];
        let (next, ahead) = (
            self.covariances[k + 1],
            predicted(&self.covariances[k], dt, self.density),
        );
        let change: Matrix = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..3)
                    .map(|m| gain[i][m] * (next[m][j] - ahead[m][j]))
                    .sum()
            })
        });
        for i in 0..3 {
            for j in 0..3 {
                self.covariances[k][i][j] += (0..3).map(|m| change[i][m] * gain[j][m]).sum::<f64>();
            }
        }
    }
}

pub(super) fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

/// F(dt) x
pub(super) fn step(jet: &ChannelState, dt: f64) -> ChannelState {
    let [value, first, second] = *jet;
    [
        value + dt * (first + 0.5 * dt * second),
        first + dt * second,
        second,
    ]
}

/// F P F' + Q, with Q the covariance that white jerk of this density adds over dt.
fn predicted(p: &Matrix, dt: f64, density: f64) -> Matrix {
    let (d1, d2) = (dt, 0.5 * dt * dt);
    // F P: the Taylor step applied to the rows of P
    let fp: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| match i {
            0 => p[0][j] + d1 * p[1][j] + d2 * p[2][j],
            1 => p[1][j] + d1 * p[2][j],
            _ => p[2][j],
        })
    });
    let (q1, q2, q3) = (density * dt, density * dt * dt, density * dt * dt * dt);
    let q: Matrix = [
        [q3 * dt * dt / 20.0, q3 * dt / 8.0, q3 / 6.0],
        [q3 * dt / 8.0, q3 / 3.0, q2 / 2.0],
        [q3 / 6.0, q2 / 2.0, q1],
    ];
    std::array::from_fn(|i| {
        let r = fp[i];
        [
            r[0] + d1 * r[1] + d2 * r[2] + q[i][0],
            r[1] + d1 * r[2] + q[i][1],
            r[2] + q[i][2],
        ]
    })
}

/// G = P F' inv(P_next)
fn smoother_gain(filtered: &Matrix, next: &Matrix, dt: f64) -> Matrix {
    let (d1, d2) = (dt, 0.5 * dt * dt);
    let inverse = inverse(next);
    std::array::from_fn(|i| {
        let r = filtered[i];
        let pf = [r[0] + d1 * r[1] + d2 * r[2], r[1] + d1 * r[2], r[2]];
        std::array::from_fn(|j| {
            pf[0] * inverse[0][j] + pf[1] * inverse[1][j] + pf[2] * inverse[2][j]
        })
    })
}

/// Inverse of a symmetric positive definite matrix, by its adjugate.
fn inverse(m: &Matrix) -> Matrix {
    let minor = |a: usize, b: usize, c: usize, d: usize| m[a][c] * m[b][d] - m[a][d] * m[b][c];
    let (c00, c01, c02) = (minor(1, 2, 1, 2), -minor(1, 2, 0, 2), minor(1, 2, 0, 1));
    let (c11, c12, c22) = (minor(0, 2, 0, 2), -minor(0, 2, 0, 1), minor(0, 1, 0, 1));
    let scale = 1.0 / (m[0][0] * c00 + m[0][1] * c01 + m[0][2] * c02);
    [
        [c00 * scale, c01 * scale, c02 * scale],
        [c01 * scale, c11 * scale, c12 * scale],
        [c02 * scale, c12 * scale, c22 * scale],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: FilterModel = FilterModel {
        value_variance: 1e-6,
        rate_variance: 1e-6,
        density: 1.0,
        max_gap_ns: 100_000_000,
    };

    fn parabola(t: f64) -> ChannelState {
        [1.0 + 2.0 * t - 1.5 * t * t, 2.0 - 3.0 * t, -3.0]
    }

    /// Filter of a jerk-free motion, sampled with jitter.
    fn parabolic_filter(keeps_history: bool) -> KalmanFilter {
        let mut filter = KalmanFilter::new(MODEL, 1, keeps_history);
        for k in 0..400_i64 {
            let stamp = k * 10_000_000 + (k * 7919 % 13) * 200_000;
            filter
                .push(
                    stamp,
                    &[parabola(seconds(stamp))[0]],
                    None,
                    Doubt::default(),
                )
                .unwrap();
        }
        filter
    }

    #[test]
    fn filter_follows_parabola_without_lag() {
        let filter = parabolic_filter(false);
        let stamp = filter.last_ns().unwrap() + 3_000_000;
        let (found, truth) = (filter.at(0, stamp), parabola(seconds(stamp)));
        for i in 0..3 {
            assert!((found[i] - truth[i]).abs() < 1e-4, "{found:?} {truth:?}");
        }
    }

    #[test]
    fn smoother_reproduces_parabola_exactly() {
        let history = parabolic_filter(true).smoothed();
        for (jet, &stamp) in history.jets.iter().zip(&history.stamps_ns) {
            let truth = parabola(seconds(stamp));
            for i in 0..3 {
                assert!(
                    (jet[i] - truth[i]).abs() < 1e-3 * (1 + i) as f64,
                    "{stamp}: {jet:?} {truth:?}"
                );
            }
        }
    }

    #[test]
    fn velocities_are_used_only_if_all_are_finite() {
        let mut filter = KalmanFilter::new(MODEL, 2, false);
        filter
            .push(0, &[0.0, 0.0], Some(&[1.0, f64::NAN]), Doubt::default())
            .unwrap();
        assert_eq!(filter.jets[0][1], 0.0);
        assert_eq!(
            filter.push(0, &[0.0, 0.0], None, Doubt::default()),
            Err(SampleError::NotLater)
        );
        assert_eq!(
            filter.push(1, &[0.0, f64::INFINITY], None, Doubt::default()),
            Err(SampleError::NotFinite)
        );
    }

    #[test]
    fn smoother_does_not_cross_gaps() {
        let mut filter = KalmanFilter::new(MODEL, 1, true);
        for k in 0..20 {
            filter
                .push(k * 10_000_000, &[0.0], None, Doubt::default())
                .unwrap();
        }
        for k in 0..20 {
            filter
                .push(
                    1_000_000_000 + k * 10_000_000,
                    &[5.0],
                    None,
                    Doubt::default(),
                )
                .unwrap();
        }
        assert_eq!(filter.started_ns(), 1_000_000_000);
        let history = filter.smoothed();
        assert!(history.jets[19][0].abs() < 1e-9 && (history.jets[20][0] - 5.0).abs() < 1e-9);
    }
}

//! The steps of a Kalman filter, kept for the backward pass of the smoother.

use super::white_jerk::{ChannelState, Matrix, predicted, seconds, step, symmetric};

/// Samples after the last one wanted are of use until their effect on it falls below this share of its standard
/// deviation: far less than rounding.
const NEGLIGIBLE: f64 = 1e-20;

/// Consecutive steps of a filter: filtered, and smoothed after [`History::smooth`].
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    channels: usize,
    stamps_ns: Vec<i64>,
    /// States of all channels, step by step.
    jets: Vec<ChannelState>,
    /// Smoother gain of each step, which propagates the next step's correction backwards; zero where the next
    /// step starts a new segment.
    gains: Vec<Matrix>,
    /// Spectral density q of the jerk from each step to the next; zero where the next step starts a new segment.
    densities: Vec<f64>,
    /// Covariance of each step, shared by all channels.
    covariances: Vec<Matrix>,
    /// Estimates are wanted up to this time.
    wanted_ns: i64,
    /// The first step after this time, once there is one.
    ahead: Option<Ahead>,
    is_complete: bool,
}

/// The first step after the estimates wanted, and the influence of the last step on it.
#[derive(Debug, Clone, Copy)]
struct Ahead {
    /// Product of the gains from the first step after the estimates wanted to the last step.
    influence: Matrix,
    /// Variances of the first step's position, velocity and acceleration.
    variances: [f64; 3],
}

impl History {
    pub(super) fn new(channels: usize) -> Self {
        Self {
            channels,
            wanted_ns: i64::MAX,
            ..Self::default()
        }
    }

    /// Forgets all steps and keeps the memory, with room for `steps` at least.
    pub(super) fn restart(&mut self, wanted_ns: i64, steps: usize) {
        self.stamps_ns.clear();
        self.jets.clear();
        self.gains.clear();
        self.densities.clear();
        self.covariances.clear();
        // growing step by step would leave memory of every smaller size behind
        self.stamps_ns.reserve_exact(steps);
        self.jets.reserve_exact(steps * self.channels);
        self.gains.reserve_exact(steps);
        self.densities.reserve_exact(steps);
        self.covariances.reserve_exact(steps);
        self.wanted_ns = wanted_ns;
        self.ahead = None;
        self.is_complete = false;
    }

    pub(super) fn wanted_ns(&self) -> i64 {
        self.wanted_ns
    }

    /// Whether later steps do not matter to the estimates wanted.
    pub(super) fn is_complete(&self) -> bool {
        self.is_complete
    }

    pub(super) fn stamps_ns(&self) -> &[i64] {
        &self.stamps_ns
    }

    /// States of all channels at a step.
    pub(super) fn jets(&self, step: usize) -> &[ChannelState] {
        &self.jets[step * self.channels..(step + 1) * self.channels]
    }

    pub(super) fn covariance(&self, step: usize) -> &Matrix {
        &self.covariances[step]
    }

    /// Sets the gain of the last step, which the step that follows belongs to, and the density of the jerk between both.
    pub(super) fn link(&mut self, gain: Matrix, density: f64) {
        if let Some(last) = self.densities.last_mut() {
            *last = density;
        }
        if let Some(last) = self.gains.last_mut() {
            *last = gain;
        }
        if let Some(ahead) = &mut self.ahead {
            ahead.influence = product(&ahead.influence, &gain);
        }
    }

    pub(super) fn push(&mut self, stamp_ns: i64, jets: &[ChannelState], covariance: &Matrix) {
        // Zero where the filter started anew.
        let is_linked = self.gains.last().is_some_and(|gain| *gain != [[0.0; 3]; 3]);
        self.stamps_ns.push(stamp_ns);
        self.jets.extend_from_slice(jets);
        self.gains.push([[0.0; 3]; 3]);
        self.densities.push(0.0);
        self.covariances.push(*covariance);
        match &self.ahead {
            Some(ahead) => {
                self.is_complete |= !is_linked || ahead.is_negligible(covariance);
            }
            None if stamp_ns > self.wanted_ns => {
                self.ahead = Some(Ahead {
                    influence: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                    variances: [0, 1, 2].map(|i| covariance[i][i]),
                });
            }
            None => {}
        }
    }

    /// Smooths from the last step to the first (Rauch-Tung-Striebel):
    /// `x_k = x_k + G_k (x_(k+1) - F x_k)` and `P_k = P_k + G_k (P_(k+1) - P_(k+1|k)) G_k'`.
    pub(super) fn smooth(&mut self) {
        let channels = self.channels;
        for k in (0..self.stamps_ns.len().saturating_sub(1)).rev() {
            let dt = seconds(self.stamps_ns[k + 1].saturating_sub(self.stamps_ns[k]));
            let gain = self.gains[k];
            let (before, after) = self.jets.split_at_mut((k + 1) * channels);
            for (jet, next) in before[k * channels..].iter_mut().zip(&after[..channels]) {
                let ahead = step(jet, dt);
                let correction: ChannelState = std::array::from_fn(|i| next[i] - ahead[i]);
                for i in 0..3 {
                    jet[i] += gain[i][0] * correction[0]
                        + gain[i][1] * correction[1]
                        + gain[i][2] * correction[2];
                }
            }
            self.smooth_covariance(k, dt);
        }
    }

    fn smooth_covariance(&mut self, k: usize, dt: f64) {
        let gain = self.gains[k];
        let (next, ahead) = (
            self.covariances[k + 1],
            predicted(&self.covariances[k], dt, self.densities[k]),
        );
        let change: Matrix = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                (0..3)
                    .map(|m| gain[i][m] * (next[m][j] - ahead[m][j]))
                    .sum()
            })
        });
        let filtered = self.covariances[k];
        self.covariances[k] = symmetric(|i, j| {
            filtered[i][j] + (0..3).map(|m| change[i][m] * gain[j][m]).sum::<f64>()
        });
    }
}

impl Ahead {
    /// Whether a correction of the last step by its standard deviation changes the first step by a negligible share of its own.
    fn is_negligible(&self, last: &Matrix) -> bool {
        let limit = NEGLIGIBLE * NEGLIGIBLE;
        (0..3).all(|i| {
            let most = limit * self.variances[i].abs();
            (0..3).all(|j| self.influence[i][j].powi(2) * last[j][j].abs() <= most)
        })
    }
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|m| a[i][m] * b[m][j]).sum()))
}

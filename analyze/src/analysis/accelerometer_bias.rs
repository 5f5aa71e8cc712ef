//! The bias of the accelerometer that was estimated and subtracted.

use tipwatch_language::{decimals, say};
use tipwatch_mechanics::machine::{Axis, Note, Parameter};

use super::notes::{NotedLog, Notes};
use super::study::{KnownRow, StudiedLog, Study};

/// Sums over the valid rows in which a bias was subtracted.
#[derive(Default)]
pub(super) struct RemovedBias {
    /// Number of these rows.
    rows: f64,
    /// The subtracted bias (m/s^2), by axis.
    removed: [f64; 3],
    /// The variance of the specific force, by axis.
    variance: [f64; 3],
}

impl Study<'_> for RemovedBias {
    type Found = Self;

    fn begin(_: &StudiedLog<'_>) -> Self {
        Self::default()
    }

    fn take_row(&mut self, row: &KnownRow<'_>) {
        let bias = &row.state.noise.accelerometer_bias;
        if !row.reasons().leave_valid() || bias.covariance_change == [0.0; 6] {
            return;
        }
        self.rows += 1.0;
        for (i, axis) in Axis::ALL.into_iter().enumerate() {
            self.removed[i] += bias.removed[i];
            let sigma = row.state.sigma(row.machine, Parameter::SpecificForce(axis));
            self.variance[i] += sigma.powi(2);
        }
    }
}

impl Notes for RemovedBias {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let stated = log.loaded.machine.uncertainty().accelerometer_bias;
        if !log.loaded.matched.sensors.imu || stated <= 0.0 {
            return Vec::new();
        }
        if self.rows == 0.0 {
            return vec![say!(
                "The bias of the accelerometer could not be estimated: there is neither an attitude with odometry nor a standstill, or \
                 the IMU is not on the base. Its stated standard deviation of {stated} m/s² remains in every band."
            ).into()];
        }
        let mean = |i: usize| {
            let removed = self.removed[i] / self.rows;
            let sigma = f64::sqrt(self.variance[i] / self.rows);
            decimals(format!(
                "{} {removed:+.3} ± {sigma:.3}",
                Axis::ALL[i].name()
            ))
        };
        vec![say!(
            "Bias of the accelerometer, estimated from attitude, odometry and standstill and subtracted (mean, IMU axes, ± one \
             standard deviation): {}, {}, {} m/s².",
            mean(0),
            mean(1),
            mean(2)
        ).into()]
    }
}

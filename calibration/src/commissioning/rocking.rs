//! Roll and pitch rates of the gyroscope compared with the change of the orientation.
//!
//! ```text
//!     (roll, pitch rate by the orientation) = A (roll, pitch rate) + c yaw rate + constant
//! ```
//! over half a second each. A is the identity where axes and signs are right. The orientation is the noisier of the two, so
//! it stands on the left: as a factor it would make A too small. An orientation that follows slowly makes it smaller too, but
//! never exchanges the axes.

use nalgebra::Vector3;

use super::estimate::{Estimate, Relation};
use super::least_squares::Equations;
use super::signals::View;

/// Bins of which the mean is compared: half a second.
const AVERAGED: usize = 5;
/// Least standard deviation of a roll or pitch rate that shows something (rad/s).
const ROCKS: f64 = 1e-3;

/// The four elements of A.
pub(super) fn rocking(view: &View) -> Vec<Estimate> {
    let mut found = Vec::new();
    for row in 0..2 {
        let mut equations = Equations::new(4).excited(0, ROCKS).excited(1, ROCKS);
        let bins: Vec<usize> = (0..view.bins).collect();
        for bins in bins.chunks_exact(AVERAGED) {
            if bins.iter().all(|&k| view.is_upright[k]) {
                let [by_gyro, by_attitude] = [&view.turning, &view.attitude_turning].map(|rates| {
                    bins.iter().map(|&k| rates[k]).sum::<Vector3<f64>>() / AVERAGED as f64
                });
                let factors = [by_gyro.x, by_gyro.y, by_gyro.z, 1.0];
                equations.add(&factors, by_attitude[row]);
            }
        }
        let Some(solution) = equations.solve() else {
            continue;
        };
        for column in 0..2 {
            let relation = Relation::Rocking(row, column);
            found.push(Estimate::of(relation, solution.of(column)));
        }
    }
    found
}

//! Errors of the readings of one instant that no unknown explains.
//!
//! ```text
//!     R = diag(sigma^2) + m^2 C C' + w^2 sum over z (C z)(C z)' + s^2 sum over slopes (dr/ds)(dr/ds)'
//! ```
//! C says which wheels a reading sums. m is the stated share of effects outside the rigid-body model, z are the loads
//! that balance themselves, whose split uneven ground leaves open, and s is what is unknown of the slope.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{
    Scope, Workspace, evaluate_one, resting_on_slope, self_equilibrated_loads,
};

use crate::identification::data::{Instant, Measured, Situation};
use crate::identification::model::{Changed, places};

/// A wheel below this share of the mean load counts as lifted.
const LEAST_SHARE: f64 = 0.02;

/// The square root of an instant's covariance; `None` where it cannot be computed.
pub(crate) fn covariance_root(changed: &Changed, instant: &Instant) -> Option<Cholesky<f64, Dyn>> {
    let readings = &instant.readings;
    let machine = changed.at(instant)?;
    let wheels = machine.wheels().len();
    let mut covariance = DMatrix::from_diagonal(&DVector::from_iterator(
        readings.len(),
        readings.iter().map(|reading| reading.sigma.powi(2)),
    ));
    if readings.iter().any(|reading| reading.what.is_load()) {
        let mut factors = DMatrix::zeros(readings.len(), wheels);
        for (row, reading) in readings.iter().enumerate() {
            if let Measured::Load { supports } = &reading.what {
                places(machine, supports).for_each(|place| factors[(row, place)] = 1.0);
            }
        }
        let (balanced, mean_load, least) = of_loads(changed, machine, instant);
        // A lifted wheel says nothing, and around it the loads are not smooth. NaN is not enough either.
        if !(least > LEAST_SHARE * mean_load) {
            return None;
        }
        let model = machine.uncertainty().model_share * mean_load;
        covariance += &factors * factors.transpose() * model.powi(2);
        // The standard deviation of one wheel's share, for a vector of length one.
        let warp = machine.warp_sigma() * (wheels as f64).sqrt();
        for direction in balanced {
            let shown = &factors * DVector::from_vec(direction) * warp;
            covariance += &shown * shown.transpose();
        }
    }
    for by_slope in changed.by_slope(instant) {
        covariance += &by_slope * by_slope.transpose();
    }
    let is_known = covariance.iter().all(|value| value.is_finite());
    is_known.then(|| Cholesky::new(covariance)).flatten()
}

/// The loads that balance themselves, and the mean and the least load of a wheel (N).
fn of_loads(changed: &Changed, machine: &Machine, instant: &Instant) -> (Vec<Vec<f64>>, f64, f64) {
    let evaluated = |machine: &_, state: &_| {
        let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
        evaluate_one(machine, state, &mut workspace);
        let loads = &workspace.outcome().load;
        let mean = loads.iter().sum::<f64>() / loads.len() as f64;
        let least = loads
            .iter()
            .copied()
            .reduce(|a, b| if a < b { a } else { b });
        (
            self_equilibrated_loads(&workspace),
            mean,
            least.unwrap_or(f64::NAN),
        )
    };
    match &instant.situation {
        Situation::Logged(state) => evaluated(machine, &changed.corrected(state)),
        Situation::AtRest {
            positions, slope, ..
        } => {
            let (machine, state) = resting_on_slope(machine, positions, *slope);
            evaluated(&machine, &state)
        }
    }
}

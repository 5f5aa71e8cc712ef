//! A row: measured and computed loads, one by one and in total.

use nalgebra::{DMatrix, DVector};

use super::rows::{ComparedRow, MeasuredRow, RowPlace};
use super::singles::Singles;
use super::total::sensors_of_all;
use super::total_row::TotalRow;
use crate::evaluate::evaluation::evaluate_one;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ForceSource, Machine};
use crate::state::State;
use crate::studies::combination_sigma::combination_sigma;
use crate::studies::self_equilibrated::self_equilibrated_loads;

/// Whether the load of a support is measured by its jack.
#[must_use]
pub fn measures_supports(machine: &Machine) -> bool {
    let joints = machine.contact().actuated_joints.iter();
    joints
        .map(|joint| &joint.source)
        .any(|source| matches!(source, ForceSource::Support { .. }))
}

/// Compares a row of a machine on the supports that are on the ground: sensor by sensor, and in total.
///
/// Sensors are compared only while every support carries, for the band of a lifted one is that of its lift-off; the total only where
/// some sensors, or the forces of jacks, carry every support once.
#[must_use]
pub fn compare(
    machine: &Machine,
    state: &State<f64>,
    measured: &MeasuredRow<'_>,
    place: RowPlace,
) -> (Option<ComparedRow>, Option<TotalRow>) {
    let sensors = measured.sensors;
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS_AND_DERIVATIVES);
    let loads = evaluate_one(machine, state, &mut workspace).load.clone();
    let sigma_of = |factors: &[f64]| {
        let by_motion = (measured.unobserved)(factors);
        combination_sigma(machine, state, &workspace, factors).hypot(by_motion)
    };
    let singles = Singles::of(machine, state, measured);
    let of_all = sensors_of_all(sensors, machine).map(|all| {
        let total: f64 = all.iter().map(|&k| measured.loads[k]).sum();
        let variance: f64 = all.iter().map(|&k| sensors[k].sigma.powi(2)).sum();
        (total, variance.sqrt())
    });
    let of_all = of_all.filter(|(total, _)| total.is_finite());
    let of_all = of_all.or_else(|| singles.as_ref().map(Singles::total));
    let total = of_all.map(|(measured, of_sensors)| TotalRow {
        time_ns: place.time_ns,
        set: place.set,
        difference: measured - loads.iter().sum::<f64>(),
        sigma: of_sensors.hypot(sigma_of(&vec![1.0; loads.len()])),
        gravity: loads.iter().sum::<f64>() / machine.mass(),
        acts: (singles.as_ref()).map(|all| all.acts(machine, &workspace, sigma_of)),
    });
    let total = total.filter(|total| total.difference.is_finite());
    if sensors.is_empty() || !loads.iter().all(|load| *load > 0.0) {
        return (None, total);
    }
    let factors: Vec<Vec<f64>> = sensors.iter().map(|it| it.factors(machine)).collect();
    let mut found = ComparedRow {
        row: place.row,
        time_ns: place.time_ns,
        set: place.set,
        measured: measured.loads.to_vec(),
        computed: (sensors.iter())
            .map(|it| it.of(machine, &loads).unwrap_or(f64::NAN))
            .collect(),
        sigma: factors.iter().map(|factors| sigma_of(factors)).collect(),
        distance: f64::NAN,
        sensors: 0,
    };
    let known: Vec<usize> = (0..sensors.len())
        .filter(|&k| (found.measured[k] - found.computed[k] + found.sigma[k]).is_finite())
        .collect();
    found.sensors = known.len();
    let residual = known.iter().map(|&k| found.measured[k] - found.computed[k]);
    let residual = DVector::from_iterator(known.len(), residual);
    // cov(a, b) = (var(a + b) - var(a) - var(b)) / 2
    let mut covariance = DMatrix::from_fn(known.len(), known.len(), |i, j| {
        let (a, b) = (known[i], known[j]);
        if i == j {
            return found.sigma[a].powi(2) + sensors[a].sigma.powi(2);
        }
        let both: Vec<f64> = factors[a]
            .iter()
            .zip(&factors[b])
            .map(|(a, b)| a + b)
            .collect();
        let apart = found.sigma[a].powi(2) + found.sigma[b].powi(2);
        0.5 * (sigma_of(&both).powi(2) - apart)
    });
    // What uneven ground shifts between the diagonals contradicts nothing.
    let warp = machine.warp_sigma() * (loads.len() as f64).sqrt();
    for direction in self_equilibrated_loads(&workspace) {
        let shown = known.iter().map(|&k| {
            let pairs = factors[k].iter().zip(&direction);
            pairs.map(|(factor, z)| factor * z).sum::<f64>() * warp
        });
        let shown = DVector::from_iterator(known.len(), shown);
        covariance += &shown * shown.transpose();
    }
    if let Some(root) = covariance.cholesky() {
        found.distance = residual.dot(&root.solve(&residual));
    }
    (Some(found), total)
}

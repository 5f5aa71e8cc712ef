//! What is uncertain whatever the explanation, as columns of one standard deviation each.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::machine::InertiaElement;

use super::amounts::{Scene, Unstated};
use super::equations::{Equations, Part};
use super::fall::Fall;

/// While the machine rotates, the ground carries the tyre further out: by this share of its radius per radian, on average
/// and as a standard deviation, up to about this rotation (rad).
const SHIFT_SHARE: f64 = 0.25;
const SHIFT_SIGMA: f64 = 0.25;
const SHIFT_UNTIL_RAD: f64 = 0.3;
/// The lean has an unknown constant: slope of the ground, mounting of the IMU (rad).
const CONSTANT_RAD: f64 = 0.05;

/// The nuisances of a fall.
pub(super) struct Nuisances {
    /// Expected residual.
    pub(super) mean: DVector<f64>,
    /// Covariance by all of them.
    pub(super) covariance: DMatrix<f64>,
}

impl Nuisances {
    pub(super) fn of(
        scene: &Scene<'_>,
        equations: &Equations,
        fall: Fall,
        has_attitude: bool,
    ) -> Self {
        let size = equations.all.len();
        let computed = scene.computed(&equations.rows, &[]);
        let stated = equations.residuals(&computed);
        let mut covariance = DMatrix::zeros(size, size);
        let mut add = |column: DVector<f64>| {
            // what cannot be evaluated with a change is not known to matter
            if column.iter().all(|value| value.is_finite()) {
                covariance += &column * column.transpose();
            }
        };
        for (unstated, sigma) in uncertain(scene) {
            let changed = scene.computed(&equations.rows, &[(unstated, sigma)]);
            add(&stated - equations.residuals(&changed));
        }
        let of_part = |part: Part, of: &dyn Fn(usize) -> f64| {
            let values = equations.all.iter();
            let values = values.map(|equation| match equation.part == part {
                true => of(equation.row),
                false => 0.0,
            });
            DVector::from_iterator(size, values)
        };
        let edge = &scene.machine.polygon().edges()[scene.edge];
        let radius = scene.machine.wheels()[edge.from].radius;
        let shift = |row: usize| {
            let turned = equations.rows[row].rotation_rad / SHIFT_UNTIL_RAD;
            let shift_m = radius * SHIFT_UNTIL_RAD * turned.tanh();
            // the true edge is further out: the true moment about it is smaller
            -computed[row].normal_n * shift_m
        };
        let shifted = of_part(Part::Fall, &shift);
        add(&shifted * SHIFT_SIGMA);
        let slope = slope_before(equations, &stated);
        add(of_part(Part::Onset, &|_| slope * fall.onset_sigma_s()));
        for axis in 0..2 {
            let of_axis = |of: &dyn Fn(usize) -> f64| {
                let values = equations.all.iter();
                let values = values.map(|equation| {
                    match equation.part == Part::Lean && equation.axis == axis {
                        true => of(equation.row),
                        false => 0.0,
                    }
                });
                DVector::from_iterator(size, values)
            };
            add(of_axis(&|_| CONSTANT_RAD));
            if !has_attitude {
                let drift = scene.machine.uncertainty().gyro_bias;
                add(of_axis(&|row| drift * equations.rows[row].time_s));
            }
        }
        Self {
            mean: shifted * SHIFT_SHARE,
            covariance,
        }
    }
}

/// The uncertain parameters and signals, with their standard deviations.
fn uncertain(scene: &Scene<'_>) -> Vec<(Unstated, f64)> {
    let machine = scene.machine;
    let mut all = Vec::new();
    for parameter in Parameter::all(machine) {
        match parameter {
            Parameter::LinkInertia(link, InertiaElement::Xx) => {
                all.push((Unstated::Inertia(link), machine.uncertainty().inertia_share));
            }
            // the share of the lean's stiffness stands for the tyres
            Parameter::LinkInertia(..) | Parameter::TyreStiffness(_) => {}
            _ => all.push((Unstated::Parameter(parameter), parameter.sigma(machine))),
        }
    }
    all.retain(|(_, sigma)| *sigma > 0.0);
    all
}

/// How fast the residual rises at the onset (N m/s): half of how fast it rises before it.
fn slope_before(equations: &Equations, stated: &DVector<f64>) -> f64 {
    let onset = equations.of_part(Part::Onset);
    let (Some(&first), Some(&last)) = (onset.first(), onset.last()) else {
        return 0.0;
    };
    let at_s = |place: usize| equations.rows[equations.all[place].row].time_s;
    let seconds = at_s(last) - at_s(first);
    if seconds > 0.0 {
        (stated[last] - stated[first]) / seconds
    } else {
        0.0
    }
}

//! Uncertain parameters of every explanation, as columns of one standard deviation each.

use nalgebra::{DMatrix, DVector};
use tipwatch_mechanics::Parameter;
use tipwatch_mechanics::machine::InertiaElement;

use super::amounts::{Scene, Unstated};
use super::equations::{Equations, Part};
use super::fall::Fall;
use crate::events::{SHIFT_SHARE, outwards};

/// On its shoulder, the ground carries a tyre further out by this share more or less than [`SHIFT_SHARE`], one standard deviation.
const SHIFT_SIGMA: f64 = 0.25;
/// While it rotates along them, the ground carries a wheel under its axle. A tyre is no circle by this share.
const ROLL_SIGMA: f64 = 0.1;
/// Places in the normal distribution that are equally probable: by so many standard deviations an onset may be off.
const ONSETS: [f64; 8] = [-1.534, -0.887, -0.489, -0.157, 0.157, 0.489, 0.887, 1.534];
/// Standard deviation of the rate at which the load leaves the wheels before the onset, as a share of it.
const RATE_SHARE: f64 = 0.5;
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
        let [rolled, shifted] = [0, 1].map(|of: usize| {
            let shift = |row: usize| {
                let rotation_rad = equations.rows[row].rotation_rad;
                let shift_m = outwards(scene.machine, scene.edge, rotation_rad)[of];
                // the true edge is further out: the true moment about it is smaller
                -computed[row].normal_n * shift_m
            };
            of_part(Part::Fall, &shift)
        });
        add(&rolled * ROLL_SIGMA);
        add(&shifted * SHIFT_SIGMA);
        let carried = carried(equations, &stated, fall);
        let count = carried.len() as f64;
        let expected = carried
            .iter()
            .fold(DVector::zeros(size), |sum, it| sum + it)
            / count;
        carried
            .iter()
            .for_each(|it| add((it - &expected) / count.sqrt()));
        add(&expected * RATE_SHARE);
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
            mean: rolled + shifted * SHIFT_SHARE + expected,
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

/// Returns the moment that the wheels off the edge still carry in each equation (N m), for each of [`ONSETS`]: until the true
/// onset that moment falls to zero.
fn carried(equations: &Equations, stated: &DVector<f64>, fall: Fall) -> Vec<DVector<f64>> {
    let rate = rate_before(equations, stated);
    let of = |sigmas: f64| {
        let onset_s = sigmas * fall.onset_sigma_s();
        let carried = equations.all.iter().map(|equation| match equation.part {
            Part::Lean => 0.0,
            Part::Onset | Part::Fall => {
                rate * (equations.rows[equation.row].time_s - onset_s).min(0.0)
            }
        });
        DVector::from_iterator(equations.all.len(), carried)
    };
    ONSETS.map(of).into()
}

/// Returns the rate at which the residual falls to zero up to the onset (N m/s); zero or negative.
fn rate_before(equations: &Equations, stated: &DVector<f64>) -> f64 {
    let at_s = |place: usize| equations.rows[equations.all[place].row].time_s;
    let mut before = equations.of_part(Part::Onset);
    before.retain(|&place| at_s(place) <= 0.0);
    let (Some(&first), Some(&last)) = (before.first(), before.last()) else {
        return 0.0;
    };
    let rate = (stated[last] - stated[first]) / (at_s(last) - at_s(first));
    if rate.is_finite() { rate.min(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector2, Vector3};
    use tipwatch_mechanics::State;
    use tipwatch_mechanics::machine::Machine;

    use super::super::amounts::RowState;
    use super::super::rows::FallRows;
    use super::*;
    use crate::base::rigid::rigid;

    const LEFT: usize = 1;
    const REAR: usize = 2;

    fn scene(machine: &Machine, edge: usize) -> Scene<'_> {
        Scene {
            machine,
            edge,
            load: machine.load_on_tool(),
            lean: None,
        }
    }

    /// A machine at rest, rotated about its rear edge.
    fn row(machine: &Machine, time_s: f64, rotation_rad: f64) -> RowState {
        let attitude = UnitQuaternion::from_euler_angles(0.0, -rotation_rad, 0.0);
        let up = attitude.inverse_transform_vector(&Vector3::z());
        let mut state = State::zero(machine);
        state.base.up = up;
        let imu_from_base = machine.imu().rotation_in_body().transpose();
        state.imu.specific_force = imu_from_base * up * machine.gravity();
        RowState {
            time_ns: (time_s * 1e9) as i64,
            time_s,
            state,
            load_place: Vector3::zeros(),
            outward: -Vector3::x(),
            rotation_rad,
            lean_rad: Vector2::zeros(),
        }
    }

    fn rows(onset: Vec<RowState>, fall: Vec<RowState>) -> FallRows {
        FallRows {
            onset,
            fall,
            lean: Vec::new(),
            no_lean: None,
            has_attitude: true,
        }
    }

    fn fall(edge: usize, onset_sigma_s: f64) -> Fall {
        Fall {
            edge,
            onset_ns: 0,
            onset_in_log: true,
            onset_sigma_s: Some(onset_sigma_s),
            until_ns: i64::MAX,
        }
    }

    #[test]
    fn the_ground_carries_a_wheel_under_its_axle() {
        let machine = rigid();
        let turned = [0.05, 0.2, 0.34];
        let states = turned.map(|angle| row(&machine, 0.5, angle));
        let weight = machine.mass() * machine.gravity();
        let radius = machine.wheels()[machine.polygon().edges()[REAR].from].radius;
        let expected = |edge: usize| {
            let scene = scene(&machine, edge);
            let equations = Equations::new(&scene, rows(Vec::new(), states.clone().into()), false);
            Nuisances::of(&scene, &equations, fall(edge, 0.05), true).mean
        };
        for (of_rear, angle) in expected(REAR).iter().zip(turned) {
            let moment = weight * radius * angle.sin();
            assert!(
                (of_rear + moment).abs() < 5e-3 * moment,
                "{angle}: {of_rear}, expected {}",
                -moment
            );
        }
        // across the wheels, on the shoulders of the tyres: by a quarter of that at most
        for (of_left, angle) in expected(LEFT).iter().zip(turned) {
            let moment = weight * radius * angle.sin();
            assert!(
                (0.15..0.26).contains(&(-of_left / moment)),
                "{angle}: {of_left}"
            );
        }
    }

    #[test]
    fn wheels_carry_until_the_true_onset() {
        const RATE: f64 = -5000.0;
        let machine = rigid();
        let times = [-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03];
        let onset = times.map(|time_s| row(&machine, time_s, 0.0));
        let scene = scene(&machine, LEFT);
        let later = vec![row(&machine, 0.06, 0.0), row(&machine, 0.5, 0.01)];
        let equations = Equations::new(&scene, rows(onset.into(), later), false);
        let at = |place: usize| equations.rows[equations.all[place].row].time_s;
        let stated = DVector::from_fn(equations.all.len(), |place, _| RATE * at(place).min(0.0));
        let found = carried(&equations, &stated, fall(LEFT, 0.02));
        let count = found.len() as f64;
        let mean = found.iter().fold(0.0 * &stated, |sum, it| sum + it) / count;
        // the mean of the positive half of a normal distribution
        let at_onset = -RATE * 0.02 / std::f64::consts::TAU.sqrt();
        assert!((mean[3] / at_onset - 1.0).abs() < 0.1, "{mean}");
        assert!((mean[0] / (RATE * -0.03) - 1.0).abs() < 0.1, "{mean}");
        assert!(mean[7] == 0.0 && mean[8] == 0.0, "{mean}");
    }
}

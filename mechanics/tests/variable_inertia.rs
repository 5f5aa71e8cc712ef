//! The second paper's model: the platform's inertia depends on the positions of its actuators.

use crate::support;
use std::sync::Arc;

use crate::support::{assert_lanes_equal_scalar, bogie_by_rods, moving, set_joint};
use nalgebra::Vector3;
use proptest::prelude::*;
use tipwatch_mechanics::closed_form::{ClosedFormInput, PlatformParts};
use tipwatch_mechanics::{
    ClosedForm, Dual, Machine, Model, Parameter, Real, Scope, State, Workspace, evaluate,
    static_outcome,
};

const RODS: [&str; 2] = ["suspension_right", "suspension_left"];
const INPUTS: [ClosedFormInput; 2] = [ClosedFormInput::Velocity, ClosedFormInput::Accelerometer];

/// The machine on bogies with rigid tyres, as in the analytic model.
fn bogie() -> Machine {
    bogie_by_rods(|text| {
        text.replace("tyre_stiffness = 8.0e5", "").replace(
            "roll_moment_distribution = 0.5",
            "roll_moment_distribution = 0.35",
        )
    })
}

/// The machine at rest in an arm posture, the rods at these positions.
fn resting(machine: &Machine, arm: f64, rods: [f64; 2]) -> State<f64> {
    let mut state = State::zero(machine);
    for (name, position) in [
        ("lift", -1.3 + 0.3 * arm),
        ("tilt", -1.4 - 0.3 * arm),
        ("slew", 3.0 * arm),
        ("extension", 0.4),
        (RODS[0], rods[0]),
        (RODS[1], rods[1]),
    ] {
        set_joint(machine, &mut state, name, [position, 0.0, 0.0]);
    }
    state
}

fn positions(state: &State<f64>) -> Vec<f64> {
    state.joints.iter().map(|joint| joint.position).collect()
}

fn variable(machine: &Machine, input: ClosedFormInput) -> Arc<Model> {
    let positions = positions(&resting(machine, 0.2, [-0.1; 2]));
    let model = ClosedForm::with_variable_inertia(machine, &positions, input).unwrap();
    Arc::new(Model::ClosedForm(Box::new(model)))
}

fn frozen(machine: &Machine, state: &State<f64>, input: ClosedFormInput) -> Arc<Model> {
    let model = ClosedForm::new(machine, &positions(state), input).unwrap();
    Arc::new(Model::ClosedForm(Box::new(model)))
}

fn otf<T: Real>(machine: &Machine, state: &State<T>, model: &Arc<Model>) -> Vec<T> {
    let mut workspace = Workspace::with_model(machine, Scope::LOADS, Arc::clone(model));
    evaluate(machine, state, &mut workspace).otf.clone()
}

/// Returns the state at rest on a slope: the IMU measures gravity, and up is known.
fn on_slope(machine: &Machine, mut state: State<f64>, lean: [f64; 2]) -> State<f64> {
    let normal = static_outcome(machine, &positions(&state)).contact_normal;
    let up = (normal + Vector3::new(lean[0], lean[1], 0.0)).normalize();
    state.imu.specific_force = up * machine.gravity();
    state.base.up = up;
    state.base.velocity = Vector3::zeros();
    state.base.velocity_rate = Vector3::zeros();
    state
}

/// Everything in motion, with attitude and base velocity known.
fn in_motion(machine: &Machine, seed: f64) -> State<f64> {
    let measured = Vector3::new(0.8, -0.6, 9.7);
    let mut state = moving(machine, seed, measured, Vector3::new(0.05, -0.04, 0.3));
    for (k, name) in RODS.into_iter().enumerate() {
        let phase = seed + k as f64;
        let rod = [
            -0.1 + 0.06 * phase.sin(),
            0.05 * phase.cos(),
            -0.2 * phase.sin(),
        ];
        set_joint(machine, &mut state, name, rod);
    }
    state.base.up = Vector3::new(0.04, -0.06, 0.99).normalize();
    state.base.velocity = Vector3::new(1.2, 0.1, 0.0);
    state.base.velocity_rate = Vector3::new(-0.7, 0.2, 0.0);
    state
}

proptest! {
    #![proptest_config(support::cases(100))]

    /// Every mass counts exactly once: at rest, the second paper's platform and the arm's wrench give the same as
    /// Newton-Euler over every body, for any positions of rods and arm.
    #[test]
    fn val_variable_platform_equals_whole_body_at_rest(
        arm in -1.0..1.0_f64,
        rods in prop::array::uniform2(-0.19..-0.01_f64),
        lean in prop::array::uniform2(-0.3..0.3_f64),
    ) {
        let machine = bogie();
        let state = on_slope(&machine, resting(&machine, arm, rods), lean);
        let whole = otf(&machine, &state, &Arc::new(Model::WholeBody));
        let weight = machine.mass() * machine.gravity();
        for input in INPUTS {
            let found = otf(&machine, &state, &variable(&machine, input));
            for (found, whole) in found.iter().zip(&whole) {
                prop_assert!((found - whole).abs() < 1e-9 * weight, "{found} {whole}");
            }
        }
    }

    /// The frozen platform is that of its posture, whatever the present rod positions.
    #[test]
    fn frozen_platform_equals_variable_one_at_mid_stroke(
        arm in -1.0..1.0_f64,
        rods in prop::array::uniform2(-0.19..-0.01_f64),
        lean in prop::array::uniform2(-0.3..0.3_f64),
    ) {
        let machine = bogie();
        let anywhere = resting(&machine, arm, rods);
        let middle = on_slope(&machine, resting(&machine, arm, [-0.1; 2]), lean);
        for input in INPUTS {
            let variable = otf(&machine, &middle, &variable(&machine, input));
            prop_assert_eq!(&otf(&machine, &middle, &frozen(&machine, &anywhere, input)), &variable);
        }
    }

    #[test]
    fn lanes_equal_scalar(seeds in prop::array::uniform5(0.0..50.0_f64)) {
        let machine = bogie();
        let scope = Scope { indicators: true, terms: true, ..Scope::LOADS };
        let mut states: Vec<_> = seeds.iter().map(|&seed| in_motion(&machine, seed)).collect();
        for input in INPUTS {
            let model = variable(&machine, input);
            assert_lanes_equal_scalar(&machine, &mut states, scope, &model);
        }
    }

    /// Dual numbers propagate through the composite inertia: the derivatives of the loads with respect to the rods
    /// equal differences and are non-zero.
    #[test]
    fn dual_number_derivatives_equal_differences(seed in 0.0..50.0_f64) {
        let machine = bogie();
        let state = in_motion(&machine, seed);
        let parameters = (0..machine.joints().len()).flat_map(|joint| {
            [Parameter::JointPosition(joint), Parameter::JointVelocity(joint), Parameter::JointAcceleration(joint)]
        });
        let model = variable(&machine, ClosedFormInput::Velocity);
        for parameter in parameters {
            let mut dual = state.map(Dual::fixed);
            dual.change(parameter, Dual { value: 0.0, slope: 1.0 });
            let slopes = otf(&machine, &dual, &model);
            let at = |amount: f64| {
                let mut state = state.clone();
                state.change(parameter, amount);
                otf(&machine, &state, &model)
            };
            let (ahead, behind) = (at(1e-5), at(-1e-5));
            for (wheel, slope) in slopes.iter().enumerate() {
                let difference = (ahead[wheel] - behind[wheel]) / 2e-5;
                let scale = 1.0 + difference.abs().max(1e4);
                prop_assert!(
                    (slope.slope - difference).abs() < 2e-6 * scale,
                    "{}: {} {difference}", parameter.name(&machine), slope.slope
                );
                let Parameter::JointPosition(joint) = parameter else { continue };
                if RODS.contains(&machine.joints()[joint].name.as_str()) {
                    prop_assert!(slope.slope.abs() > 100.0, "{}", slope.slope);
                }
            }
        }
    }
}

/// Mass, centre of mass, height, distances and inertia tensor depend on the rods.
#[test]
fn platform_parameters_depend_on_rods() {
    let machine = bogie();
    let parts = PlatformParts::of(&machine).unwrap();
    let at = |rods| {
        parts
            .place(&machine, &positions(&resting(&machine, 0.0, rods)))
            .unwrap()
    };
    let (low, high) = (at([-0.19; 2]), at([-0.01; 2]));
    assert_eq!(low.platform.mass, high.platform.mass);
    // 1400 kg of base, two bogies of 250, two cylinders of 25, two rods of 15
    assert!((low.platform.mass - 1980.0).abs() < 1e-9);
    for (a, b) in [
        (low.platform.com_height, high.platform.com_height),
        (low.platform.to_front, high.platform.to_front),
        (low.platform.inertia_xz, high.platform.inertia_xz),
        (low.inertia.m22, high.inertia.m22),
    ] {
        assert!((a - b).abs() > 0.01 * a.abs(), "{a} {b}");
    }
    let twisted = at([-0.15, -0.05]);
    let (left, right) = (
        twisted.platform.half_track_left,
        twisted.platform.half_track_right,
    );
    assert!((left - right).abs() > 1e-4, "{left} {right}");
}

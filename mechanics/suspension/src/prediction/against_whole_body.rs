//! Verifies the condensed machine against Newton-Euler over every body, and the platform's velocity and
//! acceleration against differences of its positions.

use nalgebra::{Matrix3, Vector3};

use super::predicted_state::{PredictedState, RodMotion};
use crate::condensed::Carriers;
use crate::condensed::Instant;
use crate::condensed::SuspendedMachine;
use tipwatch_mechanics::Scope;
use tipwatch_mechanics::Workspace;
use tipwatch_mechanics::dynamics::kinematics::{SensorFrame, base_motion};
use tipwatch_mechanics::evaluate;
use tipwatch_mechanics::geometry::coordinate::Motion;
use tipwatch_mechanics::machine::{Ground, LinkageInput, LogFacts, Machine, MachineSpec};
use tipwatch_mechanics::state::State;

fn bogie(edit: impl Fn(String) -> String) -> SuspendedMachine {
    let text = edit(include_str!("../../../tests/data/bogie.toml").into());
    let spec = MachineSpec::from_toml(&text, "bogie.toml").unwrap();
    let urdf = include_str!("../../../tests/data/bogie.urdf");
    let machine = spec.check(urdf, "bogie.urdf", LogFacts::default()).unwrap();
    let linkages = machine.suspension().unwrap().linkages.clone();
    SuspendedMachine {
        carriers: Carriers::of(&machine, &linkages),
        machine,
        linkages,
    }
}

/// The laboratory machine; with a payload and an IMU on the arm; on flat ground with springs; with cylinders
/// that carry the bogies' side of the triangle.
fn machines() -> Vec<SuspendedMachine> {
    let laden = |text: String| {
        text.replace("link = \"base_link\"", "link = \"lift_boom\"")
            + "\n[[payload]]\nlink = \"tool\"\nmass = 80.0\ncom = [0.1, 0.2, -0.3]\ninertia = [4.0, 5.0, 6.0, 0.1, 0.2, 0.3]\n"
    };
    let plane = |text: String| text.replace("[contact]", "[contact]\nground = \"plane\"");
    let hard = |text: String| text.replace("tyre_stiffness = 8.0e5\n", "");
    vec![bogie(|t| t), bogie(laden), bogie(plane), bogie(hard)]
}

fn wave(seed: f64, k: f64) -> f64 {
    (seed * 1.7 + 2.3 * k).sin()
}

/// A state in which everything moves.
fn state(machine: &Machine, seed: f64) -> State<f64> {
    let mut state = State::zero(machine);
    for (k, (motion, joint)) in state.joints.iter_mut().zip(machine.joints()).enumerate() {
        let middle = match joint.name.as_str() {
            "lift" | "tilt" => -1.3,
            _ => 0.1,
        };
        let k = k as f64;
        *motion = Motion {
            position: middle + 0.2 * wave(seed, k),
            rate: 0.4 * wave(seed, k + 0.3),
            acceleration: 0.7 * wave(seed, k + 0.6),
        };
    }
    state.imu.specific_force = on_ground(seed);
    state.imu.angular_velocity = Vector3::new(0.1, -0.2, 0.4) * wave(seed, 1.3);
    state.imu.angular_acceleration = Vector3::new(-0.2, 0.3, 0.1) * wave(seed, 1.4);
    state.tool_wrench.force = Vector3::new(150.0, -90.0, 220.0) * wave(seed, 1.5);
    state.tool_wrench.moment = Vector3::new(30.0, 40.0, -20.0) * wave(seed, 1.6);
    state.base.up = Vector3::new(0.1 * wave(seed, 1.7), 0.1 * wave(seed, 1.8), 1.0).normalize();
    state
}

fn on_ground(seed: f64) -> Vector3<f64> {
    Vector3::new(0.7 * wave(seed, 1.1), 0.5 * wave(seed, 1.2), 9.7)
}

/// Motions of two rods, nearly equal on flat ground, where the difference would lift wheels.
fn rods(suspended: &SuspendedMachine, seed: f64) -> [Motion<f64>; 2] {
    let plane = suspended.machine.contact().ground == Ground::Plane;
    [0.0, if plane { 1e-3 } else { 0.4 }].map(|side| Motion {
        position: -0.1 + 0.09 * wave(seed, 2.0 + side),
        rate: 0.1 * wave(seed, 2.1 + side),
        acceleration: 0.5 * wave(seed, 2.2 + side),
    })
}

/// Sets the measured joints of the suspension so that its rods have these motions.
fn set_rods(suspended: &SuspendedMachine, state: &mut State<f64>, rods: &[Motion<f64>]) {
    for (rod, &linkage) in rods.iter().zip(&suspended.linkages) {
        let linkage = &suspended.machine.linkages()[linkage];
        assert_eq!(linkage.input, LinkageInput::PivotAngle);
        state.joints[linkage.measured_joint] = linkage.measured_by_rod(rod);
    }
}

#[test]
fn condensed_machine_equals_whole_body_model() {
    for (which, suspended) in machines().iter().enumerate() {
        let mut predicted_state = PredictedState::<f64>::new(suspended);
        let mut scratch = PredictedState::<f64>::new(suspended);
        let mut instant = Instant::new(suspended);
        let at_base = suspended.machine.with_imu_at_base();
        let scope = Scope {
            indicators: true,
            ..Scope::LOADS
        };
        let mut workspace = Workspace::with_scope(&at_base, scope);
        let mut compared = 0;
        for seed in 0..200 {
            let seed = f64::from(seed);
            let mut state = state(&suspended.machine, seed);
            instant.fill(suspended, &state, &rods(suspended, seed), &mut scratch);
            // With the recorded rod motion, the base moves as the IMU measures it.
            predicted_state.fill(
                suspended,
                &instant,
                &rods(suspended, seed),
                RodMotion::InMotion,
                true,
            );
            let sensor_frame = SensorFrame::of(&suspended.machine, &instant.coordinates);
            let measured = base_motion(&suspended.machine, &sensor_frame, &state.imu);
            for (found, expected) in [
                (predicted_state.base.specific_force, measured.specific_force),
                (
                    predicted_state.base.angular_velocity,
                    measured.angular_velocity,
                ),
                (
                    predicted_state.base.angular_acceleration,
                    measured.angular_acceleration,
                ),
            ] {
                assert!((found - expected).norm() < 1e-13 * (1.0 + expected.norm()));
            }
            // An IMU on the arm tilts with it, the ground does not.
            instant.on_ground.specific_force = on_ground(seed);
            for own in [RodMotion::AtRest, RodMotion::InMotion] {
                let mut trial = rods(suspended, seed + 0.37);
                if own == RodMotion::AtRest {
                    trial = trial.map(|rod| Motion::at_rest(rod.position));
                }
                predicted_state.fill(suspended, &instant, &trial, own, true);
                set_rods(suspended, &mut state, &trial);
                state.imu.specific_force = predicted_state.base.specific_force;
                state.imu.angular_velocity = predicted_state.base.angular_velocity;
                state.imu.angular_acceleration = predicted_state.base.angular_acceleration;
                state.base.up = up_in_base(suspended, &instant, &trial);
                let whole = evaluate(&at_base, &state, &mut workspace);
                let weight = at_base.mass() * at_base.gravity();
                // A lifted wheel extends its tyre in one solution (it pulls) but not in the other.
                if whole.otf.iter().all(|&load| load > 0.005 * weight) {
                    compared += 1;
                    for (found, expected) in predicted_state.otf.iter().zip(&whole.otf) {
                        assert!(
                            (found - expected).abs() < 1e-12 * weight,
                            "{which} {seed}: {found} {expected}"
                        );
                    }
                    for (found, expected) in predicted_state
                        .angle
                        .iter()
                        .zip(&whole.indicators.stability_angle)
                    {
                        assert!(
                            (found - expected).abs() < 1e-12,
                            "{which} {seed}: {found} {expected}"
                        );
                    }
                }
            }
        }
        assert!(compared > 100, "{which}: {compared}");
    }
}

fn up_in_base(
    suspended: &SuspendedMachine,
    instant: &Instant,
    rods: &[Motion<f64>],
) -> Vector3<f64> {
    let mut scratch = PredictedState::<f64>::new(suspended);
    let support = scratch.observe(suspended, instant, rods);
    support.sensor_frame.rotation * instant.up_on_ground
}

/// On ground at rest, the platform's velocity and acceleration are the derivatives of its position.
#[test]
fn platform_motion_matches_position_differences() {
    let suspended = bogie(|t| t);
    let mut scratch = PredictedState::<f64>::new(&suspended);
    let mut instant = Instant::new(&suspended);
    let h = 1e-3;
    for seed in 0..20 {
        let seed = f64::from(seed);
        let start = rods(&suspended, seed);
        let at = |t: f64| {
            start.map(|rod| Motion {
                position: rod.position + t * rod.rate + 0.5 * t * t * rod.acceleration,
                rate: rod.rate + t * rod.acceleration,
                acceleration: rod.acceleration,
            })
        };
        instant.fill(
            &suspended,
            &state(&suspended.machine, seed),
            &start,
            &mut scratch,
        );
        // Ground at rest, without gravity.
        for measured in [
            &mut instant.on_ground.specific_force,
            &mut instant.on_ground.angular_velocity,
            &mut instant.on_ground.angular_acceleration,
        ] {
            measured.fill(0.0);
        }
        // Pose of the base in the axes of the ground.
        let mut pose = |t: f64| -> (Matrix3<f64>, Vector3<f64>) {
            let sensor_frame = scratch.observe(&suspended, &instant, &at(t)).sensor_frame;
            let ground_from_base = sensor_frame.rotation.transpose();
            (
                ground_from_base,
                -(ground_from_base * sensor_frame.position),
            )
        };
        let [(r0, p0), (r1, p1), (r2, p2)] = [pose(-h), pose(0.0), pose(h)];
        let acceleration = r1.transpose() * (p2 - p1 * 2.0 + p0) / (h * h);
        // R' Rdot = [w], and its derivative.
        let spin = r1.transpose() * (r2 - r0) / (2.0 * h);
        let w = Vector3::new(spin.m32, spin.m13, spin.m21);
        let second = r1.transpose() * (r2 - r1 * 2.0 + r0) / (h * h) - spin * spin;
        let alpha = Vector3::new(second.m32, second.m13, second.m21);
        let mut predicted_state = PredictedState::<f64>::new(&suspended);
        predicted_state.fill(&suspended, &instant, &start, RodMotion::InMotion, false);
        let near = |a: &Vector3<f64>, b: &Vector3<f64>, what: &str| {
            assert!((a - b).norm() < 2e-6, "{seed} {what}: {a} {b}");
        };
        near(&predicted_state.base.angular_velocity, &w, "w");
        near(&predicted_state.base.angular_acceleration, &alpha, "alpha");
        near(&predicted_state.base.specific_force, &acceleration, "a");
    }
}

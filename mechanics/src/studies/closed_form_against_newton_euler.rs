//! Verifies the analytic model against Newton-Euler for machines with bogies, knuckles and arms.

use nalgebra::Vector3;
use proptest::prelude::*;

use super::static_posture::static_outcome;
use crate::closed_form::{
    Demand, DemandContributions, MeasuredMotion, PlacedPlatform, PlatformParts,
};
use crate::dynamics::kinematics::{self, BodyMotion};
use crate::dynamics::newton_euler;
use crate::geometry::coordinate::Coordinate;
use crate::geometry::spatial::Wrench;
use crate::machine::of_tests::checked;
use crate::machine::{LinkGroup, Machine};
use crate::number::{Lanes, Real};
use crate::state::State;

/// A machine of the test data with rigid tyres.
fn machine(name: &str) -> Machine {
    let (spec, urdf) = match name {
        "rigid" => (
            include_str!("../../tests/data/rigid.toml"),
            include_str!("../../tests/data/rigid.urdf"),
        ),
        _ => (
            include_str!("../../tests/data/bogie.toml"),
            include_str!("../../tests/data/bogie.urdf"),
        ),
    };
    checked(&spec.replace("tyre_stiffness = 8.0e5", ""), urdf)
}

/// Joint positions: cylinders at half stroke, all others at `arm`.
fn positions(machine: &Machine, arm: f64) -> Vec<f64> {
    let of_joint = |name: &str| match name {
        "suspension_right" | "suspension_left" => -0.1,
        "lift" => -1.3 + 0.3 * arm,
        "tilt" => -1.4 + 0.3 * arm,
        "slew" => 3.0 * arm,
        "extension" => 0.4,
        _ => 0.0,
    };
    machine.joints().iter().map(|j| of_joint(&j.name)).collect()
}

/// Motions of all bodies, the joints at rest, from the base's specific force and angular motion.
fn motions<T: Real>(
    machine: &Machine,
    positions: &[T],
    base: [Vector3<T>; 3],
) -> Vec<BodyMotion<T>> {
    let mut state = State::<T>::zero(machine);
    for (motion, &position) in state.joints.iter_mut().zip(positions) {
        motion.position = position;
    }
    let zero = T::zero();
    let mut coordinates = vec![Coordinate::slid(zero, zero, zero); machine.bodies.len()];
    kinematics::coordinates(machine, &state, &mut coordinates);
    let [measured, rate, acceleration] = base;
    let mut motions = vec![BodyMotion::base(measured, rate, acceleration); machine.bodies.len()];
    for (i, body) in machine.bodies.iter().enumerate().skip(1) {
        motions[i] = motions[body.parent].carry(body, &coordinates[i]);
    }
    motions
}

/// Wrench about the base origin that accelerates the bodies for which `counted` holds.
fn moving_wrench(
    machine: &Machine,
    motions: &[BodyMotion<f64>],
    counted: impl Fn(usize) -> bool,
) -> Wrench<f64> {
    let bodies = machine.bodies.iter().zip(motions);
    let wrenches: Vec<_> = bodies
        .map(|(body, motion)| newton_euler::body_wrench(&body.inertia, motion))
        .collect();
    newton_euler::sum(&wrenches, counted)
}

fn in_arm(machine: &Machine, body: usize) -> bool {
    let mut links = machine.links.iter().filter(|link| link.body == body);
    links.all(|link| link.group == LinkGroup::Arm)
}

fn is_wheel(machine: &Machine, body: usize) -> bool {
    machine.wheels.iter().any(|wheel| wheel.body == body)
}

/// Wrench of the arm on the platform at the arm's root.
fn arm_wrench(
    machine: &Machine,
    motions: &[BodyMotion<f64>],
    placed: &PlacedPlatform<f64>,
) -> Wrench<f64> {
    let moving = moving_wrench(machine, motions, |body| in_arm(machine, body));
    let by_arm = Wrench::zero().minus(&moving);
    placed.pose.wrench_at(&by_arm, &placed.platform.arm_base)
}

fn assert_close(found: f64, expected: f64, allowed: f64) {
    let error = (found - expected).abs();
    assert!(error <= allowed, "{found}, expected {expected}");
}

/// Asserts that model and Newton-Euler demand the same, for a motion in the plane of the wheels.
fn assert_same_demand(machine: &Machine, arm: f64, slope: [f64; 2], push: [f64; 2], yaw: [f64; 2]) {
    let parts = PlatformParts::of(machine).unwrap();
    let positions = positions(machine, arm);
    let placed = parts.place(machine, &positions).unwrap();
    let (pose, g) = (&placed.pose, machine.gravity);
    let up = Vector3::new(slope[0], slope[1], 1.0).normalize();
    let to_base = pose.platform_from_base.transpose();
    // The model's platform stays on its plane, so the normal specific force is due to gravity alone.
    let measured = Vector3::new(push[0], push[1], g * up.z);
    let [rate, acceleration] = yaw.map(|yaw| to_base * Vector3::new(0.0, 0.0, yaw));
    let centre = pose.centre;
    let with_imu_at_base =
        to_base * measured - acceleration.cross(&centre) - rate.cross(&rate.cross(&centre));
    let back = pose.specific_force_at_centre(&with_imu_at_base, &rate, &acceleration);
    assert!((back - measured).norm() < 1e-12);
    let moving = motions(machine, &positions, [with_imu_at_base, rate, acceleration]);
    let at_rest = motions(
        machine,
        &positions,
        [to_base * up * g, Vector3::zeros(), Vector3::zeros()],
    );
    let whole = moving_wrench(machine, &moving, |body| !is_wheel(machine, body)).plus(
        &moving_wrench(machine, &at_rest, |body| is_wheel(machine, body)),
    );
    let below = Vector3::new(0.0, 0.0, -placed.platform.com_height);
    let demand = pose.wrench_at(&whole, &below);
    let motion = MeasuredMotion {
        specific_force: measured,
        yaw_rate: yaw[0],
        yaw_acceleration: yaw[1],
    };
    let wrench = arm_wrench(machine, &moving, &placed);
    let found: Demand<f64> =
        DemandContributions::of_measured(&placed.platform, &up, &motion, &wrench).sum();
    let scale = 1e-9 * machine.mass() * g;
    assert_close(found.b1, demand.moment.x, scale);
    assert_close(found.b2, demand.moment.y, scale);
    assert_close(found.b3, demand.force.z, scale);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn demand_equals_newton_euler(
        arm in -1.0..1.0_f64,
        slope in prop::array::uniform2(-0.4..0.4_f64),
        push in prop::array::uniform2(-3.0..3.0_f64),
        yaw in prop::array::uniform2(-0.8..0.8_f64),
    ) {
        for name in ["rigid", "bogie"] {
            assert_same_demand(&machine(name), arm, slope, push, yaw);
        }
    }
}

#[test]
fn loads_at_rest_equal_whole_body_model() {
    for (name, arm) in [("rigid", 0.3), ("bogie", -0.6)] {
        let machine = machine(name);
        let parts = PlatformParts::of(&machine).unwrap();
        let positions = positions(&machine, arm);
        let placed = parts.place(&machine, &positions).unwrap();
        let up = Vector3::z();
        let normal = placed.pose.platform_from_base.row(2).transpose();
        let measured = normal * machine.gravity;
        let at_rest = motions(
            &machine,
            &positions,
            [measured, Vector3::zeros(), Vector3::zeros()],
        );
        let wrench = arm_wrench(&machine, &at_rest, &placed);
        let motion = MeasuredMotion {
            specific_force: up * machine.gravity,
            yaw_rate: 0.0,
            yaw_acceleration: 0.0,
        };
        let contributions =
            DemandContributions::of_measured(&placed.platform, &up, &motion, &wrench);
        let whole_body = static_outcome(&machine, &positions).otf;
        for (load, wheel) in contributions
            .terms(&placed.platform)
            .loads()
            .into_iter()
            .zip(parts.wheels())
        {
            assert_close(load, whole_body[wheel], 1e-6 * machine.mass());
        }
    }
}

#[test]
fn lanes_equal_scalar_postures_bitwise() {
    let machine = machine("bogie");
    let parts = PlatformParts::of(&machine).unwrap();
    let arms = [-0.8, -0.1, 0.4, 0.9];
    let postures = arms.map(|arm| {
        let mut positions = positions(&machine, arm);
        for (joint, position) in machine.joints().iter().zip(&mut positions) {
            *position += if joint.name.starts_with("suspension") {
                0.05 * arm
            } else {
                0.0
            };
        }
        positions
    });
    let side_by_side: Vec<Lanes> = (0..postures[0].len())
        .map(|joint| Lanes::from_array(postures.each_ref().map(|posture| posture[joint])))
        .collect();
    let lanes = parts.placed(
        &machine,
        &motions(&machine, &side_by_side, [Vector3::zeros(); 3]),
    );
    for (k, posture) in postures.iter().enumerate() {
        let alone = parts.placed(&machine, &motions(&machine, posture, [Vector3::zeros(); 3]));
        let (lanes, alone) = (&lanes.platform, &alone.platform);
        let pairs = [
            (lanes.mass, alone.mass),
            (lanes.com_height, alone.com_height),
            (lanes.to_rear, alone.to_rear),
            (lanes.to_front, alone.to_front),
            (lanes.half_track_left, alone.half_track_left),
            (lanes.half_track_right, alone.half_track_right),
            (lanes.wheel_moment.x, alone.wheel_moment.x),
            (lanes.wheel_moment.z, alone.wheel_moment.z),
            (lanes.inertia_xz, alone.inertia_xz),
            (lanes.inertia_yz, alone.inertia_yz),
            (lanes.arm_base.z, alone.arm_base.z),
        ];
        for (lane, alone) in pairs {
            assert_eq!(lane.to_array()[k].to_bits(), alone.to_bits());
        }
    }
}

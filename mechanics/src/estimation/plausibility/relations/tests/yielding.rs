//! The lean of a standing platform whose ground gives way, beside one of whose joints a sensor shows nothing.

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::super::super::Explanation;
use super::super::super::notice::Rules;
use super::super::lean::LeanRelation;
use super::super::lean_model::LeanModel;
use super::{joint, posture, steered};
use crate::estimation::noise_of_tests::Noise;
use crate::machine::Machine;

const STEP_NS: i64 = 10_000_000;
const WINDOW_NS: i64 = 500_000_000;
const THRESHOLD: f64 = 22.5;

/// What stands first in 25 s: of a platform that the ground turns (rad, about x and y), and whose arm slews (rad), of which
/// the encoder shows `shown`; all by time (s).
fn first(
    machine: &Machine,
    ground: impl Fn(f64) -> Vector2<f64>,
    slew: impl Fn(f64) -> f64,
    shown: impl Fn(f64) -> f64,
) -> Option<Explanation> {
    let limits = Rules::of(machine).limits;
    let mut relation = LeanRelation::new(machine, true, THRESHOLD).unwrap();
    let mut truth = LeanModel::new(machine).unwrap();
    let level = Vector3::z() * machine.gravity();
    let mut lean = |slew: f64| {
        for (joint, position) in posture(machine, slew).into_iter().enumerate() {
            truth.set(joint, position, 0.0);
        }
        truth.posture_lean(&level)
    };
    let (mut noise, mut before, mut start_ns) = (Noise(7), None, 0);
    for step in 0..2500_i64 {
        let (stamp_ns, t) = (step * STEP_NS, step as f64 * 0.01);
        let turned = ground(t) + lean(slew(t));
        let last = before.replace(turned).unwrap_or(turned);
        let rate = (turned - last) / 0.01 + Vector2::from_fn(|_, _| 1e-3 * noise.next());
        let attitude = UnitQuaternion::from_euler_angles(turned.x, turned.y, 0.0);
        let force = attitude.inverse_transform_vector(&level);
        let positions = posture(machine, shown(t));
        let joints = positions.into_iter().enumerate();
        let joints = joints.map(|(joint, position)| (joint, position + 2e-4 * noise.next(), 0.0));
        let joints: Vec<(usize, f64, f64)> = joints.collect();
        relation.take_joints(stamp_ns, joints.into_iter(), &limits);
        let rate = Vector3::new(rate.x, rate.y, 0.0);
        relation.take_imu(stamp_ns, [&force, &rate], Some(0.0));
        if stamp_ns - start_ns >= WINDOW_NS {
            relation.weigh(start_ns, stamp_ns);
            start_ns = stamp_ns;
            if let Some((explanation, ..)) = relation.standing() {
                return Some(explanation);
            }
        }
    }
    None
}

/// From 0 to 1 between two times (s), without a jerk at either.
fn smooth(t: f64, from_s: f64, to_s: f64) -> f64 {
    let share = ((t - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
    share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
}

#[test]
fn ground_that_settles_is_no_joint_that_moves_unseen() {
    let machine = steered();
    // under one side or one end: no joint leans the platform about the same axis
    for (x, y) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
        for degrees in [0.3_f64, 2.0] {
            let axis = Vector2::new(x, y);
            let ground = |t: f64| axis * (degrees.to_radians() * smooth(t, 6.0, 16.0));
            let found = first(&machine, ground, |_| 2.0, |_| 2.0);
            assert_eq!(found, None, "{degrees} degrees about {axis}");
        }
    }
}

#[test]
fn an_encoder_that_stops_while_the_arm_slews_on_is_still_found() {
    let machine = steered();
    let slew = |t: f64| 0.8 * (0.7 * t).sin();
    let firm = |_: f64| Vector2::zeros();
    let stopped = |t: f64| slew(t.min(8.0));
    let found = first(&machine, firm, slew, stopped);
    assert_eq!(
        found,
        Some(Explanation::JointStopped(joint(&machine, "slew")))
    );
    assert_eq!(first(&machine, firm, slew, slew), None);
}

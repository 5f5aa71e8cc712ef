//! Whether the lean of a standing platform shows that the encoder of its slew has the other sign.

use nalgebra::{Vector2, Vector3};

use super::super::super::notice::Rules;
use super::super::lean::LeanRelation;
use super::{checked, joint, posture, steered};
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::scope::Scope;
use crate::machine::Machine;
use crate::studies::static_posture::at_rest;

/// Time between samples (s), and samples of a window.
const STEP_S: f64 = 0.01;
const WINDOW: i64 = 50;

/// The probability that the slew has the other sign after so many seconds. `slew` is its true angle (rad) at a time (s), `shown` the
/// sign of what is measured of it, and `speed` that of the machine (m/s) in the first sample.
fn reversed(seconds: i64, slew: impl Fn(f64) -> f64, shown: f64, speed: f64) -> f64 {
    reversed_of(&steered(), seconds, slew, shown, speed)
}

fn reversed_of(
    machine: &Machine,
    seconds: i64,
    slew: impl Fn(f64) -> f64,
    shown: f64,
    speed: f64,
) -> f64 {
    let up = Vector3::z() * machine.gravity();
    let limits = Rules::of(machine).limits;
    let mut rest = at_rest(machine, &posture(machine, 0.0), Scope::LOADS);
    rest.state.payload_share.fill(1.0);
    let stiffness: Vec<f64> = (machine.wheels().iter())
        .map(|wheel| wheel.stiffness.unwrap())
        .collect();
    let mut lean = |slew: f64| -> Vector2<f64> {
        for (motion, position) in rest.state.joints.iter_mut().zip(posture(machine, slew)) {
            motion.position = position;
        }
        let loads = &evaluate(&rest.machine, &rest.state, &mut rest.workspace).load;
        let wheels = machine.wheels().iter().zip(loads.iter().zip(&stiffness));
        wheels.fold(Vector2::zeros(), |lean, (wheel, (load, stiffness))| {
            let at = wheel.centre_at_zero;
            let squares = Vector2::new(at.y * at.y, at.x * at.x) * (4.0 * stiffness);
            lean + (Vector2::new(-at.y, at.x) * *load).component_div(&squares)
        })
    };
    let mut relation = LeanRelation::new(machine, true, 22.0).unwrap();
    for sample in 0..seconds * 2 * WINDOW {
        let (time_s, stamp_ns) = (sample as f64 * STEP_S, sample * 10_000_000);
        let (now, next) = (slew(time_s), slew(time_s + STEP_S));
        let turning = (lean(next) - lean(now)) / STEP_S;
        let turning = Vector3::new(turning.x, turning.y, 0.0);
        let speed = if sample == 0 { speed } else { 0.0 };
        relation.take_imu(stamp_ns, [&up, &turning], Some(speed));
        let joints = posture(machine, shown * now).into_iter().enumerate();
        let joints = joints.map(|(joint, position)| (joint, position, 0.0));
        relation.take_joints(stamp_ns, joints, &limits);
        if sample > 0 && sample % WINDOW == 0 {
            relation.weigh(stamp_ns - 500_000_000, stamp_ns);
        }
    }
    let of_slew = joint(machine, "slew");
    let found = relation.reversed(|_| 0.0);
    let mut found = found.into_iter().filter(|(joint, _)| *joint == of_slew);
    found.next().unwrap().1
}

/// Turns by an angle (rad) from a time on, in so many seconds.
fn turns(angle: f64, from_s: f64, in_s: f64) -> impl Fn(f64) -> f64 {
    move |time_s| angle * ((time_s - from_s) / in_s).clamp(0.0, 1.0)
}

#[test]
fn a_short_turn_shows_the_sign_of_a_slew() {
    let [right, wrong] = [1.0, -1.0].map(|sign| reversed(4, turns(1.2, 1.7, 0.9), sign, 0.0));
    assert!(right < 1e-4, "{right}");
    // the gyro may have the other sign as well: that is five times less probable beforehand
    assert!(wrong > 0.7, "{wrong}");
    let unmoved = reversed(4, |_| 0.0, 1.0, 0.0);
    assert!((unmoved - 0.01).abs() < 2e-3, "{unmoved}");
}

#[test]
fn a_platform_that_stood_from_the_first_sample_on_does_not_rock() {
    let [stood, came] = [0.0, 0.3].map(|speed| reversed(3, turns(0.12, 1.2, 1.0), 1.0, speed));
    assert!(stood < 0.3 * came, "{stood} {came}");
}

/// They hold the wheels down: without their weight the platform would tip.
#[test]
fn a_slew_is_tested_under_payloads_for_a_time() {
    let payloads = "[[payload]]\nlink = \"base_link\"\nmass = 3000.0\nto = 99.0\n\
                    [[payload]]\nlink = \"tool\"\nmass = 500.0\nto = 99.0\n";
    let spec = include_str!("../../../../../tests/data/rigid.toml");
    let urdf = include_str!("../../../../../tests/data/rigid.urdf");
    let machine = checked(&format!("{spec}\n{payloads}"), urdf);
    let [right, wrong] =
        [1.0, -1.0].map(|sign| reversed_of(&machine, 4, turns(1.2, 1.7, 0.9), sign, 0.0));
    assert!(right < 1e-4 && wrong > 0.7, "{right} {wrong}");
}

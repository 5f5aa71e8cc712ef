//! Errors of sensors that a motion tests for.

use nalgebra::Vector3;

use super::super::{Excitation, Unshown};
use super::{joint, posture, steered};
use crate::machine::Machine;
use crate::state::State;

/// Returns the errors of sensors for which twenty seconds at 20 Hz are no test. `set` changes a state at a time (s).
fn unshown(machine: &Machine, set: impl Fn(f64, &mut State<f64>)) -> Vec<Unshown> {
    let mut excitation = Excitation::new(machine);
    let mut state = State::zero(machine);
    for (motion, position) in state.joints.iter_mut().zip(posture(machine, 0.0)) {
        motion.position = position;
    }
    state.imu.specific_force.z = machine.gravity();
    for step in 0..400_i64 {
        set(step as f64 * 0.05, &mut state);
        excitation.take(step * 50_000_000, &state);
    }
    excitation.unshown()
}

#[test]
fn a_machine_at_rest_shows_nothing() {
    let machine = steered();
    let all = unshown(&machine, |_, _| {});
    for name in ["slew", "lift", "tilt", "extension"] {
        assert!(
            all.contains(&Unshown::Joint(joint(&machine, name))),
            "{name}"
        );
    }
    // Steering leans nothing: turns show it.
    assert_eq!(all.len(), 4 + 2);
    assert!(all.contains(&Unshown::Turn) && all.contains(&Unshown::Travel));
}

#[test]
fn a_joint_that_leans_the_platform_is_shown_alone() {
    let machine = steered();
    let slew = joint(&machine, "slew");
    let swing = |size: f64| {
        move |time_s: f64, state: &mut State<f64>| {
            state.joints[slew].position = size * (0.8 * time_s).sin();
        }
    };
    let all = unshown(&machine, swing(1.0));
    assert!(!all.contains(&Unshown::Joint(slew)));
    assert!(all.contains(&Unshown::Joint(joint(&machine, "tilt"))));
    assert!(all.contains(&Unshown::Turn));
    // Too little of it shows nothing.
    assert!(unshown(&machine, swing(0.02)).contains(&Unshown::Joint(slew)));
}

#[test]
fn nothing_of_the_arm_is_shown_while_the_machine_travels() {
    let machine = steered();
    let slew = joint(&machine, "slew");
    let all = unshown(&machine, |time_s, state| {
        state.joints[slew].position = (0.8 * time_s).sin();
        state.base.velocity = Vector3::x();
    });
    assert!(all.contains(&Unshown::Joint(slew)));
    assert!(!all.contains(&Unshown::Travel) && all.contains(&Unshown::Turn));
}

/// Off three wheels the tyres are no springs: nothing was compared.
#[test]
fn nothing_of_the_arm_is_shown_while_a_wheel_carries_nothing() {
    let machine = steered();
    let slew = joint(&machine, "slew");
    let on_slope = |share: f64| {
        unshown(&machine, |time_s, state| {
            state.joints[slew].position = (0.8 * time_s).sin();
            let gravity = machine.gravity();
            state.imu.specific_force =
                Vector3::new(0.0, share, (1.0 - share * share).sqrt()) * gravity;
        })
    };
    assert!(!on_slope(0.0).contains(&Unshown::Joint(slew)));
    assert!(on_slope(0.9).contains(&Unshown::Joint(slew)));
}

#[test]
fn turns_and_ways_count_within_some_seconds() {
    let machine = steered();
    let shown = |rate: f64, speed: f64| {
        let all = unshown(&machine, move |_, state| {
            state.imu.angular_velocity.z = rate;
            state.base.velocity.x = speed;
        });
        [Unshown::Turn, Unshown::Travel].map(|it| !all.contains(&it))
    };
    assert_eq!(shown(0.4, 0.0), [true, false]);
    assert_eq!(shown(-0.4, -0.8), [true, true]);
    // Over the whole log two radians and four metres, but never quickly.
    assert_eq!(shown(0.1, 0.2), [false, false]);
    assert_eq!(shown(f64::NAN, f64::NAN), [false, false]);
}

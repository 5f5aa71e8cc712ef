//! Which encoders stand out.

use super::super::standstill::Standstill;
use super::{joint, steered};

const ARM: [&str; 4] = ["slew", "lift", "tilt", "extension"];

/// Noise between -1 and 1.
fn noise(sample: i32, joint: usize) -> f64 {
    let wave = (f64::from(sample) * 12.9898 + joint as f64 * 3.7).sin() * 43_758.545_3;
    2.0 * wave.rem_euclid(1.0) - 1.0
}

/// Whether an encoder stands out after two seconds at 100 Hz, in which those in `still` repeat themselves.
fn stands_out(still: &[&str], size: f64) -> bool {
    let machine = steered();
    let mut standstill = Standstill::new(&machine);
    for sample in 0..200 {
        for (index, it) in machine.joints().iter().enumerate() {
            let flickers = ARM.contains(&it.name.as_str()) && !still.contains(&it.name.as_str());
            let position = if flickers {
                size * noise(sample, index)
            } else {
                0.3
            };
            standstill.take(index, position);
        }
    }
    standstill.stands_out()
}

#[test]
fn one_that_repeats_itself_among_those_that_flicker_stands_out() {
    for name in ARM {
        assert!(stands_out(&[name], 3e-4), "{name}");
    }
}

#[test]
fn encoders_at_rest_without_noise_do_not_stand_out() {
    // All flicker, none does, and only half of them do. Steering and wheels, which stand still here, never count.
    assert!(!stands_out(&[], 3e-4));
    assert!(!stands_out(&ARM, 3e-4));
    assert!(!stands_out(&["slew", "tilt"], 3e-4));
}

#[test]
fn smooth_motion_is_no_noise() {
    let machine = steered();
    let mut standstill = Standstill::new(&machine);
    let tilt = joint(&machine, "tilt");
    for sample in 0..500 {
        for (index, _) in machine.joints().iter().enumerate() {
            let moved = (f64::from(sample) * 0.01).sin();
            standstill.take(index, if index == tilt { 0.3 } else { moved });
        }
    }
    assert!(!standstill.stands_out());
}

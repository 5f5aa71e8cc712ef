//! Length of the specific force: at rest it is g, and a working machine adds little to it over a second.

use nalgebra::Vector3;
use tipwatch_language::{message, say, told, word};
use tipwatch_mechanics::state::Sensor;

use super::proportion::digits;
use super::windows::{median, of_windows, quantile};
use super::{GrossInput, GrossInputKind};
use crate::base::number::{percent, short};
use crate::load::LoadedLog;

/// Angular velocity below which a window is quiet (rad/s).
const QUIET_RAD_S: f64 = 0.05;
/// Fewest quiet windows that represent the log; else all windows do.
const FEWEST_QUIET: usize = 2;
/// Largest deviation from g of the median over quiet windows, as a share of g: a bias of 0.5 m/s^2 and a lasting
/// acceleration of 3 m/s^2 stay within.
const QUIET_SHARE: f64 = 0.1;
/// Largest deviation from g of the median over all windows of a machine that never rests, as a share of g.
const MOVING_SHARE: f64 = 0.2;
/// Share of g below which gravity is missing altogether.
const WITHOUT_GRAVITY: f64 = 0.5;
/// Units of acceleration, as factors from m/s^2.
const UNITS: [(&str, f64); 5] = [
    (message!("units of g"), 1.0 / 9.806_65),
    (message!("thousandths of g"), 1000.0 / 9.806_65),
    (message!("feet per second squared"), 1.0 / 0.3048),
    (message!("centimetres per second squared"), 100.0),
    (message!("millimetres per second squared"), 1000.0),
];

/// A specific force whose length is not that of gravity.
pub(super) fn scale(loaded: &LoadedLog) -> Option<GrossInput> {
    let signal = loaded.signals.iter().find(|s| s.sensor == Sensor::Imu)?;
    let all: Vec<(f64, bool)> = of_windows(&signal.recording, |reader, window| {
        // specific force and angular velocity: how many samples have it, and their sum
        let mut sums = [(0.0, [0.0; 3]); 2];
        for at in window {
            let (vectors, _) = reader.sample(at).as_chunks::<3>();
            for ((count, sum), vector) in sums.iter_mut().zip(vectors) {
                if vector.iter().all(|c| c.is_finite()) {
                    *count += 1.0;
                    for (sum, component) in sum.iter_mut().zip(vector) {
                        *sum += component;
                    }
                }
            }
        }
        let [force, turning] = sums.map(|(count, sum)| (Vector3::from(sum) / count).norm());
        force.is_finite().then_some((force, turning < QUIET_RAD_S))
    });
    let quiet: Vec<f64> = (all.iter())
        .filter(|(_, is_quiet)| *is_quiet)
        .map(|(force, _)| *force)
        .collect();
    let (lengths, allowed, is_quiet) = match quiet.len() >= FEWEST_QUIET {
        true => (quiet, QUIET_SHARE, true),
        false => (all.iter().map(|w| w.0).collect(), MOVING_SHARE, false),
    };
    let length = median(lengths.iter().copied())?;
    let gravity = loaded.machine.gravity();
    if (length / gravity - 1.0).abs() <= allowed {
        return None;
    }
    let [low, high] = [0.25, 0.75].map(|share| quantile(lengths.iter().copied(), share));
    let unit = UNITS.iter().find(|(_, factor)| {
        // a whole log at this length, not a mean by chance
        let as_unit = |value: f64| (value / (factor * gravity) - 1.0).abs() < 0.15;
        low.is_some_and(as_unit) && high.is_some_and(as_unit)
    });
    let (at_rest, windows) = match is_quiet {
        true => (word!("at rest"), word!("quiet windows of one second")),
        false => (word!("over the log"), word!("moving windows of one second")),
    };
    let (looks_like, fix) = match unit {
        Some((name, factor)) => (
            say!("it looks like {}", told(name)),
            say!(
                "bind the components with scale = {} in [signals.imu]",
                digits(1.0 / factor)
            ),
        ),
        None if length < WITHOUT_GRAVITY * gravity => (
            word!("gravity seems to be removed").to_owned(),
            word!("bind the signal that includes gravity (in [signals.imu]): without it nothing tells where up is")
                .to_owned(),
        ),
        None => (
            word!("its scale is wrong").to_owned(),
            say!(
                "check the unit of the components; scale = {} in [signals.imu] would give gravity",
                digits(gravity / length)
            ),
        ),
    };
    Some(GrossInput {
        kind: GrossInputKind::SpecificForceScale,
        headline: say!(
            "The specific force of the IMU has a length of {} m/s^2 {at_rest}, not {} m/s^2: {looks_like}",
            short(length),
            short(gravity)
        ),
        evidence: vec![
            say!(
                "Median over {} {windows}, topic {}; half of them between {} and {} m/s^2",
                lengths.len(),
                signal.topic,
                short(low.unwrap_or(length)),
                short(high.unwrap_or(length))
            ),
            say!(
                "With it the loads would add up to {} of the weight",
                percent(length / gravity)
            ),
        ],
        fix,
    })
}

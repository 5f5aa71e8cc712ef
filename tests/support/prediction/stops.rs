//! Stops of machines and of their arms, compared with the prediction shortly before.

use std::fmt::Write;

use tipwatch_mechanics::machine::PredictionSpec;
use tipwatch_mechanics::prediction::Law;

use super::followed::{Followed, OFF_GROUND, Row};

/// Time before a platform and an arm have lost a part of their speed at which the prediction is asked (s): nothing brakes yet.
/// The arm goes on until then, which the prediction cannot know: its time is shorter.
const BEFORE_S: [f64; 2] = [0.5, 0.2];
/// Time for which wheels are watched after the stop (s).
const AFTER_S: f64 = 0.3;
/// A stop that takes longer is none (s): the horizon of the prediction.
const LONGEST_S: f64 = 2.0;
/// A speed is at its greatest down to this share of it.
const BEGINS: f64 = 0.85;
/// A machine that is slower stands (m/s).
const STANDS: f64 = 0.1;
/// Share of the greatest speed below which a machine is at rest.
const RESTS: f64 = 0.1;

/// A speed that falls to zero in a stop.
type SpeedOf = fn(&Row) -> f64;

/// A stop that took place.
#[derive(Debug, Clone)]
pub struct Stop {
    /// The motion that predicts it.
    pub law: Law,
    /// The row that is asked.
    pub row: usize,
    /// Start and end of the stop (s).
    pub span_s: [f64; 2],
    /// Greatest deceleration over a tenth of a second (m/s^2; rad/s^2 or m/s^2).
    pub deceleration: f64,
}

/// Outcome of a stop, compared with its prediction.
#[derive(Debug, Clone, Copy)]
pub struct Score {
    /// Whether a wheel lifted off the ground during the stop.
    pub lifted: bool,
    /// Whether a lifted wheel was predicted, by the OTF, and by the OTF less two standard deviations.
    pub predicted: [bool; 2],
    /// Predicted less true load of the wheel that came to carry least, at its least, as a share of the mean load: more than zero
    /// where the prediction said too much.
    pub error: f64,
}

/// The stops of the platform and of the arm.
#[must_use]
pub fn stops(log: &Followed) -> Vec<Stop> {
    let mut all = Vec::new();
    let speeds: [(Law, f64, SpeedOf); 2] = [
        (Law::BrakeNow, 0.8, |row| row.speed),
        (Law::StopArm, 0.25, |row| row.arm_speed),
    ];
    for ((law, moving, speed), before_s) in speeds.into_iter().zip(BEFORE_S) {
        let times: Vec<f64> = log.rows.iter().map(|row| row.time_s).collect();
        let speeds: Vec<f64> = log.rows.iter().map(speed).collect();
        for (begins, rests) in falls(&times, &speeds, moving) {
            let asked = times.partition_point(|time_s| *time_s <= times[begins] - before_s);
            let deceleration = (begins..rests).map(|row| {
                let later = times.partition_point(|time_s| *time_s < times[row] + 0.1);
                let later = later.min(times.len() - 1);
                (speeds[row] - speeds[later]) / (times[later] - times[row])
            });
            // joints of the steering stop, too, while the machine drives
            let is_of_arm = |row: usize| law != Law::StopArm || log.rows[row].speed < STANDS;
            if let Some(row) = asked.checked_sub(1).filter(|&row| is_of_arm(row)) {
                all.push(Stop {
                    law,
                    row,
                    span_s: [times[begins], times[rests]],
                    deceleration: deceleration.fold(f64::NAN, f64::max),
                });
            }
        }
    }
    all
}

/// First and last row of every fall of a speed from above `moving` to rest.
fn falls(times: &[f64], speeds: &[f64], moving: f64) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut peak = 0.0;
    let mut at_peak = 0;
    for (row, &speed) in speeds.iter().enumerate() {
        if speed >= peak {
            peak = speed;
        }
        if speed >= BEGINS * peak {
            at_peak = row;
        } else if speed <= RESTS * peak {
            if peak >= moving && times[row] - times[at_peak] <= LONGEST_S {
                found.push((at_peak, row));
            }
            peak = 0.0;
        }
    }
    found
}

/// Scores a stop. `asked` is the same log, followed with the deceleration that is to be assumed.
#[must_use]
pub fn score(log: &Followed, stop: &Stop, asked: &Followed) -> Option<Score> {
    let ahead = &asked.rows[stop.row].ahead[stop.law as usize];
    if ahead.gap.is_some() {
        return None;
    }
    let span_s = [stop.span_s[0], stop.span_s[1] + AFTER_S];
    let (wheel, least) = log.least_load(span_s);
    Some(Score {
        lifted: least < OFF_GROUND * log.mean_load,
        predicted: [ahead.lift_off_s.is_finite(), ahead.earliest_s.is_finite()],
        error: (ahead.otf_least[wheel].max(0.0) - least) / log.mean_load,
    })
}

/// A table: both laws, asked with the keys of the machine files and with the deceleration that followed.
#[must_use]
pub fn table(logs: &[Followed]) -> String {
    let mut text = String::from(
        "\n| asked | stops | a wheel lifted: said, said as possible | none lifted: said, said as possible | error of the least load, mean | RMS |\n\
         |---|---|---|---|---|---|\n",
    );
    for law in [Law::BrakeNow, Law::StopArm] {
        let found: Vec<(&Followed, Stop)> = (logs.iter())
            .flat_map(|log| stops(log).into_iter().map(move |stop| (log, stop)))
            .filter(|(_, stop)| stop.law == law)
            .collect();
        for is_true in [false, true] {
            let scores: Vec<Score> = (found.iter())
                .filter_map(|(log, stop)| match is_true {
                    false => score(log, stop, log),
                    true => score(log, stop, &log.again(&with(log.keys(), stop))),
                })
                .collect();
            let what = if is_true {
                "the deceleration that followed"
            } else {
                "the stated deceleration"
            };
            line(&mut text, &format!("`{}`, {what}", law.name()), &scores);
        }
    }
    text
}

/// The keys with the deceleration of a stop.
fn with(keys: &PredictionSpec, stop: &Stop) -> PredictionSpec {
    let mut keys = keys.clone();
    match stop.law {
        Law::BrakeNow => keys.brake_deceleration = stop.deceleration,
        _ => {
            keys.joint_deceleration = stop.deceleration;
            keys.joint_deceleration_linear = stop.deceleration;
            keys.joints.clear();
        }
    }
    keys
}

fn line(text: &mut String, name: &str, scores: &[Score]) {
    let count = |lifted: bool, which: usize| {
        let all = scores.iter().filter(|score| score.lifted == lifted);
        all.filter(|score| score.predicted[which]).count()
    };
    let lifted = scores.iter().filter(|score| score.lifted).count();
    let number = scores.len() as f64;
    let mean = scores.iter().map(|score| score.error).sum::<f64>() / number;
    let square = scores.iter().map(|score| score.error.powi(2)).sum::<f64>() / number;
    writeln!(
        text,
        "| {name} | {} | {}, {} of {lifted} | {}, {} of {} | {:+.1} % | {:.1} % |",
        scores.len(),
        count(true, 0),
        count(true, 1),
        count(false, 0),
        count(false, 1),
        scores.len() - lifted,
        100.0 * mean,
        100.0 * square.sqrt(),
    )
    .expect("memory");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_to_rest_is_found_and_a_slow_one_is_not() {
        let times: Vec<f64> = (0..600).map(|row| f64::from(row) * 0.01).collect();
        let falling = |from_s: f64, takes_s: f64| -> Vec<f64> {
            let share = |time_s: f64| ((time_s - from_s) / takes_s).clamp(0.0, 1.0);
            times
                .iter()
                .map(|time_s| 2.0 * (1.0 - share(*time_s)))
                .collect()
        };
        let found = falls(&times, &falling(2.0, 1.0), 0.8);
        assert_eq!(found.len(), 1);
        let (begins, rests) = found[0];
        assert!((times[begins] - 2.15).abs() < 0.02 && (times[rests] - 2.9).abs() < 0.02);
        assert!(falls(&times, &falling(1.0, 4.0), 0.8).is_empty());
        assert!(falls(&times, &falling(2.0, 1.0), 3.0).is_empty());
    }
}

//! Summary of the predictions of a log's rows, for its notes.

use std::fmt::Write;

use tipwatch_language::{is_english, named, say, word};
use tipwatch_mechanics::machine::{Machine, Note};
use tipwatch_mechanics::prediction::{Law, PredictedNumber};
use tipwatch_mechanics::verdict::limits::{HOLD_NS, PERSISTENT};

use super::notes::{NotedLog, Notes};
use super::study::{StudiedLog, Study};
use crate::base::predicted::LawColumns;
use crate::base::rows::Rows;

/// Predictions of all rows, by law.
#[derive(Debug, Default)]
pub(crate) struct PredictionSeen {
    laws: [LawSeen; Law::ALL.len()],
}

/// Predictions of one law.
#[derive(Debug, Default)]
struct LawSeen {
    known_rows: usize,
    /// Consecutive rows with a predicted lift.
    in_succession: u32,
    /// Time of the last row of the last span (ns).
    last_ns: Option<i64>,
    /// Number of spans with a predicted lift.
    spans: usize,
    first: Option<Foreseen>,
    /// Time (s), wheel and utilisation of the worst row.
    worst: Option<(f64, usize, f64)>,
}

/// A predicted lift: when it was predicted (s), of which wheel, in which time, at the earliest and the latest.
#[derive(Debug)]
struct Foreseen {
    at_s: f64,
    wheel: usize,
    lift_off_s: [f64; 3],
    cause: Option<&'static str>,
}

impl Study<'_> for PredictionSeen {
    type Found = Self;

    fn begin(_: &StudiedLog<'_>) -> Self {
        Self::default()
    }

    fn take_part(&mut self, _: &Machine, rows: &Rows) {
        let verdicts = rows.verdicts.as_ref();
        let Some(predictions) = verdicts.and_then(|verdicts| verdicts.predictions.as_ref()) else {
            return;
        };
        for (seen, law) in self.laws.iter_mut().zip(Law::ALL) {
            for row in 0..rows.len() {
                seen.take(
                    rows.times_ns[row],
                    rows.seconds(row),
                    predictions.of(law),
                    row,
                );
            }
        }
    }
}

impl Notes for PredictionSeen {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        if self.laws.iter().all(|law| law.known_rows == 0) {
            return Vec::new();
        }
        let machine = &log.loaded.machine;
        let spec = machine.prediction();
        let mut text = say!(
            "Prediction over {} s, of assumed motions, not of what the operator would have done.",
            spec.horizon
        );
        for (seen, law) in self.laws.iter().zip(Law::ALL) {
            let assumed = match law {
                Law::GoOn => word!("Had the motion gone on").to_string(),
                Law::BrakeNow => say!("Had it braked by {} m/s²", spec.brake_deceleration),
                Law::StopArm => word!("Had the arm stopped at once").into(),
            };
            let _ = write!(text, " {assumed}: {}.", seen.text(machine));
        }
        vec![text.into()]
    }
}

impl LawSeen {
    fn take(&mut self, time_ns: i64, time_s: f64, columns: &LawColumns, row: usize) {
        let number = |number| columns.number(number)[row];
        let Some(wheel) = columns.wheels[row].filter(|_| columns.gaps[row].is_none()) else {
            self.in_succession = 0;
            return;
        };
        self.known_rows += 1;
        let utilisation = number(PredictedNumber::Utilisation);
        if self.worst.is_none_or(|worst| utilisation > worst.2) {
            self.worst = Some((time_s, wheel, utilisation));
        }
        let lift_off_s = number(PredictedNumber::LiftOff);
        if !lift_off_s.is_finite() {
            self.in_succession = 0;
            return;
        }
        self.in_succession += 1;
        let goes_on = (self.last_ns).is_some_and(|last| time_ns.saturating_sub(last) < HOLD_NS);
        if goes_on {
            self.last_ns = Some(time_ns);
        } else if self.in_succession >= PERSISTENT {
            self.last_ns = Some(time_ns);
            self.spans += 1;
            let band = [PredictedNumber::Earliest, PredictedNumber::Latest].map(number);
            self.first.get_or_insert(Foreseen {
                at_s: time_s,
                wheel,
                lift_off_s: [lift_off_s, band[0], band[1]],
                cause: columns.causes[row].map(tipwatch_mechanics::Contribution::name),
            });
        }
    }

    fn text(&self, machine: &Machine) -> String {
        let name = |wheel: usize| machine.wheels()[wheel].name.as_str();
        if self.known_rows == 0 {
            return word!("not predicted in any row").into();
        }
        if let Some(Foreseen {
            at_s,
            wheel,
            lift_off_s: [lift_off_s, earliest_s, latest_s],
            cause,
        }) = &self.first
        {
            let times = match self.spans {
                1 => word!("a wheel would have lifted once").to_string(),
                spans => say!("a wheel would have lifted {spans} times"),
            };
            let latest = match latest_s.is_finite() {
                true => format!("{latest_s:.2} s"),
                false => word!("beyond the horizon").into(),
            };
            let by = cause.map_or(String::new(), |cause| match is_english() {
                true => format!(", most by {cause}"),
                false => say!(", most by {}", named(cause)),
            });
            return say!(
                "{times}, first predicted at t = {at_s:.2} s: {} in {lift_off_s:.2} s (from {earliest_s:.2} s to {latest}){by}",
                name(*wheel)
            );
        }
        match self.worst {
            Some((at_s, wheel, utilisation)) => say!(
                "no wheel would have lifted; at most {:.0} % of the margin used, at t = {at_s:.2} s ({})",
                100.0 * utilisation,
                name(wheel)
            ),
            None => word!("no wheel would have lifted; the utilisation is unknown").into(),
        }
    }
}

//! A comparison as text for a terminal.

use std::fmt::Write;

use super::comparison::Comparison;
use super::facts::{EventPair, formatted};
use super::inputs::{InputDifference, NOT_HELD, in_words};
use super::series::printed_unit;
use super::side::SideSummary;
use crate::base::number::number;

/// Lines per unit, unless all are requested.
const MOST_LINES: usize = 6;

/// Formats a comparison: all lines, or the largest differences of each unit.
#[must_use]
pub fn as_text(comparison: &Comparison, all: bool) -> String {
    let most = if all { usize::MAX } else { MOST_LINES };
    let mut text = String::new();
    for (letter, side) in [("A", &comparison.a), ("B", &comparison.b)] {
        let _ = writeln!(text, "{letter}  {}\n   {}", origin(side), side.finding);
    }
    let log = match comparison.same_log {
        true => "Both results are of the same log.",
        false => "The results are of different logs.",
    };
    let _ = writeln!(text, "{log}");
    add_inputs(comparison, &mut text);
    add_events(comparison, &mut text);
    let _ = writeln!(
        text,
        "\n{:42} {:>12} {:>12} {:>12}",
        "Whole log", "A", "B", "B - A"
    );
    let mut counted = (String::new(), 0);
    for fact in &comparison.facts {
        if within(&mut counted, fact.unit, most) {
            let value = |value: Option<f64>| formatted(value, fact.unit);
            let _ = writeln!(
                text,
                "{:42} {:>12} {:>12} {:>12} {}{}",
                fact.name,
                value(fact.a),
                value(fact.b),
                value(fact.difference),
                printed_unit(fact.unit),
                fact.why_not
                    .map_or(String::new(), |why| format!(" ({why})"))
            );
        }
    }
    add_series(comparison, all, &mut text);
    text
}

/// The first digits of a SHA-256.
fn short(sha256: &str) -> &str {
    sha256.get(..8).unwrap_or("unknown")
}

/// Origin of a side, on one line.
#[must_use]
pub(super) fn origin(side: &SideSummary) -> String {
    let log = side.log.first().map_or("no log", String::as_str);
    let same = side.name == log;
    format!(
        "{}{}; machine {} (file {}, URDF {}), model {}, estimator {}",
        side.name,
        if same {
            String::new()
        } else {
            format!(" (log {log})")
        },
        side.machine,
        short(&side.machine_file_sha256),
        short(&side.urdf_sha256),
        side.model,
        side.estimator
    )
}

fn add_inputs(comparison: &Comparison, text: &mut String) {
    if comparison.inputs.is_empty() {
        let _ = writeln!(text, "Their inputs are the same.");
        return;
    }
    let _ = writeln!(text, "\nInputs that differ");
    for of in &comparison.inputs {
        let _ = writeln!(text, "{}", in_words(of));
    }
    if comparison
        .inputs
        .iter()
        .any(InputDifference::is_of_machine_files)
    {
        let _ = writeln!(text, "{NOT_HELD}");
    }
}

fn add_events(comparison: &Comparison, text: &mut String) {
    if comparison.events.is_empty() {
        let _ = writeln!(text, "\nNeither result has an event.");
        return;
    }
    let _ = writeln!(text, "\nEvents");
    for pair in &comparison.events {
        let _ = writeln!(text, "{}", event(pair));
    }
}

/// An event, with its values on both sides.
#[must_use]
pub(super) fn event(pair: &EventPair) -> String {
    let side = |letter: &str, side: &Option<super::facts::EventSide>| {
        side.as_ref().map(|event| {
            let lasts = event
                .duration_s
                .map_or("until the log ends".into(), |s| format!("for {s:.2} s"));
            let worst = event.worst.map_or("unknown".into(), number);
            format!(
                "{letter} from {:.2} s {lasts}, worst {worst} {}",
                event.start_s, event.unit
            )
        })
    };
    let sides: Vec<String> = side("A", &pair.a)
        .into_iter()
        .chain(side("B", &pair.b))
        .collect();
    let only = match (&pair.a, &pair.b, pair.is_open_elsewhere) {
        (Some(_), None, true) => ", in A; B cannot be computed there",
        (None, Some(_), true) => ", in B; A cannot be computed there",
        (Some(_), None, false) => ", only in A",
        (None, Some(_), false) => ", only in B",
        _ => "",
    };
    let kind = pair.kind.replace('_', " ");
    format!("{kind} {}{only}: {}", pair.subject, sides.join("; "))
}

fn add_series(comparison: &Comparison, all: bool, text: &mut String) {
    let most = if all { usize::MAX } else { MOST_LINES };
    let Some(series) = &comparison.series else {
        let note = comparison.series_note.as_deref().unwrap_or("unknown");
        let _ = writeln!(text, "\nNot compared row by row: {note}.");
        return;
    };
    let _ = writeln!(
        text,
        "\n{:42} {:>12} {:>12} {:>12} {:>9}",
        format!("Row by row, {} rows", series.rows),
        "mean B - A",
        "rms",
        "largest",
        "relative"
    );
    let mut counted = (String::new(), 0);
    let shown = series.columns.iter();
    for column in shown.filter(|column| all || !column.is_derivative()) {
        if within(&mut counted, &column.unit, most) {
            let relative = column
                .relative
                .map_or(String::new(), |r| format!("{:.2} %", 100.0 * r));
            let _ = writeln!(
                text,
                "{:42} {:>12} {:>12} {:>12} {relative:>9} {}",
                column.in_words(),
                number(column.mean),
                number(column.rms),
                number(column.largest),
                printed_unit(&column.unit)
            );
        }
    }
}

/// Counts lines of the same unit; returns whether to print this one.
fn within(counted: &mut (String, usize), unit: &str, most: usize) -> bool {
    if counted.0 != unit {
        *counted = (unit.into(), 0);
    }
    counted.1 += 1;
    counted.1 <= most
}

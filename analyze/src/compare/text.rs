//! A comparison as text for a terminal.

use std::fmt::Write;

use tipwatch_language::{decimals, say, told, word};

use super::comparison::Comparison;
use super::facts::{Elsewhere, EventPair, EventSide, FactDifference, formatted};
use super::inputs::{InputDifference, NOT_HELD, in_words};
use super::series::{SeriesDifference, printed_unit};
use super::side::SideSummary;
use crate::base::number::{enumerated, number, probability, readable};

/// Inputs, unless all are requested.
const MOST_INPUTS: usize = 12;
/// Lines per unit, unless all are requested.
const MOST_LINES: usize = 4;

/// Extent of a printed comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Inputs, events and the least OTF of each wheel: what an investigator asks first.
    Short,
    /// The largest differences of each unit, too.
    Usual,
    /// Every figure, derivatives included.
    Whole,
}

/// A comparison as text.
#[must_use]
pub fn as_text(comparison: &Comparison, extent: Extent) -> String {
    let all = extent == Extent::Whole;
    let most = match extent {
        Extent::Usual => MOST_LINES,
        Extent::Short | Extent::Whole => usize::MAX,
    };
    let mut text = String::new();
    for (letter, side) in [("A", &comparison.a), ("B", &comparison.b)] {
        let _ = writeln!(text, "{letter}  {}\n   {}", origin(side), side.finding);
    }
    let log = match comparison.same_log {
        true => word!("Both results are of the same log."),
        false => word!("The results are of different logs."),
    };
    let _ = writeln!(text, "{log}");
    add_inputs(comparison, all, &mut text);
    add_events(comparison, &mut text);
    let _ = writeln!(text, "\n{}", valid_rows(comparison));
    let _ = writeln!(
        text,
        "{:42} {:>12} {:>12} {:>12}",
        word!("Figure"),
        "A",
        "B",
        "B - A"
    );
    let mut counted = (String::new(), 0);
    // what both have alike tells nothing
    let is_told = |fact: &&FactDifference| match extent {
        Extent::Short => fact.is_least_otf(),
        Extent::Usual => fact.differs() || fact.a.is_none(),
        Extent::Whole => true,
    };
    for fact in comparison.facts.iter().filter(is_told) {
        if within(&mut counted, fact.unit, most) {
            let value = |value: Option<f64>| formatted(value, fact.unit);
            let _ = writeln!(
                text,
                "{:42} {:>12} {:>12} {:>12} {}{}",
                fact.name.in_words(),
                value(fact.a),
                value(fact.b),
                value(fact.difference),
                printed_unit(fact.unit),
                fact.why_not
                    .map_or(String::new(), |why| format!(" ({why})"))
            );
        }
    }
    if extent != Extent::Short {
        add_series(comparison, all, &mut text);
    }
    for caveat in &comparison.caveats {
        let _ = writeln!(text, "- {caveat}");
    }
    text
}

/// The first digits of a SHA-256.
fn short(sha256: &str) -> &str {
    sha256.get(..8).unwrap_or(word!("unknown"))
}

/// Origin of a side, on one line.
#[must_use]
pub(super) fn origin(side: &SideSummary) -> String {
    let log = side.log.first().map_or(word!("no log"), String::as_str);
    let same = side.name == log;
    say!(
        "{}{}; machine {} (file {}, URDF {}), model {}, estimator {}",
        side.name,
        if same {
            String::new()
        } else {
            say!(" (log {log})")
        },
        side.machine,
        short(&side.machine_file_sha256),
        short(&side.urdf_sha256),
        readable(&side.model),
        readable(&side.estimator)
    )
}

fn add_inputs(comparison: &Comparison, all: bool, text: &mut String) {
    if comparison.inputs.is_empty() {
        let same = match comparison.same_log {
            true => word!("Their inputs are the same."),
            false => word!("Their inputs are the same but for the logs."),
        };
        let _ = writeln!(text, "{same}");
        return;
    }
    let _ = writeln!(text, "\n{}", word!("Inputs that differ"));
    let most = if all { usize::MAX } else { MOST_INPUTS };
    for of in comparison.inputs.iter().take(most) {
        let _ = writeln!(text, "{}", in_words(of));
    }
    let others = comparison.inputs.len().saturating_sub(most);
    if others > 0 {
        let _ = writeln!(text, "{}", say!("{} more (-v)", others));
    }
    if comparison
        .inputs
        .iter()
        .any(InputDifference::is_of_machine_files)
    {
        let _ = writeln!(text, "{}", told(NOT_HELD));
    }
}

fn add_events(comparison: &Comparison, text: &mut String) {
    if comparison.events.is_empty() {
        let _ = writeln!(text, "\n{}", word!("Neither result has an event."));
        return;
    }
    let _ = writeln!(text, "\n{}", word!("Events"));
    let zero = zero_of_times(comparison);
    for line in zero.into_iter().chain(events(&comparison.events)) {
        let _ = writeln!(text, "{line}");
    }
}

/// Less than this is not seen in a time (s).
const LEAST_SEEN_S: f64 = 0.005;

/// Describes the origin of the times of events; `None` where that is the first row of both.
pub(super) fn zero_of_times(comparison: &Comparison) -> Option<String> {
    match comparison.b_begins_s {
        Some(begins_s) if begins_s.abs() < LEAST_SEEN_S => None,
        Some(begins_s) => Some(say!(
            "Times of events are from the first row of A; that of B is at t = {begins_s:.2} s."
        )),
        None => Some(word!("Times of events are from the first row of each result.").into()),
    }
}

/// The events, without those of B that an answered event of A overlaps, a line each; those that differ in nothing but what happened are on one line.
pub(super) fn events(pairs: &[EventPair]) -> Vec<String> {
    let mut stories: Vec<Vec<&EventPair>> = Vec::new();
    for pair in pairs.iter().filter(|pair| !pair.is_repeated) {
        let mut known = stories.iter_mut();
        match known.find(|story| story.iter().any(|it| shares_event(it, pair))) {
            Some(story) => story.push(pair),
            None => stories.push(vec![pair]),
        }
    }
    let mut lines: Vec<(Vec<String>, String)> = Vec::new();
    for story in &stories {
        let (what, sides) = (story[0].what(), sides(story));
        match lines.iter_mut().find(|(_, same)| *same == sides) {
            Some((all, _)) => all.push(what),
            None => lines.push((vec![what], sides)),
        }
    }
    let line = |(what, sides): (Vec<String>, String)| enumerated(&what) + &sides;
    lines.into_iter().map(line).collect()
}

/// Whether two pairs have an event of a side in common: a long one beside several short ones of the other.
fn shares_event(one: &EventPair, other: &EventPair) -> bool {
    let is_whole = |it: &EventPair| it.a.is_some() && it.b.is_some() && it.supposed.is_none();
    (one.kind, &one.subject) == (other.kind, &other.subject)
        && is_whole(one)
        && is_whole(other)
        && (one.a == other.a || one.b == other.b)
}

/// Describes the events of a side, with times and confidence; `None` without any.
fn side<'e>(letter: &str, events: impl Iterator<Item = &'e EventSide>) -> Option<String> {
    let mut told: Vec<String> = Vec::new();
    for event in events {
        let certain = event
            .certainty
            .map(|certainty| say!(" (confidence {})", probability(certainty)));
        let text = format!("{}{}", event.told, certain.unwrap_or_default());
        if !told.contains(&text) {
            told.push(text);
        }
    }
    (!told.is_empty()).then(|| format!("{letter} {}", enumerated(&told)))
}

/// Describes an event on both sides, or the pairs that share one.
fn sides(story: &[&EventPair]) -> String {
    let pair = story[0];
    let on_a = side("A", story.iter().filter_map(|pair| pair.a.as_ref()));
    let on_b = side("B", story.iter().filter_map(|pair| pair.b.as_ref()));
    if let Some((reply, answer)) = pair.supposed.as_ref().zip(pair.answer()) {
        let recorded = reply.recorded_in_words();
        let recorded = recorded.map(|chance| say!("evaluated again as in A: {chance}"));
        let supposed = say!("as in B: {answer}");
        let all = on_a.into_iter().chain(recorded).chain([supposed]);
        return format!(": {}", all.collect::<Vec<_>>().join("; "));
    }
    let sides: Vec<String> = on_a.into_iter().chain(on_b).collect();
    let only = match (pair.a.is_some(), pair.elsewhere) {
        (_, Elsewhere::There) => "",
        (true, Elsewhere::Open) => word!(", in A; B cannot be computed there"),
        (false, Elsewhere::Open) => word!(", in B; A cannot be computed there"),
        (true, Elsewhere::Absent) => word!(", only in A"),
        (false, Elsewhere::Absent) => word!(", only in B"),
        (true, Elsewhere::Unknown) => word!(", in A"),
        (false, Elsewhere::Unknown) => word!(", in B"),
    };
    format!("{only}: {}", sides.join("; "))
}

/// Of which rows the figures are.
pub(super) fn valid_rows(comparison: &Comparison) -> String {
    let [a, b] = [&comparison.a, &comparison.b].map(|side| &side.valid_rows);
    say!("All valid rows: {a} in A, {b} in B")
}

fn add_series(comparison: &Comparison, all: bool, text: &mut String) {
    let most = if all { usize::MAX } else { MOST_LINES };
    let Some(series) = &comparison.series else {
        let note = comparison
            .series_note
            .as_deref()
            .unwrap_or(word!("unknown"));
        let note = say!("Not compared row by row: {note}.");
        let _ = writeln!(text, "\n{note}");
        return;
    };
    let _ = writeln!(
        text,
        "\n{:42} {:>12} {:>12} {:>12} {:>9}",
        say!("Row by row, {} rows", series.rows),
        word!("mean B - A"),
        word!("rms"),
        word!("largest"),
        word!("relative")
    );
    let mut counted = (String::new(), 0);
    let shown = series.columns.iter();
    let is_shown = |column: &&SeriesDifference| {
        !column.is_variance() && (all || (column.differs() && !column.is_derivative()))
    };
    let shown = shown.filter(is_shown);
    for column in shown {
        if within(&mut counted, &column.unit, most) {
            let relative = column
                .relative
                .map_or(String::new(), |r| decimals(format!("{:.2} %", 100.0 * r)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{Bound, EventKind};

    /// A wheel off the ground, the tipping and the tip-over were three lines of the same numbers.
    #[test]
    fn events_that_differ_in_what_happened_alone_are_on_one_line() {
        let pair = |kind: EventKind, subject: &str, start_s: f64| EventPair {
            kind,
            subject: subject.into(),
            a: Some(EventSide {
                start_s,
                start_sigma_s: None,
                start_bound: Bound::At,
                duration_s: None,
                end_bound: Bound::At,
                told: format!("from t = {start_s} s"),
                worst: None,
                unit: String::new(),
                certainty: None,
            }),
            b: None,
            elsewhere: Elsewhere::Absent,
            is_repeated: false,
            supposed: None,
        };
        let mut pairs = vec![
            pair(EventKind::WheelLift, "fr", 4.5),
            pair(EventKind::WheelLight, "rr", 2.9),
            pair(EventKind::EdgeTipping, "left", 4.5),
            pair(EventKind::TipOver, "left", 4.5),
        ];
        assert_eq!(events(&pairs).len(), 2);
        // one long event of B beside two of A stood there twice
        let mut two = vec![pair(EventKind::WheelLight, "rl", 5.8); 2];
        for (place, pair) in two.iter_mut().enumerate() {
            pair.b.clone_from(&pair.a);
            pair.elsewhere = Elsewhere::There;
            let a = pair.a.as_mut().unwrap();
            a.start_s += place as f64;
            a.told = format!("from t = {} s", a.start_s);
        }
        assert_eq!(events(&two).len(), 1);
        two[1].b.as_mut().unwrap().start_s = 9.0;
        assert_eq!(events(&two).len(), 2);
        // what another pair shows is on none
        pairs[1].is_repeated = true;
        assert_eq!(events(&pairs).len(), 1);
    }
}

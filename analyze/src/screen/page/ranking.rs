//! The logs in which a machine came closest to tipping over.

use std::cmp::Ordering;

use maud::{Markup, html};

use super::seen::{Seen, log_link};
use crate::events::EventKind;
use crate::page::svg::margin_bar;
use crate::page::{self, number, percent, readable};
use crate::policy::facts::EXPOSURE_CAUSES;

/// Logs in the table; the data set has all.
const MOST_LOGS: usize = 100;
/// Logs that are shown at once; the others unfold.
const SHOWN_LOGS: usize = 20;
/// A log with a smaller share of computable time is marked.
const WHOLE: f64 = 0.95;
const HEAD: [&str; 11] = [
    "",
    "Log",
    "Worst margin",
    "",
    "Computable time",
    "Wheel",
    "OTF",
    "Events",
    "Main cause of exposure",
    "Machine",
    "Day",
];

pub(super) fn table(seen: &[Seen<'_>]) -> Markup {
    if seen.is_empty() {
        return html! { p { "No log could be analysed." } };
    }
    let mut ranked: Vec<&Seen<'_>> = seen.iter().collect();
    ranked.sort_by(|a, b| order(a, b));
    let listed = ranked.iter().take(MOST_LOGS).enumerate();
    let rows: Vec<Vec<Markup>> = listed.map(|(i, log)| row(i + 1, log)).collect();
    let (shown, folded) = rows.split_at(rows.len().min(SHOWN_LOGS));
    html! {
        p.hint {
            "The worst margin is the smallest overturning force (OTF) of any wheel, as a share of its static load, "
            "± two standard deviations. It is 0 when a wheel is about to lift and 100 % at rest on level ground. "
            "Logs in which the machine tipped over come first, then those in which it was tipping about an edge, "
            "those in which a wheel lifted, and those that are not decided: too little time is computable, or between the "
            "rows of a sparse log a lift cannot be excluded. Of a sparse log the margin is the smallest that motion "
            "between its rows allows. "
            "The time that is not computable may hide worse margins: it is marked where it exceeds "
            (percent(1.0 - WHOLE)) " of the log. "
            "Logs with findings link to their report."
        }
        @if ranked.len() > MOST_LOGS {
            p.hint { "The " (MOST_LOGS) " worst of " (ranked.len()) " logs; the data set has all." }
        }
        div.ranking { (page::table(&HEAD, shown)) }
        @if !folded.is_empty() {
            details {
                summary { (folded.len()) " more" }
                div.ranking { (page::table(&HEAD, folded)) }
            }
        }
    }
}

/// By group, then by margin.
fn order(a: &Seen<'_>, b: &Seen<'_>) -> Ordering {
    let margin = |log: &Seen<'_>| log.facts.worst.as_ref().map_or(f64::INFINITY, |w| w.margin);
    group(a)
        .cmp(&group(b))
        .then_with(|| margin(a).total_cmp(&margin(b)))
        .then_with(|| a.record.path.cmp(&b.record.path))
}

/// What happened comes first, the worst before the rest; then what nobody knows, then what is harmless.
fn group(log: &Seen<'_>) -> usize {
    let worst = log.facts.worst.as_ref();
    let lifted = worst.is_some_and(|worst| worst.margin <= 0.0);
    match log.facts {
        facts if facts.has_event(EventKind::TipOver) => 0,
        facts if facts.has_event(EventKind::EdgeTipping) => 1,
        facts if facts.has_event(EventKind::WheelLift) || lifted => 2,
        _ if log.is_undecided || worst.is_none() => 3,
        _ => 4,
    }
}

/// "36 % (7.3 of 20.0 s)"; marked if a notable part of the log is not computable.
fn computable(log: &Seen<'_>) -> Markup {
    let coverage = log.facts.coverage;
    let is_whole = coverage.valid_share.is_some_and(|share| share >= WHOLE);
    html! {
        @if is_whole { (coverage) } @else { strong.holes { (coverage) } }
        @if log.is_undecided { strong.holes { ": not decided" } }
    }
}

fn row(rank: usize, log: &Seen<'_>) -> Vec<Markup> {
    let worst = log.facts.worst.as_ref();
    let sigma = worst.and_then(|worst| worst.sigma).map(|sigma| 2.0 * sigma);
    vec![
        html! { (rank) },
        log_link(log.record),
        html! {
            @match (worst, sigma) {
                (None, _) => "not computable",
                (Some(worst), None) => { (percent(worst.margin)) " (uncertainty not computable)" },
                (Some(worst), Some(sigma)) => { (percent(worst.margin)) " ± " (percent(sigma)) },
            }
        },
        html! { @if let Some(worst) = worst { (margin_bar(worst.margin, sigma)) } },
        computable(log),
        html! { @if let Some(worst) = worst { (worst.wheel.to_uppercase()) } },
        html! { @if let Some(worst) = worst { (number(worst.otf_n)) " N" } },
        html! { (events(log)) },
        html! { (most_exposed_by(log)) },
        html! { (log.machine()) },
        html! { (log.record.day().unwrap_or_else(|| "unknown".into())) },
    ]
}

/// "2 wheel lift, 1 wheel light".
fn events(log: &Seen<'_>) -> String {
    let counts = EventKind::all().iter().rev();
    let parts: Vec<String> = counts
        .map(|&kind| (kind, log.facts.events_of(kind).unwrap_or(0)))
        .filter(|(_, count)| *count > 0)
        .map(|(kind, count)| format!("{count} {}", readable(kind.name())))
        .collect();
    parts.join(", ")
}

fn most_exposed_by(log: &Seen<'_>) -> String {
    let Some(seconds) = &log.facts.exposure.exposed_by_cause_s else {
        return String::new();
    };
    let all: f64 = seconds.iter().sum();
    let most = EXPOSURE_CAUSES
        .iter()
        .zip(seconds)
        .max_by(|a, b| a.1.total_cmp(b.1));
    match most {
        Some((cause, &time)) if time > 0.0 => {
            format!("{} {:.0} %", readable(cause), 100.0 * time / all)
        }
        _ => String::new(),
    }
}

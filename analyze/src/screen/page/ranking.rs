//! The logs in which a machine came nearest to tipping over.

use std::cmp::Ordering;

use super::{Seen, log_link, percent, raw_table};
use crate::base::number::number;
use crate::events::EventKind;
use crate::page::html;
use crate::page::svg::margin_bar;
use crate::policy::facts::EXPOSURE_CAUSES;

/// Logs in the table; the data set has all.
const MOST_LOGS: usize = 100;
/// Logs that are shown at once; the others unfold.
const SHOWN_LOGS: usize = 20;
const HEAD: [&str; 10] = [
    "",
    "log",
    "worst margin",
    "",
    "wheel",
    "OTF",
    "events",
    "most exposed by",
    "machine",
    "day",
];

pub(super) fn table(seen: &[Seen<'_>]) -> String {
    if seen.is_empty() {
        return "<p>No log could be analysed.</p>\n".into();
    }
    let mut ranked: Vec<&Seen<'_>> = seen.iter().collect();
    ranked.sort_by(|a, b| order(a, b));
    let rows: Vec<Vec<String>> = (ranked.iter().take(MOST_LOGS).enumerate())
        .map(|(i, log)| row(i + 1, log))
        .collect();
    let mut text = String::from(
        "<p class=\"hint\">The worst margin is what the worst wheel still carried at the worst moment, as a share of its \
         static load, with two standard deviations: 0 is a wheel about to lift, 100 % a machine at rest on level ground. \
         Logs in which the machine tipped over, or tipped about an edge, stand before all others. \
         Logs with findings link to their report.</p>\n",
    );
    if ranked.len() > MOST_LOGS {
        text.push_str(&format!(
            "<p class=\"hint\">The {MOST_LOGS} worst of {} logs; the data set has all.</p>\n",
            ranked.len()
        ));
    }
    let (shown, folded) = rows.split_at(rows.len().min(SHOWN_LOGS));
    text.push_str(&raw_table("ranking", &HEAD, shown));
    if !folded.is_empty() {
        text.push_str(&format!(
            "<details><summary>{} more</summary>\n{}</details>\n",
            folded.len(),
            raw_table("ranking", &HEAD, folded)
        ));
    }
    text
}

/// Tip-overs first, then tipping edges, then by margin; logs without any margin last.
fn order(a: &Seen<'_>, b: &Seen<'_>) -> Ordering {
    let tipped = |log: &Seen<'_>, kind| log.facts.events_of(kind) > 0;
    let margin = |log: &Seen<'_>| log.facts.worst.as_ref().map_or(f64::INFINITY, |w| w.margin);
    let by = |kind| tipped(b, kind).cmp(&tipped(a, kind));
    by(EventKind::TipOver)
        .then_with(|| by(EventKind::EdgeTipping))
        .then_with(|| margin(a).total_cmp(&margin(b)))
        .then_with(|| a.record.path.cmp(&b.record.path))
}

fn row(rank: usize, log: &Seen<'_>) -> Vec<String> {
    let worst = log.facts.worst.as_ref();
    let unknown = || "not computable".to_string();
    let margin = worst.map_or_else(unknown, |worst| {
        let sigma = worst.sigma.map_or_else(
            || " (uncertainty not computable)".into(),
            |sigma| format!(" ± {}", percent(2.0 * sigma)),
        );
        format!("{}{sigma}", percent(worst.margin))
    });
    vec![
        rank.to_string(),
        log_link(log.record),
        margin,
        worst.map_or(String::new(), |w| {
            margin_bar(w.margin, w.sigma.map(|s| 2.0 * s))
        }),
        worst.map_or(String::new(), |worst| {
            html::escape(&worst.wheel.to_uppercase())
        }),
        worst.map_or(String::new(), |worst| format!("{} N", number(worst.otf_n))),
        html::escape(&events(log)),
        most_exposed_by(log),
        html::escape(log.machine()),
        log.record.day().unwrap_or_else(|| "unknown".into()),
    ]
}

/// "2 wheel lift, 1 wheel light".
fn events(log: &Seen<'_>) -> String {
    let counts = EventKind::all().iter().rev();
    let told: Vec<String> = counts
        .map(|&kind| (kind, log.facts.events_of(kind)))
        .filter(|(_, count)| *count > 0)
        .map(|(kind, count)| format!("{count} {}", kind.name().replace('_', " ")))
        .collect();
    told.join(", ")
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
            format!("{} {:.0} %", cause.replace('_', " "), 100.0 * time / all)
        }
        _ => String::new(),
    }
}

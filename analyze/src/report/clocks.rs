//! The clocks of the log: findings, stamp statistics per topic, offsets between topics.

use maud::{Markup, html};
use tipwatch_ingest::Treatment;

use crate::analysis::clock::{PairOffset, TopicOffset, text::TopicsFinding};
use crate::analysis::{Analysis, Input};
use crate::page::{or_dash, readable, table};

/// The section on clocks.
pub(super) fn clocks(analysis: &Analysis) -> Markup {
    let head = [
        "Finding",
        "Topics",
        "Observation",
        "Treatment",
        "Action taken",
    ];
    let findings: Vec<_> = analysis.clock_findings.iter().map(finding_row).collect();
    html! {
        @if findings.is_empty() {
            p { "All signals are stamped by one clock, and its stamps are consistent." }
        } @else {
            (table(&head, &findings))
        }
        (stamps(analysis))
        (offsets(analysis))
    }
}

fn finding_row(found: &TopicsFinding) -> Vec<String> {
    let finding = &found.finding;
    let treatment = match finding.treatment {
        Treatment::Handled => "handled",
        Treatment::Refused => "refused",
        Treatment::Reported => "reported",
    };
    vec![
        readable(finding.kind.name()),
        found.topics.join(", "),
        finding.seen.clone(),
        treatment.to_owned(),
        finding.done.clone(),
    ]
}

/// Stamps compared with the log time.
fn stamps(analysis: &Analysis) -> Markup {
    let head = [
        "Topic",
        "Header stamp minus log time, median [s]",
        "Median absolute deviation [ms]",
        "Drift [ppm]",
        "Standard deviation of the drift [ppm]",
        "Jitter [ms]",
        "Zero stamps",
        "Duplicate stamps",
        "Backward stamps (largest [s])",
        "Applied correction [s]",
    ];
    let rows: Vec<_> = analysis.inputs.iter().map(stamp_row).collect();
    table(&head, &rows)
}

fn stamp_row(input: &Input) -> Vec<String> {
    let timing = &input.timing;
    let offset = timing.header_minus_log;
    let backward = match timing.largest_backward {
        Some(largest) => format!("{} ({:.3})", timing.backward_stamps, largest.size_s()),
        None => timing.backward_stamps.to_string(),
    };
    vec![
        input.topic.clone(),
        or_dash(offset.map(|o| o.median_s), 4),
        or_dash(offset.map(|o| o.mad_s * 1e3), 2),
        or_dash(offset.map(|o| o.drift_ppm), 1),
        or_dash(offset.map(|o| o.drift_sigma_ppm), 1),
        or_dash(offset.map(|o| o.jitter_s * 1e3), 2),
        timing.zero_stamps.to_string(),
        timing.duplicate_stamps.to_string(),
        backward,
        format!("{:.4}", input.correction.added_s),
    ]
}

/// Offsets between topics, from the motion that they measure.
fn offsets(analysis: &Analysis) -> Markup {
    let clock = &analysis.clock;
    let topic_head = [
        "Topic",
        "Offset [ms]",
        "Standard deviation [ms]",
        "Stated in the machine file [ms]",
        "Applied",
        "Why unknown",
    ];
    let pair_head = [
        "Topic",
        "Compared with",
        "Quantity",
        "Delay [ms]",
        "Standard deviation [ms]",
        "Correlation",
        "Why unknown",
    ];
    let topics: Vec<_> = clock.topics.iter().map(topic_row).collect();
    let pairs: Vec<_> = clock.pairs.iter().map(pair_row).collect();
    html! {
        @if let Some(reference) = &clock.reference {
            p {
                "Offsets between topics, estimated from the motion that both measure: the value to add to the stamps of a topic "
                "to align them with " (reference) ". Offsets are applied only on request."
            }
            (table(&topic_head, &topics))
            @if !pairs.is_empty() { (table(&pair_head, &pairs)) }
        }
    }
}

fn milliseconds(seconds: Option<f64>) -> String {
    // plus zero: no sign before zero
    or_dash(seconds.map(|s| s * 1e3 + 0.0), 1)
}

fn topic_row(topic: &TopicOffset) -> Vec<String> {
    vec![
        topic.topic.clone(),
        milliseconds(topic.offset_s),
        milliseconds(topic.sigma_s),
        milliseconds(topic.stated_s),
        if topic.applied { "yes" } else { "no" }.to_owned(),
        topic.why_not.clone().unwrap_or_default(),
    ]
}

fn pair_row(pair: &PairOffset) -> Vec<String> {
    vec![
        pair.topic.clone(),
        pair.against.clone(),
        pair.by.to_owned(),
        milliseconds(pair.late_s),
        milliseconds(pair.sigma_s),
        or_dash(pair.correlation, 3),
        pair.why_not.clone().unwrap_or_default(),
    ]
}

//! The clocks of the log: findings, stamp statistics per topic, offsets between topics.

use maud::{Markup, html};
use tipwatch_ingest::Treatment;
use tipwatch_language::{decimals, say, word};

use crate::analysis::clock::{PairOffset, TopicOffset, text::TopicsFinding};
use crate::analysis::{Analysis, Input};
use crate::page::{or_dash, readable, table_of};

/// The section on clocks.
pub(super) fn clocks(analysis: &Analysis) -> Markup {
    let findings = &analysis.clock.findings;
    html! {
        @if findings.is_empty() {
            p { (word!("All signals are stamped by one clock, and its stamps are consistent.")) }
        }
        (table_of(findings.iter().map(finding_row)))
        (table_of(analysis.inputs.iter().map(stamp_row)))
        (offsets(analysis))
    }
}

fn finding_row(found: &TopicsFinding) -> [(&'static str, String); 5] {
    let finding = &found.finding;
    let treatment = match finding.treatment {
        Treatment::Handled => word!("handled"),
        Treatment::Refused => word!("refused"),
        Treatment::Reported => word!("reported"),
    };
    [
        (word!("Finding"), readable(finding.kind.name())),
        (word!("Topics"), found.topics.join(", ")),
        (word!("Observation"), finding.seen.clone()),
        (word!("Treatment"), treatment.to_owned()),
        (word!("Action taken"), finding.done.clone()),
    ]
}

/// Stamps compared with the log time.
fn stamp_row(input: &Input) -> [(&'static str, String); 10] {
    let timing = &input.timing;
    let offset = timing.header_minus_log;
    let backward = match timing.largest_backward {
        Some(largest) => decimals(format!(
            "{} ({:.3})",
            timing.backward_stamps,
            largest.size_s()
        )),
        None => timing.backward_stamps.to_string(),
    };
    let median_s = offset.map(|o| o.median_s);
    let mad_ms = offset.map(|o| o.mad_s * 1e3);
    let drift = offset.map(|o| o.drift_ppm);
    let drift_sigma = offset.map(|o| o.drift_sigma_ppm);
    let jitter_ms = offset.map(|o| o.jitter_s * 1e3);
    let added_s = input.correction.added_s;
    [
        (word!("Topic"), input.topic.clone()),
        (
            word!("Header stamp minus log time, median [s]"),
            or_dash(median_s, 4),
        ),
        (word!("Median absolute deviation [ms]"), or_dash(mad_ms, 2)),
        (word!("Drift [ppm]"), or_dash(drift, 1)),
        (
            word!("Standard deviation of the drift [ppm]"),
            or_dash(drift_sigma, 1),
        ),
        (word!("Jitter [ms]"), or_dash(jitter_ms, 2)),
        (word!("Zero stamps"), timing.zero_stamps.to_string()),
        (
            word!("Duplicate stamps"),
            timing.duplicate_stamps.to_string(),
        ),
        (word!("Backward stamps (largest [s])"), backward),
        (
            word!("Applied correction [s]"),
            decimals(format!("{added_s:.4}")),
        ),
    ]
}

/// Offsets between topics, from the motion that they measure.
fn offsets(analysis: &Analysis) -> Markup {
    let clock = &analysis.clock.offsets;
    html! {
        @if let Some(reference) = &clock.reference {
            p {
                (say!("Offsets between topics, estimated from the motion that both measure: the value to add to the stamps of a topic \
                to align them with {reference}. Offsets are applied only on request."))
            }
            (table_of(clock.topics.iter().map(topic_row)))
            (table_of(clock.pairs.iter().map(pair_row)))
        }
    }
}

fn milliseconds(seconds: Option<f64>) -> String {
    // plus zero: no sign before zero
    or_dash(seconds.map(|s| s * 1e3 + 0.0), 1)
}

fn topic_row(topic: &TopicOffset) -> [(&'static str, String); 6] {
    let applied = match topic.applied {
        true => word!("yes"),
        false => word!("no"),
    };
    [
        (word!("Topic"), topic.topic.clone()),
        (word!("Offset [ms]"), milliseconds(topic.offset_s)),
        (
            word!("Standard deviation [ms]"),
            milliseconds(topic.sigma_s),
        ),
        (
            word!("Stated in the machine file [ms]"),
            milliseconds(topic.stated_s),
        ),
        (word!("Applied"), applied.to_owned()),
        (
            word!("Why unknown"),
            topic.why_not.clone().unwrap_or_default(),
        ),
    ]
}

fn pair_row(pair: &PairOffset) -> [(&'static str, String); 7] {
    [
        (word!("Topic"), pair.topic.clone()),
        (word!("Compared with"), pair.against.clone()),
        (word!("Quantity"), pair.by.to_owned()),
        (word!("Delay [ms]"), milliseconds(pair.late_s)),
        (word!("Standard deviation [ms]"), milliseconds(pair.sigma_s)),
        (word!("Correlation"), or_dash(pair.correlation, 3)),
        (
            word!("Why unknown"),
            pair.why_not.clone().unwrap_or_default(),
        ),
    ]
}

//! The clocks of the log: what is odd about them, how each goes, how far apart topics are.

use tipwatch_ingest::Treatment;

use crate::analysis::clock::{PairOffset, TopicOffset, words::TopicsFinding};
use crate::analysis::{Analysis, Input};
use crate::page::html;

/// The section on clocks.
pub(super) fn clocks(analysis: &Analysis) -> String {
    let head = ["Finding", "Topics", "Seen", "Treatment", "What was done"];
    let findings: Vec<Vec<String>> = (analysis.clock_findings.iter()).map(finding_row).collect();
    let odd = match findings.is_empty() {
        true => {
            "<p>All signals have stamps of one clock; nothing is odd about them.</p>\n".to_owned()
        }
        false => html::table(&head, &findings),
    };
    odd + &stamps(analysis) + &offsets(analysis)
}

fn finding_row(found: &TopicsFinding) -> Vec<String> {
    let finding = &found.finding;
    let treatment = match finding.treatment {
        Treatment::Handled => "handled",
        Treatment::Refused => "refused",
        Treatment::Reported => "reported",
    };
    vec![
        finding.kind.name().replace('_', " "),
        found.topics.join(", "),
        finding.seen.clone(),
        treatment.to_owned(),
        finding.done.clone(),
    ]
}

/// Stamps against the log time.
fn stamps(analysis: &Analysis) -> String {
    let head = [
        "Topic",
        "Header stamp minus log time, median [s]",
        "Median absolute deviation [ms]",
        "Drift [ppm]",
        "Its standard deviation [ppm]",
        "Jitter [ms]",
        "Zero",
        "Repeated",
        "Backward (largest [s])",
        "Added to the stamps [s]",
    ];
    let rows: Vec<Vec<String>> = analysis.inputs.iter().map(stamp_row).collect();
    html::table(&head, &rows)
}

fn stamp_row(input: &Input) -> Vec<String> {
    let timing = input.statistics.timing();
    let offset = timing.header_minus_log;
    let number = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let backward = match timing.largest_backward {
        Some(largest) => format!("{} ({:.3})", timing.backward_stamps, largest.size_s()),
        None => timing.backward_stamps.to_string(),
    };
    vec![
        input.topic.clone(),
        number(offset.map(|o| o.median_s), 4),
        number(offset.map(|o| o.mad_s * 1e3), 2),
        number(offset.map(|o| o.drift_ppm), 1),
        number(offset.map(|o| o.drift_sigma_ppm), 1),
        number(offset.map(|o| o.jitter_s * 1e3), 2),
        timing.zero_stamps.to_string(),
        timing.duplicate_stamps.to_string(),
        backward,
        format!("{:.4}", input.correction.added_s),
    ]
}

/// Topics against each other, by the physics.
fn offsets(analysis: &Analysis) -> String {
    let clock = &analysis.clock;
    let Some(reference) = &clock.reference else {
        return String::new();
    };
    let topic_head = [
        "Topic",
        "Offset [ms]",
        "Standard deviation [ms]",
        "Stated [ms]",
        "Applied",
        "Why not known",
    ];
    let pair_head = [
        "Topic",
        "Against",
        "By",
        "Late by [ms]",
        "Standard deviation [ms]",
        "Correlation",
        "Why not known",
    ];
    let topics: Vec<Vec<String>> = clock.topics.iter().map(topic_row).collect();
    let pairs: Vec<Vec<String>> = clock.pairs.iter().map(pair_row).collect();
    let said = format!(
        "<p>Offsets between topics, found from what both feel: what has to be added to the stamps of each so that they are those of {}. \
         Nothing is added unless it is asked for.</p>\n",
        html::escape(reference)
    );
    let pairs = match pairs.is_empty() {
        true => String::new(),
        false => html::table(&pair_head, &pairs),
    };
    said + &html::table(&topic_head, &topics) + &pairs
}

fn milliseconds(seconds: Option<f64>) -> String {
    seconds.map_or("–".to_owned(), |s| format!("{:.1}", s * 1e3 + 0.0))
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
        pair.correlation
            .map_or("–".to_owned(), |c| format!("{c:.3}")),
        pair.why_not.clone().unwrap_or_default(),
    ]
}

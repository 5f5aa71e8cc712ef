//! The tables of the report: events, inputs, limitations, provenance.

use maud::{Markup, html};
use tipwatch_ingest::TopicTiming;

use super::findings::{Scene, reason_counts};
use crate::analysis::{Analysis, Input};
use crate::base::provenance::FileHash;
use crate::events::{Event, EventKind};
use crate::page::{facts, list, number, or_dash, probability, readable, table};

/// Most events and lost ranges listed; the output tables have all.
const MOST_LISTED: usize = 500;

/// The table of events.
pub(super) fn events(analysis: &Analysis) -> Markup {
    if analysis.events.is_empty() {
        return html! { p { "No events." } };
    }
    let scene = Scene::of(analysis);
    let head = [
        "Event",
        "Wheel, edge or input",
        "Start [s]",
        "End [s]",
        "Worst value",
        "At [s]",
        "Lead time [s]",
        "Confidence",
        "Depends on load split",
    ];
    let listed = analysis.events.iter().take(MOST_LISTED);
    let rows: Vec<_> = listed.map(|event| event_row(&scene, event)).collect();
    html! { (table(&head, &rows)) (not_listed(analysis.events.len(), "events")) }
}

fn event_row(scene: &Scene, event: &Event) -> Vec<String> {
    let seconds = |time_ns: i64| format!("{:.2}", scene.seconds(time_ns));
    let worst = match event.kind {
        _ if !event.worst.is_finite() => number(event.worst),
        EventKind::TipOver => format!("{:.1}°", event.worst.to_degrees()),
        _ => format!("{} {}", number(event.worst), event.unit),
    };
    let end = event.end_ns.map(seconds);
    let split = match (event.split_dependent, event.load_range_n) {
        (Some(true), Some([least_n, largest_n])) => {
            format!("yes: {} to {} N", number(least_n), number(largest_n))
        }
        (Some(true), None) => "yes".to_string(),
        (Some(false), _) => "no".to_string(),
        (None, _) => "–".to_string(),
    };
    vec![
        readable(event.kind.name()),
        scene.subject(event),
        seconds(event.start_ns),
        end.unwrap_or_else(|| "end of the log".into()),
        worst,
        seconds(event.worst_ns),
        or_dash(event.lead_s, 2),
        (event.certainty).map_or("not computed".into(), probability),
        split,
    ]
}

/// The table of inputs.
pub(super) fn inputs(analysis: &Analysis) -> Markup {
    let head = [
        "Signal",
        "Topic",
        "Type",
        "Reason for this topic",
        "Clock and reason",
        "Rate [Hz]",
        "Header stamp minus log time, min / median / max [s]",
        "Gaps",
        "Duplicate stamps",
        "Backward stamps",
        "Undecodable",
        "Messages used",
    ];
    let inputs = analysis.inputs.iter();
    let rows: Vec<_> = inputs
        .map(|input| input_row(input, &input.statistics.timing()))
        .collect();
    table(&head, &rows)
}

fn input_row(input: &Input, timing: &TopicTiming) -> Vec<String> {
    let unknown = || "not computable".to_string();
    let offset = timing.header_minus_log.map_or_else(unknown, |offset| {
        format!(
            "{:.4} / {:.4} / {:.4}",
            offset.min_s, offset.median_s, offset.max_s
        )
    });
    let longest_gap = timing
        .gaps
        .iter()
        .map(|gap| gap.duration_s)
        .fold(0.0, f64::max);
    let gaps = match timing.gaps.len() {
        0 => "0".to_string(),
        count => format!("{count}, longest {longest_gap:.2} s"),
    };
    let messages = timing.message_count as u64 + input.undecodable;
    vec![
        readable(input.signal),
        input.topic.clone(),
        input.type_name.clone(),
        input.why.clone(),
        input.clock.clone(),
        timing
            .rate_hz
            .map_or_else(unknown, |rate| format!("{rate:.1}")),
        offset,
        gaps,
        timing.duplicate_stamps.to_string(),
        timing.backward_stamps.to_string(),
        input.undecodable.to_string(),
        format!("{} of {messages}", input.counts.used),
    ]
}

/// What a reader must know before relying on the results.
pub(super) fn limitations(analysis: &Analysis) -> Markup {
    let mut sentences = analysis.notes.clone();
    let losses = &analysis.losses;
    sentences.push(match losses.ranges.len() {
        0 => "No damaged bytes were found in the parts of the log that were read".to_string(),
        ranges => format!(
            "{} bytes of the log were lost, in {ranges} ranges:",
            losses.bytes_lost()
        ),
    });
    sentences.extend(losses.lines().take(MOST_LISTED));
    let valid = (analysis.rows.reasons.iter())
        .filter(|reasons| reasons.is_empty())
        .count();
    sentences.push(format!("{valid} of {} rows are valid", analysis.rows.len()));
    let reasons = reason_counts(analysis).into_iter();
    sentences.extend(reasons.map(|(reason, count)| {
        format!(
            "{count} rows are invalid because of {}",
            readable(reason.name())
        )
    }));
    html! { (list(&sentences)) (not_listed(losses.ranges.len(), "lost ranges")) }
}

/// Where everything comes from.
pub(super) fn provenance(analysis: &Analysis) -> Markup {
    let from = &analysis.provenance;
    let mut rows = vec![
        ("Program", format!("tipwatch {}", from.tipwatch_version)),
        ("Time of the analysis", from.analysed_at.clone()),
        ("Log format", from.log_format.clone()),
    ];
    rows.extend(from.log.iter().map(|file| ("Log file", hash(file))));
    let limits = analysis.min_loads_n.as_ref();
    rows.extend([
        ("Machine file", hash(&from.machine_file)),
        ("URDF", hash(&from.urdf)),
        ("IMU mounting", from.imu_mounting.clone()),
        (
            "Machine mass",
            format!("{} kg", number(analysis.machine.mass())),
        ),
        (
            "Static loads",
            by_wheel(analysis, &analysis.machine.reference().static_load),
        ),
        (
            "Load limits",
            limits.map_or("none".into(), |limits| by_wheel(analysis, limits)),
        ),
    ]);
    let rows = rows
        .into_iter()
        .map(|(name, value)| (name.to_string(), value));
    facts(&rows.chain(options(analysis)).collect::<Vec<_>>())
}

fn options(analysis: &Analysis) -> Vec<(String, String)> {
    let Ok(serde_json::Value::Object(options)) = serde_json::to_value(analysis.options) else {
        return Vec::new();
    };
    let text = |value: serde_json::Value| match value {
        serde_json::Value::Null => "not set".to_string(),
        serde_json::Value::String(text) => text,
        other => other.to_string(),
    };
    let options = options.into_iter();
    options
        .map(|(name, value)| (format!("Option {name}"), text(value)))
        .collect()
}

fn by_wheel(analysis: &Analysis, values_n: &[f64]) -> String {
    let parts = analysis.machine.wheels().iter().zip(values_n);
    let parts: Vec<String> = parts
        .map(|(wheel, &value)| match value.is_finite() {
            true => format!("{} {} N", wheel.name, number(value)),
            false => format!("{} not computable", wheel.name),
        })
        .collect();
    parts.join(", ")
}

fn hash(file: &FileHash) -> String {
    format!(
        "{} ({} bytes), SHA-256 {}",
        file.path, file.bytes, file.sha256
    )
}

fn not_listed(count: usize, of: &str) -> Markup {
    html! { @if count > MOST_LISTED { p { (count - MOST_LISTED) " more " (of) " are not listed here." } } }
}

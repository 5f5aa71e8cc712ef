//! The tables of the page: events, inputs, limitations, provenance.

use tipwatch_ingest::TopicTiming;

use super::findings::{Scene, probability, reason_counts};
use crate::analysis::{Analysis, Input};
use crate::base::number::number;
use crate::base::provenance::FileHash;
use crate::events::{Event, EventKind};
use crate::page::html;

/// Most events and lost ranges listed; the tables of the result have all.
const MOST_LISTED: usize = 500;

/// The table of events.
pub(super) fn events(analysis: &Analysis) -> String {
    if analysis.events.is_empty() {
        return "<p>No events.</p>\n".to_string();
    }
    let scene = Scene::of(analysis);
    let head = [
        "Event",
        "Of",
        "Start [s]",
        "End [s]",
        "Worst",
        "Worst at [s]",
        "Lead time [s]",
        "Certainty",
        "Split-dependent",
    ];
    let rows: Vec<Vec<String>> = analysis
        .events
        .iter()
        .take(MOST_LISTED)
        .map(|event| event_row(&scene, event))
        .collect();
    html::table(&head, &rows) + &not_listed(analysis.events.len(), "events")
}

fn event_row(scene: &Scene, event: &Event) -> Vec<String> {
    let seconds = |time_ns: i64| format!("{:.2}", scene.seconds(time_ns));
    let worst = match event.kind {
        _ if !event.worst.is_finite() => number(event.worst),
        EventKind::TipOver => format!("{:.1}°", event.worst.to_degrees()),
        _ => format!("{} {}", number(event.worst), event.unit),
    };
    vec![
        event.kind.name().replace('_', " "),
        scene.subject(event),
        seconds(event.start_ns),
        event
            .end_ns
            .map_or("until the log ends".to_string(), seconds),
        worst,
        seconds(event.worst_ns),
        event.lead_s.map_or(dash(), |lead_s| format!("{lead_s:.2}")),
        event
            .certainty
            .map_or("not computed".to_string(), probability),
        event.split_dependent.map_or(dash(), |depends| {
            if depends { "yes" } else { "no" }.to_string()
        }),
    ]
}

/// The table of inputs.
pub(super) fn inputs(analysis: &Analysis) -> String {
    let head = [
        "Signal",
        "Topic",
        "Type",
        "Why this topic",
        "Clock, and why",
        "Rate [Hz]",
        "Header stamp minus log time, min / median / max [s]",
        "Gaps",
        "Duplicate stamps",
        "Backward stamps",
        "Undecodable",
        "Used",
    ];
    let rows: Vec<Vec<String>> = analysis
        .inputs
        .iter()
        .map(|input| input_row(input, &input.statistics.timing()))
        .collect();
    html::table(&head, &rows)
}

fn input_row(input: &Input, timing: &TopicTiming) -> Vec<String> {
    let offset = timing
        .header_minus_log
        .map_or("not computable".to_string(), |offset| {
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
        count => format!("{count}, the longest {longest_gap:.2} s"),
    };
    vec![
        input.signal.replace('_', " "),
        input.topic.clone(),
        input.type_name.clone(),
        input.why.clone(),
        input.clock.clone(),
        timing
            .rate_hz
            .map_or("not computable".to_string(), |rate| format!("{rate:.1}")),
        offset,
        gaps,
        timing.duplicate_stamps.to_string(),
        timing.backward_stamps.to_string(),
        input.undecodable.to_string(),
        format!(
            "{} of {}",
            input.counts.used,
            timing.message_count as u64 + input.undecodable
        ),
    ]
}

/// What a reader must know before relying on the results.
pub(super) fn limitations(analysis: &Analysis) -> String {
    let mut sentences = analysis.notes.clone();
    let losses = &analysis.losses;
    if losses.ranges.is_empty() {
        sentences
            .push("No damaged bytes were found in the parts of the log that were read".to_string());
    } else {
        sentences.push(format!(
            "{} ranges, {} bytes, of the log are lost:",
            losses.ranges.len(),
            losses.bytes_lost()
        ));
    }
    sentences.extend(losses.lines().take(MOST_LISTED));
    sentences.push(validity(analysis));
    html::list("notes", &sentences) + &not_listed(losses.ranges.len(), "lost ranges")
}

fn validity(analysis: &Analysis) -> String {
    let rows = analysis.rows.len();
    let valid = analysis
        .rows
        .reasons
        .iter()
        .filter(|reasons| reasons.is_empty())
        .count();
    let mut sentence = format!("{valid} of {rows} rows are valid");
    for (reason, count) in reason_counts(analysis) {
        sentence.push_str(&format!(
            "; not valid because of {}: {count}",
            reason.name()
        ));
    }
    sentence
}

/// Where everything comes from.
pub(super) fn provenance(analysis: &Analysis) -> String {
    let from = &analysis.provenance;
    let mut facts = vec![
        (
            "Program".to_string(),
            format!("tipwatch {}", from.tipwatch_version),
        ),
        ("Analysed at".to_string(), from.analysed_at.clone()),
        ("Format of the log".to_string(), from.log_format.clone()),
    ];
    facts.extend(
        from.log
            .iter()
            .map(|file| ("Log file".to_string(), hash(file))),
    );
    facts.push(("Machine file".to_string(), hash(&from.machine_file)));
    facts.push(("URDF".to_string(), hash(&from.urdf)));
    facts.push(("IMU mounting".to_string(), from.imu_mounting.clone()));
    facts.push((
        "Mass of the machine".to_string(),
        format!("{} kg", number(analysis.machine.mass())),
    ));
    facts.push((
        "Static loads".to_string(),
        by_wheel(analysis, &analysis.machine.reference().static_load),
    ));
    let limits = analysis.min_loads_n.as_ref();
    facts.push((
        "Load limits".to_string(),
        limits.map_or("none".to_string(), |limits| by_wheel(analysis, limits)),
    ));
    facts.extend(options(analysis));
    html::facts(&facts)
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
    options
        .into_iter()
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

fn not_listed(count: usize, of: &str) -> String {
    match count.checked_sub(MOST_LISTED) {
        None | Some(0) => String::new(),
        Some(more) => format!("<p>{more} more {of} are not listed here.</p>\n"),
    }
}

fn dash() -> String {
    "–".to_string()
}

//! The tables of the report: events, inputs, limitations, provenance.

use maud::{Markup, html};

use super::findings::Scene;
use super::when::Calendar;
use crate::analysis::{Analysis, Input};
use crate::base::file_hash::FileHash;
use crate::events::{Event, EventKind};
use crate::page::{
    facts, input_in_words, number, or_dash, probability, readable, table_of, with_unit,
};

/// Most events listed; the output tables have all.
const MOST_LISTED: usize = 500;

/// The table of events of the machine, and that of faults and gaps of its inputs by kind.
pub(super) fn events(analysis: &Analysis) -> Markup {
    let scene = Scene::of(analysis);
    let calendar = Calendar::of(analysis);
    let events = analysis.events.iter();
    let (of_machine, of_inputs): (Vec<&Event>, Vec<&Event>) =
        events.partition(|event| event.kind.is_stability());
    let listed = of_machine.iter().take(MOST_LISTED);
    let rows = listed.map(|event| event_row(&scene, calendar, event));
    html! {
        @if of_machine.is_empty() { p { "No " (scene.word.one) " or edge event." } }
        (table_of(rows))
        (not_listed(of_machine.len(), "events"))
        @if !of_inputs.is_empty() {
            h3 { "Faults and gaps of inputs" }
            (grouped(&scene, &of_inputs))
            p.hint { "Each of them is in events.parquet." }
        }
    }
}

/// Faults and gaps by kind and input, in the order of their first start.
fn grouped(scene: &Scene, events: &[&Event]) -> Markup {
    let mut groups: Vec<(String, Vec<&Event>)> = Vec::new();
    for event in events {
        let kind = event
            .fault
            .as_ref()
            .map_or(event.kind.name(), |fault| fault.kind.name());
        let name = format!("{}: {}", input_in_words(&event.subject), readable(kind));
        match groups.iter_mut().find(|group| group.0 == name) {
            Some(group) => group.1.push(event),
            None => groups.push((name, vec![event])),
        }
    }
    let rows = groups.iter().take(MOST_LISTED).map(|(name, events)| {
        let length = |event: &&Event| {
            let end_ns = event.end_ns.unwrap_or(event.worst_ns);
            end_ns.saturating_sub(event.start_ns) as f64 * 1e-9
        };
        let total: f64 = events.iter().map(length).sum();
        let worst = events.iter().filter(|event| event.worst.is_finite());
        let worst = worst.max_by(|a, b| a.worst.abs().total_cmp(&b.worst.abs()));
        let first = events.iter().map(|event| event.start_ns).min();
        let last = events.iter().map(|event| event.start_ns).max();
        let seconds = |time: Option<i64>| or_dash(time.map(|ns| scene.seconds(ns)), 2);
        let samples: u64 = events
            .iter()
            .filter_map(|event| event.fault.as_ref())
            .map(|f| f.samples)
            .sum();
        let samples = (samples > 0).then(|| samples.to_string());
        let worst = worst.map(|event| with_unit(event.worst, event.unit));
        [
            ("Input and fault", name.clone()),
            ("Times", events.len().to_string()),
            ("Samples", samples.unwrap_or_else(|| "–".into())),
            ("Total duration [s]", format!("{total:.2}")),
            ("First at [s]", seconds(first)),
            ("Last at [s]", seconds(last)),
            ("Worst value", worst.unwrap_or_else(|| "–".into())),
        ]
    });
    html! { (table_of(rows)) (not_listed(groups.len(), "groups")) }
}

fn event_row(scene: &Scene, calendar: Calendar, event: &Event) -> [(String, String); 10] {
    let seconds = |time_ns: i64| format!("{:.2}", scene.seconds(time_ns));
    let worst = match event.kind {
        _ if !event.worst.is_finite() => number(event.worst),
        EventKind::TipOver => format!("{:.1}°", event.worst.to_degrees()),
        _ => with_unit(event.worst, event.unit),
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
    let date = calendar.utc(event.start_ns);
    let confidence = event.certainty.map(probability);
    let support = format!("{} or edge", scene.word.head);
    [
        ("Event", scene.kind(event)),
        (&support, scene.subject(event)),
        ("Start [s]", seconds(event.start_ns)),
        (
            "Start, date and time",
            date.unwrap_or_else(|| "unknown".into()),
        ),
        ("End [s]", end.unwrap_or_else(|| "end of the log".into())),
        ("Worst value", worst),
        ("At [s]", seconds(event.worst_ns)),
        ("Lead time [s]", or_dash(event.lead_s, 2)),
        (
            "Confidence",
            confidence.unwrap_or_else(|| "not computed".into()),
        ),
        ("Depends on load split", split),
    ]
    .map(|(head, cell)| (head.to_owned(), cell))
}

/// The table of inputs.
pub(super) fn inputs(analysis: &Analysis) -> Markup {
    table_of(analysis.inputs.iter().map(input_row))
}

fn input_row(input: &Input) -> [(&'static str, String); 12] {
    let timing = &input.timing;
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
    let rate = timing.rate_hz.map(|rate| format!("{rate:.1}"));
    [
        ("Signal", readable(input.signal)),
        ("Topic", input.topic.clone()),
        ("Type", input.type_name.clone()),
        ("Reason for this topic", input.why.clone()),
        ("Clock and reason", input.clock.clone()),
        ("Rate [Hz]", rate.unwrap_or_else(unknown)),
        (
            "Header stamp minus log time, min / median / max [s]",
            offset,
        ),
        ("Gaps", gaps),
        ("Duplicate stamps", timing.duplicate_stamps.to_string()),
        ("Backward stamps", timing.backward_stamps.to_string()),
        ("Undecodable", input.undecodable.to_string()),
        (
            "Messages used",
            format!("{} of {messages}", input.counts.used),
        ),
    ]
}

/// Where everything comes from.
pub(super) fn provenance(analysis: &Analysis) -> Markup {
    let from = &analysis.provenance;
    let mut rows = Vec::new();
    rows.extend(from.case.clone().map(|case| ("Case", case)));
    rows.extend(from.examiner.clone().map(|examiner| ("Examiner", examiner)));
    let program = from.program.as_ref().map_or("hash unknown".into(), |file| {
        format!("{} bytes, SHA-256 {}", file.bytes, file.hash_text())
    });
    rows.push((
        "Program",
        format!("tipwatch {}, {program}", from.tipwatch_version),
    ));
    if !from.command_line.is_empty() {
        rows.push(("Command line", from.command_line.join(" ")));
        let elsewhere = "in custody.json beside this report, with the hash of this report and of every \
            other output; `tipwatch verify` repeats the analysis and compares them";
        rows.push(("Time of the analysis", elsewhere.into()));
    }
    rows.push(("Log format", from.log_format.clone()));
    rows.extend(from.log.iter().map(|file| ("Log file", hash(file))));
    rows.extend(from.recovered_from.iter().map(|origin| {
        let files: Vec<String> = origin.files.iter().map(hash).collect();
        let (files, lost) = (files.join("; "), origin.bytes_lost);
        let by = format!(
            "by tipwatch {}; {lost} bytes were lost",
            origin.tipwatch_version
        );
        ("Recovered from", format!("{files}, {by}"))
    }));
    let limits = analysis.min_loads_n.as_ref();
    rows.extend([
        ("Machine file", hash(&from.machine_file)),
        ("URDF", hash(&from.urdf)),
        ("IMU mounting", from.imu_mounting.clone()),
        ("Commissioning", from.commissioning.clone()),
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
    let options = options.into_iter();
    options
        .map(|(name, value)| {
            (
                format!("Option: {}", readable(&name)),
                option_in_words(value),
            )
        })
        .collect()
}

/// The value of an option without the signs of a document.
fn option_in_words(value: serde_json::Value) -> String {
    match value {
        serde_json::Value::Null => "not set".to_string(),
        serde_json::Value::String(text) => readable(&text),
        serde_json::Value::Bool(true) => "yes".into(),
        serde_json::Value::Bool(false) => "no".into(),
        serde_json::Value::Object(parts) => {
            let parts = parts.into_iter();
            let parts = parts
                .map(|(name, value)| format!("{} {}", readable(&name), option_in_words(value)));
            parts.collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
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
        file.path,
        file.bytes,
        file.hash_text()
    )
}

fn not_listed(count: usize, of: &str) -> Markup {
    html! { @if count > MOST_LISTED { p { (count - MOST_LISTED) " more " (of) " are not listed here." } } }
}

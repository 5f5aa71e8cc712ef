//! The tables of the report: events, inputs, limitations, provenance.

use maud::{Markup, html};
use tipwatch_language::{decimals, say, word};

use super::findings::{Scene, led_to};
use crate::analysis::calendar::Calendar;
use crate::analysis::{Analysis, Input};
use crate::base::file_hash::FileHash;
use crate::events::{Event, EventKind};
use crate::page::{
    facts, input_in_words, number, or_dash, probability, readable, table_of, with_unit,
};

/// The table of events of the machine, and that of faults and gaps of its inputs by kind: of many the `most` important ones.
/// The output tables have all.
pub(super) fn events(analysis: &Analysis, most: usize) -> Markup {
    let scene = Scene::of(analysis);
    let calendar = Calendar::of(analysis);
    let events = analysis.events.iter();
    let (of_machine, of_inputs): (Vec<&Event>, Vec<&Event>) =
        events.partition(|event| event.kind.is_stability());
    let became = |event: &&Event| led_to(&analysis.events, event);
    let (stories, announced): (Vec<&Event>, Vec<&Event>) = of_machine
        .iter()
        .copied()
        .partition(|event| became(event).is_none());
    let announced: Vec<(i64, Option<&Event>)> = (announced.iter())
        .map(|event| (event.start_ns, became(event)))
        .collect();
    let mut listed = stories.clone();
    if listed.len() > most {
        listed.sort_by_key(|event| event.importance());
        listed.truncate(most);
        listed.sort_by_key(|event| event.start_ns);
    }
    let rows = listed.iter().map(|event| {
        let is_of = |(_, became): &&(i64, Option<&Event>)| {
            became.is_some_and(|became| std::ptr::eq(became, *event))
        };
        let began_ns = announced
            .iter()
            .filter(is_of)
            .map(|(start_ns, _)| *start_ns)
            .min();
        event_row(&scene, calendar, event, began_ns)
    });
    html! {
        @if of_machine.is_empty() { p { (say!("No {} or edge event.", scene.word.one)) } }
        (table_of(rows))
        (not_listed(stories.len(), most, word!("events")))
        @if !of_inputs.is_empty() {
            h3 { (word!("Faults and gaps of inputs")) }
            (grouped(&scene, &of_inputs, most))
            p.hint { (word!("Each of them is in events.parquet.")) }
        }
    }
}

/// Faults and gaps by kind and input, in the order of their first start.
fn grouped(scene: &Scene, events: &[&Event], most: usize) -> Markup {
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
    let rows = groups.iter().take(most).map(|(name, events)| {
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
            (word!("Input and fault"), name.clone()),
            (word!("Times"), events.len().to_string()),
            (word!("Samples"), samples.unwrap_or_else(|| "–".into())),
            (word!("Total duration [s]"), decimals(format!("{total:.2}"))),
            (word!("First at [s]"), seconds(first)),
            (word!("Last at [s]"), seconds(last)),
            (word!("Worst value"), worst.unwrap_or_else(|| "–".into())),
        ]
    });
    html! { (table_of(rows)) (not_listed(groups.len(), most, word!("groups"))) }
}

/// `began_ns` is the start of the event that it came of: of a lift, when the wheel grew light.
fn event_row(
    scene: &Scene,
    calendar: Calendar,
    event: &Event,
    began_ns: Option<i64>,
) -> [(String, String); 11] {
    let seconds = |time_ns: i64| decimals(format!("{:.2}", scene.seconds(time_ns)));
    let worst = match event.kind {
        _ if !event.worst.is_finite() => number(event.worst),
        EventKind::TipOver => decimals(format!("{:.1}°", event.worst.to_degrees())),
        _ => with_unit(event.worst, event.unit),
    };
    let end = event.end_ns.map(seconds);
    let split = match (event.split_dependent, event.load_range_n) {
        (Some(true), Some([least_n, largest_n])) => {
            say!("yes: {} to {} N", number(least_n), number(largest_n))
        }
        (Some(true), None) => word!("yes").to_string(),
        (Some(false), _) => match event.any_split_ns {
            Some(any_split_ns) => say!("its start: by any split at {}", seconds(any_split_ns)),
            None => word!("no").to_string(),
        },
        (None, _) => "–".to_string(),
    };
    let date = calendar.utc(event.start_ns);
    let confidence = event.certainty.map(probability);
    let support = say!("{} or edge", scene.word.head);
    [
        (word!("Event"), scene.kind(event)),
        (&support, scene.subject(event)),
        (
            word!("Announced from [s]"),
            began_ns.map_or("–".into(), seconds),
        ),
        (word!("Start [s]"), seconds(event.start_ns)),
        (
            word!("Start, date and time"),
            date.unwrap_or_else(|| word!("unknown").into()),
        ),
        (
            word!("End [s]"),
            end.unwrap_or_else(|| match scene.goes_on {
                true => word!("last row or later").into(),
                false => word!("end of the log").into(),
            }),
        ),
        (word!("Worst value"), worst),
        (word!("At [s]"), seconds(event.worst_ns)),
        (word!("Lead time [s]"), or_dash(event.lead_s, 2)),
        (
            word!("Confidence"),
            confidence.unwrap_or_else(|| word!("not computed").into()),
        ),
        (word!("Depends on load split"), split),
    ]
    .map(|(head, cell)| (head.to_owned(), cell))
}

/// The table of inputs.
pub(super) fn inputs(analysis: &Analysis) -> Markup {
    table_of(analysis.inputs.iter().map(input_row))
}

fn input_row(input: &Input) -> [(&'static str, String); 12] {
    let timing = &input.timing;
    let unknown = || word!("not computable").to_string();
    let offset = timing.header_minus_log.map_or_else(unknown, |offset| {
        decimals(format!(
            "{:.4} / {:.4} / {:.4}",
            offset.min_s, offset.median_s, offset.max_s
        ))
    });
    let longest_gap = timing
        .gaps
        .iter()
        .map(|gap| gap.duration_s)
        .fold(0.0, f64::max);
    let gaps = match timing.gaps.len() {
        0 => "0".to_string(),
        count => say!("{count}, longest {longest_gap:.2} s"),
    };
    let messages = timing.message_count as u64 + input.undecodable;
    let rate = timing.rate_hz.map(|rate| decimals(format!("{rate:.1}")));
    [
        (word!("Signal"), readable(input.signal)),
        (word!("Topic"), input.topic.clone()),
        (word!("Type"), input.type_name.clone()),
        (word!("Reason for this topic"), input.why.clone()),
        (word!("Clock and reason"), input.clock.clone()),
        (word!("Rate [Hz]"), rate.unwrap_or_else(unknown)),
        (
            word!("Header stamp minus log time, min / median / max [s]"),
            offset,
        ),
        (word!("Gaps"), gaps),
        (
            word!("Duplicate stamps"),
            timing.duplicate_stamps.to_string(),
        ),
        (word!("Backward stamps"), timing.backward_stamps.to_string()),
        (word!("Undecodable"), input.undecodable.to_string()),
        (
            word!("Messages used"),
            say!("{} of {messages}", input.samples_used),
        ),
    ]
}

/// Renders the provenance of the results.
pub(super) fn provenance(analysis: &Analysis) -> Markup {
    let from = &analysis.provenance;
    let mut rows = Vec::new();
    rows.extend(from.case.clone().map(|case| (word!("Case"), case)));
    rows.extend(
        from.examiner
            .clone()
            .map(|examiner| (word!("Examiner"), examiner)),
    );
    let program = from
        .program
        .as_ref()
        .map_or(word!("hash unknown").into(), |file| {
            say!("{} bytes, SHA-256 {}", file.bytes, file.hash_text())
        });
    rows.push((
        word!("Program"),
        format!("tipwatch {}, {program}", from.tipwatch_version),
    ));
    if !from.command_line.is_empty() {
        rows.push((word!("Command line"), from.command_line.join(" ")));
        let elsewhere = word!(
            "in custody.json beside this report, with the hash of this report and of every \
            other output; `tipwatch verify` repeats the analysis and compares them"
        );
        rows.push((word!("Time of the analysis"), elsewhere.into()));
    }
    rows.push((word!("Log format"), from.log_format.clone()));
    rows.extend(from.log.iter().map(|file| (word!("Log file"), hash(file))));
    rows.extend(from.recovered_from.iter().map(|origin| {
        let files: Vec<String> = origin.files.iter().map(hash).collect();
        let (files, lost) = (files.join("; "), origin.bytes_lost);
        let by = say!(
            "by tipwatch {}; {lost} bytes were lost",
            origin.tipwatch_version
        );
        (word!("Recovered from"), format!("{files}, {by}"))
    }));
    let limits = analysis.min_loads_n.as_ref();
    rows.extend([
        (word!("Machine file"), hash(&from.machine_file)),
        ("URDF", hash(&from.urdf)),
        (word!("IMU mounting"), from.imu_mounting.clone()),
        (word!("Commissioning"), from.commissioning.clone()),
        (
            word!("Machine mass"),
            format!("{} kg", number(analysis.machine.mass())),
        ),
        (
            word!("Static loads"),
            by_wheel(analysis, &analysis.machine.reference().static_load),
        ),
        (
            word!("Load limits"),
            limits.map_or(word!("none").into(), |limits| by_wheel(analysis, limits)),
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
        .map(|(name, value)| (say!("Option: {}", readable(&name)), option_in_words(value)))
        .collect()
}

/// The value of an option without the signs of a document.
fn option_in_words(value: serde_json::Value) -> String {
    match value {
        serde_json::Value::Null => word!("not set").to_string(),
        serde_json::Value::String(text) => readable(&text),
        serde_json::Value::Bool(true) => word!("yes").into(),
        serde_json::Value::Bool(false) => word!("no").into(),
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
            false => say!("{} not computable", wheel.name),
        })
        .collect();
    parts.join(", ")
}

fn hash(file: &FileHash) -> String {
    say!(
        "{} ({} bytes), SHA-256 {}",
        file.path,
        file.bytes,
        file.hash_text()
    )
}

fn not_listed(count: usize, most: usize, of: &str) -> Markup {
    html! { @if count > most { p { (say!("{} more {of} are not listed here.", count - most)) } } }
}

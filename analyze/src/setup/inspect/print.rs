//! Prints the contents of a log as text or JSON.

use std::fmt::Write;

use anyhow::Result;
use tipwatch_ingest::FieldContents;

use super::document::{ClockInspection, Inspection, TopicInspection};
use crate::analysis::clock::text as clock_text;
use crate::base::stdout;
use crate::base::transfer_text;

/// Fields of a topic in the text; JSON has all.
const MOST_FIELDS: usize = 40;

/// Prints an inspection as text or JSON.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(inspection: &Inspection, as_json: bool) -> Result<()> {
    stdout::print(inspection, as_json, table)
}

fn table(inspection: &Inspection) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let out = &mut text;
    writeln!(
        out,
        "{}: {}, {} bytes, {} file(s)",
        inspection.path,
        inspection.format,
        inspection.bytes,
        inspection.files.len()
    )?;
    for line in transfer_text::lines(&inspection.transfers) {
        writeln!(out, "{line}")?;
    }
    writeln!(out, "\ntopics")?;
    for topic in &inspection.topics {
        write!(out, "{}", describe_topic(topic))?;
    }
    for bus in &inspection.can {
        write!(out, "\n{bus}")?;
    }
    writeln!(out, "\nsignals")?;
    for signal in &inspection.signals {
        writeln!(
            out,
            "  {:<13} {} ({})",
            signal.signal,
            signal.topic.as_deref().unwrap_or("-"),
            signal.why
        )?;
    }
    if let Some(error) = &inspection.binding_error {
        writeln!(out, "  not bound: {error}")?;
    }
    writeln!(
        out,
        "  {:<13} {}",
        "description",
        inspection.robot_description.as_deref().unwrap_or("-")
    )?;
    write!(out, "\nclock\n{}", describe_clock(&inspection.clock))?;
    writeln!(out, "\nintegrity")?;
    writeln!(
        out,
        "  {}",
        inspection.integrity.unwrap_or("checksums present")
    )?;
    for line in inspection.losses.lines() {
        writeln!(out, "  lost: {line}")?;
    }
    for note in &inspection.losses.notes {
        writeln!(out, "  {note}")?;
    }
    Ok(text)
}

fn describe_clock(clock: &ClockInspection) -> String {
    let mut text = match (clock.time, &clock.topic) {
        (Some(time), Some(topic)) => format!("  {time} of {topic}\n"),
        (Some(time), None) => format!("  {time}\n"),
        (None, _) => "  no topic with a signal\n".to_owned(),
    };
    for finding in &clock.findings {
        text += &format!("  {finding}\n");
    }
    if let Some(note) = &clock.offsets_note {
        text += &format!("  offsets between topics: {note}\n");
    }
    if let Some(offsets) = &clock.offsets {
        text += &clock_text::table(offsets);
    }
    text
}

fn describe_topic(topic: &TopicInspection) -> String {
    let count = topic
        .message_count
        .map_or("?".into(), |count| count.to_string());
    let mut text = format!(
        "  {:<28} {:<32} {count:>8} messages, {}, definition {}\n",
        topic.name, topic.type_name, topic.encoding, topic.definition
    );
    if let (Some(start_ns), Some(end_ns), Some(duration_s)) =
        (topic.start_ns, topic.end_ns, topic.duration_s)
    {
        let rate = topic
            .rate_hz
            .map(|rate| format!(", {rate:.2} messages a second"));
        let _ = writeln!(
            text,
            "      log time {start_ns} to {end_ns} ns, {duration_s:.3} s{}",
            rate.unwrap_or_default()
        );
    }
    if let Some(timing) = &topic.timing {
        let number = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.3}"));
        let _ = writeln!(
            text,
            "      {} Hz, median period {} s, longest {} s; clock {}: {}",
            number(timing.rate_hz),
            number(timing.median_period_s),
            number(timing.max_period_s),
            timing.clock.source,
            timing.clock.reason
        );
        if let Some(offset) = &timing.header_minus_log {
            let _ = writeln!(
                text,
                "      header.stamp minus log time: median {:.6} s (median absolute deviation {:.6} s), {:.6} to {:.6} s, \
                 drift {:.1} ppm (standard deviation {:.1}), jitter {:.6} s",
                offset.median_s,
                offset.mad_s,
                offset.min_s,
                offset.max_s,
                offset.drift_ppm,
                offset.drift_sigma_ppm,
                offset.jitter_s
            );
        }
        for gap in &timing.gaps {
            let _ = writeln!(
                text,
                "      gap of {:.3} s at {} ns",
                gap.duration_s, gap.start_ns
            );
        }
        let odd = [
            ("duplicate", timing.duplicate_stamps),
            ("backward", timing.backward_stamps),
            ("zero", timing.zero_stamps),
        ];
        for (kind, count) in odd.into_iter().filter(|(_, count)| *count > 0) {
            let _ = writeln!(text, "      {count} {kind} stamps");
        }
    }
    if !topic.joint_names.is_empty() {
        let _ = writeln!(text, "      joints: {}", topic.joint_names.join(", "));
    }
    describe_fields(topic, &mut text);
    text
}

/// The numbers that can be bound, each in the first and the last message. A list that is zero in both, such as a covariance
/// that nobody filled in, takes one line.
fn describe_fields(topic: &TopicInspection, text: &mut String) {
    let list = |field: &FieldContents| {
        field
            .field
            .rsplit_once('[')
            .map(|(list, _)| list.to_owned())
    };
    let lines = topic
        .fields
        .chunk_by(|a, b| list(a).is_some() && list(a) == list(b));
    let lines = lines.flat_map(|fields| {
        let is_zero = |of: &FieldContents| of.first == Some(0.0) && of.last == Some(0.0);
        match fields {
            [first, .., last] if fields.iter().all(is_zero) => {
                vec![format!(
                    "{} to {}: zero in the first and the last message",
                    first.field, last.field
                )]
            }
            _ => fields.iter().map(described).collect(),
        }
    });
    let mut lines = lines.fuse();
    for line in lines.by_ref().take(MOST_FIELDS) {
        let _ = writeln!(text, "      {line}");
    }
    let more = lines.count();
    if more > 0 {
        let _ = writeln!(text, "      {more} more lines of fields: --json lists them");
    }
    if let Some(note) = &topic.fields_note {
        let _ = writeln!(text, "      fields: {note}");
    }
}

fn described(field: &FieldContents) -> String {
    let number = |value: Option<f64>| value.map_or("-".into(), |v| v.to_string());
    let [first, last] = [field.first, field.last].map(number);
    format!("{:<32} first {first}, last {last}", field.field)
}

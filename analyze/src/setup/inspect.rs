//! `inspect`: contents of a log before any analysis: topics, clocks, gaps, damage, and the topic of each
//! signal with the reason.

use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;
use tipwatch_binding::{MachineFile, named_topics};
use tipwatch_ingest::{
    Log, Losses, NamedTopics, SensorKind, SensorRecording, SensorRequest, SensorTopics,
    StampCorrection, StampSource, TimeBase, Topic, TopicId, TopicTiming, record_sensors,
    robot_description,
};

use crate::analysis::clock::{
    ClockOffsets,
    words::{self, TopicsFinding},
};
use crate::analysis::run;
use crate::base::stdout;

/// Version of the JSON document.
const SCHEMA: u32 = 2;
/// Reason for a signal without a topic of its own.
const BY_NUMBERS: &str = "fields named in the machine file";

/// Contents of a log.
#[derive(Debug, Serialize)]
pub struct Inspection {
    schema: u32,
    path: String,
    format: String,
    files: Vec<String>,
    bytes: u64,
    topics: Vec<TopicInspection>,
    signals: Vec<SignalInspection>,
    clock: ClockInspection,
    /// Why signals cannot be bound.
    binding_error: Option<String>,
    /// Topic and length of the robot description.
    robot_description: Option<String>,
    /// Parts of the log that were lost.
    pub losses: Losses,
    integrity: Option<&'static str>,
}

/// The clock to which all signals are converted.
#[derive(Debug, Serialize)]
struct ClockInspection {
    /// "header", "publish" or "log".
    time: Option<StampSource>,
    /// The topic that defines it; null for the log time.
    topic: Option<String>,
    /// Anomalies of the clocks.
    findings: Vec<TopicsFinding>,
    /// Offsets between topics, estimated from the physics; null without a machine file.
    offsets: Option<ClockOffsets>,
    /// Why there are no offsets.
    offsets_note: Option<String>,
}

#[derive(Debug, Serialize)]
struct TopicInspection {
    name: String,
    type_name: String,
    encoding: String,
    definition: String,
    message_count: Option<u64>,
    /// Statistics of the stamps, for topics that can be a signal.
    timing: Option<TopicTiming>,
    /// Conversion of the stamps to the clock of the log.
    correction: Option<StampCorrection>,
    joint_names: Vec<String>,
}

#[derive(Debug, Serialize)]
struct SignalInspection {
    signal: &'static str,
    topic: Option<String>,
    why: String,
}

/// Inspects a log; `file` resolves ambiguous topics.
///
/// # Errors
/// The log cannot be read.
pub fn inspect(path: &Path, file: Option<&MachineFile>) -> Result<Inspection> {
    let log = Log::open(path)?;
    let named = file.map_or(
        NamedTopics {
            has_tool: true,
            ..NamedTopics::default()
        },
        |file| named_topics(&file.spec),
    );
    let (found, binding_error) = match SensorTopics::find(&log, &named) {
        Ok(found) => (found, None),
        Err(error) => (SensorTopics::default(), Some(error.to_string())),
    };
    let (clocks, mut losses) = clocks(&log)?;
    if !losses.is_empty() {
        // again over all topics, for losses on those that are not signals
        let ids: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
        losses.merge(&log.read(&ids, &mut |_| ControlFlow::Continue(()))?);
    }
    let topics = log
        .topics()
        .iter()
        .map(|topic| topic_inspection(topic, &found, &clocks))
        .collect();
    let signals = if binding_error.is_none() {
        signals(&log, &found, &named, file)
    } else {
        Vec::new()
    };
    Ok(Inspection {
        schema: SCHEMA,
        path: path.display().to_string(),
        format: log.format().to_string(),
        files: log
            .files()
            .iter()
            .map(|f| f.display().to_string())
            .collect(),
        bytes: log.bytes(),
        topics,
        signals,
        clock: clock_inspection(&log, file, &clocks),
        binding_error,
        robot_description: robot_description(&log)
            .ok()
            .flatten()
            .map(|(text, topic)| format!("{topic}: {} bytes", text.len())),
        integrity: losses.integrity.note(),
        losses,
    })
}

/// Records all topics that can be a signal, for their stamps.
fn clocks(log: &Log) -> Result<(Vec<SensorRecording>, Losses)> {
    let kind_of = |topic: &Topic| {
        SensorKind::ALL
            .into_iter()
            .find(|kind| kind.is_type(&topic.type_name))
    };
    let requests: Vec<SensorRequest> = log
        .topics()
        .iter()
        .filter_map(|topic| {
            Some(SensorRequest {
                topic: topic.id,
                kind: kind_of(topic)?,
                joint_names: Vec::new(),
                numbers: None,
                other_parts: Vec::new(),
            })
        })
        .filter(|request| {
            tipwatch_ingest::SensorDecoder::new(
                &log.topics()[request.topic.index()],
                request.kind,
                &[],
            )
            .is_ok()
        })
        .collect();
    Ok(record_sensors(log, &requests, &mut |_| {})?)
}

fn clock_inspection(
    log: &Log,
    file: Option<&MachineFile>,
    clocks: &[SensorRecording],
) -> ClockInspection {
    let base = clocks.first().map(|recording| &recording.time_base);
    let findings = clocks.iter().filter_map(|recording| {
        let topic = log.topic(recording.topic).ok()?;
        Some((topic.name.as_str(), recording.findings.as_slice()))
    });
    let offsets = match file {
        None => Err("expected a machine file (--machine), found none".to_owned()),
        Some(file) => run::clock_offsets(log, file).map_err(|error| format!("{error:#}")),
    };
    ClockInspection {
        time: base.map(TimeBase::source),
        topic: base.and_then(TimeBase::anchor).map(str::to_owned),
        findings: words::findings(findings),
        offsets_note: offsets.as_ref().err().cloned(),
        offsets: offsets.ok(),
    }
}

fn topic_inspection(
    topic: &Topic,
    found: &SensorTopics,
    clocks: &[SensorRecording],
) -> TopicInspection {
    let clock = clocks.iter().find(|recording| recording.topic == topic.id);
    let joints = found
        .joint_states
        .iter()
        .find(|joint| joint.binding.topic == topic.id);
    TopicInspection {
        name: topic.name.clone(),
        type_name: topic.type_name.clone(),
        encoding: topic.encoding.clone(),
        definition: format!("{:?}", topic.definition_source).to_lowercase(),
        message_count: topic.message_count,
        timing: clock.map(|recording| recording.statistics.timing()),
        correction: clock.map(|recording| recording.correction),
        joint_names: joints.map_or(Vec::new(), |joint| joint.joint_names.clone()),
    }
}

fn signals(
    log: &Log,
    found: &SensorTopics,
    named: &NamedTopics,
    file: Option<&MachineFile>,
) -> Vec<SignalInspection> {
    let name = |id: TopicId| log.topic(id).ok().map(|topic| topic.name.clone());
    let mut signals: Vec<SignalInspection> = Vec::new();
    for joint in &found.joint_states {
        let binding = &joint.binding;
        signals.push(SignalInspection {
            signal: "joint_states",
            topic: name(binding.topic),
            why: binding.why.clone(),
        });
    }
    for joint in file.iter().flat_map(|file| file.spec.signals.joints.keys()) {
        signals.push(SignalInspection {
            signal: "joint_states",
            topic: None,
            why: format!("{joint}: {BY_NUMBERS}"),
        });
    }
    let others = [
        (SensorKind::Imu, &found.imu),
        (SensorKind::Odometry, &found.odometry),
        (SensorKind::ToolWrench, &found.tool_wrench),
    ];
    for (kind, binding) in others {
        let missing = match named.bound_by_number.contains(&kind) {
            true => BY_NUMBERS.into(),
            false => format!("no messages of type {}", kind.type_name()),
        };
        signals.push(SignalInspection {
            signal: kind.signal_key(),
            topic: binding.as_ref().and_then(|b| name(b.topic)),
            why: binding.as_ref().map_or(missing, |b| b.why.clone()),
        });
    }
    signals
}

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
    writeln!(out, "\ntopics")?;
    for topic in &inspection.topics {
        write!(out, "{}", describe_topic(topic))?;
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
        text += &words::table(offsets);
    }
    text
}

fn describe_topic(topic: &TopicInspection) -> String {
    let count = topic
        .message_count
        .map_or("?".into(), |count| count.to_string());
    let mut text = format!(
        "  {:<28} {:<32} {count:>8} messages, definition {}\n",
        topic.name, topic.type_name, topic.definition
    );
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
    text
}

//! Reads the contents of a log.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use tipwatch_binding::{MachineFile, named_topics};
use tipwatch_ingest::{
    Log, Losses, NamedTopics, SensorDecoder, SensorKind, SensorRecording, SensorRequest,
    SensorTopics, TimeBase, Topic, TopicContents, TopicId, record_sensors, robot_descriptions,
    topic_contents,
};

use super::can::{self, Described};
use super::document::{ClockInspection, Inspection, SCHEMA, SignalInspection, TopicInspection};
use crate::analysis::clock::text;
use crate::analysis::clock_offsets;
use crate::base::error_text::error_text;

/// Reason for a signal without a topic of its own.
const BY_NUMBERS: &str = "fields named in the machine file";

/// Inspects a log; `file` resolves ambiguous topics, `databases` describe the messages of its CAN buses.
///
/// # Errors
/// The log cannot be read.
pub fn inspect(
    path: &Path,
    file: Option<&MachineFile>,
    databases: &[Described],
) -> Result<Inspection> {
    let log = match file {
        Some(file) => file.open_log(path)?,
        None => Log::open(path)?,
    };
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
    let contents = contents(&log, &mut losses)?;
    let can = can::inspect(&log, databases, &mut losses)?;
    let topics = log
        .topics()
        .iter()
        .zip(contents)
        .map(|(topic, contents)| topic_inspection(topic, contents, &found, &clocks))
        .collect();
    let signals = if binding_error.is_none() {
        signals(&log, &found, &named, file)
    } else {
        Vec::new()
    };
    Ok(Inspection {
        schema: SCHEMA,
        path: log.path().display().to_string(),
        transfers: log.transfers(),
        format: log.format().to_string(),
        files: log
            .files()
            .iter()
            .map(|f| f.display().to_string())
            .collect(),
        bytes: log.bytes(),
        topics,
        can,
        signals,
        clock: clock_inspection(&log, file, &clocks),
        binding_error,
        robot_description: robot_descriptions(&log)
            .ok()
            .and_then(|mut described| described.pop())
            .map(|last| format!("{}: {} bytes", last.topic, last.text.len())),
        integrity: losses.integrity.note(),
        losses,
    })
}

/// Returns the contents of every topic, with the losses of all of them. Of a log in a bucket only the needed parts are read.
fn contents(log: &Log, losses: &mut Losses) -> Result<Vec<TopicContents>> {
    if log.whole_files().iter().all(Option::is_some) {
        let (contents, found) = topic_contents(log)?;
        if !found.is_empty() || !losses.is_empty() {
            losses.merge(&found);
        }
        return Ok(contents);
    }
    if !losses.is_empty() {
        // again over all topics, for losses on those that are not signals
        let ids: Vec<TopicId> = log.topics().iter().map(|topic| topic.id).collect();
        losses.merge(&log.read(&ids, &mut |_| ControlFlow::Continue(()))?);
    }
    let unread = TopicContents {
        note: Some(
            "not read: the log is in a bucket or on a server (--fetch-whole reads it)".into(),
        ),
        ..TopicContents::default()
    };
    Ok(vec![unread; log.topics().len()])
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
        .filter_map(|topic| Some(SensorRequest::typed(topic.id, kind_of(topic)?, Vec::new())))
        .filter(|request| {
            SensorDecoder::new(&log.topics()[request.topic.index()], request.kind, &[]).is_ok()
        })
        .collect();
    Ok(record_sensors(log, &requests, &mut |_| {})?)
}

fn clock_inspection(
    log: &Log,
    file: Option<&MachineFile>,
    clocks: &[SensorRecording],
) -> ClockInspection {
    let base = clocks.first().map(|recording| &recording.reading.time_base);
    let findings = clocks.iter().filter_map(|recording| {
        let topic = log.topic(recording.reading.topic).ok()?;
        Some((topic.name.as_str(), recording.reading.findings.as_slice()))
    });
    let offsets = match file {
        None => Err("expected a machine file (--machine), found none".to_owned()),
        Some(file) => clock_offsets(log, file).map_err(|error| error_text(&error)),
    };
    ClockInspection {
        time: base.map(TimeBase::source),
        topic: base.and_then(TimeBase::anchor).map(str::to_owned),
        findings: text::findings(findings),
        offsets_note: offsets.as_ref().err().cloned(),
        offsets: offsets.ok(),
    }
}

fn topic_inspection(
    topic: &Topic,
    contents: TopicContents,
    found: &SensorTopics,
    clocks: &[SensorRecording],
) -> TopicInspection {
    let clock = clocks
        .iter()
        .find(|recording| recording.reading.topic == topic.id);
    let joints = (found.joint_states.iter()).filter(|joint| joint.binding.topic == topic.id);
    TopicInspection {
        name: topic.name.clone(),
        type_name: topic.type_name.clone(),
        encoding: topic.encoding.clone(),
        definition: format!("{:?}", topic.definition_source).to_lowercase(),
        message_count: topic.message_count,
        start_ns: contents.start_ns,
        end_ns: contents.end_ns,
        duration_s: contents.duration_s(),
        rate_hz: contents.rate_hz(),
        fields: contents.fields,
        fields_note: contents.note,
        timing: clock.map(|recording| recording.reading.statistics.timing()),
        correction: clock.map(|recording| recording.reading.correction),
        joint_names: joints.flat_map(|joint| joint.joint_names.clone()).collect(),
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

//! The topics in a log of the monitor's recorder. Live writes them, offline reads them. Every
//! signal has its own topic, with the values that the monitor used: topics, scales and clock
//! offsets of the machine file are applied already.

use tipwatch_ingest::{Error, FieldRecording, FieldRequest, Log, record_fields};
use tipwatch_mechanics::machine::{FieldSpec, MachineSpec, OneOrMany, SignalSpec, SignalsSpec};

/// Name of the verdict topic. Offline reads from it which samples were missing, late or refused.
pub const NAME: &str = "/tipwatch/verdict";
/// Type of its messages.
pub const TYPE_NAME: &str = "tipwatch_msgs/msg/Verdict";
/// The fields that offline reads, all unsigned integers: the kind of verdict (1: on a row, whose
/// time is the header stamp), and the faults, cautions and acknowledgement since the previous row.
pub const FIELDS: [&str; 4] = ["event", "faults", "cautions", "acknowledged"];
/// The fields that tell of the latched alarm with which the session began: its level (0: none), and
/// whether it had been acknowledged. Earlier recordings lack them.
pub const INHERITED_FIELDS: [&str; 2] = ["inherited_alarm", "inherited_acknowledged"];
/// The field that tells whether the sensors were contradicted in a session before. Earlier recordings lack it.
pub const CONTRADICTED_FIELD: &str = "inherited_contradiction";
/// Value of `event` for a verdict on a row, see [`FIELDS`].
pub const EVENT_ROW: u32 = 1;
/// Name of the topic on which the recorder reports what it missed.
pub const GAPS: &str = "/tipwatch/record_gap";
/// Type of its messages.
pub const GAPS_TYPE_NAME: &str = "tipwatch_msgs/msg/RecordGap";
/// The fields that offline reads: the number of samples, and of verdicts and commands, missing
/// before the message.
pub const GAPS_FIELDS: [&str; 2] = ["samples", "verdicts"];
/// Topic of the IMU.
pub const IMU: &str = "/imu/data";
/// Topic of the odometry.
pub const ODOMETRY: &str = "/odom";
/// Topic of the tool wrench.
pub const TOOL_WRENCH: &str = "/tool_wrench";
/// Field of an actuator force signal.
pub const ACTUATOR_FIELD: &str = "value";

/// Topic of a stream of joint states; rows are computed at the samples of the first.
#[must_use]
pub fn joint_states(stream: usize) -> String {
    match stream {
        0 => "/joint_states".into(),
        _ => format!("/joint_states_{}", stream + 1),
    }
}

/// Topic of the force of a linkage's actuator (N).
#[must_use]
pub fn force(linkage: &str) -> String {
    format!("/actuator/{linkage}/force")
}

/// Topic of the piston-side pressure of a linkage's actuator (Pa).
#[must_use]
pub fn piston_pressure(linkage: &str) -> String {
    format!("/actuator/{linkage}/piston_pressure")
}

/// Topic of the rod-side pressure of a linkage's actuator (Pa).
#[must_use]
pub fn rod_pressure(linkage: &str) -> String {
    format!("/actuator/{linkage}/rod_pressure")
}

/// Whether a monitor's recorder wrote the log.
#[must_use]
pub fn is_in(log: &Log) -> bool {
    has(log, NAME, TYPE_NAME)
}

fn has(log: &Log, name: &str, type_name: &str) -> bool {
    let mut topics = log.topics().iter();
    topics.any(|topic| topic.name == name && topic.type_name == type_name)
}

/// [`FIELDS`] of all recorded verdicts; `None` if the log is not from the monitor's recorder. Their
/// stamps are those of the monitor's joint states and stay unchanged: verdicts have no clock of
/// their own.
///
/// # Errors
/// The log cannot be read.
pub fn verdicts(log: &Log) -> Result<Option<[FieldRecording; 4]>, Error> {
    columns(log, NAME, TYPE_NAME, FIELDS)
}

/// [`INHERITED_FIELDS`] of all recorded verdicts; `None` if the log is not from the monitor's
/// recorder, or from an earlier version of it.
///
/// # Errors
/// The log cannot be read.
pub fn inherited_alarms(log: &Log) -> Result<Option<[FieldRecording; 2]>, Error> {
    known_columns(log, INHERITED_FIELDS)
}

/// [`CONTRADICTED_FIELD`] of all recorded verdicts; `None` if the log is not from the monitor's recorder, or from an earlier
/// version of it.
///
/// # Errors
/// The log cannot be read.
pub fn inherited_contradictions(log: &Log) -> Result<Option<[FieldRecording; 1]>, Error> {
    known_columns(log, [CONTRADICTED_FIELD])
}

/// Fields of the verdicts, if the definition of the topic has them.
fn known_columns<const N: usize>(
    log: &Log,
    fields: [&str; N],
) -> Result<Option<[FieldRecording; N]>, Error> {
    let mut topics = log.topics().iter().filter(|topic| topic.name == NAME);
    let has_fields = topics.any(|topic| {
        let definition = topic.definition.as_deref().unwrap_or_default();
        fields.iter().all(|field| definition.contains(field))
    });
    if !has_fields {
        return Ok(None);
    }
    columns(log, NAME, TYPE_NAME, fields)
}

/// [`GAPS_FIELDS`] of all gaps in the recording; `None` if the log is not from the monitor's
/// recorder.
///
/// # Errors
/// The log cannot be read.
pub fn gaps(log: &Log) -> Result<Option<[FieldRecording; 2]>, Error> {
    columns(log, GAPS, GAPS_TYPE_NAME, GAPS_FIELDS)
}

fn columns<const N: usize>(
    log: &Log,
    name: &str,
    type_name: &str,
    fields: [&str; N],
) -> Result<Option<[FieldRecording; N]>, Error> {
    if !has(log, name, type_name) {
        return Ok(None);
    }
    let requests = fields.map(|field| FieldRequest::raw(name, field));
    // losses of the topic are reported when the sensors are read
    let (columns, _) = record_fields(log, &requests, None)?;
    Ok(columns.try_into().ok())
}

/// The machine with its signals bound to the topics of a recorder's log.
pub(crate) fn bound(log: &Log, spec: &MachineSpec) -> MachineSpec {
    let is_there = |name: &String| log.topics().iter().any(|topic| topic.name == *name);
    let streams = (0..).map(joint_states).take_while(is_there);
    let mut bound = spec.clone();
    bound.signals = SignalsSpec {
        joint_states: Some(OneOrMany::Many(streams.collect())),
        imu: Some(IMU.into()).filter(is_there).map(SignalSpec::Topic),
        odometry: Some(ODOMETRY.into())
            .filter(is_there)
            .map(SignalSpec::Topic),
        tool_wrench: Some(TOOL_WRENCH.into())
            .filter(is_there)
            .map(SignalSpec::Topic),
        ..SignalsSpec::default()
    };
    bound.clock.offset.clear();
    for (linkage, stated) in bound.linkage.iter_mut().zip(&spec.linkage) {
        linkage.force = spec.force_of(stated).map(|_| field(force(&stated.name)));
        if let Some(pressure) = &mut linkage.pressure {
            pressure.piston = field(piston_pressure(&stated.name));
            pressure.rod = field(rod_pressure(&stated.name));
        }
    }
    bound
}

fn field(topic: String) -> FieldSpec {
    FieldSpec {
        topic,
        field: Some(ACTUATOR_FIELD.into()),
        joint: None,
        scale: 1.0,
        offset: 0.0,
        can: None,
    }
}

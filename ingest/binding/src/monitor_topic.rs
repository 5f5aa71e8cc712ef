//! The topics in a log of the monitor's recorder. Live writes them, offline reads them. Every
//! signal has its own topic, with the values that the monitor used: topics, scales and clock
//! offsets of the machine file are applied already.

use std::borrow::Cow;
use std::collections::BTreeMap;

use tipwatch_ingest::{Error, FieldRequest, Log, SensorRecording, record_fields};
use tipwatch_mechanics::estimation::plausibility::{Inherited, KnownPosition, SignalDoubt};
use tipwatch_mechanics::machine::{
    FieldSpec, JointFields, MachineSpec, OneOrMany, PayloadMass, PresenceSpec, SignalSpec,
    SignalsSpec, WheelSpec,
};
use tipwatch_mechanics::machine::{Proof, Proofs};

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
/// Field that states whether the sensors were contradicted in a session before. Earlier recordings lack it.
pub const CONTRADICTED_FIELD: &str = "inherited_contradiction";
/// The fields of the verdicts that tell which signals somebody trusts again since the row before: the lower and the upper half
/// of the bits, which a number holds exactly only so. Earlier recordings lack them and the next.
pub const ACKNOWLEDGED_SIGNALS_FIELDS: [&str; 2] =
    ["acknowledged_signals_low", "acknowledged_signals_high"];
/// Field of the verdicts with the signals that are doubted since they failed visibly, as bits.
pub const DOUBTED_FIELD: &str = "doubted";
/// The largest number up to which a field holds every integer: lower bits of one above it are lost.
const MOST_EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
/// Name of the topic on which the monitor describes itself and the state with which its session begins.
pub const PROGRAM: &str = "/tipwatch/program";
/// Type of its messages.
pub const PROGRAM_TYPE_NAME: &str = "tipwatch_msgs/msg/Program";
/// Field with the number of signals that the session begins by doubting. Earlier recordings lack it and the following ones.
pub const DOUBTED_COUNT_FIELD: &str = "doubted_count";
/// Lists of that many numbers: the signals, the size of the error of each, and the part of the error that motion may explain.
/// Of a joint that is not measured any more the latter is its velocity; see [`SignalDoubt`].
pub const DOUBTED_FIELDS: [&str; 3] =
    ["doubted_signals", "doubted_by", "doubted_velocity_or_moved"];
/// Name of the last list in earlier recordings, whose velocities have no sign.
const DOUBTED_MOVED_FIELD: &str = "doubted_moved";
/// Field with the number of joints that have a known position of a session before. Earlier recordings lack it and the following
/// ones.
pub const KNOWN_COUNT_FIELD: &str = "known_count";
/// The lists of that many numbers: which joints these are, when they were there (us), and where.
pub const KNOWN_FIELDS: [&str; 3] = ["known_joints", "known_stamps_us", "known_positions"];
/// Value of `event` for a verdict on a row, see [`FIELDS`].
pub const EVENT_ROW: u32 = 1;
/// Name of the topic on which the recorder reports missed messages.
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

/// Topic of the measured load of a support (N).
#[must_use]
pub fn support_load(support: &str) -> String {
    format!("/support/{support}/load")
}

/// Returns the topic of the signal that shows whether supports are set or raised, by the first of them.
#[must_use]
pub fn switch(support: &str) -> String {
    format!("/support/{support}/switch")
}

/// Topic of a load sensor (N), by its name.
#[must_use]
pub fn load_sensor(name: &str) -> String {
    format!("/load_sensor/{name}")
}

/// Returns the topic of the commanded rate of a joint (rad/s or m/s).
#[must_use]
pub fn joint_command(joint: &str) -> String {
    format!("/joint_command/{joint}")
}

/// Topic of the mass of a payload (kg), by its number in the machine file, from 1.
#[must_use]
pub fn payload_mass(number: usize) -> String {
    format!("/payload/{number}/mass")
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
pub fn verdicts(log: &Log) -> Result<Option<[SensorRecording; 4]>, Error> {
    columns(log, NAME, TYPE_NAME, FIELDS)
}

/// [`INHERITED_FIELDS`] of all recorded verdicts; `None` if the log is not from the monitor's
/// recorder, or from an earlier version of it.
///
/// # Errors
/// The log cannot be read.
pub fn inherited_alarms(log: &Log) -> Result<Option<[SensorRecording; 2]>, Error> {
    known_columns(log, INHERITED_FIELDS)
}

/// [`CONTRADICTED_FIELD`] of all recorded verdicts; `None` if the log is not from the monitor's recorder, or from an earlier
/// version of it.
///
/// # Errors
/// The log cannot be read.
pub fn inherited_contradictions(log: &Log) -> Result<Option<[SensorRecording; 1]>, Error> {
    known_columns(log, [CONTRADICTED_FIELD])
}

/// The signals that somebody trusts again, by time of the row; none if the log is not from the monitor's recorder, or from an
/// earlier version of it.
///
/// # Errors
/// The log cannot be read.
pub fn trusted_signals(log: &Log) -> Result<Vec<(i64, Proofs)>, Error> {
    let [low, high] = ACKNOWLEDGED_SIGNALS_FIELDS;
    let Some([event, low, high]) = known_columns(log, ["event", low, high])? else {
        return Ok(Vec::new());
    };
    let bits = |at: usize| low.values[at] as u64 | (high.values[at] as u64) << 32;
    let rows = (0..event.values.len()).filter(|&at| event.values[at] == f64::from(EVENT_ROW));
    let trusted = rows.map(|at| (event.stamps_ns[at], Proofs::from_bits(bits(at))));
    Ok(trusted.filter(|(_, signals)| !signals.is_empty()).collect())
}

/// The times of the rows in which the monitor doubted a signal with whose doubt its session began, but for the doubts that doubt no
/// row; none if the log is not from the monitor's recorder, or from an earlier version of it.
///
/// # Errors
/// The log cannot be read.
pub fn doubted_rows(log: &Log, inherited: &[SignalDoubt]) -> Result<Vec<i64>, Error> {
    let failed = inherited.iter().filter(|it| it.disputed().is_empty());
    let failed: Proofs = failed.map(|doubt| doubt.signal).collect();
    if failed.is_empty() {
        return Ok(Vec::new());
    }
    let Some([event, doubted]) = known_columns(log, ["event", DOUBTED_FIELD])? else {
        return Ok(Vec::new());
    };
    let is_doubted = |at: &usize| {
        let doubted = doubted.values[*at];
        let is_of_these = || {
            !Proofs::from_bits(doubted as u64)
                .shared_with(failed)
                .is_empty()
        };
        event.values[*at] == f64::from(EVENT_ROW) && (doubted > MOST_EXACT || is_of_these())
    };
    let rows = (0..event.values.len()).filter(is_doubted);
    Ok(rows.map(|at| event.stamps_ns[at]).collect())
}

/// The signals that the session begins by doubting, and the positions of joints in the session before; none if the log is not from
/// the monitor's recorder, or from an earlier version of it. Of a monitor that was restarted meanwhile only the first run counts.
///
/// # Errors
/// The log cannot be read.
pub fn inherited(log: &Log) -> Result<Inherited, Error> {
    let [signals, by, moved] = DOUBTED_FIELDS;
    let has_sign = has_fields(log, PROGRAM, &[moved]);
    let moved = if has_sign { moved } else { DOUBTED_MOVED_FIELD };
    let lists = first_lists(log, DOUBTED_COUNT_FIELD, [signals, by, moved])?.into_iter();
    let doubts = lists.filter_map(|[number, by, moved]| {
        let signal = Proof::from_number(number as u32)?;
        let moved = match has_sign {
            true => moved,
            false => SignalDoubt::moved_of_before(by, moved),
        };
        Some(SignalDoubt { signal, by, moved })
    });
    let lists = first_lists(log, KNOWN_COUNT_FIELD, KNOWN_FIELDS)?.into_iter();
    let positions = lists.map(|[joint, stamp_us, position]| KnownPosition {
        joint: joint as usize,
        stamp_ns: (stamp_us as i64).saturating_mul(1000),
        position,
    });
    Ok(Inherited {
        doubts: doubts.collect(),
        positions: positions.collect(),
    })
}

/// Returns the rows of three parallel lists of numbers, as the monitor first recorded them; `count` is the field with their
/// length.
fn first_lists(log: &Log, count: &str, lists: [&str; 3]) -> Result<Vec<[f64; 3]>, Error> {
    let counts = match has_fields(log, PROGRAM, &[count]) {
        true => columns(log, PROGRAM, PROGRAM_TYPE_NAME, [count])?,
        false => None,
    };
    let first = counts.and_then(|[counts]| counts.values.first().copied());
    let mut rows = Vec::new();
    for place in 0..first.unwrap_or(0.0) as usize {
        let fields = lists.map(|field| format!("{field}[{place}]"));
        let fields = [&*fields[0], &*fields[1], &*fields[2]];
        let numbers = columns(log, PROGRAM, PROGRAM_TYPE_NAME, fields)?;
        if let Some([Some(a), Some(b), Some(c)]) =
            numbers.map(|numbers| numbers.map(|column| column.values.first().copied()))
        {
            rows.push([a, b, c]);
        }
    }
    Ok(rows)
}

/// Fields of the verdicts, if the definition of the topic has them.
fn known_columns<const N: usize>(
    log: &Log,
    fields: [&str; N],
) -> Result<Option<[SensorRecording; N]>, Error> {
    match has_fields(log, NAME, &fields) {
        true => columns(log, NAME, TYPE_NAME, fields),
        false => Ok(None),
    }
}

/// Whether the definition of a topic has these fields.
fn has_fields(log: &Log, name: &str, fields: &[&str]) -> bool {
    let mut topics = log.topics().iter().filter(|topic| topic.name == name);
    topics.any(|topic| {
        let definition = topic.definition.as_deref().unwrap_or_default();
        fields.iter().all(|field| definition.contains(field))
    })
}

/// [`GAPS_FIELDS`] of all gaps in the recording; `None` if the log is not from the monitor's
/// recorder.
///
/// # Errors
/// The log cannot be read.
pub fn gaps(log: &Log) -> Result<Option<[SensorRecording; 2]>, Error> {
    columns(log, GAPS, GAPS_TYPE_NAME, GAPS_FIELDS)
}

fn columns<const N: usize>(
    log: &Log,
    name: &str,
    type_name: &str,
    fields: [&str; N],
) -> Result<Option<[SensorRecording; N]>, Error> {
    if !has(log, name, type_name) {
        return Ok(None);
    }
    let requests = fields.map(|field| FieldRequest::raw(name, field));
    // losses of the topic are reported when the sensors are read
    let (columns, _) = record_fields(log, &requests, None)?;
    Ok(columns.try_into().ok())
}

/// The machine with its signals bound to the topics of a recorder's log; of another log, as it is.
#[must_use]
pub fn bound<'s>(log: &Log, spec: &'s MachineSpec) -> Cow<'s, MachineSpec> {
    if !is_in(log) {
        return Cow::Borrowed(spec);
    }
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
        wheels: spec.signals.wheels.clone(),
        load_sums: spec.signals.load_sums.clone(),
        joints: commands_alone(&spec.signals),
        frames: BTreeMap::new(),
    };
    bound.clock.offset.clear();
    for (linkage, stated) in bound.linkage.iter_mut().zip(&spec.linkage) {
        linkage.force = spec.force_of(stated).map(|_| field(force(&stated.name)));
        if let Some(pressure) = &mut linkage.pressure {
            pressure.piston = field(piston_pressure(&stated.name));
            pressure.rod = field(rod_pressure(&stated.name));
        }
    }
    let names: Vec<String> = spec.wheels.keys().cloned().collect();
    for switch in spec.support_switches() {
        let topic = self::switch(&names[switch.supports[0].index()]);
        for support in &switch.supports {
            let wheel = bound.wheels.get_mut(&names[support.index()]);
            if let Some(PresenceSpec::Signal(told)) = wheel.and_then(WheelSpec::told_mut) {
                told.number = field(topic.clone());
            }
        }
    }
    for (name, wheel) in &mut bound.wheels {
        if let Some(load) = &mut wheel.origin.force {
            load.field = field(support_load(name));
        }
    }
    for (joint, command) in bound.signals.command_fields_mut() {
        *command = field(joint_command(joint));
    }
    for (name, load) in bound.signals.load_fields_mut() {
        *load = field(load_sensor(&name));
    }
    for (index, payload) in bound.payload.iter_mut().enumerate() {
        if let PayloadMass::Signal(mass) = &mut payload.mass {
            mass.signal = field(payload_mass(index + 1));
        }
    }
    // recordings of earlier versions have neither
    let signals = &mut bound.signals;
    (signals.wheels).retain(|_, fields| is_there(&fields.load.topic));
    (signals.load_sums).retain(|fields| is_there(&fields.load.topic));
    (signals.joints).retain(|_, fields| {
        let command = fields.command.as_ref();
        command.is_some_and(|command| is_there(&command.topic))
    });
    Cow::Owned(bound)
}

/// Returns the joints with commanded rates, without the fields that the recorder's joint states hold.
fn commands_alone(signals: &SignalsSpec) -> BTreeMap<String, JointFields> {
    let joints = signals.joints.iter().filter_map(|(name, fields)| {
        let alone = JointFields {
            position: None,
            velocity: None,
            effort: None,
            command: Some(fields.command.clone()?),
        };
        Some((name.clone(), alone))
    });
    joints.collect()
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

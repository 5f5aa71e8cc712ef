//! Loads a log: the machine checked against it, and the samples of its sensors.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;

use anyhow::{Result, bail};
use rayon::prelude::*;
use tipwatch_binding::{MachineFile, bind, monitor_topic};
use tipwatch_ingest::{Log, Losses, SensorBlock, SensorRequest, TopicId, read_sensor_blocks};
use tipwatch_language::{message, say, told};
use tipwatch_mechanics::estimation::plausibility::{Inherited, Part};
use tipwatch_mechanics::machine::{Machine, Proofs};
use tipwatch_mechanics::state::{JointStream, MatchedSensors, NumberKind, Sample, Sensor, Sensors};

use super::arrivals::for_each_arrival;
use super::held_forces::HeldForces;
use super::recording::Recording;
use super::sample_store::{Expected, SampleStore};
use super::span::{self, RecordingSpan};
use super::standing::Standing;
use super::supports::{self, SupportTimeline};
use crate::base::file_hash::{FileHash, hash_of};
use crate::base::options::Estimator;

/// Most values of samples that stay in memory: a quarter of an hour of a usual machine, 32 MB.
const MOST_IN_MEMORY: usize = 4 << 20;

/// A machine and the samples of its sensors in a log.
#[derive(Debug)]
pub struct LoadedLog {
    /// The machine, checked against the log.
    pub machine: Machine,
    /// Hash of its URDF.
    pub urdf: FileHash,
    /// Text of its URDF.
    pub urdf_text: String,
    /// The sensors, in the order of [`LoadedLog::signals`].
    pub matched: MatchedSensors,
    /// Each sensor's topic and samples.
    pub signals: Arc<Vec<Signal>>,
    /// Topic and samples of each signal from which the state is not estimated: those that tell which supports are on the ground,
    /// load sensors.
    pub beside: Vec<Signal>,
    /// Parts of the log that were lost.
    pub losses: Losses,
    /// Clock offsets (s) from the machine file, by topic; already applied.
    pub clock_offsets_s: BTreeMap<String, f64>,
    /// Bound signals that are missing from the log, as sentences.
    pub notes: Vec<String>,
    /// The time that the recording covers, by the times of the log.
    pub span: RecordingSpan,
    /// Supports on the ground over time; `None` if they are always the same.
    pub(crate) supports: Option<SupportTimeline>,
    /// Doubts about signals of the monitor that recorded the log.
    pub(crate) signal_doubts: SignalDoubts,
    /// Forces of supports that are measured too slowly for the estimator.
    pub(super) held_forces: HeldForces,
}

/// Doubts of a monitor about signals that fail visibly, where it recorded the log.
#[derive(Debug, Default)]
pub(crate) struct SignalDoubts {
    /// Those that the session took over from the one before.
    pub(crate) inherited: Inherited,
    /// Signals that somebody trusted again, by time of the row (ns), in order.
    pub(crate) trusted: Vec<(i64, Proofs)>,
}

impl LoadedLog {
    /// Visits all samples in the order in which the recorder received them, as live.
    ///
    /// # Errors
    /// Samples cannot be read from their temporary file.
    pub fn for_each_arrival(&self, mut visit: impl FnMut(&Sample<'_>)) -> Result<()> {
        let signals: Vec<&Signal> = self.signals.iter().chain(&self.beside).collect();
        let recordings: Vec<&Recording> = signals.iter().map(|s| &s.recording).collect();
        for_each_arrival(&recordings, |signal, sample, values| {
            let signal = signals[signal];
            visit(&Sample::new(
                signal.sensor,
                signal.recording.stamps_ns[sample],
                values,
            ));
        })?;
        self.check_read()
    }

    /// The first stamp of a sensor (ns), from which the spans of time of the machine file count.
    pub(crate) fn start_ns(&self) -> Option<i64> {
        let recordings = self.signals.iter().map(|signal| &signal.recording);
        let starts = recordings.filter_map(|recording| recording.stamps_ns.iter().min());
        starts.min().copied()
    }

    /// The machine on the supports that are on the ground at a time.
    pub(crate) fn standing(&self) -> Standing<'_> {
        Standing::of(&self.machine, self.supports.as_ref())
    }

    /// Frees the memory of the samples, all but their stamps, unless somebody else still reads them.
    pub(crate) fn forget_samples(&mut self) {
        let signals = Arc::get_mut(&mut self.signals).into_iter().flatten();
        for signal in signals.chain(&mut self.beside) {
            signal.recording.forget_samples();
        }
    }

    /// Checks that no [`SampleReader`](super::SampleReader) has failed so far.
    ///
    /// # Errors
    /// Samples could not be read from their temporary file.
    pub fn check_read(&self) -> Result<()> {
        let signals = self.signals.iter().chain(&self.beside);
        let failures = signals.map(|s| (s, s.recording.failure()));
        match failures
            .filter_map(|(s, failure)| Some((s, failure?)))
            .next()
        {
            Some((signal, failure)) => bail!(
                "topic {}: expected its samples in a temporary file, found that it cannot be read: {failure}",
                signal.topic
            ),
            None => Ok(()),
        }
    }
}

/// A sensor, its topic and its samples.
#[derive(Debug, Clone)]
pub struct Signal {
    /// The sensor.
    pub sensor: Sensor,
    /// "joint_states", "imu", "odometry", "tool_wrench" or "actuator".
    pub name: &'static str,
    /// The name that tells it from the others: "imu", "actuator.lift", or "joint_states.lift" where the joints have several
    /// topics.
    pub subject: String,
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Reason why this topic was chosen.
    pub why: String,
    /// The samples.
    pub recording: Recording,
}

/// Reads the samples of a machine's sensors from a log. Those of a long log go to temporary files.
///
/// Velocities that a driver fills with zeros are left out: for the smoother, which knows the whole log, from the first sample on;
/// else from the sample on that shows the motion, as live. For the smoother the repeats of held values are left out, too, and the
/// joints of one message that are measured at other instants than the rest become a signal of their own.
///
/// # Errors
/// The machine does not fit the log, a signal is missing or ambiguous, the log cannot be read, or a temporary file
/// cannot be written.
pub fn load(
    log: &Log,
    file: &MachineFile,
    estimator: Estimator,
    progress: &mut dyn FnMut(u64),
) -> Result<LoadedLog> {
    load_within(log, file, estimator, MOST_IN_MEMORY, progress)
}

/// Loads a log as [`load`] does, with at most `most_in_memory` values in memory.
///
/// # Errors
/// As for [`load`].
pub fn load_within(
    log: &Log,
    file: &MachineFile,
    estimator: Estimator,
    most_in_memory: usize,
    progress: &mut dyn FnMut(u64),
) -> Result<LoadedLog> {
    let urdf = file.urdf(None, Some(log))?;
    let bound = bind(log, &file.spec, &urdf.text, &urdf.name)?;
    let requests: Vec<SensorRequest> = bound.all().map(|b| b.request.clone()).collect();
    let expected = bound.all().map(|sensor| {
        let topic = log.topic(sensor.request.topic).ok();
        Expected {
            messages: topic.and_then(|topic| topic.message_count).unwrap_or(0),
            joints: (bound.matched.sensors.joints_of(sensor.sensor)).map(<[usize]>::len),
        }
    });
    let mut samples = SampleStore::new(expected.collect(), most_in_memory);
    let mut take = |block: &SensorBlock<'_>| samples.take(block);
    let (readings, losses) = read_sensor_blocks(log, &requests, &mut take, progress)?;
    let samples = samples.finish()?;
    let topics: Vec<TopicId> = readings.iter().map(|reading| reading.topic).collect();
    let used = topics[..bound.sensors.len()].to_vec();
    let recordings = readings.into_par_iter().zip(samples);
    let recordings = recordings.map(|(reading, samples)| Recording::new(reading, samples));
    let recordings: Vec<Recording> = recordings.collect::<io::Result<_>>()?;
    let (mut signals, mut beside) = (Vec::with_capacity(recordings.len()), Vec::new());
    let mut matched = bound.matched;
    let sensors = bound.sensors.into_iter().chain(bound.beside);
    for (place, ((sensor, topic), mut recording)) in sensors.zip(topics).zip(recordings).enumerate()
    {
        let topic = log.topic(topic)?;
        let is_used = place < used.len();
        let joints = (matched.sensors.joints_of(sensor.sensor)).map(<[usize]>::to_vec);
        if estimator == Estimator::Smoother {
            recording.leave_out_filled_velocities()?;
        }
        if let Some(&offset_s) = bound.clock_offsets_s.get(&topic.name) {
            recording.shift(offset_s);
        }
        if recording.stamps_ns.is_empty() && joints.is_some() {
            let refusal = recording.reading.refusal().map(ToString::to_string);
            bail!(
                "{}: topic {}: expected joint states, found {}",
                log.path().display(),
                topic.name,
                refusal.as_deref().unwrap_or("no readable message")
            );
        }
        let signal = |sensor_of_part, recording| Signal {
            sensor: sensor_of_part,
            name: sensor.request.kind.signal_key(),
            subject: String::new(),
            topic: topic.name.clone(),
            type_name: topic.type_name.clone(),
            why: sensor.why.clone(),
            recording,
        };
        if !is_used {
            beside.push(signal(sensor.sensor, recording));
            continue;
        }
        if estimator == Estimator::Causal {
            signals.push(signal(sensor.sensor, recording));
            continue;
        }
        let number = joints.as_ref().map(Vec::len);
        let mut is_first = true;
        for (places, recording) in recording.without_repeats(number)? {
            let of_part = match (&joints, sensor.sensor) {
                (Some(joints), Sensor::Joints(stream)) => {
                    let joints = places.iter().map(|&place| joints[place]).collect();
                    Sensor::Joints(put_stream(&mut matched, stream, is_first, joints))
                }
                _ => sensor.sensor,
            };
            is_first = false;
            signals.push(signal(of_part, recording));
        }
    }
    if signals
        .iter()
        .any(|signal| signal.recording.held_values().is_some())
    {
        put_fastest_stream_first(&mut matched, &mut signals);
    }
    for signal in signals.iter_mut().chain(&mut beside) {
        signal.subject = subject(signal.sensor, signal.name, &matched.sensors, &bound.machine);
    }
    let mut machine = bound.machine;
    if estimator == Estimator::Causal {
        machine.weigh_payloads_by_row();
    }
    let mut loaded = LoadedLog {
        machine,
        urdf: hash_of(urdf.name, urdf.text.as_bytes()),
        urdf_text: urdf.text,
        matched,
        signals: Arc::new(signals),
        beside,
        losses,
        clock_offsets_s: bound.clock_offsets_s,
        notes: bound.notes,
        span: span::of(log, &used)?,
        supports: None,
        signal_doubts: SignalDoubts {
            inherited: monitor_topic::inherited(log)?,
            trusted: monitor_topic::trusted_signals(log)?,
        },
        held_forces: HeldForces::default(),
    };
    let of_signals = (loaded.signals.iter()).map(|signal| (signal.sensor, &signal.recording));
    loaded.held_forces = HeldForces::of(&loaded.machine, &loaded.matched.sensors, of_signals);
    let mut readings = (loaded.signals.iter()).map(|signal| &signal.recording.reading);
    loaded.supports = supports::read(
        log,
        file,
        &loaded.machine,
        loaded.start_ns(),
        readings.next().map(|reading| &reading.time_base),
    );
    loaded.notes.extend(unmeasured(&loaded.signals));
    loaded.notes.extend(filled_velocities(&loaded));
    loaded.notes.extend(held_values(&loaded));
    if let Some(timeline) = &loaded.supports {
        loaded.notes.extend_from_slice(&timeline.notes);
    }
    Ok(loaded)
}

/// Returns the name that identifies a sensor among the others: its key, with the names of its joints or of its actuator.
fn subject(sensor: Sensor, key: &str, sensors: &Sensors, machine: &Machine) -> String {
    match sensor {
        Sensor::Joints(_) if sensors.joints.len() > 1 => {
            let joints = sensors.joints_of(sensor).unwrap_or_default();
            let names = joints
                .iter()
                .map(|&joint| machine.joints()[joint].name.as_str());
            format!("{key}.{}", names.collect::<Vec<_>>().join(", "))
        }
        Sensor::Number(NumberKind::Actuator, index) => {
            let signal = sensors.actuators.get(index);
            let joint = signal.map(|signal| &machine.contact().actuated_joints[signal.joint]);
            let name = joint.map_or("", |joint| joint.name(machine.linkages()));
            format!("{key}.{}", name.to_lowercase())
        }
        Sensor::Number(NumberKind::Switch, index) => format!("switch.{index}"),
        Sensor::Number(NumberKind::Load | NumberKind::Payload | NumberKind::Force, _) => {
            Part::Number.subject(sensor, machine)
        }
        Sensor::Number(NumberKind::Command, index) => {
            let joint = machine.joint_commands()[index].joint;
            format!("command.{}", machine.joints()[joint].name)
        }
        _ => key.into(),
    }
}

/// The joints whose velocity a driver fills with zeros, as a sentence for each topic.
fn filled_velocities(loaded: &LoadedLog) -> Vec<String> {
    let of_topic = |signal: &Signal| {
        let joints = loaded.matched.sensors.joints_of(signal.sensor)?;
        let name = |place: usize| Some(loaded.machine.joints()[*joints.get(place)?].name.as_str());
        let names: Vec<&str> = (signal.recording.filled_velocities())
            .filter_map(name)
            .collect();
        (!names.is_empty()).then(|| {
            say!(
                "Topic {}: velocity exactly 0 in every message, while the position moves: {}. Such velocities are treated as not \
                 measured; they follow from the positions.",
                signal.topic,
                names.join(", ")
            )
        })
    };
    loaded.signals.iter().filter_map(of_topic).collect()
}

/// The values that are held between two measurements, as a sentence for each topic.
fn held_values(loaded: &LoadedLog) -> Vec<String> {
    // by topic and by period and interval (ms)
    let mut of_topics: BTreeMap<&str, BTreeMap<[i64; 2], Vec<&str>>> = BTreeMap::new();
    for signal in loaded.signals.iter() {
        let Some(held) = signal.recording.held_values() else {
            continue;
        };
        let rate = [held.period_ns, held.interval_ns].map(|ns| ns / 1_000_000);
        let of_topic = of_topics.entry(&signal.topic).or_default();
        let of_rate = of_topic.entry(rate).or_default();
        match loaded.matched.sensors.joints_of(signal.sensor) {
            Some(joints) => {
                of_rate.extend(
                    joints
                        .iter()
                        .map(|&joint| loaded.machine.joints()[joint].name.as_str()),
                );
            }
            None => of_rate.push(&signal.subject),
        }
    }
    let at_rate = |([period_ms, interval_ms], names): ([i64; 2], Vec<&str>)| {
        say!(
            "{} (a measurement every {period_ms} ms, a message every {interval_ms} ms)",
            names.join(", ")
        )
    };
    let sentence = |(topic, rates): (&str, BTreeMap<[i64; 2], Vec<&str>>)| {
        let rates: Vec<String> = rates.into_iter().map(at_rate).collect();
        say!(
            "Topic {topic}: values are held until the next measurement: {}. The repeats between measurements are left out.",
            rates.join("; ")
        )
    };
    of_topics.into_iter().map(sentence).collect()
}

/// Makes a stream of these joints: in the place of the one that they are of if they are its first part, else a further one. Returns
/// its index.
fn put_stream(
    matched: &mut MatchedSensors,
    of: usize,
    is_first: bool,
    joints: Vec<usize>,
) -> usize {
    let part = JointStream { joints };
    if is_first {
        matched.sensors.joints[of] = part;
        return of;
    }
    matched.sensors.joints.push(part);
    matched.streams.push(matched.streams[of]);
    matched.sensors.joints.len() - 1
}

/// Rows are computed at the samples of the first stream of joints: the one with most samples, of those that are left.
fn put_fastest_stream_first(matched: &mut MatchedSensors, signals: &mut [Signal]) {
    let is_stream = |signal: &Signal| matches!(signal.sensor, Sensor::Joints(_));
    let streams = signals.iter().filter(|signal| is_stream(signal)).count();
    signals.sort_by_key(|signal| match signal.sensor {
        Sensor::Joints(_) => (0, std::cmp::Reverse(signal.recording.len())),
        _ => (1, std::cmp::Reverse(0)),
    });
    let before = matched.clone();
    for (stream, signal) in signals[..streams].iter_mut().enumerate() {
        if let Sensor::Joints(was) = signal.sensor {
            matched.sensors.joints[stream] = before.sensors.joints[was].clone();
            matched.streams[stream] = before.streams[was];
            signal.sensor = Sensor::Joints(stream);
        }
    }
}

/// The quantities of an IMU without which no wheel load is computed, each with the place of its values in a sample and its key.
const NEEDED_OF_IMU: [(&str, std::ops::Range<usize>, &str); 2] = [
    (message!("specific force"), 0..3, "specific_force"),
    (message!("angular velocity"), 3..6, "angular_velocity"),
];

/// Quantities that no message of an IMU gives, as sentences: its driver marks them as not measured. That is no fault of the sensor.
fn unmeasured(signals: &[Signal]) -> Vec<String> {
    let imus = signals
        .iter()
        .filter(|s| s.sensor == Sensor::Imu && !s.recording.is_empty());
    let of_imu = |imu: &Signal| {
        let is_missing = |values: std::ops::Range<usize>| {
            let mut reader = imu.recording.reader();
            let mut samples = 0..imu.recording.len();
            samples.all(|at| reader.sample(at)[values.clone()].iter().all(|v| v.is_nan()))
        };
        let missing = NEEDED_OF_IMU
            .into_iter()
            .filter(|(_, values, _)| is_missing(values.clone()));
        let notes = missing.map(|(quantity, _, key)| {
            say!(
                "Topic {}: no message gives the {}; a first covariance of -1 marks it as not measured (REP 145). Without it no \
                 wheel loads are computed; only what the attitude shows is told: tilt, and rotation about an edge. If another topic \
                 measures it, bind it as {key} in [signals.imu].",
                imu.topic,
                told(quantity)
            )
        });
        notes.collect::<Vec<String>>()
    };
    imus.flat_map(of_imu).collect()
}

//! Loads a log: the machine checked against it, and the samples of its sensors.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, arrivals, bind};
use tipwatch_ingest::{Log, Losses, SensorRecording};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{MatchedSensors, Sample, Sensor};

use crate::base::file_hash::{FileHash, hash_of};

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
    /// Parts of the log that were lost.
    pub losses: Losses,
    /// Clock offsets (s) from the machine file, by topic; already applied.
    pub clock_offsets_s: BTreeMap<String, f64>,
    /// Bound signals that are missing from the log, as sentences.
    pub notes: Vec<String>,
}

impl LoadedLog {
    /// All samples in the order in which the recorder received them, as live.
    pub fn arrivals(&self) -> impl Iterator<Item = Sample<'_>> {
        let signals: Vec<_> = self
            .signals
            .iter()
            .map(|signal| (signal.sensor, &signal.recording))
            .collect();
        arrivals(signals).map(|(sample, _)| sample)
    }
}

/// A sensor, its topic and its samples.
#[derive(Debug)]
pub struct Signal {
    /// Which sensor.
    pub sensor: Sensor,
    /// "joint_states", "imu", "odometry", "tool_wrench" or "actuator".
    pub name: &'static str,
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Why this topic was chosen.
    pub why: String,
    /// The samples.
    pub recording: SensorRecording,
}

/// Reads the samples of a machine's sensors from a log.
///
/// # Errors
/// The machine does not fit the log, a signal is missing or ambiguous, or the log cannot be read.
pub fn load(log: &Log, file: &MachineFile, progress: &mut dyn FnMut(u64)) -> Result<LoadedLog> {
    let urdf = file.urdf(None, Some(log))?;
    let bound = bind(log, &file.spec, &urdf.text, &urdf.name)?;
    let (recordings, losses) = bound.record(log, progress)?;
    let mut signals = Vec::with_capacity(recordings.len());
    for (sensor, recording) in bound.sensors.into_iter().zip(recordings) {
        let topic = log.topic(recording.topic)?;
        if recording.stamps_ns.is_empty() && matches!(sensor.sensor, Sensor::Joints(_)) {
            let refusal = recording.refusal().map(ToString::to_string);
            bail!(
                "{}: topic {}: expected joint states, found {}",
                log.path().display(),
                topic.name,
                refusal.as_deref().unwrap_or("no readable message")
            );
        }
        signals.push(Signal {
            sensor: sensor.sensor,
            name: sensor.request.kind.signal_key(),
            topic: topic.name.clone(),
            type_name: topic.type_name.clone(),
            why: sensor.why,
            recording,
        });
    }
    Ok(LoadedLog {
        machine: bound.machine,
        urdf: hash_of(urdf.name, urdf.text.as_bytes()),
        urdf_text: urdf.text,
        matched: bound.matched,
        signals: Arc::new(signals),
        losses,
        clock_offsets_s: bound.clock_offsets_s,
        notes: bound.notes,
    })
}

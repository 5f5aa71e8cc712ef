//! From a log and a machine file to a checked machine and its sensors' samples.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};
use tipwatch_binding::{arrivals, bind};
use tipwatch_ingest::{
    Log, Losses, SensorRecording, SensorRequest, record_sensors, robot_description,
};
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec};
use tipwatch_mechanics::signal::{MatchedSensors, Sample, Sensor};

use crate::provenance::FileHash;

/// A machine file as read.
#[derive(Debug, Clone)]
pub struct MachineFile {
    /// Where it is.
    pub path: PathBuf,
    /// What it says.
    pub spec: MachineSpec,
    /// Its hash.
    pub hash: FileHash,
}

impl MachineFile {
    /// Reads a machine file.
    ///
    /// # Errors
    /// The file cannot be read, or is no machine file.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        Self::from_text(path, &text)
    }

    /// A machine file from its text; `path` tells where its URDF is looked for.
    ///
    /// # Errors
    /// The text is no machine file.
    pub fn from_text(path: &Path, text: &str) -> Result<Self> {
        let name = path.display().to_string();
        let spec = MachineSpec::from_toml(text, &name)?;
        Ok(Self {
            path: path.into(),
            spec,
            hash: hash_of(name, text.as_bytes()),
        })
    }

    /// The URDF beside the machine file, else the one in the log.
    fn urdf(&self, log: Option<&Log>) -> Result<Urdf> {
        if let Some(name) = &self.spec.urdf {
            let path = self.path.parent().unwrap_or(Path::new("")).join(name);
            let text = std::fs::read_to_string(&path).with_context(|| {
                format!(
                    "{}: urdf = \"{name}\": {} cannot be read",
                    self.path.display(),
                    path.display()
                )
            })?;
            let name = path.display().to_string();
            return Ok(Urdf {
                hash: hash_of(name.clone(), text.as_bytes()),
                name,
                text,
            });
        }
        let described = log.map(robot_description).transpose()?.flatten();
        let Some((text, topic)) = described else {
            bail!(
                "{}: expected urdf = \"...\" in the machine file or a topic /robot_description in the log, found neither",
                self.path.display()
            );
        };
        let name = format!("topic {topic}");
        Ok(Urdf {
            hash: hash_of(name.clone(), text.as_bytes()),
            name,
            text,
        })
    }

    /// The machine without a log: every joint counts as measured that no linkage moves.
    ///
    /// # Errors
    /// The machine file or its URDF does not describe a machine.
    pub fn check_alone(&self) -> Result<Machine> {
        let urdf = self.urdf(None)?;
        Ok(self
            .spec
            .check(&urdf.text, &urdf.name, LogFacts::default())?)
    }
}

struct Urdf {
    name: String,
    text: String,
    hash: FileHash,
}

/// A machine and the samples of its sensors in a log.
#[derive(Debug)]
pub struct LoadedLog {
    /// The machine as checked against the log.
    pub machine: Machine,
    /// The hash of its URDF.
    pub urdf: FileHash,
    /// The sensors, in the order of [`LoadedLog::signals`].
    pub matched: MatchedSensors,
    /// Each sensor's topic and samples.
    pub signals: Vec<Signal>,
    /// What of the log was lost.
    pub losses: Losses,
}

impl LoadedLog {
    /// All samples in the order in which the recorder received them.
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
    /// Its place among the sensors.
    pub sensor: Sensor,
    /// "joint_states", "imu", "odometry" or "tool_wrench".
    pub name: &'static str,
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Why this topic.
    pub why: String,
    /// The samples.
    pub recording: SensorRecording,
}

/// Reads the samples of a machine's sensors from a log.
///
/// # Errors
/// The machine does not fit the log, a signal is missing or ambiguous, or the log cannot be read.
pub fn load(log: &Log, file: &MachineFile, progress: &mut dyn FnMut(u64)) -> Result<LoadedLog> {
    let urdf = file.urdf(Some(log))?;
    let bound = bind(log, &file.spec, &urdf.text, &urdf.name)?;
    let requests: Vec<SensorRequest> = bound.sensors.iter().map(|b| b.request.clone()).collect();
    let (recordings, losses) = record_sensors(log, &requests, progress)?;
    let mut signals = Vec::with_capacity(recordings.len());
    for (bound, recording) in bound.sensors.into_iter().zip(recordings) {
        let topic = log.topic(recording.topic)?;
        if recording.stamps_ns.is_empty() && matches!(bound.sensor, Sensor::Joints(_)) {
            bail!(
                "{}: topic {}: expected joint states, found no readable message",
                log.path().display(),
                topic.name
            );
        }
        signals.push(Signal {
            sensor: bound.sensor,
            name: bound.request.kind.signal_key(),
            topic: topic.name.clone(),
            type_name: topic.type_name.clone(),
            why: bound.why,
            recording,
        });
    }
    Ok(LoadedLog {
        machine: bound.machine,
        urdf: urdf.hash,
        matched: bound.matched,
        signals,
        losses,
    })
}

/// The hash of bytes that stand under `path`.
pub(crate) fn hash_of(path: String, bytes: &[u8]) -> FileHash {
    FileHash {
        path,
        sha256: hex(&Sha256::digest(bytes)),
        bytes: bytes.len() as u64,
    }
}

/// The hash of a file, read piece by piece.
pub(crate) fn hash_file(path: &Path) -> Result<FileHash> {
    let mut file =
        std::fs::File::open(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let (mut hasher, mut buffer, mut bytes) = (Sha256::new(), vec![0; 1 << 18], 0);
    loop {
        let read = file
            .read(&mut buffer)
            .with_context(|| format!("{}: cannot be read", path.display()))?;
        if read == 0 {
            break;
        }
        hasher.update(&buffer[..read]);
        bytes += read as u64;
    }
    Ok(FileHash {
        path: path.display().to_string(),
        sha256: hex(&hasher.finalize()),
        bytes,
    })
}

fn hex(bytes: &[u8]) -> String {
    use std::fmt::Write;
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

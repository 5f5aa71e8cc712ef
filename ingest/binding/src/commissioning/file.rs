//! File of a commissioning: the machine it is of, and its result.
//!
//! The file is JSON. Its `seal` is the SHA-256 of everything else in the file: a change by accident or by hand is noticed. The
//! seal is no protection against somebody who computes it anew.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use tipwatch_calibration::commissioning::{Assessment, Status};
use tipwatch_language::{message, say};
use tipwatch_mechanics::machine::{Commissioned, Machine, Proof};

use crate::files::read_text;
use crate::files::sha256;
use crate::machine_file::{MachineFile, Urdf};

/// Version of the file. Version 1 does not say when its drive was recorded, and none before 3 at which positions it has shown a joint:
/// these prove no joint.
const SCHEMA: u32 = 3;
const OLDEST_SCHEMA: u32 = 1;
const FIRST_WITH_RANGES: u32 = 3;

/// A commissioning of one machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Commissioning {
    /// Version of the file.
    pub schema: u32,
    /// Name of the machine.
    pub machine: String,
    /// SHA-256 of the text of the machine file, hexadecimal.
    pub machine_file_sha256: String,
    /// SHA-256 of the text of the URDF, hexadecimal.
    pub urdf_sha256: String,
    /// Version of the program.
    pub tipwatch_version: String,
    /// The log, or "live session" with its identity.
    pub source: String,
    /// SHA-256 of the log, hexadecimal; for a live session, of its samples in order of arrival.
    pub source_sha256: String,
    /// Time at which the result was written (UTC, RFC 3339).
    pub made_at: String,
    /// Stamp of the first sample of the drive (ns since 1970, where the sensors know the time of day). A result can be made from
    /// an old drive: this is how old it is. `None` in a file of version 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recorded_from_ns: Option<i64>,
    /// Length of the recording (s).
    pub duration_s: f64,
    /// The result, item by item.
    pub items: Vec<CommissioningItem>,
    /// Faults that would explain the contradictions.
    pub explanations: Vec<String>,
    /// SHA-256 of this file with an empty seal, hexadecimal.
    pub seal: String,
}

/// One item of the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommissioningItem {
    /// Stable name.
    pub key: String,
    /// "proven", "confirmed", "contradicted" or "not_shown".
    pub status: String,
    /// The compared figure.
    pub value: Option<f64>,
    /// Its standard deviation.
    pub sigma: Option<f64>,
    /// Expected value.
    pub expected: Option<f64>,
    /// Standard deviations by which the nearest alternative is excluded.
    pub excluded_sigmas: Option<f64>,
    /// Least and greatest position of a joint at which the item was shown (rad or m); `None` for other items.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Evidence, likely correction, or missing motion.
    pub text: String,
}

/// Origin of a result.
#[derive(Debug, Clone)]
pub struct CommissioningSource {
    /// The log, or "live session" with its identity.
    pub name: String,
    /// SHA-256 of the log or of the samples, hexadecimal.
    pub sha256: String,
    /// Version of the program.
    pub tipwatch_version: String,
    /// The time (UTC, RFC 3339).
    pub made_at: String,
    /// Stamp of the first sample of the drive (ns).
    pub recorded_from_ns: Option<i64>,
}

/// Error: a commissioning cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CommissioningError {
    /// The file cannot be read.
    #[error("{}: cannot be read; without it remove the key commissioning of the machine file, or make it with check-machine", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file is not the result of a commissioning.
    #[error("{}: not the result of a commissioning", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Error of the JSON parser.
        source: serde_json::Error,
    },
    /// The file was changed.
    #[error("{}: expected the seal of its content, found another: the file was changed after the commissioning", path.display())]
    Seal {
        /// The file.
        path: PathBuf,
    },
    /// The file is of another machine, or the machine has changed since.
    #[error("{}: expected a commissioning of this {what}, found one of another: commission the machine again, or use the file with which it was commissioned", path.display())]
    OtherMachine {
        /// The file.
        path: PathBuf,
        /// "machine file" or "URDF".
        what: &'static str,
    },
    /// The commissioning contradicts the machine file.
    #[error("{}: expected a commissioning without contradictions, found: {text}", path.display())]
    Contradicted {
        /// The file.
        path: PathBuf,
        /// The contradicted items.
        text: String,
    },
}

impl Commissioning {
    /// The result of a commissioning of the machine of this file.
    #[must_use]
    pub fn new(
        file: &MachineFile,
        urdf: &Urdf,
        source: CommissioningSource,
        assessment: &Assessment,
    ) -> Self {
        let items = assessment.items.iter().map(|item| CommissioningItem {
            key: item.key.clone(),
            status: item.status.to_string(),
            value: item.figure.map(|figure| figure.value),
            sigma: item.figure.map(|figure| figure.sigma),
            expected: item.figure.map(|figure| figure.expected),
            excluded_sigmas: item.sigmas,
            range: item.range,
            text: item.text.clone(),
        });
        let mut made = Self {
            schema: SCHEMA,
            machine: file.spec.name.clone(),
            machine_file_sha256: sha256(file.text.as_bytes()),
            urdf_sha256: sha256(urdf.text.as_bytes()),
            tipwatch_version: source.tipwatch_version,
            source: source.name,
            source_sha256: source.sha256,
            made_at: source.made_at,
            recorded_from_ns: source.recorded_from_ns,
            duration_s: assessment.duration_s,
            items: items.collect(),
            explanations: assessment.explanations.clone(),
            seal: String::new(),
        };
        made.seal = made.expected_seal();
        made
    }

    /// The text of the file.
    #[must_use]
    pub fn to_json(&self) -> String {
        // A document of strings and numbers has a text.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    fn expected_seal(&self) -> String {
        let unsealed = Self {
            seal: String::new(),
            ..self.clone()
        };
        sha256(unsealed.to_json().as_bytes())
    }

    /// Reads a file and checks its seal.
    ///
    /// # Errors
    /// The file cannot be read, is not a result of a commissioning, or was changed.
    pub fn read(path: &Path) -> Result<Self, CommissioningError> {
        let text = read_text(path).map_err(|source| CommissioningError::Read {
            path: path.into(),
            source,
        })?;
        let found: Self =
            serde_json::from_str(&text).map_err(|source| CommissioningError::Parse {
                path: path.into(),
                source,
            })?;
        if !(OLDEST_SCHEMA..=SCHEMA).contains(&found.schema) || found.seal != found.expected_seal()
        {
            return Err(CommissioningError::Seal { path: path.into() });
        }
        Ok(found)
    }

    /// Checks that the commissioning is of this machine and contradicts nothing.
    ///
    /// # Errors
    /// The commissioning is of another machine file or URDF, or is contradicted.
    pub fn check(
        &self,
        path: &Path,
        file: &MachineFile,
        urdf: &Urdf,
    ) -> Result<(), CommissioningError> {
        let texts = [
            ("machine file", &file.text, &self.machine_file_sha256),
            ("URDF", &urdf.text, &self.urdf_sha256),
        ];
        if let Some((what, ..)) = texts
            .iter()
            .find(|(_, text, hash)| sha256(text.as_bytes()) != **hash)
        {
            return Err(CommissioningError::OtherMachine {
                path: path.into(),
                what,
            });
        }
        let contradicted = self.with_status(Status::Contradicted);
        match contradicted.first() {
            None => Ok(()),
            Some(first) => Err(CommissioningError::Contradicted {
                path: path.into(),
                text: match contradicted.len() {
                    1 => format!("{}: {}", first.key, first.text),
                    more => format!("{}: {} (and {} more)", first.key, first.text, more - 1),
                },
            }),
        }
    }

    /// Returns the signals that the commissioning proved or a person confirmed, among those that the loads of the machine depend
    /// on, and for joints the positions for which the proof holds. A signal with an open or missing item is not included.
    #[must_use]
    pub fn proven(&self, machine: &Machine) -> Commissioned {
        let is_shown = |item: &CommissioningItem| {
            let status = Status::from_str(&item.status);
            matches!(status, Ok(Status::Proven | Status::Confirmed))
        };
        let has = |key: &str| self.items.iter().any(|item| item.key == key);
        let are_shown = |prefix: &str| {
            let mut items = self.items.iter();
            items.all(|item| !item.key.starts_with(prefix) || is_shown(item))
        };
        // all that it asks about a signal, and at least what shows that it asked
        let is_proven = |proof: Proof| match proof {
            Proof::SpecificForce => {
                has("imu.mounting.up")
                    && has("imu.specific_force.scale")
                    && ["imu.mounting.", "imu.specific_force.", "travel."]
                        .iter()
                        .all(|prefix| are_shown(prefix))
            }
            Proof::AngularVelocity => {
                has("imu.angular_velocity.yaw")
                    && has("imu.angular_velocity.roll_pitch")
                    && are_shown("imu.angular_velocity.")
            }
            Proof::Odometry => {
                has("odometry.velocity") && are_shown("odometry.") && are_shown("travel.")
            }
            Proof::ToolWrench => has("tool_wrench") && are_shown("tool_wrench"),
            Proof::ActuatorForces => {
                let mut joints = machine.contact().actuated_joints.iter();
                let key = |name: &str| format!("actuator.{name}");
                joints.all(|joint| has(&key(joint.name(machine.linkages()))))
                    && are_shown("actuator.")
            }
            Proof::Payload => {
                let mut payloads = machine.payloads_by_signals();
                payloads.all(|payload| has(&format!("payload.{}", payload + 1)))
                    && are_shown("payload.")
            }
            Proof::Supports => {
                let supports = machine.supports();
                let mut told = supports.told_by_signals();
                told.all(|it| has(&format!("support.{}", supports.support(it).name)))
                    && are_shown("support.")
            }
            // no motion shows the ground that comes
            Proof::Ground => false,
            Proof::Joint(joint) => {
                let prefix = format!("joint.{}.", machine.joints()[joint].name);
                let asked = ["sign", "steering"].map(|part| has(&format!("{prefix}{part}")));
                asked.contains(&true) && are_shown(&prefix)
            }
        };
        let all = Proof::all(machine.joints().len());
        let proofs = all.filter(|&proof| is_proven(proof)).collect();
        let joints = machine.joints().iter();
        let ranges = joints.map(|joint| self.range(&joint.name)).collect();
        Commissioned::new(machine, proofs, ranges)
    }

    /// The positions at which all was shown that was asked about the position of a joint (rad or m); `None` where the file says none.
    fn range(&self, joint: &str) -> Option<[f64; 2]> {
        let keys = ["sign", "scale", "steering"].map(|part| format!("joint.{joint}.{part}"));
        let items = self.items.iter().filter(|item| keys.contains(&item.key));
        let ranges: Option<Vec<[f64; 2]>> = items.map(|item| item.range).collect();
        let all = ranges?.into_iter();
        all.reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])])
    }

    /// The items with this status.
    #[must_use]
    pub fn with_status(&self, status: Status) -> Vec<&CommissioningItem> {
        let name = status.to_string();
        self.items
            .iter()
            .filter(|item| item.status == name)
            .collect()
    }

    /// Summarises the commissioning in a sentence.
    #[must_use]
    pub fn statement(&self) -> String {
        let count = |status| self.with_status(status).len();
        let open = self.with_status(Status::NotShown);
        let shown = say!(
            "commissioned at {} with {} ({} items proven, {} confirmed by a person)",
            self.made_at,
            self.source,
            count(Status::Proven),
            count(Status::Confirmed)
        );
        let shown = match open.len() {
            0 => shown,
            more => {
                let keys: Vec<&str> = open.iter().map(|item| item.key.as_str()).collect();
                say!(
                    "{shown}; in part only, {more} not shown: {}",
                    keys.join(", ")
                )
            }
        };
        match self.schema < FIRST_WITH_RANGES {
            true => say!(
                "{shown}; it does not say at which positions its drive has shown the joints, and proves none of them: assess the drive \
                 again with check-machine"
            ),
            false => shown,
        }
    }
}

/// Statement about a machine without a commissioning.
pub const NOT_COMMISSIONED: &str = message!(
    "not commissioned: signs, axes, order, scale and mounting of the sensors are taken from the machine file and were not proven by a commissioning drive"
);

impl MachineFile {
    /// Binds the machine file to this result of a commissioning, instead of the one that it names.
    ///
    /// # Errors
    /// The file cannot be found.
    pub fn with_commissioning(mut self, path: &Path) -> Result<Self, CommissioningError> {
        let found = path.canonicalize();
        let found = found.map_err(|source| CommissioningError::Read {
            path: path.into(),
            source,
        })?;
        self.spec.commissioning = Some(found.display().to_string());
        Ok(self)
    }
}

/// The commissioning that a machine file names, checked against the machine; `None` if it names none.
///
/// # Errors
/// The file cannot be read, was changed, is of another machine, or contradicts it.
pub fn commissioning_of(
    file: &MachineFile,
    urdf: &Urdf,
) -> Result<Option<(PathBuf, Commissioning)>, CommissioningError> {
    let Some(name) = &file.spec.commissioning else {
        return Ok(None);
    };
    let path = file.beside(name);
    let found = Commissioning::read(&path)?;
    found.check(&path, file, urdf)?;
    Ok(Some((path, found)))
}

//! The lines: their keys, and what is wrong with them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tipwatch_mechanics::machine::Machine;

use crate::error::SuspensionError;

/// Version of the protocol.
pub(super) const VERSION: u32 = 1;

/// The first line: the measured joints of the machine and their positions (rad or m).
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    #[serde(default = "this_version")]
    protocol: u32,
    joints: BTreeMap<String, f64>,
}

impl Opening {
    /// Reads the first line.
    ///
    /// # Errors
    /// [`ProtocolError::Opening`], [`ProtocolError::Version`].
    pub fn parse(line: &str) -> Result<Self, ProtocolError> {
        let opening: Self = serde_json::from_str(line).map_err(ProtocolError::Opening)?;
        match opening.protocol {
            VERSION => Ok(opening),
            found => Err(ProtocolError::Version { found }),
        }
    }

    /// Names of the measured joints.
    #[must_use]
    pub fn joint_names(&self) -> Vec<String> {
        self.joints.keys().cloned().collect()
    }

    /// Positions of the machine's joints.
    pub(super) fn posture(&self, machine: &Machine) -> Result<Vec<f64>, ProtocolError> {
        let joints = machine.joints().iter();
        let position = |name: &String| {
            let found = self.joints.get(name).copied();
            found.ok_or_else(|| ProtocolError::OpeningJoint { name: name.clone() })
        };
        joints.map(|joint| position(&joint.name)).collect()
    }
}

/// The answer to the first line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ready {
    pub(super) protocol: u32,
    pub(super) rods: Vec<String>,
    pub(super) step_s: f64,
    pub(super) stroke_m: [f64; 2],
    /// Longest time for which a command counts without the next one (s).
    pub(super) valid_s: f64,
}

/// The answer to a state.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Answer {
    /// A command; numbers that are not finite are null.
    Command {
        /// [`Status::name`](crate::Status::name).
        status: &'static str,
        /// Whether the valves close.
        hold: bool,
        /// Reasons for which the valves close; empty while they follow.
        reasons: Vec<&'static str>,
        /// Stroke at the end of the step, by rod (m).
        position: Vec<f64>,
        /// Velocity at the end of the step (m/s).
        velocity: Vec<f64>,
        /// Acceleration during the step (m/s^2).
        acceleration: Vec<f64>,
        /// Valve commands, -1 to 1.
        opening: Vec<f64>,
        /// Cost (30).
        cost: f64,
    },
    /// An invalid line.
    Invalid {
        /// The error: the expected and the found content.
        error: String,
        /// True: the valves close.
        hold: bool,
    },
}

/// An invalid line.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// The first line is not an [`Opening`].
    #[error("first line: expected {{\"joints\": {{name: position}}}}")]
    Opening(#[source] serde_json::Error),
    /// The client speaks another version of the protocol.
    #[error("first line: protocol: expected {VERSION}, found {found}")]
    Version {
        /// The client's version.
        found: u32,
    },
    /// The first line lacks a joint of the machine.
    #[error("first line: expected joint \"{name}\", found none")]
    OpeningJoint {
        /// Name of the joint.
        name: String,
    },
    /// The suspension cannot be controlled like this.
    #[error(transparent)]
    Suspension(#[from] SuspensionError),
    /// A line is not a state.
    #[error(transparent)]
    State(#[from] serde_json::Error),
    /// A state lacks a joint of the machine.
    #[error("expected joint \"{name}\", found none")]
    Joint {
        /// Name of the joint.
        name: String,
    },
    /// A wrong number of pressures.
    #[error("pressures: expected {expected} pairs or none, found {found}")]
    Pressures {
        /// Number of rods of the machine.
        expected: usize,
        /// Number of pairs in the line.
        found: usize,
    },
    /// A wrong number of rods.
    #[error("rods: expected {expected} numbers, found {found}")]
    Rods {
        /// Number of rods of the machine.
        expected: usize,
        /// Number of strokes in the line.
        found: usize,
    },
}

/// A number, or `null` if unknown.
pub(super) type Number = Option<f64>;

/// A state that requests a command.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Request {
    pub(super) joints: BTreeMap<String, [Number; 3]>,
    pub(super) rods: Vec<Number>,
    /// Time of the state (s), from any beginning.
    #[serde(default)]
    pub(super) time_s: Number,
    pub(super) specific_force: [Number; 3],
    pub(super) angular_velocity: [Number; 3],
    pub(super) angular_acceleration: [Number; 3],
    pub(super) up: [Number; 3],
    /// Pressures on the piston's side and on the rod's side, by rod (Pa).
    #[serde(default)]
    pub(super) pressures: Vec<[Number; 2]>,
}

/// A client that does not say its version.
fn this_version() -> u32 {
    VERSION
}

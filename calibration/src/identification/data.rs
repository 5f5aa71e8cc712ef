//! Measured data: instants of logs and weighings, with the readings of each.

use std::sync::Arc;

use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::SupportId;

/// Measured data of an identification.
#[derive(Debug, Clone, Default)]
pub struct Data {
    /// The sensors.
    pub channels: Vec<Channel>,
    /// The logs and the weighings.
    pub sources: Vec<Source>,
}

impl Data {
    /// The index of the channel of this name; `channel` is added if there is none.
    pub fn index_of(&mut self, channel: Channel) -> usize {
        let mut known = self.channels.iter();
        known
            .position(|known| known.name == channel.name)
            .unwrap_or_else(|| {
                self.channels.push(channel);
                self.channels.len() - 1
            })
    }
}

/// A sensor whose readings share a constant error.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Its name, for messages.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Standard deviation of its constant error; zero where each reading has an error of its own.
    pub bias_sigma: f64,
    /// Whether the sensor measures loads of supports.
    pub is_load: bool,
}

/// A log, or a weighing in one posture.
#[derive(Debug, Clone)]
pub struct Source {
    /// Its name, for messages.
    pub name: String,
    /// Whether the source is a log, whose instants follow each other in time; otherwise a weighing.
    pub is_log: bool,
    /// Its instants, in order of time.
    pub instants: Vec<Instant>,
}

/// The readings of one instant.
#[derive(Debug, Clone)]
pub struct Instant {
    /// Time (s) after the start of the log.
    pub time_s: f64,
    /// The supports on the ground.
    pub supports: Arc<[SupportId]>,
    /// The situation of the machine.
    pub situation: Situation,
    /// Readings of the sensors.
    pub readings: Vec<Reading>,
}

/// The situation of the machine at an instant.
#[derive(Debug, Clone)]
pub enum Situation {
    /// A row of a log: the motion is known from its signals.
    Logged(Box<State<f64>>),
    /// At rest on ground of stated slope.
    AtRest {
        /// Positions of the joints as the encoders show them (rad or m).
        positions: Vec<f64>,
        /// Slope of the ground (rad), positive where it rises forward and where it rises to the left.
        slope: [f64; 2],
        /// Standard deviation of either (rad).
        slope_sigma: f64,
    },
}

/// A measured number.
#[derive(Debug, Clone)]
pub struct Reading {
    /// Measured quantity.
    pub what: Measured,
    /// The number (N or m/s^2).
    pub value: f64,
    /// Standard deviation of its own error, beyond that of its channel.
    pub sigma: f64,
    /// Index of its channel.
    pub channel: usize,
}

/// Quantity that a reading measures.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// Total load of some supports (N); those off the ground carry nothing.
    Load {
        /// Supports whose loads the reading sums up.
        supports: Vec<SupportId>,
    },
    /// Force of the actuator of a linkage, positive when it extends the rod (N).
    ActuatorForce {
        /// Index of the linkage.
        linkage: usize,
    },
    /// Specific force along an axis of the IMU, at rest (m/s^2).
    SpecificForce {
        /// Axis of the IMU, 0 to 2.
        axis: usize,
    },
}

impl Data {
    /// The sets of supports on which the machine stood, each once.
    pub(crate) fn sets(&self) -> Vec<Arc<[SupportId]>> {
        let mut sets: Vec<Arc<[SupportId]>> = Vec::new();
        for instant in self.sources.iter().flat_map(|source| &source.instants) {
            if !sets.contains(&instant.supports) {
                sets.push(Arc::clone(&instant.supports));
            }
        }
        sets
    }
}

impl Measured {
    /// Whether the quantity is a load of supports.
    #[must_use]
    pub fn is_load(&self) -> bool {
        matches!(self, Self::Load { .. })
    }
}

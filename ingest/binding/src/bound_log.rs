//! A machine bound to a log: its sensors and the topics that carry them.

use std::collections::BTreeMap;

use tipwatch_ingest::{SensorRequest, SensorTopics};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{MatchedSensors, Sensor};

/// A machine bound to a log.
#[derive(Debug)]
pub struct BoundLog {
    /// The machine, checked against the log.
    pub machine: Machine,
    /// Its sensors, in the form that the estimators use.
    pub matched: MatchedSensors,
    /// Request of each sensor, in the order of
    /// [`Sensors::iter`](tipwatch_mechanics::state::Sensors::iter).
    pub sensors: Vec<BoundSensor>,
    /// Requests of the signals from which the state is not estimated, without those missing from the log: first the signals that
    /// tell which supports are on the ground, then the load sensors and the commanded joint rates.
    pub beside: Vec<BoundSensor>,
    /// All topics found, used or not.
    pub topics: SensorTopics,
    /// Clock offsets from the machine file, to be added to the stamps (s), by topic.
    pub clock_offsets_s: BTreeMap<String, f64>,
    /// Bound signals missing from the log, as sentences.
    pub notes: Vec<String>,
}

impl BoundLog {
    /// Returns the sensors, then the signals beside them.
    pub fn all(&self) -> impl Iterator<Item = &BoundSensor> {
        self.sensors.iter().chain(&self.beside)
    }
}

/// A sensor and the topic that carries it.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundSensor {
    /// The sensor of the machine.
    pub sensor: Sensor,
    /// Request that reads the sensor.
    pub request: SensorRequest,
    /// Reason why this topic was chosen.
    pub why: String,
}

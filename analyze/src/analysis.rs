//! What the analysis of one log gives: everything that tables, summary and report are made from.

use nalgebra::Vector3;
use tipwatch_ingest::{Losses, TopicStatistics};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::signal::{Reasons, StreamCounts};
use tipwatch_mechanics::{OutcomeColumns, StateColumns};

use crate::events::Event;
use crate::options::Options;
use crate::provenance::Provenance;

/// The analysis of one log.
#[derive(Debug)]
pub struct Analysis {
    /// The machine as checked against the log.
    pub machine: Machine,
    /// What was asked for.
    pub options: Options,
    /// Where everything comes from.
    pub provenance: Provenance,
    /// The signals that were used, and how well they were recorded.
    pub inputs: Vec<Input>,
    /// Things that a reader must know of: what was assumed, missing or odd, in plain sentences.
    pub notes: Vec<String>,
    /// What of the log was lost.
    pub losses: Losses,
    /// The results, row by row.
    pub rows: Rows,
    /// The static load of each wheel: level, at rest, posture of the first valid row (N).
    pub static_loads_n: Vec<f64>,
    /// The load below which each wheel is light (N); `None` where the machine file sets no limit.
    pub min_loads_n: Option<Vec<f64>>,
    /// What was found.
    pub events: Vec<Event>,
}

/// A signal and the topic that it comes from.
#[derive(Debug, Clone)]
pub struct Input {
    /// "joint_states", "imu", "odometry" or "tool_wrench".
    pub signal: &'static str,
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Why this topic.
    pub why: String,
    /// Which of the stamps of its messages is used, and why.
    pub clock: String,
    /// Its stamps: rates, gaps, offsets.
    pub statistics: TopicStatistics,
    /// How many of its samples were used.
    pub counts: StreamCounts,
    /// Messages that could not be decoded.
    pub undecodable: u64,
}

/// Results row by row.
#[derive(Debug)]
pub struct Rows {
    /// Times (ns), in the stamps' clock.
    pub times_ns: Vec<i64>,
    /// Why each row is not valid.
    pub reasons: Vec<Reasons>,
    /// The states.
    pub states: StateColumns,
    /// Wheel loads and stability; NaN where they cannot be computed.
    pub outcomes: OutcomeColumns,
    /// The direction up in base axes, where the log knows it.
    pub up_in_base: Vec<Option<Vector3<f64>>>,
}

impl Rows {
    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.times_ns.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.times_ns.is_empty()
    }

    /// Seconds of a row from the first one.
    #[must_use]
    pub fn seconds(&self, row: usize) -> f64 {
        (self.times_ns[row] - self.times_ns[0]) as f64 * 1e-9
    }
}

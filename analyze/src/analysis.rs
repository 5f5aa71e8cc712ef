//! What the analysis of one log gives: everything that tables, summary and report are made from.

use nalgebra::Vector3;
use tipwatch_ingest::{Losses, StampCorrection, TopicStatistics};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::{Reasons, StreamCounts};
use tipwatch_mechanics::{OutcomeColumns, State, StateColumns};

use crate::clock::{ClockOffsets, words::TopicsFinding};
use crate::events::Event;
use crate::model_comparison::ModelComparison;
use crate::monte_carlo::MonteCarlo;
use crate::options::Options;
use crate::payload::EstimatedPayload;
use crate::provenance::Provenance;
use crate::sensitivity::SensitivityTable;
use crate::verdicts::Verdicts;

/// The analysis of one log.
#[derive(Debug)]
pub struct Analysis {
    /// The machine as checked against the log.
    pub machine: Machine,
    /// What was asked for.
    pub options: Options,
    /// Where everything comes from.
    pub provenance: Provenance,
    /// The texts that the machine was made from.
    pub sources: Sources,
    /// The signals that were used, and how well they were recorded.
    pub inputs: Vec<Input>,
    /// Things that a reader must know of: what was assumed, missing or odd, in plain sentences.
    pub notes: Vec<String>,
    /// What of the log was lost.
    pub losses: Losses,
    /// The results, row by row.
    pub rows: Rows,
    /// The load below which each wheel is light (N); `None` where the machine file sets no limit.
    pub min_loads_n: Option<Vec<f64>>,
    /// What was found.
    pub events: Vec<Event>,
    /// Derivatives of the loads; `None` of a model that has none.
    pub sensitivity: Option<SensitivityTable>,
    /// The study of parametric uncertainty, if it was asked for.
    pub monte_carlo: Option<MonteCarlo>,
    /// Payloads whose mass was estimated from the force of a cylinder.
    pub payloads: Vec<EstimatedPayload>,
    /// Offsets between the topics' clocks, from the physics.
    pub clock: ClockOffsets,
    /// What is odd about the clocks.
    pub clock_findings: Vec<TopicsFinding>,
    /// How each other model differs, or why it cannot be computed.
    pub comparisons: Vec<Result<ModelComparison, String>>,
}

/// What a machine was made from, as it was read.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The machine file.
    pub machine_file: String,
    /// The URDF.
    pub urdf: String,
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
    /// What was done to its stamps to put them on the clock of the log.
    pub correction: StampCorrection,
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
    /// What a monitor says of each row; `None` of a model without uncertainty, which a verdict needs.
    pub verdicts: Option<Verdicts>,
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

    /// The direction up of a row in base axes, where the log knows it.
    #[must_use]
    pub fn up_in_base(&self, machine: &Machine, row: usize) -> Option<Vector3<f64>> {
        let mut state = State::zero(machine);
        self.states.get(row, &mut state);
        Some(state.base.up).filter(|up| up.iter().all(|c| c.is_finite()))
    }

    /// Whether a row's loads are known as well as they can be.
    #[must_use]
    pub fn is_valid(&self, row: usize) -> bool {
        self.reasons[row].is_empty()
    }

    /// The row at a time, or the first after it.
    #[must_use]
    pub fn at(&self, time_ns: i64) -> usize {
        let row = self.times_ns.partition_point(|&t| t < time_ns);
        row.min(self.len().saturating_sub(1))
    }

    /// Seconds of a row from the first one.
    #[must_use]
    pub fn seconds(&self, row: usize) -> f64 {
        (self.times_ns[row] - self.times_ns[0]) as f64 * 1e-9
    }
}

//! What the analysis of one log gives: everything that tables, summary and report are made from.

use tipwatch_ingest::{Losses, StampCorrection, TopicStatistics};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::signal::StreamCounts;

use super::clock::{ClockOffsets, words::TopicsFinding};
use super::model_comparison::ModelComparison;
use super::monte_carlo::MonteCarlo;
use super::payload::EstimatedPayload;
use super::sensitivity::SensitivityTable;
use crate::base::options::Options;
use crate::base::provenance::Provenance;
use crate::base::rows::Rows;
use crate::events::Event;

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

//! The result of an analysis: the source of tables, summary and report.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_ingest::{FileTransfer, Losses, StampCorrection, TopicTiming};
use tipwatch_mechanics::machine::{Machine, Note};

use super::advice::Advice;
use super::clock::text::Clocks;
use super::coverage::Coverage;
use super::digest::Digest;
use super::margin::Margins;
use super::measured_loads::LoadComparison;
use super::measured_torques::TorquesUsed;
use super::model_comparison::ModelComparison;
use super::monte_carlo::MonteCarlo;
use super::payload::EstimatedPayload;
use super::sensitivity::SensitivityTable;
use super::undecided::Undecided;
use super::unstated_load::ExplainedFall;
use crate::analysis::health::SensorHealth;
use crate::analysis::inputs::GrossInput;
use crate::base::clip::Clip;
use crate::base::options::Options;
use crate::base::provenance::Provenance;
use crate::base::table::Table;
use crate::events::{Event, Turning};
use crate::load::{LogTimes, MeasuredLoads};

/// The analysis of one log.
#[derive(Debug)]
pub struct Analysis {
    /// The machine, checked against the log.
    pub machine: Machine,
    /// The options used.
    pub options: Options,
    /// Files, versions and hashes.
    pub provenance: Provenance,
    /// Requests and bytes that reading the log took, for each of its files in a bucket or on a server.
    pub transfers: Vec<FileTransfer>,
    /// Machine file and URDF as read.
    pub sources: Sources,
    /// The signals used, with the quality of their recording.
    pub inputs: Vec<Input>,
    /// The health of each sensor, in the order of `inputs`.
    pub health: Vec<SensorHealth>,
    /// Notes for the reader: assumptions, missing signals, anomalies.
    pub notes: Vec<Note>,
    /// Parts of the log that were lost.
    pub losses: Losses,
    /// Grossly wrong inputs. While there is any, no row is valid and nothing is concluded.
    pub gross_inputs: Vec<GrossInput>,
    /// Results, row by row.
    pub rows: Table,
    /// Key figures of all rows.
    pub digest: Digest,
    /// Rows in which measured forces determined the load split.
    pub torques: TorquesUsed,
    /// The margins.
    pub margins: Margins,
    /// Share of the log's time that could be computed.
    pub coverage: Coverage,
    /// Load below which each wheel is light (N); `None` if unknown.
    pub min_loads_n: Option<Vec<f64>>,
    /// The events.
    pub events: Vec<Event>,
    /// The probability that each joint of the arm has the other sign, by the motion that was recorded.
    pub(crate) reversed: Vec<(usize, f64)>,
    /// Rotation of the platform when the log ends, if a fall may have begun that is not known as an event.
    pub turning: Option<Turning>,
    /// Derivatives of the loads; `None` for models without them.
    pub sensitivity: Option<SensitivityTable>,
    /// Changes that would have prevented the worst event; `None` without one, and for models without derivatives.
    pub advice: Option<Advice>,
    /// Explanations of each rotation about an edge.
    pub explained_falls: Vec<ExplainedFall>,
    /// Monte Carlo study of the parameters, if requested.
    pub monte_carlo: Option<MonteCarlo>,
    /// Payload masses estimated from cylinder forces.
    pub payloads: Vec<EstimatedPayload>,
    /// The clocks: anomalies, and offsets between topics.
    pub clock: Clocks,
    /// Comparison with each other model, or why it cannot be computed.
    pub comparisons: Vec<Result<ModelComparison, String>>,
    /// Measured wheel loads.
    pub measured_loads: Arc<MeasuredLoads>,
    /// Measured against computed loads.
    pub load_comparison: LoadComparison,
    /// The times of the log at the times of the rows.
    pub log_times: LogTimes,
    /// Clips that were cut out of the log; `None` without the option.
    pub clips: Option<Vec<Clip>>,
}

impl Analysis {
    /// Returns the reason why the analysis decides nothing; `None` if it decides. At least `min_valid` of the log's time must be
    /// computable.
    #[must_use]
    pub fn undecided(&self, min_valid: f64) -> Option<Undecided> {
        Undecided::of(&self.coverage, &self.gross_inputs_in_words(), min_valid)
    }

    /// The findings about grossly wrong inputs, one sentence each.
    #[must_use]
    pub fn gross_inputs_in_words(&self) -> Vec<String> {
        let headlines = self.gross_inputs.iter();
        headlines.map(|input| input.headline.clone()).collect()
    }
}

/// The files that describe a machine, as read.
#[derive(Debug, Clone)]
pub struct Sources {
    /// The machine file.
    pub machine_file: String,
    /// The URDF.
    pub urdf: String,
}

/// A signal and its topic.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "InputSummary")]
pub struct Input {
    /// "joint_states", "imu", "odometry" or "tool_wrench".
    pub signal: &'static str,
    /// The name that tells it from the others, and that its events have: "imu", "actuator.lift".
    #[serde(skip)]
    pub subject: String,
    /// Name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: String,
    /// Reason why this topic was chosen.
    pub why: String,
    /// Time stamp of the messages that is used, and the reason.
    #[serde(skip)]
    pub clock: String,
    /// Samples used.
    pub samples_used: u64,
    /// Samples with a stamp not later than the preceding one.
    pub samples_not_later: u64,
    /// Samples with a value that is not finite.
    pub samples_not_finite: u64,
    /// Implausible samples, rejected in part or given less weight.
    pub samples_implausible: u64,
    /// Messages that could not be decoded.
    #[serde(rename = "messages_undecodable")]
    pub undecodable: u64,
    /// The noise that its samples show; empty where `[estimator]` keeps the stated one.
    pub noise: Vec<InputNoise>,
    /// Its stamps: rates, gaps, offsets.
    pub timing: TopicTiming,
    /// Correction that maps its stamps to the clock of the log.
    pub correction: StampCorrection,
}

/// Noise of a signal.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "NoiseSummary")]
pub struct InputNoise {
    /// Key of `[estimator]` that states it.
    pub key: &'static str,
    /// As stated, in the unit of the key.
    pub stated: f64,
    /// As the samples show it, which the estimates and their bands rest on.
    pub shown: f64,
}

//! The keys of `summary.json`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_ingest::{Losses, StampCorrection, TopicTiming};

use crate::analysis::Coverage;
use crate::analysis::advice::Advice;
use crate::analysis::clock::{ClockOffsets, text::TopicsFinding};
use crate::analysis::health::SensorHealth;
use crate::analysis::inputs::GrossInput;
use crate::analysis::measured_loads::SensorStatistics;
use crate::analysis::model_comparison::LoadDifference;
use crate::analysis::payload::EstimatedPayload;
use crate::analysis::unstated_load::ExplainedFall;
use crate::base::clip::Clip;
use crate::base::options::Options;
use crate::base::provenance::Provenance;
use crate::events::{Event, Turning};

/// Version of the document.
pub const SCHEMA: u32 = 6;

/// The JSON schema (draft 2020-12) of the document.
#[must_use]
pub fn json_schema() -> String {
    format!("{:#}\n", schemars::schema_for!(Summary<'static>).to_value())
}

/// The document.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Summary<'a> {
    /// Version of this document's keys.
    pub schema: u32,
    /// What happened, in words, the most important first.
    pub findings: Vec<String>,
    /// The evidence for each finding, in the order of `findings`: statements in words.
    pub evidence: Vec<Vec<String>>,
    /// What in the inputs is grossly wrong: while there is any, no row is valid and nothing is concluded.
    pub gross_inputs: &'a [GrossInput],
    /// The events by kind: how many, and the worst. `events.parquet` lists all of them.
    pub events: BTreeMap<&'static str, EventGroup<'a>>,
    /// The wheels by name, in lower case.
    pub wheels: BTreeMap<String, WheelSummary>,
    /// The machine.
    pub machine: MachineSummary<'a>,
    /// The rows.
    pub rows: RowSummary,
    /// How much of the log's time could be computed.
    pub coverage: Coverage,
    /// Source of specific force and angular velocity: "imu", "odometry" or "none".
    pub specific_force_source: &'static str,
    /// The signals used.
    pub inputs: Vec<InputSummary<'a>>,
    /// The health of the sensors: rates, gaps, steps of clocks, resolution, vibration, limits and outliers of each number.
    pub health: &'a [SensorHealth],
    /// The clocks: anomalies, and offsets between topics.
    pub clock: ClockSummary<'a>,
    /// Notes: assumptions, missing signals, anomalies.
    pub notes: Vec<&'a str>,
    /// Parts of the log that were lost.
    pub losses: &'a Losses,
    /// The model of the loads, and how other models differ.
    pub model: ModelSummary,
    /// Sensitivity of the smallest load; null for models without derivatives.
    pub sensitivity: Option<SensitivitySummary>,
    /// What would have prevented the worst event, by simulation of single changes; null without a wheel below its
    /// limit in an event, and for models without derivatives.
    pub advice: Option<&'a Advice>,
    /// What explains each rotation about an edge: an unstated load on the tool and other explanations, with their evidence;
    /// absent without one.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[schemars(default)]
    pub explained_falls: &'a [ExplainedFall],
    /// How the platform turns when the log ends, if a fall may have begun that no event tells of; absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default)]
    pub turning_at_end: Option<&'a Turning>,
    /// Payload masses estimated from cylinder forces.
    pub estimated_payloads: &'a [EstimatedPayload],
    /// Measured against computed loads, by load sensor of the machine file; absent without one in the log.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub measured_loads: Vec<MeasuredLoadSummary<'a>>,
    /// Monte Carlo study of the parameters; null if not requested.
    pub monte_carlo: Option<MonteCarloSummary>,
    /// The clips that were cut out of the log, in order of time; absent without `--clips`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(default)]
    pub clips: Option<&'a [Clip]>,
    /// Standard deviation of each parameter, stated or default.
    pub uncertainty: BTreeMap<&'static str, f64>,
    /// The options used.
    pub options: Options,
    /// Files, versions and hashes.
    pub provenance: &'a Provenance,
}

/// The events of a kind.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EventGroup<'a> {
    pub(super) count: usize,
    /// The lowest load, the largest moment, rotation or duration, or the fault of most samples; the first of several.
    pub(super) worst: EventSummary<'a>,
}

/// An event, and its start on the clock of the rows.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EventSummary<'a> {
    /// Start since the first row.
    pub(super) start_s: f64,
    #[serde(flatten)]
    pub(super) event: &'a Event,
}

/// The model of the ground wrench.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ModelSummary {
    pub(super) name: &'static str,
    /// The assumption by which loads are split where equilibrium leaves it open.
    pub(super) split_rule: String,
    /// The other models over the same rows.
    pub(super) others: Vec<OtherModelSummary>,
    /// Why other models cannot be computed.
    pub(super) other_notes: Vec<String>,
}

/// Comparison with another model.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OtherModelSummary {
    pub(super) name: &'static str,
    pub(super) rows_compared: usize,
    /// OTF difference by wheel, other model minus this one.
    pub(super) difference: BTreeMap<String, LoadDifference>,
}

/// A load sensor.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MeasuredLoadSummary<'a> {
    #[serde(flatten)]
    pub(super) statistics: &'a SensorStatistics,
    /// Spans in which measured and computed loads contradict each other and this sensor is furthest off, or in which the
    /// totals do: first and last row. Their rows are not valid.
    pub(super) contradictions_ns: Vec<[i64; 2]>,
}

/// Monte Carlo study of the parameters.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MonteCarloSummary {
    pub(super) draws: usize,
    /// Largest relative deviation of lengths, angles, masses and inertias.
    pub(super) spread: f64,
    pub(super) seed: u64,
    /// Half width of the band that contains 95 % of the draws, averaged over the rows, by column of
    /// samples.parquet (N or N m).
    pub(super) mean_half_band: BTreeMap<String, Option<f64>>,
    /// Largest number of draws times rows that could not be evaluated, over all quantities.
    pub(super) left_out: u64,
}

/// The wheel that came closest to lift-off, of the rows with derivatives where there are any, and the sensitivity of its load.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SensitivitySummary {
    pub(super) wheel: String,
    /// When its OTF was smallest, of the rows with derivatives where there are any (ns).
    pub(super) worst_ns: i64,
    /// That OTF (N); one without derivatives can be smaller.
    pub(super) worst_otf_n: f64,
    /// The parameters with the largest share of the variance, largest first.
    pub(super) parameters: Vec<ParameterSummary>,
}

/// Effect of one parameter on a wheel load.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ParameterSummary {
    pub(super) parameter: String,
    pub(super) unit: &'static str,
    pub(super) nominal: Option<f64>,
    pub(super) sigma: f64,
    pub(super) derivative_n_per_unit: f64,
    pub(super) change_to_zero: Option<f64>,
    pub(super) variance_share: f64,
}

/// A wheel.
#[derive(Debug, Serialize, JsonSchema)]
pub struct WheelSummary {
    pub(super) static_load_n: Option<f64>,
    pub(super) min_load_limit_n: Option<f64>,
    pub(super) mean_load_n: Option<f64>,
    pub(super) least_load_n: Option<f64>,
    pub(super) least_otf_n: Option<f64>,
    pub(super) least_otf_s: Option<f64>,
    pub(super) largest_load_n: Option<f64>,
    /// Median standard deviation of the load.
    pub(super) median_load_sigma_n: Option<f64>,
}

/// The machine.
#[derive(Debug, Serialize, JsonSchema)]
pub struct MachineSummary<'a> {
    pub(super) name: &'a str,
    /// With the payloads that it always carries.
    pub(super) mass_kg: f64,
    /// With the payloads of the row in which they are heaviest.
    pub(super) largest_mass_kg: f64,
    pub(super) gravity_m_s2: f64,
    pub(super) base_link: &'a str,
}

/// The rows.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RowSummary {
    pub(super) count: usize,
    pub(super) valid: usize,
    /// Rows in which signals contradict each other; most are valid.
    pub(super) doubted: usize,
    pub(super) first_ns: i64,
    pub(super) last_ns: i64,
    pub(super) duration_s: f64,
    pub(super) invalid_by_reason: BTreeMap<&'static str, usize>,
}

/// The clocks.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ClockSummary<'a> {
    pub(super) findings: &'a [TopicsFinding],
    pub(super) offsets: &'a ClockOffsets,
}

/// Noise of a signal.
#[derive(Debug, Serialize, JsonSchema)]
pub struct NoiseSummary {
    /// Key of `[estimator]` that states it.
    pub(super) key: &'static str,
    /// As stated, in the unit of the key.
    pub(super) stated: f64,
    /// As the samples show it, which the estimates and their bands rest on.
    pub(super) shown: f64,
}

/// A signal.
#[derive(Debug, Serialize, JsonSchema)]
pub struct InputSummary<'a> {
    pub(super) signal: &'static str,
    pub(super) topic: &'a str,
    pub(super) type_name: &'a str,
    pub(super) why: &'a str,
    pub(super) samples_used: u64,
    pub(super) samples_not_later: u64,
    pub(super) samples_not_finite: u64,
    /// Implausible samples, rejected in part or given less weight.
    pub(super) samples_implausible: u64,
    pub(super) messages_undecodable: u64,
    /// The noise that its samples show; empty where `[estimator]` keeps the stated one.
    pub(super) noise: Vec<NoiseSummary>,
    pub(super) timing: &'a TopicTiming,
    pub(super) correction: StampCorrection,
}

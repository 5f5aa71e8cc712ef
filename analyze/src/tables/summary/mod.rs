//! `summary.json`: the analysis as one small, stable document.
//!
//! Keys include their unit. Values that cannot be computed are null. Keys change only with `schema`. Each key is one line of
//! this file: what an analysis found, as its own struct serialises.

mod events;
mod parts;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_ingest::Losses;

use self::events::EventGroup;
use self::parts::{MachineSummary, MeasuredLoadSummary, ModelSummary, RowSummary};
use crate::analysis::advice::Advice;
use crate::analysis::clock::text::Clocks;
use crate::analysis::digest::WheelDigest;
use crate::analysis::health::SensorHealth;
use crate::analysis::inputs::GrossInput;
use crate::analysis::monte_carlo::MonteCarlo;
use crate::analysis::payload::EstimatedPayload;
use crate::analysis::sensitivity::SensitivityTable;
use crate::analysis::unstated_load::ExplainedFall;
use crate::analysis::{Analysis, Coverage, Input};
use crate::base::built::built;
use crate::base::clip::Clip;
use crate::base::options::Options;
use crate::base::provenance::Provenance;
use crate::events::{Finding, Turning};

/// Version of the document.
pub const SCHEMA: u32 = 6;

/// The JSON schema (draft 2020-12) of the document.
#[must_use]
pub fn json_schema() -> String {
    format!("{:#}\n", schemars::schema_for!(Summary<'static>).to_value())
}

built! {
    /// The document.
    #[derive(Debug, Serialize, JsonSchema)]
    pub struct Summary<'a>: pub fn of(analysis: &'a Analysis, findings: Vec<Finding>) {
        let findings = findings.into_iter();
        let (findings, evidence) = findings.map(|found| (found.headline, found.evidence)).unzip();
    } {
        /// Version of this document's keys.
        pub schema: u32 = SCHEMA,
        /// What happened, in words, the most important first.
        pub findings: Vec<String> = findings,
        /// The evidence for each finding, in the order of `findings`: statements in words.
        pub evidence: Vec<Vec<String>> = evidence,
        /// What in the inputs is grossly wrong: while there is any, no row is valid and nothing is concluded.
        pub gross_inputs: &'a [GrossInput] = &analysis.gross_inputs,
        /// The events by kind: how many, and the worst. `events.parquet` lists all of them.
        pub events: BTreeMap<&'static str, EventGroup<'a>> = events::groups(&analysis.events, analysis.rows.times_ns[0]),
        /// The wheels by name, in lower case.
        pub wheels: BTreeMap<String, &'a WheelDigest> = (analysis.machine.wheels().iter())
            .zip(&analysis.digest.wheels)
            .map(|(wheel, found)| (wheel.name.to_lowercase(), found))
            .collect(),
        /// The machine.
        pub machine: MachineSummary<'a> = MachineSummary::of(analysis),
        /// The rows.
        pub rows: RowSummary = RowSummary::of(&analysis.rows),
        /// How much of the log's time could be computed.
        pub coverage: Coverage = analysis.coverage,
        /// Source of specific force and angular velocity: "imu", "odometry" or "none".
        pub specific_force_source: &'static str = specific_force_source(&analysis.inputs),
        /// The signals used.
        pub inputs: &'a [Input] = &analysis.inputs,
        /// The health of the sensors: rates, gaps, steps of clocks, resolution, vibration, limits and outliers of each number.
        pub health: &'a [SensorHealth] = &analysis.health,
        /// The clocks: anomalies, and offsets between topics.
        pub clock: &'a Clocks = &analysis.clock,
        /// Notes: assumptions, missing signals, anomalies.
        pub notes: Vec<&'a str> = analysis.notes.iter().map(|note| &**note).collect(),
        /// Parts of the log that were lost.
        pub losses: &'a Losses = &analysis.losses,
        /// The model of the loads, and how other models differ.
        pub model: ModelSummary<'a> = ModelSummary::of(analysis),
        /// Sensitivity of the smallest load; null for models without derivatives.
        pub sensitivity: Option<&'a SensitivityTable> =
            (analysis.sensitivity.as_ref()).filter(|found| !found.parameters.is_empty()),
        /// What would have prevented the worst event, by simulation of single changes; null without a wheel below its
        /// limit in an event, and for models without derivatives.
        pub advice: Option<&'a Advice> = analysis.advice.as_ref(),
        /// What explains each rotation about an edge: an unstated load on the tool and other explanations, with their evidence;
        /// absent without one.
        #[serde(skip_serializing_if = "<[_]>::is_empty")]
        #[schemars(default)]
        pub explained_falls: &'a [ExplainedFall] = &analysis.explained_falls,
        /// How the platform turns when the log ends, if a fall may have begun that no event tells of; absent otherwise.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(default)]
        pub turning_at_end: Option<&'a Turning> = analysis.turning.as_ref(),
        /// Payload masses estimated from cylinder forces.
        pub estimated_payloads: &'a [EstimatedPayload] = &analysis.payloads,
        /// Measured against computed loads, by load sensor of the machine file; absent without one in the log.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        #[schemars(default)]
        pub measured_loads: Vec<MeasuredLoadSummary<'a>> = parts::measured_loads(&analysis.load_comparison),
        /// Monte Carlo study of the parameters; null if not requested.
        pub monte_carlo: Option<&'a MonteCarlo> = analysis.monte_carlo.as_ref(),
        /// The clips that were cut out of the log, in order of time; absent without `--clips`.
        #[serde(skip_serializing_if = "Option::is_none")]
        #[schemars(default)]
        pub clips: Option<&'a [Clip]> = analysis.clips.as_deref(),
        /// Standard deviation of each parameter, stated or default.
        pub uncertainty: BTreeMap<&'static str, f64> = analysis.machine.uncertainty().by_key().into_iter().collect(),
        /// The options used.
        pub options: Options = analysis.options,
        /// Files, versions and hashes.
        pub provenance: &'a Provenance = &analysis.provenance,
    }
}

fn specific_force_source(inputs: &[Input]) -> &'static str {
    let has = |signal: &str| inputs.iter().any(|input| input.signal == signal);
    match (has("imu"), has("odometry")) {
        (true, _) => "imu",
        (false, true) => "odometry",
        (false, false) => "none",
    }
}

//! `summary.json` of a replay.

use std::collections::BTreeMap;

use serde::Serialize;
use tipwatch_language::told;
use tipwatch_mechanics::machine::Note;
use tipwatch_suspension::replay::{RodTrack, Track};

use super::findings::findings;
use super::mode::WhatIfOptions;
use super::statistics::{largest, mean, range, rms};
use super::table::rod_names;
use super::what_if::{CAVEATS, WhatIf};
use crate::analysis::Coverage;
use crate::base::provenance::Provenance;

/// Version of the document.
const SCHEMA: u32 = 1;

/// The document; values that cannot be computed are null.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    /// Version of this document's keys.
    pub schema: u32,
    /// Headlines of the findings.
    pub findings: Vec<String>,
    /// Evidence of each finding.
    pub evidence: Vec<Vec<String>>,
    /// The options used.
    pub options: WhatIfOptions,
    /// Rows of the log and rows replayed.
    pub rows: RowSummary,
    /// Share of the log's time that could be computed.
    pub coverage: Coverage,
    /// Motion with the rods locked in the first valid row.
    pub fixed: TrackSummary,
    /// Motion with the requested rod motion.
    pub moved: TrackSummary,
    /// Mean load spread, equation (35), of the best posture at rest (N).
    pub best_mean_spread_n: f64,
    /// Achieved reduction of the mean spread, as a share of the reduction by the best posture.
    pub gain_share: Option<f64>,
    /// The actuators against their limits, by linkage.
    pub actuators: BTreeMap<String, ActuatorSummary>,
    /// Rows by status of the control.
    pub statuses: BTreeMap<&'static str, usize>,
    /// Limits of a replay.
    pub caveats: [&'static str; 5],
    /// Notes on the log.
    pub notes: &'a [Note],
    /// Files, versions and hashes.
    pub provenance: &'a Provenance,
}

/// Numbers of rows.
#[derive(Debug, Serialize)]
pub struct RowSummary {
    total: usize,
    fixed: usize,
    moved: usize,
}

/// One suspension motion.
#[derive(Debug, Serialize)]
pub struct TrackSummary {
    mean_spread_n: f64,
    rms_spread_n: f64,
    largest_spread_n: f64,
    mean_com_offset_m: f64,
    largest_com_offset_m: f64,
    least_stability_angle_rad: f64,
    /// Smallest load by wheel (N).
    least_load_n: BTreeMap<String, f64>,
    /// Rows without load by wheel.
    lifted_rows: BTreeMap<String, usize>,
}

/// An actuator.
#[derive(Debug, Serialize)]
pub struct ActuatorSummary {
    stroke_m: [f64; 2],
    position_range_m: [f64; 2],
    max_velocity_m_s: f64,
    largest_velocity_m_s: f64,
    /// Range of the reference, which obeys the limits; null without control.
    largest_reference_velocity_m_s: f64,
    max_acceleration_m_s2: f64,
    /// Range of the command, which obeys the limits; null without control.
    largest_commanded_acceleration_m_s2: f64,
    largest_opening: f64,
    pressure_range_pa: [f64; 2],
    largest_force_n: f64,
    rms_tracking_error_m: f64,
    largest_tracking_error_m: f64,
}

impl<'a> Summary<'a> {
    /// Summarises a replay.
    #[must_use]
    pub fn of(what_if: &'a WhatIf) -> Self {
        let comparison = &what_if.comparison;
        let (findings, evidence) = (findings(what_if).into_iter())
            .map(|finding| (finding.headline, finding.evidence))
            .unzip();
        let known = |track: &Track| track.spread.iter().filter(|v| v.is_finite()).count();
        let mut statuses = BTreeMap::new();
        for status in comparison.moved.status.iter().flatten() {
            *statuses.entry(status.name()).or_insert(0) += 1;
        }
        Self {
            schema: SCHEMA,
            findings,
            evidence,
            options: what_if.options,
            rows: RowSummary {
                total: what_if.analysis.rows.len(),
                fixed: known(&comparison.fixed),
                moved: known(&comparison.moved),
            },
            coverage: what_if.analysis.coverage,
            fixed: TrackSummary::of(what_if, &comparison.fixed),
            moved: TrackSummary::of(what_if, &comparison.moved),
            best_mean_spread_n: comparison.best.mean_spread(),
            gain_share: comparison.gain_share(),
            actuators: actuators(what_if),
            statuses,
            caveats: CAVEATS.map(told),
            notes: &what_if.analysis.notes,
            provenance: &what_if.analysis.provenance,
        }
    }
}

impl TrackSummary {
    fn of(what_if: &WhatIf, track: &Track) -> Self {
        let wheels = what_if.analysis.machine.wheels();
        let names = wheels.iter().map(|wheel| wheel.name.to_lowercase());
        let lifted = |load: &Vec<f64>| load.iter().filter(|&&load| load == 0.0).count();
        let com = track.com_offset();
        Self {
            mean_spread_n: mean(&track.spread),
            rms_spread_n: rms(&track.spread),
            largest_spread_n: range(&track.spread)[1],
            mean_com_offset_m: mean(&com),
            largest_com_offset_m: range(&com)[1],
            least_stability_angle_rad: range(&track.stability_angle)[0],
            least_load_n: names
                .clone()
                .zip(track.load.iter().map(|load| range(load)[0]))
                .collect(),
            lifted_rows: names.zip(track.load.iter().map(lifted)).collect(),
        }
    }
}

fn actuators(what_if: &WhatIf) -> BTreeMap<String, ActuatorSummary> {
    let comparison = &what_if.comparison;
    let suspension = &comparison.suspension;
    let of = |(name, rod): (String, &RodTrack)| {
        let pressures = [range(&rod.piston_pressure), range(&rod.rod_pressure)];
        let error = rod.tracking_error();
        let summary = ActuatorSummary {
            stroke_m: suspension.stroke,
            position_range_m: range(&rod.position),
            max_velocity_m_s: suspension.max_velocity,
            largest_velocity_m_s: largest(&rod.velocity),
            largest_reference_velocity_m_s: largest(&rod.reference_velocity),
            max_acceleration_m_s2: suspension.max_acceleration,
            largest_commanded_acceleration_m_s2: largest(&rod.commanded_acceleration),
            largest_opening: largest(&rod.opening),
            pressure_range_pa: [
                pressures[0][0].min(pressures[1][0]),
                pressures[0][1].max(pressures[1][1]),
            ],
            largest_force_n: largest(&rod.force),
            rms_tracking_error_m: rms(&error),
            largest_tracking_error_m: largest(&error),
        };
        (name, summary)
    };
    let rods = rod_names(what_if).into_iter().zip(&comparison.moved.rods);
    rods.map(of).collect()
}

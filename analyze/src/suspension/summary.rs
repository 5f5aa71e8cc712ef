//! `summary.json` of a replay.

use std::collections::BTreeMap;

use serde::Serialize;
use tipwatch_language::told;
use tipwatch_mechanics::machine::{Note, Suspension};
use tipwatch_suspension::replay::{RodTrack, Track};

use super::findings::findings;
use super::mode::WhatIfOptions;
use super::statistics::{largest, mean, range, rms};
use super::table::rod_names;
use super::what_if::{CAVEATS, WhatIf};
use crate::analysis::Coverage;
use crate::base::built::built;
use crate::base::provenance::Provenance;

/// Version of the document.
const SCHEMA: u32 = 1;

built! {
    /// The document; values that cannot be computed are null.
    #[derive(Debug, Serialize)]
    pub struct Summary<'a>: pub fn of(what_if: &'a WhatIf) {
        let (analysis, comparison) = (&what_if.analysis, &what_if.comparison);
        let findings = findings(what_if).into_iter();
        let (findings, evidence) = findings.map(|found| (found.headline, found.evidence)).unzip();
        let known = |track: &Track| track.spread.iter().filter(|v| v.is_finite()).count();
        let mut statuses = BTreeMap::new();
        for status in comparison.moved.status.iter().flatten() {
            *statuses.entry(status.name()).or_insert(0) += 1;
        }
    } {
        /// Version of this document's keys.
        pub schema: u32 = SCHEMA,
        /// Headlines of the findings.
        pub findings: Vec<String> = findings,
        /// Evidence of each finding.
        pub evidence: Vec<Vec<String>> = evidence,
        /// The options used.
        pub options: WhatIfOptions = what_if.options,
        /// Rows of the log and rows replayed.
        pub rows: RowSummary = RowSummary {
            total: analysis.rows.len(),
            fixed: known(&comparison.fixed),
            moved: known(&comparison.moved),
        },
        /// Share of the log's time that could be computed.
        pub coverage: Coverage = analysis.coverage,
        /// Motion with the rods locked in the first valid row.
        pub fixed: TrackSummary = TrackSummary::of(what_if, &comparison.fixed),
        /// Motion with the requested rod motion.
        pub moved: TrackSummary = TrackSummary::of(what_if, &comparison.moved),
        /// Mean load spread, equation (35), of the best posture at rest (N).
        pub best_mean_spread_n: f64 = comparison.best.mean_spread(),
        /// Achieved reduction of the mean spread, as a share of the reduction by the best posture.
        pub gain_share: Option<f64> = comparison.gain_share(),
        /// The actuators against their limits, by linkage.
        pub actuators: BTreeMap<String, ActuatorSummary> = actuators(what_if),
        /// Rows by status of the control.
        pub statuses: BTreeMap<&'static str, usize> = statuses,
        /// Limits of a replay.
        pub caveats: [&'static str; 5] = CAVEATS.map(told),
        /// Notes on the log.
        pub notes: &'a [Note] = &analysis.notes,
        /// Files, versions and hashes.
        pub provenance: &'a Provenance = &analysis.provenance,
    }
}

/// Numbers of rows.
#[derive(Debug, Serialize)]
pub struct RowSummary {
    total: usize,
    fixed: usize,
    moved: usize,
}

built! {
    /// One suspension motion.
    #[derive(Debug, Serialize)]
    pub struct TrackSummary: fn of(what_if: &WhatIf, track: &Track) {
        let wheels = what_if.analysis.machine.wheels();
        let names = || wheels.iter().map(|wheel| wheel.name.to_lowercase());
        let lifted = |load: &Vec<f64>| load.iter().filter(|&&load| load == 0.0).count();
        let com = track.com_offset();
    } {
        mean_spread_n: f64 = mean(&track.spread),
        rms_spread_n: f64 = rms(&track.spread),
        largest_spread_n: f64 = range(&track.spread)[1],
        mean_com_offset_m: f64 = mean(&com),
        largest_com_offset_m: f64 = range(&com)[1],
        least_stability_angle_rad: f64 = range(&track.stability_angle)[0],
        /// Smallest load by wheel (N).
        least_load_n: BTreeMap<String, f64> = names().zip(track.load.iter().map(|load| range(load)[0])).collect(),
        /// Rows without load by wheel.
        lifted_rows: BTreeMap<String, usize> = names().zip(track.load.iter().map(lifted)).collect(),
    }
}

built! {
    /// An actuator.
    #[derive(Debug, Serialize)]
    pub struct ActuatorSummary: fn of(suspension: &Suspension, rod: &RodTrack) {
        let pressures = [range(&rod.piston_pressure), range(&rod.rod_pressure)];
        let error = rod.tracking_error();
    } {
        stroke_m: [f64; 2] = suspension.stroke,
        position_range_m: [f64; 2] = range(&rod.position),
        max_velocity_m_s: f64 = suspension.max_velocity,
        largest_velocity_m_s: f64 = largest(&rod.velocity),
        /// Range of the reference, which obeys the limits; null without control.
        largest_reference_velocity_m_s: f64 = largest(&rod.reference_velocity),
        max_acceleration_m_s2: f64 = suspension.max_acceleration,
        /// Range of the command, which obeys the limits; null without control.
        largest_commanded_acceleration_m_s2: f64 = largest(&rod.commanded_acceleration),
        largest_opening: f64 = largest(&rod.opening),
        pressure_range_pa: [f64; 2] = [
            pressures[0][0].min(pressures[1][0]),
            pressures[0][1].max(pressures[1][1]),
        ],
        largest_force_n: f64 = largest(&rod.force),
        rms_tracking_error_m: f64 = rms(&error),
        largest_tracking_error_m: f64 = largest(&error),
    }
}

fn actuators(what_if: &WhatIf) -> BTreeMap<String, ActuatorSummary> {
    let suspension = &what_if.comparison.suspension;
    let rods = &what_if.comparison.moved.rods;
    let of = |(name, rod)| (name, ActuatorSummary::of(suspension, rod));
    rod_names(what_if).into_iter().zip(rods).map(of).collect()
}

//! `summary.json` of a replay, and its findings as text.

use std::collections::BTreeMap;

use serde::Serialize;
use tipwatch_suspension::Status;

use super::mode::{SuspensionMode, WhatIfOptions};
use super::table::rod_names;
use super::track::Track;
use super::what_if::{CAVEATS, WhatIf};
use crate::base::provenance::Provenance;

/// Version of the document.
const SCHEMA: u32 = 1;

/// The document; values that cannot be computed are null.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    /// Version of this document's keys.
    pub schema: u32,
    /// Findings as text.
    pub findings: Vec<String>,
    /// The options used.
    pub options: WhatIfOptions,
    /// Rows of the log and rows replayed.
    pub rows: RowSummary,
    /// With the rods locked in the first valid row.
    pub fixed: TrackSummary,
    /// With the requested rod motion.
    pub moved: TrackSummary,
    /// Mean load spread, equation (35), of the best static posture at each sample (N).
    pub best_mean_spread_n: f64,
    /// Achieved reduction of the mean spread, as a share of the reduction by the best posture.
    pub gain_share: Option<f64>,
    /// The actuators against their limits, by linkage.
    pub actuators: BTreeMap<String, ActuatorSummary>,
    /// Rows by status of the control.
    pub statuses: BTreeMap<&'static str, usize>,
    /// What a replay cannot show.
    pub caveats: [&'static str; 5],
    /// Notes on the log.
    pub notes: &'a [String],
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
    /// Of a replay.
    #[must_use]
    pub fn of(what_if: &'a WhatIf) -> Self {
        let known = |track: &Track| track.spread.iter().filter(|v| v.is_finite()).count();
        let mut statuses = BTreeMap::new();
        for status in what_if.moved.status.iter().flatten() {
            *statuses.entry(status.name()).or_insert(0) += 1;
        }
        Self {
            schema: SCHEMA,
            findings: findings(what_if),
            options: what_if.options,
            rows: RowSummary {
                total: what_if.analysis.rows.len(),
                fixed: known(&what_if.fixed),
                moved: known(&what_if.moved),
            },
            fixed: TrackSummary::of(what_if, &what_if.fixed),
            moved: TrackSummary::of(what_if, &what_if.moved),
            best_mean_spread_n: what_if.best.mean_spread(),
            gain_share: what_if.gain_share(),
            actuators: actuators(what_if),
            statuses,
            caveats: CAVEATS,
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
    let suspension = &what_if.suspension;
    let of = |(name, rod): (String, &super::track::RodTrack)| {
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
    let rods = rod_names(what_if).into_iter().zip(&what_if.moved.rods);
    rods.map(of).collect()
}

/// Findings as sentences.
#[must_use]
pub(crate) fn findings(what_if: &WhatIf) -> Vec<String> {
    let (fixed, moved) = (&what_if.fixed, &what_if.moved);
    let then = match what_if.options.suspension {
        SuspensionMode::Locked => "locked",
        SuspensionMode::Recorded => "as recorded",
        SuspensionMode::Literal | SuspensionMode::LookAhead => "controlled",
    };
    let mut found = Vec::new();
    let (before, after) = (mean(&fixed.spread), mean(&moved.spread));
    found.push(format!(
        "Mean spread of the wheel loads, equation (35) with each pair once: {:.0} N with the suspension locked, {:.0} N \
         with it {then} ({:+.1} %).",
        before,
        after,
        100.0 * (after / before - 1.0)
    ));
    found.push(match what_if.gain_share() {
        Some(share) => format!(
            "The best static posture at each sample would give {:.0} N: {:.0} % of the possible reduction was achieved.",
            what_if.best.mean_spread(),
            100.0 * share
        ),
        None => format!(
            "No posture within the stroke has a smaller spread than the locked one ({:.0} N).",
            what_if.best.mean_spread()
        ),
    });
    let (before, after) = (mean(&fixed.com_offset()), mean(&moved.com_offset()));
    found.push(format!(
        "Mean distance of the centre of mass from the middle of the contact points: {:.1} cm with the suspension \
         locked, {:.1} cm with it {then}.",
        100.0 * before,
        100.0 * after
    ));
    for (wheel, spec) in what_if.analysis.machine.wheels().iter().enumerate() {
        let least = |track: &Track| range(&track.load[wheel])[0];
        let lifted = |track: &Track| track.load[wheel].iter().filter(|&&n| n == 0.0).count();
        if lifted(fixed) + lifted(moved) > 0 {
            found.push(format!(
                "Wheel {}: unloaded in {} rows with the suspension locked, in {} with it {then}.",
                spec.name,
                lifted(fixed),
                lifted(moved)
            ));
        } else {
            found.push(format!(
                "Wheel {}: smallest load {:.0} N with the suspension locked, {:.0} N with it {then}.",
                spec.name,
                least(fixed),
                least(moved)
            ));
        }
    }
    let alarms = moved.status.iter().flatten().filter(|s| s.is_alarm());
    let alarms = alarms.count();
    let short = moved.status.iter().flatten();
    let short = short.filter(|&&s| s == Status::StepTooShort).count();
    if alarms > 0 {
        found.push(format!(
            "The control raised an alarm in {alarms} rows; see column status."
        ));
    }
    if short > 0 {
        found.push(format!(
            "In {short} rows the rods stopped, because the step was too short for the posture of the arm."
        ));
    }
    found
}

/// Mean of the finite values; NaN if there are none.
pub(crate) fn mean(values: &[f64]) -> f64 {
    let known = values.iter().filter(|v| v.is_finite());
    known.clone().sum::<f64>() / known.count() as f64
}

fn rms(values: &[f64]) -> f64 {
    let squares: Vec<f64> = values.iter().map(|v| v * v).collect();
    mean(&squares).sqrt()
}

/// Smallest and largest of the finite values; NaN if there are none.
fn range(values: &[f64]) -> [f64; 2] {
    let known = values.iter().copied().filter(|v| v.is_finite());
    known.fold([f64::NAN; 2], |[least, greatest], v| {
        [least.min(v), greatest.max(v)]
    })
}

fn largest(values: &[f64]) -> f64 {
    let [least, greatest] = range(values);
    least.abs().max(greatest.abs())
}

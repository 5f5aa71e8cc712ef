//! The margin of a machine: remaining load of its worst wheel, as a share of its static load.
//!
//! ```text
//!     margin = min over the wheels of OTF / static load
//! ```
//! It is 1 for a machine at rest on level ground and 0 for a wheel about to lift. OTF is the overturning
//! force, the load that a wheel would carry if every wheel were held to the ground.

use serde::{Deserialize, Serialize};
use tipwatch_mechanics::{Contribution, Quantity};

use crate::analysis::Analysis;
use crate::base::number::known;

/// Edges of the bins of [`Exposure::margin_s`]: one below 0, twenty of width 1/20, one above 1.
pub const HISTOGRAM_EDGES: [f64; 21] = {
    let mut edges = [0.0; 21];
    let mut i = 0;
    while i < 21 {
        edges[i] = i as f64 / 20.0;
        i += 1;
    }
    edges
};

/// Causes of load loss, in the order of [`Exposure::exposed_by_cause_s`]: `posture` is the change of the
/// weight loads of chassis, wheels and arm from the static posture; the others are named as in the
/// columns.
pub const EXPOSURE_CAUSES: [&str; 7] = [
    "posture",
    "slope",
    "arm_motion",
    "platform_acceleration",
    "cornering",
    "tool_force",
    "specific_force",
];

/// The causes behind each of [`EXPOSURE_CAUSES`] but the first.
const MOTION_CAUSES: [Contribution; 6] = [
    Contribution::Slope,
    Contribution::ArmMotion,
    Contribution::PlatformAcceleration,
    Contribution::Cornering,
    Contribution::ToolForce,
    Contribution::SpecificForce,
];
const WEIGHTS: [Contribution; 3] = [
    Contribution::ChassisWeight,
    Contribution::WheelWeight,
    Contribution::ArmWeight,
];

/// The smallest margin of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorstMargin {
    /// OTF as a share of the static load.
    pub margin: f64,
    /// Its standard deviation; `None` for models without it.
    pub sigma: Option<f64>,
    /// The wheel, in lower case.
    pub wheel: String,
    /// Time (ns).
    pub time_ns: i64,
    /// OTF of the wheel at that time (N).
    pub otf_n: f64,
    /// Its standard deviation (N).
    pub otf_sigma_n: Option<f64>,
}

/// Time by margin, and causes of small margins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Time in each bin of the margin (s); see [`HISTOGRAM_EDGES`]. `None` without any margin.
    pub margin_s: Option<Vec<f64>>,
    /// Time without a computable margin (s).
    pub unknown_s: f64,
    /// Time with a margin below 1 - the notice level of the machine file (s); `None` without any margin.
    pub exposed_s: Option<f64>,
    /// The same by cause (s), in the order of [`EXPOSURE_CAUSES`]: each instant is divided in proportion
    /// to the load that the causes take from the worst wheel; `None` for models without causes.
    pub exposed_by_cause_s: Option<Vec<f64>>,
}

/// The columns that define margins.
struct Wheels<'a> {
    analysis: &'a Analysis,
    otf: Vec<&'a [f64]>,
    static_load: &'a [f64],
}

impl<'a> Wheels<'a> {
    fn of(analysis: &'a Analysis) -> Self {
        let wheels = 0..analysis.machine.wheels().len();
        let otf = wheels.map(|wheel| analysis.rows.outcomes.column(Quantity::Otf(wheel)));
        Self {
            analysis,
            otf: otf.collect(),
            static_load: &analysis.machine.reference().static_load,
        }
    }

    /// The worst wheel of a row and its margin; `None` unless all wheels have one.
    fn margin(&self, row: usize) -> Option<(usize, f64)> {
        let margin = |wheel: usize| self.otf[wheel][row] / self.static_load[wheel];
        let margins = (0..self.otf.len()).map(|wheel| (wheel, margin(wheel)));
        let worst = margins.reduce(|a, b| if b.1 < a.1 || b.1.is_nan() { b } else { a })?;
        let usable = self.static_load.iter().all(|&load| load > 0.0);
        (usable && worst.1.is_finite()).then_some(worst)
    }

    fn column(&self, quantity: Quantity) -> Option<&'a [f64]> {
        let outcomes = &self.analysis.rows.outcomes;
        let has = outcomes.quantities.contains(&quantity);
        has.then(|| outcomes.column(quantity))
    }
}

/// The smallest margin over the valid rows; `None` if there is none.
pub(super) fn worst(analysis: &Analysis) -> Option<WorstMargin> {
    let (rows, wheels) = (&analysis.rows, Wheels::of(analysis));
    let valid = (0..rows.len()).filter(|&row| rows.is_valid(row));
    let margins = valid.filter_map(|row| wheels.margin(row).map(|worst| (row, worst)));
    let (row, (wheel, margin)) = margins.min_by(|a, b| (a.1).1.total_cmp(&(b.1).1))?;
    let sigma_n = wheels.column(Quantity::OtfSigma(wheel)).map(|s| s[row]);
    let otf_sigma_n = sigma_n.and_then(known);
    Some(WorstMargin {
        margin,
        sigma: otf_sigma_n.map(|sigma| sigma / wheels.static_load[wheel]),
        wheel: analysis.machine.wheels()[wheel].name.to_lowercase(),
        time_ns: rows.times_ns[row],
        otf_n: wheels.otf[wheel][row],
        otf_sigma_n,
    })
}

pub(super) fn largest_utilisation(analysis: &Analysis) -> Option<f64> {
    let column = Wheels::of(analysis).column(Quantity::Utilisation)?;
    let values = column.iter().enumerate();
    values
        .filter(|(row, value)| analysis.rows.is_valid(*row) && value.is_finite())
        .map(|(_, &value)| value)
        .reduce(f64::max)
}

/// Exposure: a row lasts until the next one, except across gaps. Rows of a tipping machine count too,
/// below zero.
pub(super) fn exposure(analysis: &Analysis) -> Exposure {
    let (rows, wheels) = (&analysis.rows, Wheels::of(analysis));
    let notice_margin = 1.0 - analysis.machine.limits().notice;
    let max_gap_s = analysis.machine.estimator().max_gap;
    let mut by_cause = wheels
        .column(Quantity::Contribution(Contribution::ChassisWeight, 0))
        .map(|_| vec![0.0; EXPOSURE_CAUSES.len()]);
    let mut margin_s = vec![0.0; HISTOGRAM_EDGES.len() + 1];
    let (mut known_s, mut exposed_s) = (0.0, 0.0);
    for row in 0..rows.len().saturating_sub(1) {
        let lasts_s = (rows.times_ns[row + 1] - rows.times_ns[row]) as f64 * 1e-9;
        let margin = wheels.margin(row);
        let margin = margin.filter(|_| rows.reasons[row].leave_loads() && lasts_s <= max_gap_s);
        let Some((wheel, margin)) = margin else {
            continue;
        };
        known_s += lasts_s;
        margin_s[HISTOGRAM_EDGES.partition_point(|&edge| edge <= margin)] += lasts_s;
        if margin < notice_margin {
            exposed_s += lasts_s;
            if let Some(by_cause) = &mut by_cause {
                share_out(lasts_s, &taken(&wheels, row, wheel), by_cause);
            }
        }
    }
    let is_known = known_s > 0.0;
    Exposure {
        margin_s: is_known.then_some(margin_s),
        unknown_s: (analysis.coverage.covered_s - known_s).max(0.0),
        exposed_s: is_known.then_some(exposed_s),
        exposed_by_cause_s: by_cause.filter(|_| is_known),
    }
}

/// Load that each of [`EXPOSURE_CAUSES`] takes from a wheel, relative to the static load (N).
fn taken(wheels: &Wheels<'_>, row: usize, wheel: usize) -> [f64; EXPOSURE_CAUSES.len()] {
    let given = |cause: Contribution| {
        let column = wheels.column(Quantity::Contribution(cause, wheel));
        column.map_or(0.0, |values| values[row])
    };
    let mut taken = [0.0; EXPOSURE_CAUSES.len()];
    taken[0] = wheels.static_load[wheel] - WEIGHTS.map(given).iter().sum::<f64>();
    for (taken, cause) in taken[1..].iter_mut().zip(MOTION_CAUSES) {
        *taken = -given(cause);
    }
    taken
}

/// Divides a time in proportion to the load that each cause takes; causes that add load get no share.
fn share_out(time_s: f64, taken: &[f64], by_cause: &mut [f64]) {
    let takes = |value: f64| if value > 0.0 { value } else { 0.0 };
    let all: f64 = taken.iter().map(|&value| takes(value)).sum();
    for (sum, &value) in by_cause.iter_mut().zip(taken) {
        if all > 0.0 {
            *sum += time_s * takes(value) / all;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_by_cause_adds_up() {
        let mut by_cause = [0.0; 4];
        share_out(2.0, &[300.0, -500.0, 100.0, f64::NAN], &mut by_cause);
        assert_eq!(by_cause, [1.5, 0.0, 0.5, 0.0]);
    }

    #[test]
    fn margins_at_an_edge_fall_into_the_bin_above() {
        let bin = |margin: f64| HISTOGRAM_EDGES.partition_point(|&edge| edge <= margin);
        assert_eq!([bin(-0.01), bin(0.0), bin(0.049)], [0, 1, 1]);
        assert_eq!([bin(0.999), bin(1.0), bin(3.0)], [20, 21, 21]);
    }
}

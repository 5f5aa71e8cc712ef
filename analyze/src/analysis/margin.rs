//! The margin of a machine: remaining load of its worst wheel, as a share of its static load.
//!
//! ```text
//!     margin = min over the wheels of OTF / static load
//! ```
//! It is 1 for a machine at rest on level ground and 0 for a wheel about to lift. OTF is the overturning
//! force, the load that a wheel would carry if every wheel were held to the ground.

use serde::{Deserialize, Serialize};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::machine::Parameter;
use tipwatch_mechanics::{Contribution, Quantity, State};

use super::study::{Block, StudiedLog, Study};
use crate::base::number::known;
use crate::base::rows::Rows;
use crate::base::shared::Shared;

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
    pub wheel: Shared<str>,
    /// Time (ns).
    pub time_ns: i64,
    /// OTF of the wheel at that time (N).
    pub otf_n: f64,
    /// Its standard deviation (N).
    pub otf_sigma_n: Option<f64>,
    /// Motion of the machine at that time; absent from results of older versions.
    #[serde(default)]
    pub moment: Option<Moment>,
}

/// Motion of a machine at one time. A quantity that the log does not contain is `None`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Speed of the base (m/s).
    pub speed_m_s: Option<f64>,
    /// Angle between the upward axis of the base and the vertical (rad).
    pub tilt_rad: Option<f64>,
    /// Names of the joints other than those that turn wheels.
    pub joints: Shared<[String]>,
    /// Whether the position of each joint is a length; absent from results of older versions.
    #[serde(default)]
    pub are_lengths: Vec<bool>,
    /// Position of each joint (rad or m).
    pub positions: Vec<Option<f64>>,
}

impl Moment {
    fn of(machine: &Machine, rows: &Rows, row: usize) -> Self {
        let mut state = State::zero(machine);
        rows.states.get(row, &mut state);
        let up = state.base.up;
        let all = machine.joints().iter().enumerate();
        let joints = || all.clone().filter(|(_, joint)| joint.spins_wheel.is_none());
        let names: Vec<String> = joints().map(|(_, joint)| joint.name.clone()).collect();
        let position = |joint| state.value(Parameter::JointPosition(joint)).and_then(known);
        Self {
            speed_m_s: known(state.base.velocity.norm()),
            tilt_rad: known(up.z.clamp(-1.0, 1.0).acos()),
            joints: names.into(),
            are_lengths: joints()
                .map(|(joint, _)| machine.joint_slides(joint))
                .collect(),
            positions: joints().map(|(joint, _)| position(joint)).collect(),
        }
    }
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
    /// Exposed time by cause (s), in the order of [`EXPOSURE_CAUSES`]: each instant is divided in proportion to the load that the
    /// causes take from the worst wheel; `None` for models without causes.
    pub exposed_by_cause_s: Option<Vec<f64>>,
}

/// Margins while the rows are computed block by block.
#[derive(Debug)]
pub(super) struct MarginPass<'a> {
    machine: &'a Machine,
    /// Times of all rows (ns).
    times_ns: &'a [i64],
    /// Those of the rows so far.
    margins: Margins,
}

/// The margins of a log.
#[derive(Debug, Clone, Default)]
pub struct Margins {
    /// The smallest margin over the valid rows; `None` if there is none.
    pub worst: Option<WorstMargin>,
    /// The smallest margin that holds under any split of the load, 0 to 1, see `MarginPass::holds_under_any_split`.
    /// `None` where it is unknown.
    pub any_split: Option<f64>,
    /// Largest utilisation over the valid rows.
    pub largest_utilisation: Option<f64>,
    margin_s: Vec<f64>,
    known_s: f64,
    exposed_s: f64,
    by_cause_s: Option<Vec<f64>>,
}

impl Margins {
    /// Exposure: a row lasts until the next one, except across gaps. Rows of a tipping machine count too,
    /// below zero. `covered_s` is the time that the log covers.
    #[must_use]
    pub fn exposure(&self, covered_s: f64) -> Exposure {
        let is_known = self.known_s > 0.0;
        Exposure {
            margin_s: is_known.then(|| self.margin_s.clone()),
            unknown_s: (covered_s - self.known_s).max(0.0),
            exposed_s: is_known.then_some(self.exposed_s),
            exposed_by_cause_s: self.by_cause_s.clone().filter(|_| is_known),
        }
    }
}

impl<'a> Study<'a> for MarginPass<'a> {
    type Found = Margins;

    fn begin(log: &StudiedLog<'a>) -> Self {
        let chassis = Quantity::Contribution(Contribution::ChassisWeight, 0);
        let has_causes = log.table.has(chassis);
        Self {
            machine: log.machine,
            times_ns: &log.table.times_ns,
            margins: Margins {
                margin_s: vec![0.0; HISTOGRAM_EDGES.len() + 1],
                by_cause_s: has_causes.then(|| vec![0.0; EXPOSURE_CAUSES.len()]),
                ..Margins::default()
            },
        }
    }

    fn take(&mut self, block: &Block<'a>) {
        let rows = &*block.rows;
        let wheels = Wheels::of(self.machine, rows);
        let notice_margin = 1.0 - self.machine.limits().notice;
        let max_gap_s = self.machine.estimator().max_gap;
        let utilisation = wheels.rows.outcomes.known_column(Quantity::Utilisation);
        let largest_loads: Vec<_> = (0..self.machine.wheels().len())
            .map(|wheel| {
                wheels
                    .rows
                    .outcomes
                    .known_column(Quantity::LoadLargest(wheel))
            })
            .collect();
        let mut worst_row = None;
        for row in 0..rows.len() {
            let margin = wheels.margin(row);
            if rows.is_valid(row) {
                if self.look_for_worst(&wheels, row, margin) {
                    worst_row = Some(row);
                }
                self.holds_under_any_split(&wheels, row, &largest_loads);
                let used = utilisation.map(|values| values[row]);
                let used = used.filter(|used| used.is_finite());
                let largest = &mut self.margins.largest_utilisation;
                *largest = largest.iter().copied().chain(used).reduce(f64::max);
            }
            let Some(next_ns) = self.times_ns.get(rows.first + row + 1) else {
                continue;
            };
            let lasts_s = (next_ns - rows.times_ns[row]) as f64 * 1e-9;
            let margin = margin.filter(|_| rows.reasons[row].leave_loads() && lasts_s <= max_gap_s);
            let Some((wheel, margin)) = margin else {
                continue;
            };
            let margins = &mut self.margins;
            margins.known_s += lasts_s;
            margins.margin_s[HISTOGRAM_EDGES.partition_point(|&edge| edge <= margin)] += lasts_s;
            if margin < notice_margin {
                margins.exposed_s += lasts_s;
                if let Some(by_cause) = &mut margins.by_cause_s {
                    share_out(lasts_s, &taken(&wheels, row, wheel), by_cause);
                }
            }
        }
        if let (Some(row), Some(worst)) = (worst_row, &mut self.margins.worst) {
            worst.moment = Some(Moment::of(self.machine, rows, row));
        }
    }
}

impl From<MarginPass<'_>> for Margins {
    fn from(pass: MarginPass<'_>) -> Self {
        pass.margins
    }
}

impl MarginPass<'_> {
    /// The margin of a row under any split: the largest load that equilibrium allows the wheel that may have least of it, as
    /// a share of its static load, at most 1. It is 0 where a wheel is off the ground under every split. (The smallest load
    /// says nothing: more than three wheels always have a split that leaves one of them nothing.)
    fn holds_under_any_split(
        &mut self,
        wheels: &Wheels<'_>,
        row: usize,
        largest_loads: &[Option<&[f64]>],
    ) {
        for (load, static_load) in largest_loads.iter().zip(wheels.static_load) {
            let share = load.map(|load| load[row] / static_load).and_then(known);
            let share = share.map(|share| share.min(1.0));
            let least = &mut self.margins.any_split;
            *least = least.iter().copied().chain(share).reduce(f64::min);
        }
    }

    /// Takes the row if it has the smallest margin so far; returns whether it has.
    fn look_for_worst(
        &mut self,
        wheels: &Wheels<'_>,
        row: usize,
        margin: Option<(usize, f64)>,
    ) -> bool {
        let Some((wheel, margin)) = margin else {
            return false;
        };
        let is_worse = |worst: &WorstMargin| margin.total_cmp(&worst.margin).is_lt();
        if !self.margins.worst.as_ref().is_none_or(is_worse) {
            return false;
        }
        let sigmas = wheels.rows.outcomes.known_column(Quantity::OtfSigma(wheel));
        let sigma_n = sigmas.map(|s| s[row]);
        let otf_sigma_n = sigma_n.and_then(known);
        self.margins.worst = Some(WorstMargin {
            margin,
            sigma: otf_sigma_n.map(|sigma| sigma / wheels.static_load[wheel]),
            wheel: self.machine.wheels()[wheel].name.to_lowercase().into(),
            time_ns: wheels.rows.times_ns[row],
            otf_n: wheels.least_otf(wheel, row),
            otf_sigma_n,
            moment: None,
        });
        true
    }
}

/// The columns that define margins.
struct Wheels<'a> {
    rows: &'a Rows,
    otf: Vec<&'a [f64]>,
    /// Smallest OTF until the next row of a sparse log; empty for other logs.
    least: Vec<&'a [f64]>,
    static_load: &'a [f64],
    /// Contributions by cause of [`WEIGHTS`] and [`MOTION_CAUSES`] and by wheel; empty for models without them.
    contributions: Vec<Vec<&'a [f64]>>,
}

impl<'a> Wheels<'a> {
    fn of(machine: &'a Machine, rows: &'a Rows) -> Self {
        let wheels = 0..machine.wheels().len();
        let otf = wheels
            .clone()
            .map(|wheel| rows.outcomes.column(Quantity::Otf(wheel)));
        let causes = WEIGHTS.into_iter().chain(MOTION_CAUSES);
        let known = |of: &dyn Fn(usize) -> Quantity| -> Vec<&'a [f64]> {
            let columns = wheels
                .clone()
                .map(|wheel| rows.outcomes.known_column(of(wheel)));
            columns.flatten().collect()
        };
        let of_cause = |cause: Contribution| known(&|wheel| Quantity::Contribution(cause, wheel));
        Self {
            rows,
            least: known(&Quantity::OtfBetweenLeast),
            otf: otf.collect(),
            static_load: &machine.reference().static_load,
            contributions: causes.map(of_cause).collect(),
        }
    }

    /// The worst wheel of a row and its margin; `None` unless all wheels have one.
    fn margin(&self, row: usize) -> Option<(usize, f64)> {
        let margin = |wheel: usize| self.least_otf(wheel, row) / self.static_load[wheel];
        let margins = (0..self.otf.len()).map(|wheel| (wheel, margin(wheel)));
        let worst = margins.reduce(|a, b| if b.1 < a.1 || b.1.is_nan() { b } else { a })?;
        let usable = self.static_load.iter().all(|&load| load > 0.0);
        (usable && worst.1.is_finite()).then_some(worst)
    }

    /// The OTF of a row; of a static row the smallest that motion until the next one allows, where it is known.
    fn least_otf(&self, wheel: usize, row: usize) -> f64 {
        let least = self.least.get(wheel).map(|least| least[row]);
        let least = least.filter(|least| least.is_finite());
        least.unwrap_or(self.otf[wheel][row])
    }
}

/// Load that each of [`EXPOSURE_CAUSES`] takes from a wheel, relative to the static load (N).
fn taken(wheels: &Wheels<'_>, row: usize, wheel: usize) -> [f64; EXPOSURE_CAUSES.len()] {
    let given = |columns: &Vec<&[f64]>| columns.get(wheel).map_or(0.0, |values| values[row]);
    let (weights, motion) = wheels.contributions.split_at(WEIGHTS.len());
    let mut taken = [0.0; EXPOSURE_CAUSES.len()];
    taken[0] = wheels.static_load[wheel] - weights.iter().map(given).sum::<f64>();
    for (taken, columns) in taken[1..].iter_mut().zip(motion) {
        *taken = -given(columns);
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

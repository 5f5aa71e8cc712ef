//! Causes of a load loss: the contributions that took the load up to the onset of an event.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{Contribution, Quantity, State};

use super::event::{CauseShare, EventCauses};
use super::pages::Pages;
use crate::base::rows::Rows;

/// Joint velocities (rad/s or m/s) and angular velocities (rad/s) of a steady machine are below this.
const STEADY_RATE: f64 = 0.02;
/// The load that acceleration adds to or takes from a wheel of a steady machine is below this share of the mean
/// load.
const STEADY_LOAD_SHARE: f64 = 0.02;
/// Time for which a machine must have been at rest to count as steady (ns).
const STEADY_NS: i64 = 500_000_000;
/// Time in which causes are looked for where no moment was steady (ns).
const BEFORE_NS: i64 = 2_000_000_000;
/// Contributions of acceleration and motion to a load.
const OF_MOTION: [Contribution; 3] = [
    Contribution::ArmMotion,
    Contribution::PlatformAcceleration,
    Contribution::Cornering,
];

/// Finds the causes of the events of a log.
pub(super) struct Causes<'a> {
    pub(super) rows: &'a Pages<'a>,
    pub(super) steady: &'a SteadyRows,
}

impl Causes<'_> {
    /// Load loss by cause of a weighted sum of OTF between the last steady moment, or without one two seconds before, and the
    /// onset: the last row with loads up to `start_ns`. `None` where either is unknown.
    pub(super) fn of(&self, start_ns: i64, factors: &[f64]) -> Option<EventCauses> {
        let upto = self.rows.times_ns.partition_point(|&t| t <= start_ns);
        // up to the onset the wheels are on the ground, though rows before it may be taken as tipping already
        let row = (0..upto).rev().find(|&row| self.rows.is_meaningful(row))?;
        let at = |quantity: &dyn Fn(usize) -> Quantity, row: usize| -> f64 {
            let wheels = factors.iter().enumerate().filter(|(_, f)| **f != 0.0);
            wheels
                .map(|(wheel, f)| f * self.rows.value(quantity(wheel), row))
                .sum()
        };
        let otf_n = at(&Quantity::Otf, row);
        let by_cause = |cause| at(&|wheel| Quantity::Contribution(cause, wheel), row);
        let steady = self.steady.upto(row);
        let from = steady.or_else(|| self.shortly_before(row))?;
        let otf_before_n = at(&Quantity::Otf, from);
        let before = Contribution::ALL
            .iter()
            .map(|&cause| at(&|wheel| Quantity::Contribution(cause, wheel), from));
        let before: Vec<f64> = before.collect();
        let lost_n = otf_before_n - otf_n;
        if !lost_n.is_finite() {
            return None;
        }
        // Load transferred from lifted wheels follows from the lift, it does not cause it.
        let causes = Contribution::ALL.into_iter().zip(before);
        let mut shares: Vec<CauseShare> = causes
            .filter(|(cause, _)| *cause != Contribution::LiftOff)
            .map(|(cause, before)| (cause, before - by_cause(cause)))
            .filter(|(_, taken_n)| taken_n.is_finite())
            .map(|(cause, taken_n)| CauseShare {
                cause: cause.name(),
                taken_n,
                percent: 100.0 * taken_n / lost_n,
            })
            .collect();
        shares.sort_by(|a, b| b.taken_n.total_cmp(&a.taken_n));
        Some(EventCauses {
            since_ns: self.rows.times_ns[from],
            since_is_steady: steady.is_some(),
            at_ns: self.rows.times_ns[row],
            otf_before_n,
            otf_n,
            shares,
        })
    }

    /// The valid row two seconds before `row`, or the first one after that.
    fn shortly_before(&self, row: usize) -> Option<usize> {
        let from_ns = self.rows.times_ns[row].saturating_sub(BEFORE_NS);
        (self.rows.at(from_ns)..row).find(|&row| self.rows.is_valid(row))
    }
}

/// The rows at which the machine has been steady for a while.
#[derive(Debug, Default)]
pub(super) struct SteadyRows {
    /// Runs of steady rows, ends included.
    runs: Vec<(usize, usize)>,
    /// Time since which the machine has been steady (ns).
    since_ns: Option<i64>,
}

impl SteadyRows {
    /// Returns the last steady row up to `row`.
    fn upto(&self, row: usize) -> Option<usize> {
        let after = self.runs.partition_point(|run| run.0 <= row);
        let run = after.checked_sub(1).map(|place| self.runs[place])?;
        Some(run.1.min(row))
    }

    /// Looks at the next rows. While a wheel carries less than its limit (N), the machine is no longer as it was before.
    pub(super) fn add(&mut self, machine: &Machine, rows: &Rows, min_loads_n: Option<&[f64]>) {
        let of = OfRows::new(machine, rows, min_loads_n);
        let mut state = State::zero(machine);
        for row in 0..rows.len() {
            let is_steady = rows.is_valid(row) && of.is_steady(row, &mut state);
            let time_ns = rows.times_ns[row];
            self.since_ns = match self.since_ns {
                Some(since) if is_steady => Some(since),
                _ => is_steady.then_some(time_ns),
            };
            if self
                .since_ns
                .is_some_and(|since| time_ns - since >= STEADY_NS)
            {
                let row = rows.first + row;
                match self.runs.last_mut() {
                    Some(run) if run.1 + 1 == row => run.1 = row,
                    _ => self.runs.push((row, row)),
                }
            }
        }
    }
}

/// Quantities of the rows that decide whether the machine is steady.
struct OfRows<'a> {
    machine: &'a Machine,
    rows: &'a Rows,
    weight: &'a [f64],
    /// Load of each wheel, and the least load of a wheel that is not light (N).
    loads: Vec<(&'a [f64], f64)>,
    /// Contributions of motion to the load of each wheel.
    motion: Vec<[&'a [f64]; OF_MOTION.len()]>,
}

impl<'a> OfRows<'a> {
    fn new(machine: &'a Machine, rows: &'a Rows, min_loads_n: Option<&[f64]>) -> Self {
        let load = |wheel: usize| {
            let least_n = min_loads_n.map_or(0.0, |limits| limits[wheel].max(0.0));
            (rows.outcomes.column(Quantity::Load(wheel)), least_n)
        };
        let of_wheel = |wheel: usize| {
            OF_MOTION.map(|cause| rows.outcomes.column(Quantity::Contribution(cause, wheel)))
        };
        Self {
            machine,
            rows,
            weight: rows.outcomes.column(Quantity::NormalForce),
            loads: (0..machine.wheels().len()).map(load).collect(),
            motion: (0..machine.wheels().len()).map(of_wheel).collect(),
        }
    }

    /// Whether the machine neither moves nor accelerates, except perhaps its wheels at constant speed, and no wheel is light.
    /// Without an attitude, acceleration and slope cannot be told apart, so the wheels must stand still too.
    fn is_steady(&self, row: usize, state: &mut State<f64>) -> bool {
        let mean_n = self.weight[row] / self.motion.len() as f64;
        let mut moved = self.motion.iter().map(|columns| -> f64 {
            let known = columns.iter().map(|column| column[row]);
            known.filter(|n| n.is_finite()).sum()
        });
        let mut loads = self.loads.iter();
        if !moved.all(|n| n.abs() < STEADY_LOAD_SHARE * mean_n)
            || loads.any(|(load_n, least_n)| load_n[row] <= *least_n)
        {
            return false;
        }
        self.rows.states.get(row, state);
        let knows_attitude = state.base.known_up().is_some();
        let joints = self.machine.joints().iter().zip(&state.joints);
        let still = joints
            .filter(|(joint, _)| joint.spins_wheel.is_none() || !knows_attitude)
            .all(|(_, motion)| motion.rate.abs() < STEADY_RATE);
        still && state.imu.angular_velocity.norm() < STEADY_RATE
    }
}

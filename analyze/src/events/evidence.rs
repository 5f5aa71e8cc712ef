//! The evidence for an event: its confidence, and the causes of the load loss.

use std::cell::OnceCell;

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{
    Contribution, Quantity, Scope, State, Workspace, combination_sigma, evaluate,
};

use super::event::{CauseShare, Event, EventCauses, EventKind};
use crate::base::rows::Rows;

/// Joint velocities (rad/s or m/s) and angular velocities (rad/s) of a machine at rest are below this.
const STEADY_RATE: f64 = 0.02;
/// The acceleration (m/s^2) of a machine at rest is below this, noise included.
const STEADY_ACCELERATION: f64 = 0.2;

/// Finds the evidence for the events of a log.
pub(crate) struct Evidence<'a> {
    machine: &'a Machine,
    rows: &'a Rows,
    scope: Scope,
    /// For each row, the last valid row before it in which the machine was steady; computed on first use,
    /// once for all events.
    steady_before: OnceCell<Vec<Option<usize>>>,
}

/// What an event claims: a sum of OTF is below a limit.
struct Claim {
    /// Weight of the OTF of each wheel in the sum.
    factors: Vec<f64>,
    /// The claim holds while the sum is below this (N).
    limit_n: f64,
}

impl<'a> Evidence<'a> {
    pub(crate) fn new(machine: &'a Machine, rows: &'a Rows, scope: Scope) -> Self {
        Self {
            machine,
            rows,
            scope,
            steady_before: OnceCell::new(),
        }
    }

    /// Adds confidence and causes to an event, as far as the scope of the evaluation includes them.
    pub(crate) fn add(&self, event: &mut Event, min_loads_n: Option<&[f64]>) {
        let Some(claim) = self.claim(event, min_loads_n) else {
            return;
        };
        let row = self.most_unloaded(event, &claim);
        if self.scope.sensitivities {
            event.certainty = self.certainty(row, &claim);
        }
        if self.scope.contributions {
            event.causes = self.causes(event, row, &claim);
        }
    }

    fn claim(&self, event: &Event, min_loads_n: Option<&[f64]>) -> Option<Claim> {
        let wheels = self.machine.wheels();
        let wheel = wheels
            .iter()
            .position(|w| w.name.to_lowercase() == event.subject);
        let only = |wheel: usize| (0..wheels.len()).map(move |w| f64::from(u8::from(w == wheel)));
        match event.kind {
            EventKind::WheelLight => wheel.map(|wheel| Claim {
                factors: only(wheel).collect(),
                limit_n: min_loads_n.map_or(f64::NAN, |loads| loads[wheel]),
            }),
            EventKind::WheelLift => wheel.map(|wheel| Claim {
                factors: only(wheel).collect(),
                limit_n: 0.0,
            }),
            EventKind::EdgeTipping | EventKind::TipOver => {
                let mut edges = self.machine.polygon().edges().iter();
                let edge = edges.find(|edge| edge.name == event.subject)?;
                let factors = edge.carries.iter().map(|&on| if on { 0.0 } else { 1.0 });
                Some(Claim {
                    factors: factors.collect(),
                    limit_n: 0.0,
                })
            }
            EventKind::InputGap | EventKind::InputFault => None,
        }
    }

    /// The row of the event in which the sum is smallest.
    fn most_unloaded(&self, event: &Event, claim: &Claim) -> usize {
        let first = self.rows.at(event.start_ns);
        let last = event
            .end_ns
            .map_or(self.rows.len() - 1, |end| self.rows.at(end));
        let least =
            (first..=last).min_by(|&a, &b| self.otf(a, claim).total_cmp(&self.otf(b, claim)));
        least.unwrap_or(first)
    }

    /// The sum of OTF (N).
    fn otf(&self, row: usize, claim: &Claim) -> f64 {
        let columns = claim.factors.iter().enumerate();
        columns
            .filter(|(_, factor)| **factor != 0.0)
            .map(|(wheel, factor)| factor * self.rows.outcomes.column(Quantity::Otf(wheel))[row])
            .sum()
    }

    /// Probability that the sum is below the limit, if it is normally distributed with the computed standard
    /// deviation.
    fn certainty(&self, row: usize, claim: &Claim) -> Option<f64> {
        let mut state = State::zero(self.machine);
        self.rows.states.get(row, &mut state);
        let mut workspace = Workspace::with_scope(self.machine, Scope::ALL);
        evaluate(self.machine, &state, &mut workspace);
        let sigma = combination_sigma(self.machine, &state, &workspace, &claim.factors);
        let probability = normal_distribution((claim.limit_n - self.otf(row, claim)) / sigma);
        Some(probability).filter(|p| p.is_finite())
    }

    /// Load loss by cause since the machine was last steady, or since the first valid row.
    fn causes(&self, event: &Event, row: usize, claim: &Claim) -> Option<EventCauses> {
        let start = self.rows.at(event.start_ns);
        let steady = self.steady_before(start);
        let first_valid = || (0..start).find(|&row| self.rows.is_valid(row));
        let from = steady.or_else(first_valid)?;
        let lost_n = self.otf(from, claim) - self.otf(row, claim);
        let by_cause = |cause: Contribution, row: usize| -> f64 {
            let wheels = claim.factors.iter().enumerate().filter(|(_, f)| **f != 0.0);
            wheels
                .map(|(wheel, factor)| {
                    factor
                        * self
                            .rows
                            .outcomes
                            .column(Quantity::Contribution(cause, wheel))[row]
                })
                .sum()
        };
        let mut shares: Vec<CauseShare> = Contribution::ALL
            .into_iter()
            .filter(|&cause| cause != Contribution::LiftOff)
            .map(|cause| (cause, by_cause(cause, from) - by_cause(cause, row)))
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
            otf_before_n: self.otf(from, claim),
            otf_n: self.otf(row, claim),
            shares,
        })
    }

    /// The last valid row before `row` in which the machine was steady.
    fn steady_before(&self, row: usize) -> Option<usize> {
        let all = self.steady_before.get_or_init(|| {
            let mut state = State::zero(self.machine);
            let mut last = None;
            let before = |row: usize| {
                let known = last;
                self.rows.states.get(row, &mut state);
                if self.rows.is_valid(row) && is_steady(self.machine, &state) {
                    last = Some(row);
                }
                known
            };
            (0..self.rows.len()).map(before).collect()
        });
        all[row]
    }
}

/// Whether nothing moves, except perhaps the wheels at constant speed.
fn is_steady(machine: &Machine, state: &State<f64>) -> bool {
    let joints = machine.joints().iter().zip(&state.joints);
    let still = joints
        .filter(|(joint, _)| joint.spins_wheel.is_none())
        .all(|(_, motion)| motion.rate.abs() < STEADY_RATE);
    let push = state.imu.specific_force.norm() - machine.gravity();
    still && state.imu.angular_velocity.norm() < STEADY_RATE && push.abs() < STEADY_ACCELERATION
}

/// Cumulative distribution function of the standard normal distribution.
fn normal_distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::normal_distribution;

    #[test]
    fn normal_distribution_matches_tabulated_values() {
        for (z, p) in [
            (0.0, 0.5),
            (1.0, 0.841_344_746_068_543),
            (-2.0, 0.022_750_131_948_179),
            (6.0, 1.0 - 9.865_876e-10),
        ] {
            assert!((normal_distribution(z) - p).abs() < 1e-15, "{z}");
        }
        assert!(normal_distribution(f64::NAN).is_nan());
    }
}

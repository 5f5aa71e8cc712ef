//! Contradictions between measured and required forces, by the rows so far.

use super::compared::{Compared, MOST_SIGMAS, measured_position, required_force};
use super::standstill::Standstill;
use crate::estimation::Estimate;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ArmForce, Machine};
use crate::state::Reason;
use crate::studies::actuator_force_sigma::ForceSigma;
use crate::studies::measured_loads::{FEWEST_ROWS, PERIOD_NS, Run};

/// Doubt because of the measured forces of the arm, as bits by their index in [`Machine::arm_forces`]; those from the 32nd on share the
/// last bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ForceDoubt {
    /// The forces that contradict what masses and motion require.
    pub contradicted: u32,
    /// The forces that repeat one value although the required one changes.
    pub frozen: u32,
}

/// Follows the measured forces of one machine's arm by past rows only. A contradiction stands from two seconds of rows that are off on
/// end until a row is not. It never changes a computed load.
///
/// Comparing a row, four times a second, allocates; the other rows do not.
#[derive(Debug)]
pub struct ForceWatch {
    watched: Vec<Watched>,
    workspace: Workspace<f64>,
    compared_ns: Option<i64>,
    doubt: ForceDoubt,
}

/// A force that is watched.
#[derive(Debug)]
struct Watched {
    force: ArmForce,
    sigma: ForceSigma,
    off: Run<()>,
    standstill: Option<Standstill>,
}

impl ForceWatch {
    /// A watch that has seen nothing; `None` for a machine without such forces.
    #[must_use]
    pub fn new(machine: &Machine) -> Option<Self> {
        let watched = machine.arm_forces().iter().map(|force| Watched {
            force: force.clone(),
            sigma: ForceSigma::new(machine, force.linkage),
            off: Run::new(FEWEST_ROWS),
            standstill: None,
        });
        let watched: Vec<Watched> = watched.collect();
        (!watched.is_empty()).then(|| Self {
            watched,
            workspace: Workspace::with_scope(machine, Scope::LOADS),
            compared_ns: None,
            doubt: ForceDoubt::default(),
        })
    }

    /// Returns the doubt after the last row.
    #[must_use]
    pub fn doubt(&self) -> ForceDoubt {
        self.doubt
    }

    /// Takes the next row; one beside a contradiction is doubted from here on: either the force is wrong, or what the loads rest on.
    pub fn row(&mut self, machine: &Machine, estimate: &mut Estimate) {
        self.compare(machine, estimate);
        if self.doubt.contradicted != 0 {
            estimate.reasons.add(Reason::Contradiction);
        }
    }

    fn compare(&mut self, machine: &Machine, estimate: &Estimate) {
        let time_ns = estimate.time_ns;
        let is_due = (self.compared_ns)
            .is_none_or(|before_ns| time_ns.saturating_sub(before_ns) >= PERIOD_NS);
        if !is_due || !estimate.reasons.leave_valid() {
            return;
        }
        self.compared_ns = Some(time_ns);
        let (state, workspace) = (&estimate.state, &mut self.workspace);
        let mut doubt = ForceDoubt::default();
        let forces = self.watched.iter_mut().zip(&estimate.arm_forces);
        for (index, (watched, &measured)) in forces.enumerate() {
            let required = required_force(machine, state, watched.force.linkage, workspace);
            // rows without a number say nothing and end nothing
            if let Some(computed) = required {
                let sigma = &mut watched.sigma;
                // complete when a contradiction could have enough rows first
                sigma.update(machine, state, computed, FEWEST_ROWS, workspace);
                if measured.is_finite() {
                    let by_masses = sigma.sigma();
                    let force = &watched.force;
                    let at = measured_position(machine, state, force.linkage);
                    let row = Compared::of_force(time_ns, force, at, measured, computed, by_masses);
                    if let Some(row) = row {
                        watched.take(row);
                    }
                }
            }
            let bit = 1_u32 << index.min(31);
            // the sensor of a force that has stopped is what is wrong
            if watched.is_frozen() {
                doubt.frozen |= bit;
            } else if watched.off.lasting().is_some() {
                doubt.contradicted |= bit;
            }
        }
        self.doubt = doubt;
    }
}

impl Watched {
    fn take(&mut self, row: Compared) {
        match &mut self.standstill {
            Some(standstill) => standstill.take(row),
            None => self.standstill = Some(Standstill::begin(row)),
        }
        if row.limit.is_finite() {
            self.off.take(row.time_ns, row.is_off(), ());
        }
    }

    fn is_frozen(&self) -> bool {
        let least = MOST_SIGMAS * self.force.force_sigma;
        (self.standstill).is_some_and(|it| it.missed(least).is_some())
    }
}

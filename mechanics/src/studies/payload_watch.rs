//! The masses of payloads row by row, from the forces of the actuators that lift them: by past rows only.

use std::collections::VecDeque;

use super::payload_estimate::{CORRELATION_S, Fit, ForceQuality, Row, Scale, Sums};
use crate::estimation::Estimate;
use crate::machine::Machine;
use crate::state::{Reason, State};

/// Rows that a fit needs: a second.
const LEAST_ROWS: usize = 5;
/// Rows that tell whether the load is another one: two seconds.
const RECENT_ROWS: usize = 10;
/// Factor on the weight of a row with each later row: the fit remembers ten seconds.
const KEPT: f64 = 0.98;
/// Standard deviations from which a row shows that the load was picked up or dropped.
const JUMP_SIGMAS: f64 = 5.0;
/// Standard deviations of the last rows from the fit of all from which the load has changed slowly.
const DRIFT_SIGMAS: f64 = 3.0;

/// Weighs the payloads of one machine whose mass is unknown, in the rows of a causal estimator. A load that is picked up or dropped is
/// weighed anew; until then, and while the force is missing, its mass is unknown, and with it the loads.
///
/// Nothing allocates after the beginning.
#[derive(Debug)]
pub struct PayloadWatch {
    weighed: Vec<Weighed>,
    /// The state without the masses that are unknown.
    state: State<f64>,
}

/// A payload that is weighed.
#[derive(Debug)]
struct Weighed {
    payload: usize,
    scale: Scale,
    quality: ForceQuality,
    all: Sums,
    recent: VecDeque<Row>,
    taken_ns: Option<i64>,
    /// Mass (kg) and its variance (kg^2).
    found: Option<[f64; 2]>,
}

impl PayloadWatch {
    /// A watch that has seen nothing, of a machine that is [weighed by row](Machine::weigh_payloads_by_row).
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let payloads = machine.payloads().iter().enumerate();
        let weighed = payloads.filter_map(|(payload, spec)| {
            let lift = spec.lift.as_ref().filter(|_| spec.is_weighed())?;
            Some(Weighed {
                payload,
                scale: Scale::new(machine, lift.linkage, payload),
                quality: ForceQuality {
                    sigma: lift.force_sigma,
                    friction_share: lift.friction_share,
                    interval_s: CORRELATION_S,
                },
                all: Sums::default(),
                recent: VecDeque::with_capacity(RECENT_ROWS + 1),
                taken_ns: None,
                found: None,
            })
        });
        Self {
            weighed: weighed.collect(),
            state: State::zero(machine),
        }
    }

    /// Takes the next row, and gives it the masses as far as they are known.
    pub fn row(&mut self, machine: &Machine, estimate: &mut Estimate) {
        // that one mass is not known is no reason for the next
        let is_unknown = estimate.reasons.leave_state_unknown();
        for weighed in &mut self.weighed {
            let payload = weighed.payload;
            if estimate.state.payload_share[payload] == 0.0 {
                weighed.clear();
                continue;
            }
            if is_unknown {
                continue;
            }
            let force = estimate.lift_forces[payload];
            if !force.is_finite() {
                weighed.clear();
            } else if estimate.reasons.leave_valid() && weighed.is_due(estimate.time_ns) {
                self.state.copy_from(&estimate.state);
                self.state.payload_share[payload] = 0.0;
                weighed.take(estimate.time_ns, &self.state, force);
            }
            match weighed.found.filter(|found| is_possible(machine, found)) {
                None => estimate.reasons.add(Reason::ToolWrenchGap),
                Some([mass, variance]) => {
                    estimate.state.payload_share[payload] = mass;
                    let largest = &mut estimate.state.noise.payload_mass;
                    *largest = largest.max(variance);
                }
            }
        }
    }
}

fn is_possible(machine: &Machine, [mass, variance]: &[f64; 2]) -> bool {
    !machine
        .plausible_payload(mass + 2.0 * variance.sqrt())
        .is_nan()
}

impl Weighed {
    fn clear(&mut self) {
        self.all = Sums::default();
        self.recent.clear();
        self.found = None;
    }

    fn is_due(&self, time_ns: i64) -> bool {
        let period_ns = (CORRELATION_S * 1e9) as i64;
        (self.taken_ns).is_none_or(|taken_ns| time_ns.saturating_sub(taken_ns) >= period_ns)
    }

    fn take(&mut self, time_ns: i64, state: &State<f64>, force: f64) {
        let Some(row) = self.scale.row(state, force) else {
            return;
        };
        self.taken_ns = Some(time_ns);
        let before = self.fit(&self.all);
        if before.is_some_and(|fit| !row.is_explained(&fit, &self.quality, JUMP_SIGMAS)) {
            self.clear();
        }
        self.all.forget(KEPT);
        self.all.add(&row);
        self.recent.push_back(row);
        if self.recent.len() > RECENT_ROWS {
            self.recent.pop_front();
            self.follow_slow_change();
        }
        // complete when it is needed first, and a second old at most
        self.scale.update_systematic(state, LEAST_ROWS);
        let fit = (self.fit(&self.all)).filter(|_| self.recent.len() >= LEAST_ROWS);
        let found = fit.map(|fit| {
            let constant = self.scale.systematic_variance(fit.mass);
            [fit.mass, fit.variance + constant]
        });
        self.found = found.filter(|[_, variance]| variance.is_finite());
    }

    /// Leaves the last rows alone if they tell another mass than all.
    fn follow_slow_change(&mut self) {
        let mut recent = Sums::default();
        self.recent.iter().for_each(|row| recent.add(row));
        let Some((last, all)) = self.fit(&recent).zip(self.fit(&self.all)) else {
            return;
        };
        let variance = last.variance + all.variance;
        if (last.mass - all.mass).powi(2) > DRIFT_SIGMAS.powi(2) * variance {
            self.all = recent;
        }
    }

    fn fit(&self, sums: &Sums) -> Option<Fit> {
        sums.fit(&self.quality)
    }
}

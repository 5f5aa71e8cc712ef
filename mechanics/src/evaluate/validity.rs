//! What an outcome says about whether its row is valid.

use super::outcome::Outcome;
use crate::state::{Reason, Reasons};

/// The values of an outcome that determine whether it is valid.
pub(crate) struct OutcomeSigns {
    pub(crate) linkage_closure: f64,
    pub(crate) normal_force: f64,
    pub(crate) largest_overturning_moment: f64,
    pub(crate) loads_are_finite: bool,
}

impl Reasons {
    /// These reasons and those that the row's outcome adds.
    #[must_use]
    pub fn with_outcome(self, outcome: &Outcome<f64>) -> Self {
        self.with_signs(&OutcomeSigns {
            linkage_closure: outcome.linkage_closure,
            normal_force: outcome.normal_force,
            largest_overturning_moment: largest(outcome.itom_full.iter().copied()),
            loads_are_finite: outcome.load.iter().all(|load| load.is_finite()),
        })
    }

    pub(crate) fn with_signs(mut self, signs: &OutcomeSigns) -> Self {
        // a measured rotation says nothing of the loads
        let are_signals_sound = (self.iter()).all(|it| {
            matches!(
                it,
                Reason::Tipping | Reason::Settling | Reason::Contradiction
            )
        });
        let rotates = self.has(Reason::Tipping);
        if signs.linkage_closure < 0.0 {
            self.add(Reason::LinkageOpen);
        }
        if signs.normal_force <= 0.0 {
            self.add(Reason::NoGroundContact);
        } else if signs.largest_overturning_moment > 0.0 {
            self.add(Reason::Tipping);
        }
        if !signs.loads_are_finite && (self.leave_inputs_known() || (rotates && are_signals_sound))
        {
            self.add(Reason::NotFinite);
        }
        self
    }
}

pub(crate) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NEG_INFINITY, f64::max)
}

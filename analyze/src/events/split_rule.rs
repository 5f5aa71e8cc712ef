//! The assumption by which loads are split where equilibrium leaves it open, in words.

use tipwatch_language::{decimals, is_english, say, word};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{Ground, Machine, Split};

use super::support_words::SupportWord;
use crate::base::rows::Rows;

/// Ranges of a load up to this share of the weight count as none.
const NO_RANGE_SHARE: f64 = 1e-3;

/// The split rule of a machine, to follow "if".
#[must_use]
pub(crate) fn split_rule(machine: &Machine) -> String {
    let contact = machine.contact();
    let stiffness = |wheel: usize| machine.wheels()[wheel].stiffness;
    let are_equal = (1..machine.wheels().len()).all(|wheel| stiffness(wheel) == stiffness(0));
    let word = SupportWord::of(machine);
    let rule = match &contact.split {
        Split::RollMomentDistribution { share, .. } => say!(
            "the front axle takes {} of the difference between the sides",
            share_in_words(*share)
        ),
        Split::Springs if are_equal => {
            say!(
                "all {} are springs of the same stiffness under a rigid frame",
                word.many
            )
        }
        Split::Springs => {
            let stiffness = match word.is_wheel() {
                true => word!("the tyres' stiffness"),
                false => word!("their stiffness"),
            };
            say!(
                "the {} are springs of {stiffness} under a rigid frame",
                word.many
            )
        }
    };
    match contact.ground {
        Ground::Plane if contact.mean_stiffness.is_some() => say!("{rule}, on flat ground"),
        _ => rule,
    }
}

fn share_in_words(share: f64) -> String {
    match share {
        0.0 if is_english() => "nothing".into(),
        0.5 if is_english() => "half".into(),
        1.0 if is_english() => "all".into(),
        share => {
            let percent = format!("{:.3}", 100.0 * share);
            decimals(percent.trim_end_matches('0').trim_end_matches('.')) + " %"
        }
    }
}

/// Returns the clause about the part of the load split that equilibrium leaves open, to follow "how the".
#[must_use]
pub(crate) fn sharing(machine: &Machine) -> String {
    match machine.contact().split {
        Split::RollMomentDistribution { .. } => word!("axles share the load").into(),
        Split::Springs => say!("{} share the load", SupportWord::of(machine).many),
    }
}

/// Whether the machine file states the quantities that determine the split: flat ground and the stiffness of the tyres. Their
/// uncertainties are in every band.
#[must_use]
pub(crate) fn is_stated(machine: &Machine) -> bool {
    let contact = machine.contact();
    let is_plane = contact.ground == Ground::Plane;
    is_plane && contact.mean_stiffness.is_some() && matches!(contact.split, Split::Springs)
}

/// Returns the names of the sensors that measure the force on a support or in a cylinder, where they determine the split of any row:
/// of `rows_by_forces`.
#[must_use]
pub(crate) fn measured_forces(machine: &Machine, rows_by_forces: usize) -> Option<String> {
    let joints = machine.contact().actuated_joints.iter();
    let names: Vec<&str> = joints.map(|j| j.name(machine.linkages())).collect();
    (rows_by_forces > 0 && !names.is_empty()).then(|| names.join(", "))
}

/// Whether equilibrium leaves the load of a wheel open in a row.
pub(crate) fn is_open(rows: &Rows, wheel: usize, row: usize) -> bool {
    let at = |quantity| rows.outcomes.column(quantity)[row];
    let range = at(Quantity::LoadLargest(wheel)) - at(Quantity::LoadLeast(wheel));
    range > NO_RANGE_SHARE * at(Quantity::NormalForce)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_words_or_per_cent() {
        let words = [0.5, 1.0, 0.58, 0.405].map(share_in_words);
        assert_eq!(words, ["half", "all", "58 %", "40.5 %"]);
    }
}

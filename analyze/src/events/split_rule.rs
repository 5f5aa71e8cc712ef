//! The assumption by which loads are split where equilibrium leaves it open, in words.

use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{Ground, Machine, Split};

use crate::base::rows::Rows;

/// Ranges of a load up to this share of the weight count as none.
const NO_RANGE_SHARE: f64 = 1e-3;

/// The split rule of a machine, to follow "under the ".
#[must_use]
pub(crate) fn split_rule(machine: &Machine) -> String {
    let contact = machine.contact();
    let stiffness = |wheel: usize| machine.wheels()[wheel].stiffness;
    let are_equal = (1..machine.wheels().len()).all(|wheel| stiffness(wheel) == stiffness(0));
    let rule = match &contact.split {
        Split::RollMomentDistribution { share, .. } => format!("split by front_share {share}"),
        Split::Springs if are_equal => "equal-stiffness split".to_string(),
        Split::Springs => "split by tyre stiffness".to_string(),
    };
    match contact.ground {
        Ground::Plane if contact.mean_stiffness.is_some() => format!("{rule} on plane ground"),
        _ => rule,
    }
}

/// Measurements that would decide how the load is split, as one sentence without a period.
#[must_use]
pub(crate) fn deciding_measurements(machine: &Machine) -> String {
    let contact = machine.contact();
    let mut ways = vec!["weighing the wheels where the machine stood".to_string()];
    if machine.suspension().is_some() || !contact.actuated_joints.is_empty() {
        ways.push("logging the pressures of the cylinders that carry the wheels".into());
    }
    if contact.mean_stiffness.is_none() {
        ways.push("ground = \"plane\" with tyre_stiffness, if the ground was flat".into());
    }
    format!("To decide it: {}", ways.join("; or "))
}

/// Whether equilibrium leaves the load of a wheel open in a row.
pub(crate) fn is_open(rows: &Rows, wheel: usize, row: usize) -> bool {
    let at = |quantity| rows.outcomes.column(quantity)[row];
    let range = at(Quantity::LoadLargest(wheel)) - at(Quantity::LoadLeast(wheel));
    range > NO_RANGE_SHARE * at(Quantity::NormalForce)
}

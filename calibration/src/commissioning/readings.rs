//! Positions and velocities of the joints against each other, and positions against limits.

use super::estimate::{Estimate, Relation};
use super::grid::{noise, smooth};
use super::least_squares::Equations;
use super::moved::MOVING;
use super::roles::{Role, Roles};
use super::signals::View;
use tipwatch_mechanics::machine::Machine;

/// Positions and velocities of the joints against each other, and positions against limits.
pub(super) fn readings(machine: &Machine, roles: &Roles, view: &View) -> Vec<Estimate> {
    let mut found = Vec::new();
    for (joint, columns) in view.joints.iter().enumerate() {
        if matches!(roles.of(joint), Role::Constant) {
            continue;
        }
        let least = MOVING.max(10.0 * 3.2 * noise(&columns.position));
        let mut equations = Equations::new(2).excited(0, least);
        for (rate, measured) in columns.rate.iter().zip(&columns.measured_rate) {
            equations.add(&[*rate, 1.0], *measured);
        }
        if let Some(solution) = equations.solve() {
            found.push(Estimate::of(Relation::Rate(joint), solution.of(0)));
        }
        let Some([least, largest]) = machine.joints()[joint].limits else {
            continue;
        };
        let known = smooth(&columns.position)
            .into_iter()
            .filter(|p| p.is_finite());
        let beyond = known
            .map(|p| (least - p).max(p - largest).max(0.0))
            .fold(0.0, f64::max);
        let span = largest - least;
        if span.is_finite() && span > 0.0 {
            found.push(Estimate::of(Relation::Range(joint), [beyond / span, 0.001]));
        }
    }
    found
}

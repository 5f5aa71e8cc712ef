//! Uncertainty of the computed force of an actuator, because of the masses that it carries.

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::{Axis, Machine, Parameter, links_with_mass};
use crate::state::State;
use crate::studies::actuator_force::{actuator_force, carries_payload};

/// Standard deviation (N) of [`actuator_force`] due to the masses and centres of mass of the links, and to the masses of
/// the payloads that are attached. Errors of sensors and friction are not included.
#[must_use]
pub fn actuator_force_sigma(machine: &Machine, state: &State<f64>, linkage: usize) -> f64 {
    let force = |machine: &Machine| {
        let mut workspace = Workspace::new(machine);
        evaluate(machine, state, &mut workspace);
        actuator_force(machine, state, &workspace, linkage)
    };
    let known = force(machine);
    let by_links = changes_by_links(machine, |changed| force(changed) - known);
    let carried = (0..machine.payloads.len())
        .filter(|&payload| carries_payload(machine, linkage, payload))
        .filter(|&payload| state.payload_share[payload] > 0.0);
    let by_payloads = carried.map(|payload| {
        let mass = Parameter::PayloadMass(payload);
        let sigma = match machine.payloads[payload].is_by_row {
            // its mass is counted as shares of a kilogram
            true => state.sigma(machine, mass) / state.payload_share[payload],
            false => mass.sigma(machine),
        };
        force(&machine.changed(&[(mass, sigma)])) - known
    });
    let variance: f64 = by_links
        .chain(by_payloads)
        .map(|change| change * change)
        .sum();
    variance.sqrt()
}

/// Returns the `change` for each mass and each coordinate of a centre of mass that is off by one standard deviation.
fn changes_by_links(
    machine: &Machine,
    change: impl Fn(&Machine) -> f64,
) -> impl Iterator<Item = f64> {
    with_changed_links(machine).map(move |changed| change(&changed))
}

/// The machine with each mass and each coordinate of a centre of mass off by one standard deviation.
pub(super) fn with_changed_links(machine: &Machine) -> impl Iterator<Item = Machine> {
    let parameters = links_with_mass(machine).flat_map(|link| {
        let com = Axis::ALL.map(|axis| Parameter::LinkCom(link, axis));
        std::iter::once(Parameter::LinkMass(link)).chain(com)
    });
    parameters.map(move |parameter| machine.changed(&[(parameter, parameter.sigma(machine))]))
}

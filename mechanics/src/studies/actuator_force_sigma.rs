//! Uncertainty of the computed force of an actuator, because of the masses that it carries.

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::{Axis, Machine, Parameter, links_with_mass};
use crate::state::State;
use crate::studies::actuator_force::{actuator_force, carries_payload};

/// Standard deviation (N) of [`actuator_force`] due to the masses and centres of mass of the links, and to the masses of
/// the payloads that are attached. Errors of sensors and friction are not included. The actuator must not carry wheels, whose loads
/// would matter, too.
#[must_use]
pub fn actuator_force_sigma(machine: &Machine, state: &State<f64>, linkage: usize) -> f64 {
    let mut workspace = Workspace::with_scope(machine, Scope::LOADS);
    let known = force(machine, state, linkage, &mut workspace);
    let mut sigma = ForceSigma::new(machine, linkage);
    sigma.update(machine, state, known, 1, &mut workspace);
    sigma.sigma()
}

/// That standard deviation, followed from posture to posture by a few of its parts at a time.
#[derive(Debug, Clone)]
pub struct ForceSigma {
    linkage: usize,
    parameters: Vec<Parameter>,
    /// Change of the force by one standard deviation of each parameter (N); NaN before it was computed.
    by: Vec<f64>,
    /// The next of them to be computed.
    next: usize,
}

impl ForceSigma {
    /// A standard deviation of which nothing is computed yet.
    #[must_use]
    pub fn new(machine: &Machine, linkage: usize) -> Self {
        let bodies = &machine.linkages[linkage].bodies;
        let moved = [bodies.pivot, bodies.cylinder, bodies.rod];
        let is_moved = |link: usize| {
            let body = machine.links[link].body;
            moved.iter().any(|&by| machine.is_carried_by(body, by))
        };
        let links = links_with_mass(machine).filter(|&link| is_moved(link));
        let payloads = (0..machine.payloads.len())
            .filter(|&payload| carries_payload(machine, linkage, payload))
            .map(Parameter::PayloadMass);
        let parameters: Vec<Parameter> = links.flat_map(of_link).chain(payloads).collect();
        Self {
            linkage,
            by: vec![f64::NAN; parameters.len()],
            parameters,
            next: 0,
        }
    }

    /// Computes one of `parts` parts of it again in this posture, in which the force is `known` (N); the next part with the next call.
    pub fn update(
        &mut self,
        machine: &Machine,
        state: &State<f64>,
        known: f64,
        parts: usize,
        workspace: &mut Workspace<f64>,
    ) {
        for _ in 0..self.parameters.len().div_ceil(parts) {
            let parameter = self.parameters[self.next];
            self.by[self.next] = match standard_deviation(machine, state, parameter) {
                0.0 => 0.0,
                sigma => {
                    let changed = machine.changed(&[(parameter, sigma)]);
                    force(&changed, state, self.linkage, workspace) - known
                }
            };
            self.next = (self.next + 1) % self.parameters.len();
        }
    }

    /// The standard deviation (N); NaN before all of it was computed.
    #[must_use]
    pub fn sigma(&self) -> f64 {
        self.by.iter().map(|by| by * by).sum::<f64>().sqrt()
    }
}

/// Standard deviation of a parameter; zero for the mass of a payload that is not attached.
fn standard_deviation(machine: &Machine, state: &State<f64>, parameter: Parameter) -> f64 {
    let Parameter::PayloadMass(payload) = parameter else {
        return parameter.sigma(machine);
    };
    let share = state.payload_share[payload];
    match machine.payloads[payload].is_by_row {
        _ if !(share > 0.0) => 0.0,
        // its mass is counted as shares of a kilogram
        true => state.sigma(machine, parameter) / share,
        false => parameter.sigma(machine),
    }
}

fn force(
    machine: &Machine,
    state: &State<f64>,
    linkage: usize,
    workspace: &mut Workspace<f64>,
) -> f64 {
    evaluate(machine, state, workspace);
    actuator_force(machine, state, workspace, linkage)
}

/// The mass of a link, and each coordinate of its centre of mass.
fn of_link(link: usize) -> impl Iterator<Item = Parameter> {
    let com = Axis::ALL.map(|axis| Parameter::LinkCom(link, axis));
    std::iter::once(Parameter::LinkMass(link)).chain(com)
}

/// The machine with each mass and each coordinate of a centre of mass off by one standard deviation.
pub(super) fn with_changed_links(machine: &Machine) -> impl Iterator<Item = Machine> {
    let parameters = links_with_mass(machine).flat_map(of_link);
    parameters.map(move |parameter| machine.changed(&[(parameter, parameter.sigma(machine))]))
}

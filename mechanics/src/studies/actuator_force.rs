//! The force of a linkage's actuator, from the motion of the bodies that it moves.
//!
//! By virtual work: a virtual displacement of the rod moves the pivot's distal subtree, the cylinder and the
//! rod with the fields S_i, and the actuator does the same work as the wrenches that accelerate them:
//! ```text
//!     f = sum over bodies S_i . W_i - S_tool . W_tool - sum over wheels S_j . W_j                  P(1)
//! ```
//! where W_i is the wrench that accelerates body i, weight included, and W_j that of the ground on a wheel in
//! the distal subtree, with its traction proportional to its load. Friction is not included.

use crate::dynamics::composite::Field;
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::newton_euler::{body_wrench, tool_wrench};
use crate::evaluate::workspace::Workspace;
use crate::explain::sensitivity::followed_by;
use crate::geometry::spatial::{Wrench, cross, z_axis};
use crate::machine::{Inertia, Machine};
use crate::number::Real;
use crate::state::State;

/// Force of an actuator (N), positive when it extends the rod.
///
/// `linkage` is an index into [`Machine::linkages`]; `workspace` must hold the evaluation of `state`.
#[must_use]
pub fn actuator_force<T: Real>(
    machine: &Machine,
    state: &State<T>,
    workspace: &Workspace<T>,
    linkage: usize,
) -> T {
    let step = RodStep::new(machine, state, &workspace.motions, linkage);
    let mut force = T::zero();
    for (body, wrench) in workspace.wrenches.iter().enumerate() {
        force += step.work(machine, body, wrench);
    }
    if let Some(tool) = &machine.tool {
        let wrench = tool_wrench(machine, state, &workspace.motions);
        force -= step.work(machine, tool.body, &wrench);
    }
    let out = &workspace.outcome;
    let pivot = machine.linkages[linkage].bodies.pivot;
    for (wheel, spec) in machine.wheels.iter().enumerate() {
        if machine.is_carried_by(spec.body, pivot) {
            let contact =
                workspace.wheel_centres[wheel] - out.contact_normal * workspace.radii[wheel];
            let pushed = out.ground_wrench.force * (out.load[wheel] / out.normal_force);
            let wrench = Wrench {
                force: pushed,
                moment: cross(&contact, &pushed),
            };
            force -= step.work(machine, spec.body, &wrench);
        }
    }
    force
}

/// Force per payload mass (N/kg); zero where the actuator does not carry the payload.
#[must_use]
pub(crate) fn force_by_payload_mass(
    machine: &Machine,
    state: &State<f64>,
    workspace: &Workspace<f64>,
    linkage: usize,
    payload: usize,
) -> f64 {
    let step = RodStep::new(machine, state, &workspace.motions, linkage);
    let payload = &machine.payloads[payload];
    let kilogram = Inertia {
        mass: 1.0,
        com: payload.inertia.com,
        ..Inertia::zero()
    };
    let wrench = body_wrench(&kilogram, &workspace.motions[payload.body]);
    step.work(machine, payload.body, &wrench)
}

/// Whether the actuator of a linkage carries the payload.
#[must_use]
pub fn carries_payload(machine: &Machine, linkage: usize, payload: usize) -> bool {
    let pivot = machine.linkages[linkage].bodies.pivot;
    machine.is_carried_by(machine.payloads[payload].body, pivot)
}

/// Motion fields for a rod displacement of one metre.
struct RodStep<T> {
    /// The body that each field moves together with its distal subtree.
    fields: [(usize, Field<T>); 3],
}

impl<T: Real> RodStep<T> {
    fn new(machine: &Machine, state: &State<T>, motions: &[BodyMotion<T>], linkage: usize) -> Self {
        let linkage = &machine.linkages[linkage];
        let [pivot, cylinder, rod] = followed_by(linkage, state).map(|by| by.coordinate);
        let axis = |body: usize| z_axis(&motions[body].rotation);
        let turning = |body: usize, angle: T| {
            let field = Field::turning(&axis(body), &motions[body].origin);
            (body, field.scaled(angle / rod))
        };
        let bodies = &linkage.bodies;
        Self {
            fields: [
                turning(bodies.pivot, pivot),
                turning(bodies.cylinder, cylinder),
                (bodies.rod, Field::sliding(&axis(bodies.rod))),
            ],
        }
    }

    /// Work of a body's wrench in that displacement.
    fn work(&self, machine: &Machine, body: usize, wrench: &Wrench<T>) -> T {
        let carried = self
            .fields
            .iter()
            .filter(|(by, _)| machine.is_carried_by(body, *by));
        carried.fold(T::zero(), |sum, (_, field)| {
            sum + field.linear.dot(&wrench.force) + field.angular.dot(&wrench.moment)
        })
    }
}

//! What the sensors of the actuated joints would measure if equilibrium and the split rule alone shared the load, and what they
//! would measure of another motion.
//!
//! A measured force f differs from the one by the rule, r, by what nobody states: uneven ground, a support that sinks, a load, an
//! error of the sensor. It is supposed that another state leaves that difference as it is:
//! ```text
//!     f' = f + (r' - r)                                                                          P(2)
//! ```

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ForceSource, Machine};
use crate::number::Real;
use crate::state::State;
use crate::studies::actuator_force::actuator_force;

/// Memory for the forces by the rule, and for those of a changed state.
#[derive(Debug)]
pub struct ForcesByRule<T: Real> {
    workspace: Workspace<T>,
    /// The state without measured forces.
    state: State<T>,
    measured: Vec<T>,
    by_rule: [Vec<T>; 2],
}

impl<T: Real> ForcesByRule<T> {
    /// Memory for a machine, and for one that differs from it by its parameters.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        Self {
            workspace: Workspace::new(machine),
            state: State::zero(machine),
            measured: Vec::new(),
            by_rule: [Vec::new(), Vec::new()],
        }
    }

    /// Changes a state of a machine to one of another machine, which differs from it by its parameters. Measured forces change
    /// by P(2); those that are unknown stay so.
    pub fn change(
        &mut self,
        [from, to]: [&Machine; 2],
        state: &mut State<T>,
        change: impl FnOnce(&mut State<T>),
    ) {
        if from.contact().actuated_joints.is_empty() {
            change(state);
            return;
        }
        self.measured.clone_from(&state.actuator_force);
        self.find(0, from, state);
        change(state);
        self.find(1, to, state);
        let [before, after] = &self.by_rule;
        let pairs = before.iter().zip(after);
        for ((force, &measured), (&before, &after)) in
            (state.actuator_force.iter_mut().zip(&self.measured)).zip(pairs)
        {
            *force = measured + (after - before);
        }
    }

    /// Finds the force of each actuated joint by the split rule: of a support what it carries while all are held to the ground.
    /// That of one that is off the ground is zero.
    fn find(&mut self, place: usize, machine: &Machine, state: &State<T>) {
        self.state.copy_from(state);
        self.state.actuator_force.fill(T::constant(f64::NAN));
        self.state.follows_supports = T::zero();
        evaluate(machine, &self.state, &mut self.workspace);
        let forces = machine.contact.actuated_joints.iter();
        let forces = forces.map(|joint| match joint.source {
            ForceSource::Linkage(linkage) => {
                actuator_force(machine, &self.state, &self.workspace, linkage)
            }
            ForceSource::Support { wheel, .. } => {
                wheel.map_or(T::zero(), |wheel| self.workspace.outcome.otf[wheel])
            }
        });
        self.by_rule[place].clear();
        self.by_rule[place].extend(forces);
    }
}

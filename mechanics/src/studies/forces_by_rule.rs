//! Predicted readings of the actuated joints' force sensors: if equilibrium and the split rule alone shared the load, and in
//! another motion.
//!
//! A measured force f differs from the one by the rule, r, by what nobody states: uneven ground, a support that sinks, a load, an
//! error of the sensor. It is supposed that another state leaves that difference as it is.
//!
//! A support that shows no load tells of the difference only that it is at most -r: the ground does not pull, and the sensor
//! shows zero of all that is below. Where the rule lifts it, too (r < 0), any difference from none to -r explains its reading, and
//! the one by which the reading changes least is supposed: the support carries in another state only what r' is above zero, and
//! is as far off the ground as before until r' is below r.
//! ```text
//!     f' = f + (r' - r*)                                                                         P(3)
//!     r* = r;   of a support with f within the noise of its sensor the value nearest to r' from r to max(r, 0)
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
    /// by P(3); those that are unknown stay so.
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
        let by_rule = before.iter().zip(after);
        let joints = from.contact.actuated_joints.iter().zip(by_rule);
        for ((force, &measured), (joint, (&before, &after))) in
            (state.actuator_force.iter_mut().zip(&self.measured)).zip(joints)
        {
            *force = match joint.source {
                // a rod pulls as it pushes
                ForceSource::Linkage(_) => measured + (after - before),
                ForceSource::Support { .. } => {
                    of_support(measured, [before, after], joint.force_sigma)
                }
            };
        }
    }

    /// Finds the force of each actuated joint by the split rule: of a support, its load while all supports are held to the
    /// ground; zero of a support that is off the ground.
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

/// P(3) for a support whose sensor has this standard deviation (N); unknown where a force is.
fn of_support<T: Real>(measured: T, [before, after]: [T; 2], sigma: f64) -> T {
    let shows_load = T::constant(sigma).lt(measured);
    // unknown loads stay so
    let carried = T::zero().max(before);
    let nearest = after.max(before).min(carried);
    measured + (after - T::select(shows_load, before, nearest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_support_off_the_ground_carries_only_what_the_rule_gives_it() {
        let changed = |measured: f64, by_rule: [f64; 2]| of_support(measured, by_rule, 50.0);
        // still lifted by equilibrium, less than before
        assert_eq!(changed(0.0, [-500.0, -100.0]), 0.0);
        assert_eq!(changed(0.0, [-500.0, 300.0]), 300.0);
        // lifted more
        assert_eq!(changed(0.0, [-500.0, -700.0]), -200.0);
        // what its sensor shows is noise
        assert_eq!(changed(20.0, [-500.0, -100.0]), 20.0);
        // off the ground although the rule has it carry
        assert_eq!(changed(0.0, [400.0, 700.0]), 300.0);
        assert_eq!(changed(0.0, [400.0, -100.0]), -500.0);
        // the same state
        for by_rule in [-500.0, 0.0, 400.0] {
            assert_eq!(changed(30.0, [by_rule; 2]), 30.0);
            assert_eq!(changed(900.0, [by_rule; 2]), 900.0);
        }
        // on the ground, also where the rule lifts it
        assert_eq!(changed(900.0, [-500.0, -100.0]), 1300.0);
        assert_eq!(changed(900.0, [500.0, 100.0]), 500.0);
        let unknown = f64::NAN;
        assert!(changed(unknown, [-500.0, 300.0]).is_nan());
        assert!(changed(0.0, [unknown, 300.0]).is_nan());
        assert!(changed(0.0, [-500.0, unknown]).is_nan());
    }
}

//! A machine at rest on level ground: mass distribution and wheel loads.

use nalgebra::Vector3;

use crate::evaluate::evaluation::evaluate;
use crate::evaluate::outcome::Outcome;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::geometry::spatial::rotate;
use crate::machine::{LinkGroup, Machine};
use crate::studies::combination_sigma::combination_sigma;
use crate::studies::static_posture::{AtRest, at_rest, resting_on_slope};

/// A machine at rest in one posture.
#[derive(Debug)]
pub struct RestingMachine {
    at_rest: AtRest,
    /// Centres of the wheels in the base frame (m).
    pub wheel_centres: Vec<Vector3<f64>>,
    /// Platform: all links other than wheels and arm.
    pub chassis: MassShare,
    /// The wheels.
    pub wheels: MassShare,
    /// The arm, without payloads.
    pub arm: MassShare,
    /// The payloads without a time limit.
    pub payloads: MassShare,
}

/// Mass and centre of mass of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassShare {
    /// Mass (kg).
    pub mass: f64,
    /// Centre of mass in the base frame (m); NaN without mass.
    pub com: Vector3<f64>,
}

impl MassShare {
    fn of(points: impl Iterator<Item = (f64, Vector3<f64>)>) -> Self {
        let (mass, first) = points.fold((0.0, Vector3::zeros()), |(mass, first), (m, at)| {
            (mass + m, first + at * m)
        });
        Self {
            mass,
            com: first / mass,
        }
    }
}

impl RestingMachine {
    /// The machine at rest on level ground with these joint positions (rad or m) in the order of
    /// [`Machine::joints`]. NaN where a linkage cannot close at these positions.
    #[must_use]
    pub fn new(machine: &Machine, joint_positions: &[f64]) -> Self {
        Self::of(
            machine,
            at_rest(machine, joint_positions, Scope::LOADS_AND_DERIVATIVES),
        )
    }

    /// The machine at rest on ground that rises by these angles forward and to the left (rad).
    #[must_use]
    pub fn on_slope(machine: &Machine, joint_positions: &[f64], slope: [f64; 2]) -> Self {
        let (resting, state) = resting_on_slope(machine, joint_positions, slope);
        let mut workspace = Workspace::with_scope(&resting, Scope::LOADS_AND_DERIVATIVES);
        evaluate(&resting, &state, &mut workspace);
        Self::of(
            machine,
            AtRest {
                machine: resting,
                state,
                workspace,
            },
        )
    }

    fn of(machine: &Machine, at_rest: AtRest) -> Self {
        let workspace = &at_rest.workspace;
        let place = |body: usize, com: &Vector3<f64>| {
            let motion = &workspace.motions[body];
            motion.origin + rotate(&motion.rotation, com)
        };
        let group = |group: LinkGroup| {
            let massive = |link: &&crate::machine::Link| link.inertia.mass > 0.0;
            let links = machine.links().iter().filter(massive);
            let of_group = links.filter(move |link| link.group == group);
            MassShare::of(of_group.map(|l| (l.inertia.mass, place(l.body, &l.inertia.com))))
        };
        let payloads = machine.payloads().iter().filter(|p| p.is_always());
        Self {
            chassis: group(LinkGroup::Chassis),
            wheels: group(LinkGroup::Wheel),
            arm: group(LinkGroup::Arm),
            payloads: MassShare::of(
                payloads.map(|p| (p.inertia.mass, place(p.body, &p.inertia.com))),
            ),
            wheel_centres: workspace.wheel_centres.clone(),
            at_rest,
        }
    }

    /// Loads and stability.
    #[must_use]
    pub fn outcome(&self) -> &Outcome<f64> {
        self.at_rest.workspace.outcome()
    }

    /// Total load of these wheels (N) and its standard deviation (N) due to the stated uncertainty of the
    /// machine's parameters. Sensor errors do not enter: gravity and level ground are given. The standard
    /// deviation is NaN if one of the wheels is lifted.
    #[must_use]
    pub fn load_of(&self, wheels: &[usize]) -> (f64, f64) {
        let loads = &self.outcome().load;
        let load = wheels.iter().map(|&wheel| loads[wheel]).sum();
        if !loads.iter().all(|load| *load > 0.0) {
            return (load, f64::NAN);
        }
        let AtRest {
            machine,
            state,
            workspace,
        } = &self.at_rest;
        let factors: Vec<f64> = (0..loads.len())
            .map(|wheel| f64::from(u8::from(wheels.contains(&wheel))))
            .collect();
        (load, combination_sigma(machine, state, workspace, &factors))
    }

    /// The whole machine.
    #[must_use]
    pub fn whole(&self) -> MassShare {
        let parts = [self.chassis, self.wheels, self.arm, self.payloads];
        let massive = parts.into_iter().filter(|part| part.mass > 0.0);
        MassShare::of(massive.map(|part| (part.mass, part.com)))
    }
}

//! The measured load of every support on the ground, one by one, where all of them are measured.
//!
//! What they are more than the computed loads, D_i = F_i - N_i at the places p_i, is a load that the machine file does not
//! state, whatever the split:
//! ```text
//!     D = sum of D_i,      acts at  sum of D_i p_i / D
//! ```

use nalgebra::Vector3;
use tipwatch_mechanics::machine::{ForceSource, Machine};
use tipwatch_mechanics::{State, Workspace, combination_sigma};

use crate::load::MeasuredLoads;

/// Standard deviation of the distance between the centre of mass of a load and the link that carries it (m): half of a
/// large pallet, a full bucket or a log.
const EXTENT_M: f64 = 0.5;

/// Measured loads of all supports on the ground.
pub(super) struct Singles {
    /// By wheel of the machine (N).
    loads: Vec<f64>,
    /// Standard deviation of each (N).
    sigmas: Vec<f64>,
    /// Whether each is a force that the state holds, so that computed loads can follow it.
    are_forces: bool,
}

/// Where the difference of measured and computed loads acts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Acts {
    /// Forward and to the left of the base frame's origin (m).
    pub(super) at: [f64; 2],
    /// Standard deviation of either (m).
    pub(super) sigma: [f64; 2],
    /// How far that is from where the arm carries loads, and from the nearest support: in standard deviations of both
    /// directions, the load's own extent included for the arm.
    pub(super) from_tool: f64,
    pub(super) from_support: f64,
    /// Whether computed loads can follow the measured ones.
    pub(super) can_be_followed: bool,
}

impl Singles {
    /// Those of a row; `None` if the load of a support on the ground is not measured by itself.
    pub(super) fn of(
        machine: &Machine,
        state: &State<f64>,
        measured: &MeasuredLoads,
        time_ns: i64,
    ) -> Option<Self> {
        let mut known: Vec<Option<(f64, f64)>> = vec![None; machine.wheels().len()];
        let joints = machine.contact().actuated_joints.iter();
        for (joint, &force) in joints.zip(&state.actuator_force) {
            if let ForceSource::Support {
                wheel: Some(place), ..
            } = joint.source
                && force.is_finite()
            {
                let friction = joint.friction_share * force;
                known[place] = Some((force, joint.force_sigma.hypot(friction)));
            }
        }
        let are_forces = known.iter().all(Option::is_some);
        for (index, load) in measured.sensors.iter().enumerate() {
            let mut places = load.sensor.places(machine);
            let value = measured.at(index, time_ns);
            if let (Some(place), None) = (places.next(), places.next())
                && value.is_finite()
            {
                known[place] = Some((value, load.sensor.sigma));
            }
        }
        let known: Vec<(f64, f64)> = known.into_iter().collect::<Option<_>>()?;
        let (loads, sigmas) = known.into_iter().unzip();
        Some(Self {
            loads,
            sigmas,
            are_forces,
        })
    }

    /// Their total (N), and its standard deviation.
    pub(super) fn total(&self) -> (f64, f64) {
        let variance: f64 = self.sigmas.iter().map(|sigma| sigma * sigma).sum();
        (self.loads.iter().sum(), variance.sqrt())
    }

    /// Where the difference from the computed loads acts, after the evaluation of `workspace`.
    pub(super) fn acts(
        &self,
        machine: &Machine,
        state: &State<f64>,
        workspace: &Workspace<f64>,
    ) -> Acts {
        let computed = &workspace.outcome().load;
        let off: Vec<f64> = (self.loads.iter().zip(computed))
            .map(|(measured, computed)| measured - computed)
            .collect();
        let difference: f64 = off.iter().sum();
        let centres = workspace.wheel_centres();
        let along = |axis: usize| {
            let moments = off.iter().zip(centres).map(|(off, at)| off * at[axis]);
            let at = moments.sum::<f64>() / difference;
            let levers: Vec<f64> = centres.iter().map(|centre| centre[axis] - at).collect();
            let of_model = combination_sigma(machine, state, workspace, &levers);
            let of_sensors = levers.iter().zip(&self.sigmas);
            let of_sensors: f64 = of_sensors.map(|(a, sigma)| (a * sigma).powi(2)).sum();
            (at, of_model.hypot(of_sensors.sqrt()) / difference.abs())
        };
        let (x, y) = (along(0), along(1));
        let distance = |place: &Vector3<f64>, extent: f64| {
            let of = |along: (f64, f64), place: f64| (along.0 - place) / along.1.hypot(extent);
            of(x, place.x).hypot(of(y, place.y))
        };
        let tool = machine.load_on_tool();
        let tool = tool.map(|tool| workspace.point(tool.body, &tool.place));
        let supports = centres.iter().map(|centre| distance(centre, 0.0));
        Acts {
            at: [x.0, y.0],
            sigma: [x.1, y.1],
            from_tool: tool.map_or(f64::INFINITY, |tool| distance(&tool, EXTENT_M)),
            from_support: supports.fold(f64::INFINITY, f64::min),
            can_be_followed: self.are_forces,
        }
    }
}

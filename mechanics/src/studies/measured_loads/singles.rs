//! The measured load of every support on the ground, one by one, where all of them are measured.
//!
//! Their excess over the computed loads, D_i = F_i - N_i at the places p_i, is a load that the machine file does not state,
//! whatever the split:
//! ```text
//!     D = sum of D_i,      acts at  sum of D_i p_i / D
//! ```

use super::rows::MeasuredRow;
use crate::evaluate::workspace::Workspace;
use crate::machine::{ForceSource, Machine};
use crate::state::State;
use nalgebra::{Matrix3, Vector3};

/// Standard deviation of the distance between the centre of mass of a load and the link that carries it (m): half of a
/// large pallet, a full bucket or a log.
const EXTENT_M: f64 = 0.5;

/// Measured loads of all supports on the ground.
pub(super) struct Singles {
    /// Measured load by wheel of the machine (N).
    loads: Vec<f64>,
    /// Standard deviation of each (N).
    sigmas: Vec<f64>,
    /// Whether each measured load is a force that the state can hold, so that computed loads can follow it.
    are_forces: bool,
}

/// Place of the difference between measured and computed loads, and its explanations.
#[derive(Debug, Clone)]
pub struct Acts {
    /// Forward and to the left of the base frame's origin (m).
    pub at: [f64; 2],
    /// Standard deviation of either (m).
    pub sigma: [f64; 2],
    /// Distance of the difference's force and moments from zero, all three together (standard deviations).
    pub distance: f64,
    /// The force where the arm carries loads that best explains the difference; `None` without such a place.
    pub on_tool: Option<PointForce>,
    /// Distance from the difference to its best explanation by a force at one support (standard deviations).
    pub from_support: f64,
    /// Each pair of supports, and the distance of the difference from zero if their sensors are exchanged (standard deviations).
    pub exchanged: Vec<([usize; 2], f64)>,
    /// Whether computed loads can follow the measured ones.
    pub can_be_followed: bool,
}

/// A vertical force at one place.
#[derive(Debug, Clone, Copy)]
pub struct PointForce {
    /// The force (N), downwards.
    pub force: f64,
    /// Its standard deviation (N).
    pub sigma: f64,
    /// Distance from the difference to this force, in both directions together (standard deviations).
    pub misfit: f64,
}

/// Force and moments of the difference about the base frame's origin, r = (D, sum of y_i D_i, sum of x_i D_i), with their
/// covariance S.
#[derive(Clone, Copy)]
struct Difference {
    wrench: Vector3<f64>,
    covariance: Matrix3<f64>,
}

impl Difference {
    /// The root of r' S^-1 r; infinite for a covariance that is none.
    fn distance(&self) -> f64 {
        let root = self.covariance.cholesky();
        root.map_or(f64::INFINITY, |root| {
            self.wrench.dot(&root.solve(&self.wrench)).sqrt()
        })
    }

    /// Returns the force f at a place that best explains the difference, with a = (1, y, x):
    /// ```text
    ///     f = a' S^-1 r / a' S^-1 a,      var f = 1 / a' S^-1 a
    /// ```
    /// The place is known to `extent` (m), which moves the moments by f times as much.
    fn force_at(&self, place: &Vector3<f64>, extent: f64) -> Option<PointForce> {
        let a = Vector3::new(1.0, place.y, place.x);
        let mut found: Option<PointForce> = None;
        // the extent counts by the force of the first pass
        for _ in 0..2 {
            let of_extent = found.map_or(0.0, |found| (found.force * extent).powi(2));
            let of_extent = Matrix3::from_diagonal(&Vector3::new(0.0, of_extent, of_extent));
            let root = (self.covariance + of_extent).cholesky()?;
            let information = a.dot(&root.solve(&a));
            let force = a.dot(&root.solve(&self.wrench)) / information;
            let left = self.wrench - a * force;
            found = Some(PointForce {
                force,
                sigma: information.recip().sqrt(),
                misfit: left.dot(&root.solve(&left)).sqrt(),
            });
        }
        found
    }
}

impl Singles {
    /// Returns the measured loads of a row; `None` if the load of a support on the ground is not measured by itself.
    pub(super) fn of(
        machine: &Machine,
        state: &State<f64>,
        measured: &MeasuredRow<'_>,
    ) -> Option<Self> {
        let mut known: Vec<Option<(f64, f64)>> = vec![None; machine.wheels().len()];
        let joints = machine.contact().actuated_joints.iter().enumerate();
        for ((index, joint), &force) in joints.zip(&state.actuator_force) {
            let force = match force.is_nan() {
                true => (measured.held)(index),
                false => force,
            };
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
        for (sensor, &value) in measured.sensors.iter().zip(measured.loads) {
            let mut places = sensor.places(machine);
            if let (Some(place), None) = (places.next(), places.next())
                && value.is_finite()
            {
                known[place] = Some((value, sensor.sigma));
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

    /// Returns the total of the measured loads, and its standard deviation (N).
    pub(super) fn total(&self) -> (f64, f64) {
        let variance: f64 = self.sigmas.iter().map(|sigma| sigma * sigma).sum();
        (self.loads.iter().sum(), variance.sqrt())
    }

    /// Returns the place of the difference from the computed loads, after the evaluation of `workspace`. `sigma_of` is the
    /// standard deviation of a weighted sum of the computed loads (N, or Nm for levers).
    pub(super) fn acts(
        &self,
        machine: &Machine,
        workspace: &Workspace<f64>,
        sigma_of: impl Fn(&[f64]) -> f64,
    ) -> Acts {
        let computed = &workspace.outcome().load;
        let off: Vec<f64> = (self.loads.iter().zip(computed))
            .map(|(measured, computed)| measured - computed)
            .collect();
        let centres = workspace.wheel_centres();
        let levers = |about: &Vector3<f64>| -> [Vec<f64>; 3] {
            [
                vec![1.0; centres.len()],
                centres.iter().map(|centre| centre.y - about.y).collect(),
                centres.iter().map(|centre| centre.x - about.x).collect(),
            ]
        };
        let variance_of = |levers: &[f64]| {
            let of_sensors = levers.iter().zip(&self.sigmas);
            let of_sensors: f64 = of_sensors
                .map(|(lever, sigma)| (lever * sigma).powi(2))
                .sum();
            sigma_of(levers).powi(2) + of_sensors
        };
        let about_origin = levers(&Vector3::zeros());
        let sums = (about_origin.iter())
            .map(|levers| levers.iter().zip(&off).map(|(l, off)| l * off).sum());
        let wrench = Vector3::from_iterator(sums);
        // cov(a, b) = (var(a + b) - var(a) - var(b)) / 2
        let variances: Vec<f64> = about_origin
            .iter()
            .map(|levers| variance_of(levers))
            .collect();
        let covariance = Matrix3::from_fn(|i, j| match i == j {
            true => variances[i],
            false => {
                let pairs = about_origin[i].iter().zip(&about_origin[j]);
                let both: Vec<f64> = pairs.map(|(a, b)| a + b).collect();
                0.5 * (variance_of(&both) - variances[i] - variances[j])
            }
        });
        let difference = Difference { wrench, covariance };
        let at = Vector3::new(wrench.z, wrench.y, 0.0) / wrench.x;
        let [_, y, x] = levers(&at).map(|levers| variance_of(&levers).sqrt() / wrench.x.abs());
        let tool = machine.load_on_tool();
        let tool = tool.map(|tool| workspace.point(tool.body, &tool.place));
        let misfits = centres
            .iter()
            .filter_map(|centre| Some(difference.force_at(centre, 0.0)?.misfit));
        let count = centres.len();
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j]));
        let exchanged = pairs.map(|pair| {
            let [a, b] = pair.map(|at| Vector3::new(1.0, centres[at].y, centres[at].x));
            let wrench = difference.wrench + (a - b) * (self.loads[pair[1]] - self.loads[pair[0]]);
            let exchanged = Difference {
                wrench,
                ..difference
            };
            (pair, exchanged.distance())
        });
        Acts {
            at: [at.x, at.y],
            sigma: [x, y],
            distance: difference.distance(),
            on_tool: tool.and_then(|tool| difference.force_at(&tool, EXTENT_M)),
            from_support: misfits.fold(f64::INFINITY, f64::min),
            exchanged: exchanged.collect(),
            can_be_followed: self.are_forces,
        }
    }
}

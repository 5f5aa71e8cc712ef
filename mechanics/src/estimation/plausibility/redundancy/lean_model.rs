//! How the platform should lean on its tyres, by the measured motion of the joints.
//!
//! About the point below the base origin on the ground, with the weight's moment M and the angular momentum H of
//! every body but the wheels, the tyres carry the moment `N = dH/dt - M`. With the tyres' vertical stiffness k at
//! (x, y), the platform sinks by the plane `z = s0 + s1 x + s2 y`:
//! ```text
//!     sum k a a' s = -(0, -N_y, N_x),  a = (1, x, y),   lean = (s2, -s1)
//! ```
//! Changes of the total force sink the platform but hardly turn it, and are neglected. The derivative of H is that
//! of its low-pass filter: `L(L(dH/dt)) = (L(H) - L(L(H))) / T`.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::low_pass::LowPass;
use crate::dynamics::kinematics::{self, BodyMotion};
use crate::geometry::coordinate::{Coordinate, Motion};
use crate::machine::{JointCoupling, Machine};
use crate::state::State;

/// Time constant of both low-pass filters (s): slower than the platform swings on its tyres.
pub(super) const SMOOTHED_S: f64 = 0.1;
/// Time constant of the up direction (s).
const LEVELLED_S: f64 = 3.0;

/// The model, and what it remembers.
#[derive(Debug, Clone)]
pub(super) struct LeanModel {
    machine: Machine,
    state: State<f64>,
    coordinates: Vec<Coordinate<f64>>,
    motions: Vec<BodyMotion<f64>>,
    /// Bodies that spin as wheels.
    spins: Vec<bool>,
    is_known: Vec<bool>,
    /// Lean per moment N (rad/(N m)).
    compliance: Matrix2<f64>,
    /// Largest lean while wheels carry the machine (rad): the whole weight on the farthest wheel.
    pub(super) largest: f64,
    /// Height of the ground in the base frame (m).
    ground: f64,
    up: LowPass<3>,
    weight: [LowPass<2>; 2],
    momentum: [LowPass<2>; 2],
}

impl LeanModel {
    /// `None` where the machine file does not state how the tyres deflect, or the wheels move on a suspension.
    pub(super) fn new(machine: &Machine) -> Option<Self> {
        if machine.suspension().is_some() || machine.imu().body != 0 {
            return None;
        }
        let mut stiffness = Matrix3::zeros();
        let mut ground = 0.0;
        for wheel in machine.wheels() {
            let centre = wheel.centre_at_zero;
            let a = Vector3::new(1.0, centre.x, centre.y);
            stiffness += a * a.transpose() * wheel.stiffness?;
            ground += (centre.z - wheel.radius) / machine.wheels().len() as f64;
        }
        let inverse = stiffness.try_inverse()?;
        // (s1, s2) = -inverse (-N_y, N_x), lean = (s2, -s1)
        let compliance = Matrix2::new(
            -inverse[(2, 2)],
            inverse[(2, 1)],
            inverse[(1, 2)],
            -inverse[(1, 1)],
        );
        let centres = machine.wheels().iter().map(|wheel| wheel.centre_at_zero);
        let reach = centres.map(|centre| centre.xy().norm()).fold(0.0, f64::max);
        let largest = compliance.norm() * machine.mass() * machine.gravity() * reach;
        let spins_wheel = |joint: usize| machine.joints()[joint].spins_wheel.is_some();
        let spins = (machine.bodies.iter())
            .map(|body| matches!(body.coupling, JointCoupling::Measured(j) if spins_wheel(j)));
        let rest = BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let smoothed = || [LowPass::new(SMOOTHED_S), LowPass::new(SMOOTHED_S)];
        Some(Self {
            state: State::zero(machine),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            motions: vec![rest; machine.bodies.len()],
            spins: spins.collect(),
            is_known: vec![false; machine.joints().len()],
            compliance,
            largest,
            ground,
            up: LowPass::new(LEVELLED_S),
            weight: smoothed(),
            momentum: smoothed(),
            machine: machine.clone(),
        })
    }

    pub(super) fn reset(&mut self) {
        self.up.reset();
        let filters = self.weight.iter_mut().chain(&mut self.momentum);
        filters.for_each(LowPass::reset);
    }

    /// Takes the measured direction of gravity: the specific force in base axes.
    pub(super) fn level(&mut self, dt: f64, specific_force: &Vector3<f64>) -> Vector3<f64> {
        let mean = self.up.step(dt, specific_force);
        mean.try_normalize(1e-3).unwrap_or_else(Vector3::z)
    }

    /// Takes the motion of a joint.
    pub(super) fn set(&mut self, joint: usize, position: f64, rate: f64) {
        self.is_known[joint] = true;
        self.state.joints[joint] = Motion {
            position,
            rate,
            acceleration: 0.0,
        };
    }

    /// The lean about x and y (rad), smoothed, but for a constant; `None` while a joint is unknown.
    pub(super) fn lean(&mut self, dt: f64, up: &Vector3<f64>) -> Option<Vector2<f64>> {
        if !self.is_known.iter().all(|known| *known) {
            return None;
        }
        let machine = &self.machine;
        kinematics::coordinates(machine, &self.state, &mut self.coordinates);
        let (mut first, mut momentum) = (Vector3::zeros(), Vector3::zeros());
        for (i, body) in machine.bodies.iter().enumerate() {
            if i > 0 {
                self.motions[i] = self.motions[body.parent].carry(body, &self.coordinates[i]);
            }
            if self.spins[i] {
                continue;
            }
            let motion = &self.motions[i];
            let (inertia, w) = (&body.inertia, &motion.angular_velocity);
            let com = motion.rotation * inertia.com;
            let place = motion.origin + com - Vector3::z() * self.ground;
            let velocity = motion.velocity + w.cross(&com);
            let tensor = motion.rotation * inertia.about_com * motion.rotation.transpose();
            first += place * inertia.mass;
            momentum += place.cross(&velocity) * inertia.mass + tensor * w;
        }
        let weight = first.cross(&(up * -machine.gravity()));
        let mut smoothed = Vector2::new(weight.x, weight.y);
        for filter in &mut self.weight {
            smoothed = filter.step(dt, &smoothed);
        }
        let [once, twice] = &mut self.momentum;
        let once = once.step(dt, &Vector2::new(momentum.x, momentum.y));
        let change = (once - twice.step(dt, &once)) / SMOOTHED_S;
        let lean = self.compliance * (change - smoothed);
        lean.iter().all(|v| v.is_finite()).then_some(lean)
    }
}

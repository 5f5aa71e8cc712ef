//! Joints with measured torque: their information on the load split that equilibrium leaves open.
//!
//! A virtual displacement of a linkage's actuator rotates the pivot's distal subtree and moves cylinder and
//! rod. By virtual work, per radian of the pivot,
//! ```text
//!     sum over distal wheels of z . (r_i - p) x q N_i = T_p + phi' T_c + x' (T_r - f)                        A(1)
//! ```
//! where T are the torques and the force that accelerate the distal subtrees of pivot, cylinder hinge and rod,
//! phi' and x' the derivatives of the latter two coordinates with respect to the pivot's, f the measured force
//! and q = F / F_n the traction per load. A(1) is T(14) with an actuator. It does not hold exactly: friction,
//! sensor error and traction that is not proportional to load leave it uncertain by
//! ```text
//!     s_j^2 = x'^2 (s_f^2 + (mu f)^2) + (share F_n/n sum over distal wheels of h_i)^2                          A(2)
//! ```
//! where h_i is the lever arm of a horizontal force. The loads are uncertain accordingly: of all loads in
//! equilibrium, the solution minimises the energy of the springs, of the split rule, and of the rows A(1)
//! treated as springs of compliance S = s^2 / s_0^2. s_0 is the prior standard deviation of the loads from the
//! split rule:
//! ```text
//!     N = K (u + A' l),   (A K A' + diag S) l = b - A K u;      covariance s_0^2 (I - L A) K                   A(3)
//! ```
//! The measured load F of a support, such as the force of a jack, is a row of its own:
//! ```text
//!     N_i = F,      s_j^2 = s_f^2 + (mu F)^2                                                                   A(4)
//! ```

use super::equilibrium::{DistalSubtrees, Equations, RULE_COMPLIANCE};
use crate::dynamics::newton_euler_derivatives::joint_form;
use crate::geometry::coordinate::Motion;
use crate::machine::{ActuatedJoint, ForceSource, Linkage, MAX_WHEELS, Machine};
use crate::number::{Mask, Real};
use crate::state::State;

/// Rows with less compliance than this (m^2) may contradict each other within rounding.
const LEAST_COMPLIANCE: f64 = 1e-7;

/// Motion of a linkage's cylinder and rod relative to its pivot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gearing<T> {
    /// Derivatives with respect to the pivot angle: 1, phi' and x' (rad, m).
    pub(crate) by_pivot: [T; 3],
    /// Their derivatives with respect to the measured joint's position.
    pub(crate) slope: [T; 3],
}

/// Inputs from the actuated joints, before the loads are computed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Actuation<T> {
    pub(crate) gearing: Gearing<T>,
    /// Actuator force (N); zero where unknown.
    pub(crate) force: T,
    /// 1 where the force is known, else 0.
    pub(crate) known: T,
}

impl<T: Real> Gearing<T> {
    /// Returns the gearing of a linkage. With unit velocity and zero acceleration of the measured joint, the joints' velocities
    /// are first and their accelerations second derivatives with respect to its position.
    fn of(linkage: &Linkage, measured: &Motion<T>) -> Self {
        let solved = linkage.solve(&Motion {
            position: measured.position,
            rate: T::one(),
            acceleration: T::zero(),
        });
        let turn = &solved.pivot;
        let by_pivot = |rate: T| rate / turn.rate;
        let slope = |rate: T, acceleration: T| {
            (acceleration * turn.rate - rate * turn.acceleration) / (turn.rate * turn.rate)
        };
        let (cylinder, rod) = (&solved.cylinder, &solved.rod);
        Self {
            by_pivot: [T::one(), by_pivot(cylinder.rate), by_pivot(rod.rate)],
            slope: [
                T::zero(),
                slope(cylinder.rate, cylinder.acceleration),
                slope(rod.rate, rod.acceleration),
            ],
        }
    }
}

impl<T: Real> Gearing<T> {
    /// A(4): the load itself is measured, positive upwards, where a rod's force enters A(1) with the opposite sign.
    fn of_support() -> Self {
        Self {
            by_pivot: [T::zero(), T::zero(), -T::one()],
            slope: [T::zero(); 3],
        }
    }
}

impl<T: Real> Actuation<T> {
    pub(crate) fn unknown() -> Self {
        let nothing = [T::zero(); 3];
        Self {
            gearing: Gearing {
                by_pivot: nothing,
                slope: nothing,
            },
            force: T::zero(),
            known: T::zero(),
        }
    }

    /// Fills the entry of every actuated joint.
    pub(crate) fn fill(machine: &Machine, state: &State<T>, actuations: &mut [Self]) {
        let joints = machine.contact.actuated_joints.iter();
        for ((joint, &force), actuation) in joints.zip(&state.actuator_force).zip(actuations) {
            let known = force.abs().lt(T::constant(f64::INFINITY));
            *actuation = Self {
                gearing: match joint.source {
                    ForceSource::Linkage(linkage) => {
                        let linkage = &machine.linkages[linkage];
                        Gearing::of(linkage, &state.joints[linkage.measured_joint])
                    }
                    ForceSource::Support { .. } => Gearing::of_support(),
                },
                force: T::select(known, force, T::zero()),
                known: T::select(known, T::one(), T::zero()),
            };
        }
    }
}

impl<T: Real> Equations<T> {
    /// Whether the equations include rows of measured torques.
    pub(crate) fn are_measured(&self) -> bool {
        self.value.len() > self.measured
    }

    /// Removes the measured rows, so that the split rule applies again.
    pub(crate) fn forget_measured(&mut self) {
        for row in self.certain..self.value.len() {
            self.compliance[row] = T::zero();
            self.holds[row] = if row < self.measured {
                T::one()
            } else {
                T::zero()
            };
        }
    }

    /// Deactivates the measured rows until [`Self::take_measured_up`].
    pub(crate) fn set_measured_aside(&mut self) {
        let [holds, compliance] = &mut self.aside;
        holds.copy_from_slice(&self.holds);
        compliance.copy_from_slice(&self.compliance);
        self.forget_measured();
    }

    /// Restores the rows that were deactivated.
    pub(crate) fn take_measured_up(&mut self) {
        let [holds, compliance] = &self.aside;
        self.holds.copy_from_slice(holds);
        self.compliance.copy_from_slice(compliance);
    }

    /// Sets the rows A(1) with their compliance A(2), where the force is known.
    pub(crate) fn set_actuated_joints(
        &mut self,
        machine: &Machine,
        distal: &DistalSubtrees<'_, T>,
        actuations: &[Actuation<T>],
    ) {
        self.forget_measured();
        let contact = &machine.contact;
        let mut any = T::Mask::splat(false);
        for (j, (joint, actuation)) in contact.actuated_joints.iter().zip(actuations).enumerate() {
            let row = self.measured + j;
            let (levers, on_ground) = match (&joint.source, joint.steps.first()) {
                (ForceSource::Support { wheel, .. }, _) => (T::zero(), self.set_load(row, *wheel)),
                (_, Some(pivot)) => (self.set_distal_wheels(row, pivot, distal), T::one()),
                (_, None) => (T::zero(), T::zero()),
            };
            let known = actuation.known * on_ground;
            let [_, _, by_rod] = actuation.gearing.by_pivot;
            let mut value = -(by_rod * actuation.force);
            for (s, (step, &factor)) in joint
                .steps
                .iter()
                .zip(&actuation.gearing.by_pivot)
                .enumerate()
            {
                let kind = machine.bodies[step.body].kind;
                let form = joint_form(kind, &distal.motions[step.body], factor);
                value += distal.wrenches[contact.torque_place(j, s)].contracted(&form);
            }
            self.value[row] = value;
            self.holds[row] = known;
            let variance = self.variance(machine, joint, actuation, levers);
            let compliance = variance.held() * T::constant(self.prior_scale.powi(-2));
            self.compliance[row] = compliance.max(T::constant(LEAST_COMPLIANCE)) * known;
            any = any | T::zero().lt(known);
        }
        for row in self.certain..self.measured {
            let soft = T::constant(RULE_COMPLIANCE);
            self.compliance[row] = T::select(any, soft, T::zero());
        }
    }

    /// Sets the factors of the row of a measured load; returns 1, or 0 while the support is off the ground.
    fn set_load(&mut self, row: usize, wheel: Option<usize>) -> T {
        self.factor[row] = [T::zero(); MAX_WHEELS];
        let Some(wheel) = wheel else {
            return T::zero();
        };
        self.factor[row][wheel] = T::one();
        T::one()
    }

    /// A(2) except for the part that depends on the loads; `levers` is the sum of h_i (m).
    fn variance(
        &self,
        machine: &Machine,
        joint: &ActuatedJoint,
        actuation: &Actuation<T>,
        levers: T,
    ) -> T {
        let [_, _, by_rod] = actuation.gearing.by_pivot;
        let sensor = T::constant(joint.force_sigma);
        let friction = T::constant(joint.friction_share) * actuation.force;
        let share = machine.contact.traction_share / self.wheels as f64;
        let traction = T::constant(share) * self.value[0] * levers;
        by_rod * by_rod * (sensor * sensor + friction * friction) + traction * traction
    }

    /// Variances of the loads given the measured torques, A(3) (N^2); zero where no torque is known. `slack`
    /// returns (I - L A) K of two wheels.
    pub(crate) fn measured_variance(&self, slack: impl Fn(usize) -> T) -> [T; MAX_WHEELS] {
        let mut variance = [T::zero(); MAX_WHEELS];
        let scale = self.prior_variance();
        for (wheel, variance) in variance[..self.wheels].iter_mut().enumerate() {
            *variance = (slack(wheel) * scale).max(T::zero());
        }
        variance
    }

    /// s_0^2 of A(3) where any torque is known, zero elsewhere (N^2).
    pub(crate) fn prior_variance(&self) -> T {
        let known = T::zero().lt(self.known_torques());
        let scale = T::constant(self.prior_scale.powi(2));
        T::select(known, scale, T::zero())
    }

    /// Number of measured torques that are known.
    pub(crate) fn known_torques(&self) -> T {
        let holds = &self.holds[self.measured..];
        holds.iter().fold(T::zero(), |sum, &holds| sum + holds)
    }

    /// Residual of a measured torque: measured minus predicted (N m about the pivot); NaN where unknown.
    pub(crate) fn residual(&self, joint: usize, loads: &[T]) -> T {
        let row = self.measured + joint;
        let mut residual = -self.value[row];
        for (&load, &factor) in loads.iter().zip(&self.factor[row]) {
            residual += load * factor;
        }
        let known = T::zero().lt(self.holds[row]);
        T::select(known, residual, T::constant(f64::NAN))
    }
}

//! The measured loads of all supports in place of the computed ground force: where a load is there that the machine does not
//! state.
//!
//! Nothing is known of such a load beforehand, so the supports alone determine force and moments: first the total and where
//! it acts, then the split by A(4). With F_i the measured loads at the places x_i, y_i,
//! ```text
//!     F_n = sum F_i      M_x = sum y_i F_i      M_y = -sum x_i F_i;      N_i = F_i,   var N_i = s_f^2 + (mu F_i)^2      A(5)
//! ```
//! No parameter of the machine has an effect on these loads.

use nalgebra::Vector2;

use super::actuated::Actuation;
use super::equilibrium::{Equations, GroundForce};
use super::response::Response;
use crate::machine::{MAX_WHEELS, Machine};
use crate::number::{Mask, Real};

/// The measured loads of all supports on the ground.
#[derive(Debug)]
pub(super) struct BySupports<T> {
    /// 1 where they are followed, else 0.
    follows: T,
    /// Variance of each (N^2).
    variance: [T; MAX_WHEELS],
}

impl<T: Real> BySupports<T> {
    pub(super) fn nowhere() -> Self {
        Self {
            follows: T::zero(),
            variance: [T::zero(); MAX_WHEELS],
        }
    }

    /// Where they are followed.
    pub(super) fn follows(&self) -> T::Mask {
        T::zero().lt(self.follows)
    }

    /// Whether they are followed in any sample.
    pub(super) fn follows_any(&self) -> bool {
        self.follows().any()
    }

    /// These variances of loads, or those of the measured loads where they are followed.
    pub(super) fn or_measured(&self, mut variances: [T; MAX_WHEELS]) -> [T; MAX_WHEELS] {
        for (variance, measured) in variances.iter_mut().zip(&self.variance) {
            *variance = T::select(self.follows(), *measured, *variance);
        }
        variances
    }

    /// Variance of a weighted sum of the loads, where they are followed (N^2).
    pub(super) fn variance_of(&self, factors: &[T]) -> T {
        let pairs = factors.iter().zip(&self.variance);
        pairs.fold(T::zero(), |sum, (&factor, &variance)| {
            sum + factor * factor * variance
        })
    }
}

impl<T: Real> Equations<T> {
    /// A(5) where it is `wanted` (1) and the loads of all supports are measured; else the computed force.
    pub(crate) fn ground_force(
        &mut self,
        machine: &Machine,
        wanted: T,
        actuations: &[Actuation<T>],
        contacts: &[Vector2<T>],
        computed: GroundForce<T>,
    ) -> GroundForce<T> {
        self.by_supports = BySupports::nowhere();
        if !T::zero().lt(wanted).any() {
            return computed;
        }
        let mut loads = [T::zero(); MAX_WHEELS];
        let mut known = [T::zero(); MAX_WHEELS];
        let joints = machine.contact.actuated_joints.iter().zip(actuations);
        for (joint, actuation) in joints {
            let Some(wheel) = joint.support_place() else {
                continue;
            };
            let friction = T::constant(joint.friction_share) * actuation.force;
            let sensor = T::constant(joint.force_sigma);
            loads[wheel] = actuation.force;
            known[wheel] = actuation.known;
            self.by_supports.variance[wheel] = sensor * sensor + friction * friction;
        }
        let all = (known[..contacts.len()].iter()).fold(wanted, |all, &known| all * known);
        self.by_supports.follows = all;
        let mut measured = GroundForce {
            normal: T::zero(),
            moment: Vector2::zeros(),
        };
        for (contact, &load) in contacts.iter().zip(&loads) {
            measured.normal += load;
            measured.moment.x += contact.y * load;
            measured.moment.y -= contact.x * load;
        }
        let follows = self.by_supports.follows();
        let either = |measured: T, computed: T| T::select(follows, measured, computed);
        GroundForce {
            normal: either(measured.normal, computed.normal),
            moment: Vector2::new(
                either(measured.moment.x, computed.moment.x),
                either(measured.moment.y, computed.moment.y),
            ),
        }
    }
}

impl<T: Real> Equations<T> {
    /// Whether the measured loads are followed in any sample.
    pub(crate) fn follow_supports(&self) -> bool {
        self.by_supports.follows_any()
    }

    /// Variance of a weighted sum of the loads by A(5) (N^2); zero where they are not followed.
    pub(crate) fn variance_by_supports(&self, factors: &[T]) -> T {
        let variance = self.by_supports.variance_of(factors);
        T::select(self.by_supports.follows(), variance, T::zero())
    }
}

impl<T: Real> Response<T> {
    /// Where the measured loads are followed, each load responds to its own row alone.
    pub(super) fn follow_supports(&mut self, equations: &Equations<T>) {
        if !equations.by_supports.follows_any() {
            return;
        }
        let follows = equations.by_supports.follows();
        for (row, loads) in self.loads.iter_mut().enumerate() {
            let measured = row.checked_sub(equations.measured);
            let own = measured.and_then(|measured| equations.load_of[measured]);
            for (wheel, load) in loads.iter_mut().enumerate() {
                let of_row = if own == Some(wheel) { 1.0 } else { 0.0 };
                *load = T::select(follows, T::constant(of_row), *load);
            }
        }
        for multiplier in &mut self.multiplier {
            *multiplier = T::select(follows, T::zero(), *multiplier);
        }
    }
}

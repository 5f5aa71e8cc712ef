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
use super::measured_supports::MeasuredSupports;
use super::response::Response;
use crate::machine::{MAX_WHEELS, Machine};
use crate::number::{Mask, Real};

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
        self.by_supports = MeasuredSupports::nowhere();
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
    /// Whether the computed loads follow the measured loads of all supports in any sample.
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
    /// Makes each load respond to its own row alone, where the computed loads follow the measured ones.
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

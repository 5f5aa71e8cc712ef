//! Contributions to each wheel's load: how much of it is due to weight, slope, motion and tool force.
//!
//! The OTF is linear in the wrench of every body (with the equations' factors fixed), so it is the sum of the
//! contributions of the parts of the wrench. The parts are:
//!
//! ```text
//!     weights                 g n            over chassis, wheels and arm, n the contact plane's normal
//!     slope                   g (up - n)
//!     arm motion              due to the motion of the arm's own joints
//!     cornering               w x v + w x (w x r), and the gyroscopic moment of all bodies
//!     platform acceleration   the remaining acceleration of the base, alpha x r, and the motion of wheels
//!                             and suspension relative to it
//!     tool force              the wrench on the tool
//!     warp                    not a wrench: what measured torques, or wheel heights on ground declared a
//!                             plane, add to the load split by the split rule
//! ```
//! with v the velocity of the base origin. Where v is unknown, the term w x v of cornering remains in the
//! platform acceleration. Where up is unknown, only the sum of slope and platform acceleration is known: the
//! specific force.

use nalgebra::Vector3;

use crate::dynamics::composite::{Composite, Field};
use crate::dynamics::groups::{Groups, Parts};
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::newton_euler_derivatives::torque_form;
use crate::geometry::spatial::{Wrench, cross};
use crate::machine::Machine;
use crate::number::{Real, Wheels};
use crate::state::BaseState;
use crate::wheel_loads::LoadAdjoint;

named! {
    /// A contribution to a wheel's load.
    #[derive(PartialOrd, Ord)]
    pub enum Contribution {
        /// Weight of all links other than wheels and arm, along the contact plane's normal.
        ChassisWeight,
        /// Weight of the wheels.
        WheelWeight,
        /// Weight of the arm and its payloads.
        ArmWeight,
        /// Gravity due to the inclination of the contact plane.
        Slope,
        /// Inertia forces of the motion of the arm's joints.
        ArmMotion,
        /// Linear and angular acceleration of the platform.
        PlatformAcceleration,
        /// Centripetal acceleration and gyroscopic moment of turning at speed.
        Cornering,
        /// Force and moment on the tool.
        ToolForce,
        /// Change of the load split due to measured joint torques, or due to wheel heights on ground declared a
        /// plane.
        Warp,
        /// Load transferred from lifted wheels to the others: load minus OTF.
        LiftOff,
        /// Sum of slope and platform acceleration, where the attitude is unknown.
        SpecificForce,
    }
}

/// Contributions to one wheel's load, in the order of [`Contribution::ALL`] (N).
///
/// Without `LiftOff` they add up to the OTF, with it to the load. Either `SpecificForce` is NaN, or both
/// `Slope` and `PlatformAcceleration` are.
pub type Contributions<T> = [T; Contribution::ALL.len()];

/// Motion of the base, as far as it is known.
pub(crate) struct Circumstances<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) base: &'a BodyMotion<T>,
    pub(crate) known: &'a BaseState<T>,
    /// Normal of the contact plane.
    pub(crate) normal: &'a Vector3<T>,
}

/// Wrenches of the contributions; zero for warp and lift-off, which are not wrenches.
type CauseWrenches<T> = [Wrench<T>; Contribution::ALL.len()];

/// Computes the contributions to every wheel's load; `motions` holds the motion of every body.
pub(crate) fn attribute<T: Real>(
    circumstances: &Circumstances<'_, T>,
    groups: &Groups<T>,
    motions: &[BodyMotion<T>],
    adjoints: &[LoadAdjoint<T::Wheels>],
    contributions: &mut [Contributions<T>],
) {
    contributions.fill([T::zero(); Contribution::ALL.len()]);
    for (set, parts) in groups.sets.iter().enumerate() {
        let wrenches = circumstances.wrenches(parts);
        for (contributions, adjoint) in contributions.chunks_mut(T::Wheels::COUNT).zip(adjoints) {
            let form = match set.checked_sub(1) {
                None => adjoint.share,
                Some(k) => {
                    let joint = &circumstances.machine.contact.free_joints[k];
                    torque_form(&motions[joint.body], adjoint.torque_share[k])
                }
            };
            for (cause, wrench) in wrenches.iter().enumerate() {
                let by = wrench.contracted_side_by_side(&form);
                for (place, contributions) in contributions.iter_mut().enumerate() {
                    contributions[cause] += by.wheel(place);
                }
            }
        }
    }
    for contributions in contributions {
        circumstances.clear_unknown(contributions);
    }
}

impl<T: Real> Circumstances<'_, T> {
    fn wrenches(&self, parts: &Parts<T>) -> CauseWrenches<T> {
        let gravity = T::constant(self.machine.gravity());
        let (w, f) = (&self.base.angular_velocity, &self.base.specific_force);
        let (weight, up) = (self.normal * gravity, self.known.up * gravity);
        let centripetal = self.centripetal_acceleration();
        let whole = parts.whole();
        let mut rest = parts.chassis.moments;
        rest.add(&parts.wheels.moments);
        let rest_moving = parts
            .chassis
            .wrench
            .plus(&parts.wheels.wrench)
            .minus(&self.frozen(&rest));
        let accelerated = whole
            .accelerated(&Field {
                angular: self.base.angular_acceleration,
                linear: f - centripetal,
            })
            .plus(&rest_moving);
        let mut wrenches = [Wrench::zero(); Contribution::ALL.len()];
        let mut set = |cause: Contribution, wrench: Wrench<T>| wrenches[cause as usize] = wrench;
        set(
            Contribution::ChassisWeight,
            parts.chassis.moments.uniformly_accelerated(&weight),
        );
        set(
            Contribution::WheelWeight,
            parts.wheels.moments.uniformly_accelerated(&weight),
        );
        set(
            Contribution::ArmWeight,
            parts.arm.moments.uniformly_accelerated(&weight),
        );
        set(
            Contribution::Slope,
            whole.uniformly_accelerated(&(up - weight)),
        );
        set(
            Contribution::ArmMotion,
            parts.arm.wrench.minus(&self.frozen(&parts.arm.moments)),
        );
        set(
            Contribution::PlatformAcceleration,
            accelerated.minus(&whole.uniformly_accelerated(&up)),
        );
        set(
            Contribution::Cornering,
            whole
                .uniformly_accelerated(&centripetal)
                .plus(&whole.spun(w)),
        );
        set(Contribution::ToolForce, Wrench::zero().minus(&parts.tool));
        set(
            Contribution::SpecificForce,
            accelerated.minus(&whole.uniformly_accelerated(&weight)),
        );
        wrenches
    }

    /// Wrench of bodies that move with the base, their joints locked.
    fn frozen(&self, moments: &Composite<T>) -> Wrench<T> {
        let field = Field {
            angular: self.base.angular_acceleration,
            linear: self.base.specific_force,
        };
        moments
            .accelerated(&field)
            .plus(&moments.spun(&self.base.angular_velocity))
    }

    /// w x v, zero where v is unknown.
    fn centripetal_acceleration(&self) -> Vector3<T> {
        let centripetal = cross(&self.base.angular_velocity, &self.known.velocity);
        let zero = T::zero();
        let known = (centripetal.x + centripetal.y + centripetal.z)
            .abs()
            .lt(T::constant(f64::INFINITY));
        centripetal.map(|component| T::select(known, component, zero))
    }

    fn clear_unknown(&self, contributions: &mut Contributions<T>) {
        let unknown = T::constant(f64::NAN);
        let up = &self.known.up;
        let known = (up.x + up.y + up.z).abs().lt(T::constant(f64::INFINITY));
        let together = &mut contributions[Contribution::SpecificForce as usize];
        *together = T::select(known, unknown, *together);
        for cause in [Contribution::Slope, Contribution::PlatformAcceleration] {
            let alone = &mut contributions[cause as usize];
            *alone = T::select(known, *alone, unknown);
        }
    }
}

/// Contribution of each link's wrench to the OTF of each wheel; zero for links without mass.
pub(crate) fn attribute_links<T: Real>(
    machine: &Machine,
    motions: &[BodyMotion<T>],
    adjoints: &[LoadAdjoint<T::Wheels>],
    parts: &mut [Vec<T>],
) {
    for (link, shares) in machine.links.iter().zip(parts) {
        let motion = &motions[link.body];
        let moments = Composite::of(&link.moments, motion);
        let wrench = moments.moved(motion);
        for (shares, adjoint) in shares.chunks_mut(T::Wheels::COUNT).zip(adjoints) {
            let mut by = wrench.contracted_side_by_side(&adjoint.share);
            let free = machine.contact.free_joints.iter();
            for (joint, &torque) in free.zip(&adjoint.torque_share) {
                if joint.supports_body[link.body] {
                    let form = torque_form(&motions[joint.body], torque);
                    by += wrench.contracted_side_by_side(&form);
                }
            }
            for (place, share) in shares.iter_mut().enumerate() {
                *share = by.wheel(place);
            }
        }
    }
}

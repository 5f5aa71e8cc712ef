//! What causes each wheel's load.
//!
//! The OTF is linear in the wrench of every body (with the equations' factors held), so it is the sum of
//! what each part of the wrench contributes. The causes take the wrench apart:
//!
//! ```text
//!     weights                 g n            over chassis, wheels and arm, n the contact plane's normal
//!     slope                   g (up - n)
//!     arm motion              what the arm's own joints add to its wrench
//!     cornering               w x v + w x (w x r), and the gyroscopic moment of the whole
//!     platform acceleration   the rest of the base's acceleration, alpha x r, and what wheels and
//!                             suspension add by their own motion
//!     tool force              on the tool
//!     warp                    no wrench: what measured torques or heights on a plane add to the rule's split
//! ```
//! with v the velocity of the base origin. Where the log does not know v, the part w x v of cornering
//! stays in the platform's acceleration; where it does not know up, slope and platform acceleration are
//! only known together, as specific force.

use nalgebra::Vector3;

use crate::dynamics::composite::{Composite, Field};
use crate::dynamics::groups::{Groups, Parts};
use crate::dynamics::kinematics::BodyMotion;
use crate::dynamics::newton_euler_derivatives::torque_form;
use crate::geometry::spatial::{Wrench, cross};
use crate::machine::Machine;
use crate::number::Real;
use crate::state::BaseState;
use crate::wheel_loads::Influence;

/// A cause of a wheel's load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// Weight of what is neither wheel nor arm, along the contact plane's normal.
    ChassisWeight,
    /// Weight of the wheels.
    WheelWeight,
    /// Weight of the arm and of what hangs on it.
    ArmWeight,
    /// What gravity adds because the plane is not level.
    Slope,
    /// What the motion of the arm's joints adds.
    ArmMotion,
    /// Acceleration of the platform, in a line and in turning.
    PlatformAcceleration,
    /// What turning at speed adds.
    Cornering,
    /// Force and moment on the tool.
    ToolForce,
    /// What measured joint torques, or heights of the wheels on ground declared a plane, say of the
    /// split beyond the rule.
    Warp,
    /// What lifted wheels give to the others: load less OTF.
    LiftOff,
    /// Slope and platform acceleration together, where the attitude is unknown.
    SpecificForce,
}

impl Cause {
    /// All causes, in the order of their columns.
    pub const ALL: [Self; 11] = [
        Self::ChassisWeight,
        Self::WheelWeight,
        Self::ArmWeight,
        Self::Slope,
        Self::ArmMotion,
        Self::PlatformAcceleration,
        Self::Cornering,
        Self::ToolForce,
        Self::Warp,
        Self::LiftOff,
        Self::SpecificForce,
    ];

    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ChassisWeight => "chassis_weight",
            Self::WheelWeight => "wheel_weight",
            Self::ArmWeight => "arm_weight",
            Self::Slope => "slope",
            Self::ArmMotion => "arm_motion",
            Self::PlatformAcceleration => "platform_acceleration",
            Self::Cornering => "cornering",
            Self::ToolForce => "tool_force",
            Self::Warp => "warp",
            Self::LiftOff => "lift_off",
            Self::SpecificForce => "specific_force",
        }
    }
}

/// What each cause contributes to a wheel's load, in the order of [`Cause::ALL`] (N).
///
/// Without `LiftOff` they add up to the OTF, with it to the load. Either `SpecificForce` is NaN, or
/// `Slope` and `PlatformAcceleration` are.
pub type Causes<T> = [T; Cause::ALL.len()];

/// The base's motion and what is known of it.
pub(crate) struct Circumstances<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) base: &'a BodyMotion<T>,
    pub(crate) known: &'a BaseState<T>,
    /// Normal of the contact plane.
    pub(crate) normal: &'a Vector3<T>,
}

/// Wrenches of the causes; those of warp and lift-off are none.
type CauseWrenches<T> = [Wrench<T>; Cause::ALL.len()];

/// Fills the causes of every wheel; `motions` are those of all bodies.
pub(crate) fn attribute<T: Real>(
    circumstances: &Circumstances<'_, T>,
    groups: &Groups<T>,
    motions: &[BodyMotion<T>],
    influences: &[Influence<T>],
    causes: &mut [Causes<T>],
) {
    causes.fill([T::zero(); Cause::ALL.len()]);
    for (set, parts) in groups.sets.iter().enumerate() {
        let wrenches = circumstances.wrenches(parts);
        for (causes, influence) in causes.iter_mut().zip(influences) {
            let form = match set.checked_sub(1) {
                None => influence.share,
                Some(k) => {
                    let joint = &circumstances.machine.contact.free_joints[k];
                    torque_form(&motions[joint.body], influence.torque_share[k])
                }
            };
            for (cause, wrench) in causes.iter_mut().zip(&wrenches) {
                *cause += wrench.contracted(&form);
            }
        }
    }
    for causes in causes {
        circumstances.leave_out_the_unknown(causes);
    }
}

impl<T: Real> Circumstances<'_, T> {
    fn wrenches(&self, parts: &Parts<T>) -> CauseWrenches<T> {
        let gravity = T::constant(self.machine.gravity());
        let (w, f) = (&self.base.angular_velocity, &self.base.specific_force);
        let (weight, up) = (self.normal * gravity, self.known.up * gravity);
        let turning = self.turning_at_speed();
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
                linear: f - turning,
            })
            .plus(&rest_moving);
        let mut wrenches = [Wrench::zero(); Cause::ALL.len()];
        let mut set = |cause: Cause, wrench: Wrench<T>| wrenches[cause as usize] = wrench;
        set(
            Cause::ChassisWeight,
            parts.chassis.moments.uniformly_accelerated(&weight),
        );
        set(
            Cause::WheelWeight,
            parts.wheels.moments.uniformly_accelerated(&weight),
        );
        set(
            Cause::ArmWeight,
            parts.arm.moments.uniformly_accelerated(&weight),
        );
        set(Cause::Slope, whole.uniformly_accelerated(&(up - weight)));
        set(
            Cause::ArmMotion,
            parts.arm.wrench.minus(&self.frozen(&parts.arm.moments)),
        );
        set(
            Cause::PlatformAcceleration,
            accelerated.minus(&whole.uniformly_accelerated(&up)),
        );
        set(
            Cause::Cornering,
            whole.uniformly_accelerated(&turning).plus(&whole.spun(w)),
        );
        set(Cause::ToolForce, Wrench::zero().minus(&parts.tool));
        set(
            Cause::SpecificForce,
            accelerated.minus(&whole.uniformly_accelerated(&weight)),
        );
        wrenches
    }

    /// The wrench of bodies that the base carries with their joints held.
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
    fn turning_at_speed(&self) -> Vector3<T> {
        let turning = cross(&self.base.angular_velocity, &self.known.velocity);
        let zero = T::zero();
        let known = (turning.x + turning.y + turning.z)
            .abs()
            .lt(T::constant(f64::INFINITY));
        turning.map(|component| T::select(known, component, zero))
    }

    fn leave_out_the_unknown(&self, causes: &mut Causes<T>) {
        let unknown = T::constant(f64::NAN);
        let up = &self.known.up;
        let known = (up.x + up.y + up.z).abs().lt(T::constant(f64::INFINITY));
        let together = &mut causes[Cause::SpecificForce as usize];
        *together = T::select(known, unknown, *together);
        for cause in [Cause::Slope, Cause::PlatformAcceleration] {
            let alone = &mut causes[cause as usize];
            *alone = T::select(known, *alone, unknown);
        }
    }
}

/// What each link's wrench contributes to the OTF of each wheel; links without mass contribute nothing.
pub(crate) fn attribute_links<T: Real>(
    machine: &Machine,
    motions: &[BodyMotion<T>],
    influences: &[Influence<T>],
    parts: &mut [Vec<T>],
) {
    for (link, shares) in machine.links.iter().zip(parts) {
        let motion = &motions[link.body];
        let moments = Composite::of(&link.moments, motion);
        let wrench = moments.moved(motion);
        for (share, influence) in shares.iter_mut().zip(influences) {
            *share = wrench.contracted(&influence.share);
            let free = machine.contact.free_joints.iter();
            for (joint, &torque) in free.zip(&influence.torque_share) {
                if joint.carries_body[link.body] {
                    let form = torque_form(&motions[joint.body], torque);
                    *share += wrench.contracted(&form);
                }
            }
        }
    }
}

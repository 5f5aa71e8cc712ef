//! Newton-Euler equations: the wrench that accelerates each body, about the base origin.
//!
//! ```text
//!     f_i = m_i (a_i + alpha_i x c_i + w_i x (w_i x c_i))
//!     n_i = I_i alpha_i + w_i x I_i w_i + (p_i + c_i) x f_i
//! ```
//! a_i is a specific force, so f_i includes the weight: the sum over all bodies minus the tool wrench is the
//! ground wrench. It includes the wheel dynamics (32)-(44) of the first paper.

use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::{Wrench, cross, rotate, rotate_back, rotate_constant};
use crate::machine::{Inertia, Machine};
use crate::number::Real;
use crate::state::State;

/// Wrench about the base origin that produces a body's motion, base axes.
#[inline(always)]
pub(crate) fn body_wrench<T: Real>(inertia: &Inertia, motion: &BodyMotion<T>) -> Wrench<T> {
    let (w, alpha) = (&motion.angular_velocity, &motion.angular_acceleration);
    let com = rotate_constant(&motion.rotation, &inertia.com);
    let acceleration = motion.specific_force + cross(alpha, &com) + cross(w, &cross(w, &com));
    let force = acceleration * T::constant(inertia.mass);
    // I alpha + w x I w in the body's axes, where I is constant
    let tensor = inertia.about_com.map(T::constant);
    let (w_body, alpha_body) = (
        rotate_back(&motion.rotation, w),
        rotate_back(&motion.rotation, alpha),
    );
    let couple = rotate(&tensor, &alpha_body) + cross(&w_body, &rotate(&tensor, &w_body));
    let moment = rotate(&motion.rotation, &couple) + cross(&(motion.origin + com), &force);
    Wrench { force, moment }
}

/// Wrench of the surroundings on the tool, about the base origin, base axes.
pub fn tool_wrench<T: Real>(
    machine: &Machine,
    state: &State<T>,
    motions: &[BodyMotion<T>],
) -> Wrench<T> {
    let Some(tool) = &machine.tool else {
        return Wrench::zero();
    };
    let motion = &motions[tool.body];
    let rotation = motion.rotation * tool.rotation_in_body().map(T::constant);
    let origin = motion.point(&tool.body_from_mount.translation.vector);
    let force = rotation * state.tool_wrench.force;
    Wrench {
        force,
        moment: rotation * state.tool_wrench.moment + origin.cross(&force),
    }
}

/// Adds the wrench of each payload to that of the body that carries it.
pub(crate) fn add_payloads<T: Real>(
    machine: &Machine,
    state: &State<T>,
    motions: &[BodyMotion<T>],
    wrenches: &mut [Wrench<T>],
) {
    for (payload, &share) in machine.payloads.iter().zip(&state.payload_share) {
        let whole = body_wrench(&payload.inertia, &motions[payload.body]);
        let carried = Wrench {
            force: whole.force * share,
            moment: whole.moment * share,
        };
        wrenches[payload.body] = wrenches[payload.body].plus(&carried);
    }
}

/// Sum of the wrenches of the bodies for which `counted` holds.
pub(crate) fn sum<T: Real>(wrenches: &[Wrench<T>], counted: impl Fn(usize) -> bool) -> Wrench<T> {
    let mut total = Wrench::zero();
    for (_, wrench) in wrenches.iter().enumerate().filter(|(i, _)| counted(*i)) {
        total = total.plus(wrench);
    }
    total
}

//! Derivatives with respect to the positions of IMU, arm and wheels, and to the contact parameters.

use nalgebra::Vector3;

use super::Writer;
use super::chain::{Chain, SensedMotion};
use crate::composite::Composite;
use crate::kinematics::BodyMotion;
use crate::machine::{LinkGroup, Seat, Split};
use crate::newton_euler_derivatives::BaseGradient;
use crate::number::Real;
use crate::spatial::{Wrench, cross, rotate, rotate_back};
use crate::wheel_loads::Influence;

/// Position and small rotations of the IMU in its body.
pub(super) fn write_imu<T: Real>(
    motion: &SensedMotion<'_, T>,
    base: &BaseGradient<T>,
    write: &mut Writer<'_, T>,
) {
    let (machine, seat) = (motion.machine, motion.seat);
    let carrier = &motion.motions[machine.imu.body];
    // The difference between the specific forces of IMU and base is due to the motion of the sensor's point p:
    // a shift d in the body changes it by alpha x d + w x (w x d), with the body's own angular motion.
    let by_place = -pulled(carrier, &base.specific_force);
    let sensed = base.by_sensor(motion);
    let felt = |v: &Vector3<T>| rotate(&seat.rotation, v);
    let imu = &motion.state.imu;
    let by_turn = cross(&felt(&imu.specific_force), &sensed.specific_force)
        + cross(&felt(&imu.angular_velocity), &sensed.angular_velocity)
        + cross(
            &felt(&imu.angular_acceleration),
            &sensed.angular_acceleration,
        );
    for by in [by_place, by_turn] {
        write.vector(&rotate_back(&carrier.rotation, &by));
    }
}

/// Position of the arm on its carrier. An IMU on the arm moves with it.
pub(super) fn write_arm<T: Real>(
    motion: &SensedMotion<'_, T>,
    chain: &Chain<T>,
    base: &BaseGradient<T>,
    write: &mut Writer<'_, T>,
) {
    let Some(seat) = &motion.machine.arm_seat else {
        return;
    };
    let arm = &motion.groups.sets[0].arm;
    let force = arm.wrench.force - motion.groups.sets[0].tool.force;
    let form = &chain.form[seat.carrier];
    let carrier = &motion.motions[seat.carrier];
    let mut by = shifted(carrier, &arm.moments, &force, form);
    let links = &motion.machine.links;
    if links
        .iter()
        .any(|l| l.body == motion.machine.imu.body && l.group == LinkGroup::Arm)
    {
        by -= pulled(carrier, &base.specific_force);
    }
    write_in_seat(motion, seat, &by, write);
}

/// Position and radius of every wheel.
pub(super) fn write_wheels<T: Real>(
    motion: &SensedMotion<'_, T>,
    chain: &Chain<T>,
    influence: &Influence<T>,
    write: &mut Writer<'_, T>,
) {
    for (wheel, spec) in motion.machine.wheels.iter().enumerate() {
        let seat = &spec.seat;
        let mut by = influence.centre[wheel];
        if spec.body != seat.carrier {
            let (moments, wrench) = (&chain.beyond[spec.body], &chain.wrench_beyond[spec.body]);
            let carrier = &motion.motions[seat.carrier];
            by += shifted(carrier, moments, &wrench.force, &chain.form[spec.body]);
        }
        write_in_seat(motion, seat, &by, write);
        write.write([influence.radius[wheel] + influence.rest_radius[wheel]]);
    }
}

/// The split rule and the tyres.
pub(super) fn write_contact<T: Real>(
    motion: &SensedMotion<'_, T>,
    influence: &Influence<T>,
    write: &mut Writer<'_, T>,
) {
    let contact = &motion.machine.contact;
    if matches!(contact.split, Split::FrontShare { .. }) {
        write.write([influence.front_share]);
    }
    if contact.tyres_deflect {
        influence.stiffness.iter().for_each(|&by| write.write([by]));
    }
}

/// Derivative with respect to a shift d of bodies on their carrier, axes parallel to the base's: the specific
/// force of their points changes by `alpha x d + w x (w x d)`, and their wrench moves by d:
/// ```text
///     dF = m (alpha x d + w x (w x d)),      dM = d x F + h x (the same)
/// ```
fn shifted<T: Real>(
    carrier: &BodyMotion<T>,
    moments: &Composite<T>,
    force: &Vector3<T>,
    form: &Wrench<T>,
) -> Vector3<T> {
    let lever = form.force * moments.mass + cross(&form.moment, &moments.first);
    pulled(carrier, &lever) + cross(force, &form.moment)
}

/// The transpose of d -> alpha x d + w x (w x d).
pub(super) fn pulled<T: Real>(carrier: &BodyMotion<T>, by: &Vector3<T>) -> Vector3<T> {
    let (w, alpha) = (&carrier.angular_velocity, &carrier.angular_acceleration);
    cross(by, alpha) + cross(w, &cross(w, by))
}

fn write_in_seat<T: Real>(
    motion: &SensedMotion<'_, T>,
    seat: &Seat,
    by: &Vector3<T>,
    write: &mut Writer<'_, T>,
) {
    let in_carrier = rotate_back(&motion.motions[seat.carrier].rotation, by);
    let axes = seat.carrier_from_axes.map(T::constant);
    write.vector(&rotate_back(&axes, &in_carrier));
}

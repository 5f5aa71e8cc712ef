//! Derivatives with respect to the positions of IMU, arm and wheels, and to the contact parameters.

use nalgebra::Vector3;

use super::reverse_pass::ReversePass;
use super::sensed_motion::SensedMotion;
use super::wanted::Forms;
use super::writer::Writer;
use crate::dynamics::composite::Composite;
use crate::dynamics::newton_euler_derivatives::BaseGradient;
use crate::geometry::spatial::{
    Wrench, cross, each, rotate, rotate_back_by_constant, rotate_each_back,
};
use crate::machine::{LinkGroup, Mounting, Split};
use crate::number::{Real, Wheels};
use crate::wheel_loads::LoadAdjoint;

/// Position and small rotations of the IMU in its body.
pub(super) fn write_imu<T: Real>(
    motion: &SensedMotion<'_, T>,
    reverse_pass: &ReversePass<T>,
    base: &BaseGradient<T::Wheels>,
    sensed: &BaseGradient<T::Wheels>,
    write: &mut Writer<'_, T::Wheels>,
) {
    let (machine, mounting) = (motion.machine, motion.sensor_frame);
    let carrier = &motion.motions[machine.imu.body];
    // The difference between the specific forces of IMU and base is due to the motion of the sensor's point p:
    // a shift d in the body changes it by alpha x d + w x (w x d), with the body's own angular motion.
    let by_place = -reverse_pass.by_place(machine.imu.body, &base.specific_force);
    let measured = |v: &Vector3<T>| each(&rotate(&mounting.rotation, v));
    let imu = &motion.state.imu;
    let by_turn = cross(&measured(&imu.specific_force), &sensed.specific_force)
        + cross(&measured(&imu.angular_velocity), &sensed.angular_velocity)
        + cross(
            &measured(&imu.angular_acceleration),
            &sensed.angular_acceleration,
        );
    for by in [by_place, by_turn] {
        write.vector(&rotate_each_back(&carrier.rotation, &by));
    }
}

/// Position of the arm on its carrier. An IMU on the arm moves with it.
pub(super) fn write_arm<T: Real>(
    motion: &SensedMotion<'_, T>,
    reverse_pass: &ReversePass<T>,
    forms: Forms<'_, T::Wheels>,
    base: &BaseGradient<T::Wheels>,
    write: &mut Writer<'_, T::Wheels>,
) {
    let Some(mounting) = &motion.machine.arm_mounting else {
        return;
    };
    let arm = &motion.groups.sets[0].arm;
    let force = arm.wrench.force - motion.groups.sets[0].tool.force;
    let form = forms.of(mounting.carrier);
    let moments = &arm.moments;
    let mut by = shifted(reverse_pass, mounting.carrier, moments, &force, form);
    let links = &motion.machine.links;
    if links
        .iter()
        .any(|l| l.body == motion.machine.imu.body && l.group == LinkGroup::Arm)
    {
        by -= reverse_pass.by_place(mounting.carrier, &base.specific_force);
    }
    write_in_mounting(motion, mounting, &by, write);
}

/// Position and radius of every wheel.
pub(super) fn write_wheels<T: Real>(
    motion: &SensedMotion<'_, T>,
    reverse_pass: &ReversePass<T>,
    forms: Forms<'_, T::Wheels>,
    write: &mut Writer<'_, T::Wheels>,
) {
    let adjoint = forms.adjoint;
    for (wheel, spec) in motion.machine.wheels.iter().enumerate() {
        let mounting = &spec.mounting;
        let mut by = adjoint.centre[wheel];
        if spec.body != mounting.carrier {
            let moments = &reverse_pass.distal[spec.body];
            let force = &reverse_pass.distal_wrench[spec.body].force;
            let form = forms.of(spec.body);
            by += shifted(reverse_pass, mounting.carrier, moments, force, form);
        }
        write_in_mounting(motion, mounting, &by, write);
        write.write([adjoint.radius[wheel] + adjoint.rest_radius[wheel]]);
    }
}

/// The split rule and the tyres.
pub(super) fn write_contact<T: Real>(
    motion: &SensedMotion<'_, T>,
    adjoint: &LoadAdjoint<T::Wheels>,
    write: &mut Writer<'_, T::Wheels>,
) {
    let contact = &motion.machine.contact;
    if matches!(contact.split, Split::RollMomentDistribution { .. }) {
        write.write([adjoint.roll_moment_distribution]);
    }
    if contact.tyres_deflect {
        let wheels = motion.machine.wheels.len();
        let by_stiffness = adjoint.stiffness[..wheels].iter();
        by_stiffness.for_each(|&by| write.write([by]));
    }
}

/// Derivative with respect to a shift d of bodies on their carrier, axes parallel to the base's: the specific
/// force of their points changes by `alpha x d + w x (w x d)`, and their wrench moves by d:
/// ```text
///     dF = m (alpha x d + w x (w x d)),      dM = d x F + h x (the same)
/// ```
fn shifted<T: Real>(
    reverse_pass: &ReversePass<T>,
    carrier: usize,
    moments: &Composite<T>,
    force: &Vector3<T>,
    form: &Wrench<T::Wheels>,
) -> Vector3<T::Wheels> {
    let lever =
        form.force * T::Wheels::each(moments.mass) + cross(&form.moment, &each(&moments.first));
    reverse_pass.by_place(carrier, &lever) + cross(&each(force), &form.moment)
}

fn write_in_mounting<T: Real>(
    motion: &SensedMotion<'_, T>,
    mounting: &Mounting,
    by: &Vector3<T::Wheels>,
    write: &mut Writer<'_, T::Wheels>,
) {
    let carrier = &motion.motions[mounting.carrier];
    let in_carrier = rotate_each_back(&carrier.rotation, by);
    write.vector(&rotate_back_by_constant(
        &mounting.carrier_from_axes,
        &in_carrier,
    ));
}

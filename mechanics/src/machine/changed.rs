//! Copies of a machine with changed parameters.

use std::sync::Arc;

use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector3};

use super::body::link_parts;
use super::parameter::{Axis, Parameter};
use super::support_set::share_stiffness;
use super::{Inertia, LinkGroup, Machine, MassMoments, Mounting, Split, SupportId, Wheel};

impl Machine {
    /// This machine with each parameter changed by an amount in its unit. Signals are not part of a machine and
    /// are ignored, see [`State::change`](crate::State::change).
    ///
    /// The result is not validated: a change can make the machine impossible, for example by a negative mass.
    #[must_use]
    pub fn changed(&self, changes: &[(Parameter, f64)]) -> Self {
        let mut changed = self.clone();
        for &(parameter, amount) in changes {
            changed.change(parameter, amount);
        }
        changed.gather();
        changed
    }

    fn change(&mut self, parameter: Parameter, amount: f64) {
        match parameter {
            Parameter::LinkMass(link) => self.links[link].inertia.mass += amount,
            Parameter::LinkCom(link, axis) => {
                let link = &mut self.links[link];
                link.inertia.com += link.body_from_link.rotation * along(axis, amount);
            }
            Parameter::LinkInertia(link, element) => {
                let (j, k) = element.place();
                let mut tensor = Matrix3::zeros();
                (tensor[(j, k)], tensor[(k, j)]) = (amount, amount);
                let link = &mut self.links[link];
                let rotation = link.body_from_link.rotation.to_rotation_matrix();
                link.inertia.about_com +=
                    rotation.matrix() * tensor * rotation.matrix().transpose();
            }
            Parameter::PayloadMass(payload) => self.payloads[payload].inertia.mass += amount,
            Parameter::WheelPosition(wheel, axis) => self.shift_wheel(wheel, axis, amount),
            Parameter::WheelRadius(id) => {
                self.change_support(id, |wheel| wheel.radius += amount);
            }
            Parameter::ArmPosition(axis) => self.shift_arm(axis, amount),
            Parameter::ImuPosition(axis) => {
                self.imu.body_from_mount.translation.vector += along(axis, amount);
            }
            Parameter::ImuRotation(axis) => {
                let turn = UnitQuaternion::from_scaled_axis(along(axis, amount));
                self.imu.body_from_mount.rotation = turn * self.imu.body_from_mount.rotation;
            }
            Parameter::RollMomentDistribution => {
                if let Split::RollMomentDistribution { share, .. } = &mut self.contact.split {
                    *share += amount;
                }
                if let Some(share) = &mut Arc::make_mut(&mut self.supports).roll_moment_distribution
                {
                    *share += amount;
                }
            }
            Parameter::TyreStiffness(id) => self.change_support(id, |wheel| {
                wheel.stiffness = wheel.stiffness.map(|stiffness| stiffness * amount.exp());
            }),
            Parameter::JointPosition(_)
            | Parameter::JointVelocity(_)
            | Parameter::JointAcceleration(_)
            | Parameter::SpecificForce(_)
            | Parameter::AngularVelocity(_)
            | Parameter::AngularAcceleration(_)
            | Parameter::ToolForce(_)
            | Parameter::ToolMoment(_)
            | Parameter::ActuatorForce(_)
            | Parameter::BaseMotion(_) => {}
        }
    }

    /// Changes a support here and for every other set of supports that the machine will stand on.
    fn change_support(&mut self, id: SupportId, change: impl Fn(&mut Wheel)) {
        change(&mut Arc::make_mut(&mut self.supports).all[id.index()]);
        if let Some(place) = self.place_of(id) {
            change(&mut self.wheels[place]);
        }
    }

    fn shift_wheel(&mut self, id: SupportId, axis: Axis, amount: f64) {
        let wheel = self.support(id);
        let (body, is_carrier) = (wheel.body, wheel.body == wheel.mounting.carrier);
        let shift = wheel.mounting.shift(axis, amount);
        if !is_carrier {
            self.bodies[body].joint_in_parent += shift;
        }
        self.change_support(id, |wheel| {
            if is_carrier {
                wheel.centre_in_body += shift;
            }
            wheel.centre_at_zero += shift;
        });
    }

    fn shift_arm(&mut self, axis: Axis, amount: f64) {
        let Some(mounting) = self.arm_mounting else {
            return;
        };
        let shift = mounting.shift(axis, amount);
        let is_arm = |link: &super::Link| link.group == LinkGroup::Arm;
        for (i, body) in self.bodies.iter_mut().enumerate().skip(1) {
            let arm = self.links.iter().any(|link| link.body == i && is_arm(link));
            if arm && body.parent == mounting.carrier {
                body.joint_in_parent += shift;
            }
        }
        for link in self.links.iter_mut().filter(|l| l.body == mounting.carrier) {
            if is_arm(link) {
                link.inertia.com += shift;
                let moved = Translation3::from(shift);
                link.body_from_link = moved * link.body_from_link;
            }
        }
    }

    /// Recomputes the quantities derived from the parameters.
    pub(super) fn gather(&mut self) {
        for i in 0..self.bodies.len() {
            let links = self.links.iter().filter(|link| link.body == i);
            self.bodies[i].inertia =
                links.fold(Inertia::zero(), |sum, link| sum.welded(&link.inertia));
            self.bodies[i].parts = link_parts(&self.links, i);
        }
        for link in &mut self.links {
            link.moments = MassMoments::from(&link.inertia);
        }
        for payload in &mut self.payloads {
            payload.moments = MassMoments::from(&payload.inertia);
        }
        let first = self.wheels[0].radius;
        self.contact.radii_differ = self.wheels.iter().any(|wheel| wheel.radius != first);
        share_stiffness(&mut self.wheels);
        self.contact.renew_warp(&self.wheels);
    }
}

impl Mounting {
    fn shift(&self, axis: Axis, amount: f64) -> Vector3<f64> {
        self.carrier_from_axes * along(axis, amount)
    }
}

fn along(axis: Axis, amount: f64) -> Vector3<f64> {
    let mut vector = Vector3::zeros();
    vector[axis as usize] = amount;
    vector
}

//! The signals and parameters of a machine, in the order of every gradient, with their names.

use super::parameter::{Axis, InertiaElement, Parameter};
use super::support_id::SupportId;
use super::travel::BaseMotion;
use super::{Machine, Split};

impl Parameter {
    /// All signals and parameters of a machine on the supports that it stands on, signals first: the order of every
    /// gradient.
    #[must_use]
    pub fn all(machine: &Machine) -> Vec<Self> {
        let has_rule = matches!(machine.contact.split, Split::RollMomentDistribution { .. });
        Self::on(machine, &machine.stands_on, has_rule)
    }

    /// Returns the parameters of a machine on any of its supports, in the same order.
    pub(super) fn of_all_supports(machine: &Machine) -> Vec<Self> {
        let all: Vec<SupportId> = machine.supports.ids().collect();
        let has_rule = matches!(machine.contact.split, Split::RollMomentDistribution { .. })
            || machine.supports.rule_of_other_sets().is_some();
        Self::on(machine, &all, has_rule)
    }

    /// The index of the first payload's mass in [`Self::all`].
    pub(crate) fn first_payload(machine: &Machine) -> usize {
        let tool = if machine.tool.is_some() { 6 } else { 0 };
        let arm = if machine.arm_mounting.is_some() { 3 } else { 0 };
        let links = links_with_mass(machine).count() * (4 + InertiaElement::ALL.len());
        let actuated = machine.contact.actuated_joints.len();
        3 * machine.joints.len() + 9 + tool + actuated + 6 + arm + links
    }

    fn on(machine: &Machine, supports: &[SupportId], has_rule: bool) -> Vec<Self> {
        let mut all = Vec::new();
        for joint in 0..machine.joints.len() {
            all.extend([
                Self::JointPosition(joint),
                Self::JointVelocity(joint),
                Self::JointAcceleration(joint),
            ]);
        }
        let mut triple = |of: fn(Axis) -> Self| all.extend(Axis::ALL.map(of));
        triple(Self::SpecificForce);
        triple(Self::AngularVelocity);
        triple(Self::AngularAcceleration);
        if machine.tool.is_some() {
            triple(Self::ToolForce);
            triple(Self::ToolMoment);
        }
        all.extend((0..machine.contact.actuated_joints.len()).map(Self::ActuatorForce));
        let mut triple = |of: fn(Axis) -> Self| all.extend(Axis::ALL.map(of));
        triple(Self::ImuPosition);
        triple(Self::ImuRotation);
        if machine.arm_mounting.is_some() {
            triple(Self::ArmPosition);
        }
        for link in links_with_mass(machine) {
            all.push(Self::LinkMass(link));
            all.extend(Axis::ALL.map(|axis| Self::LinkCom(link, axis)));
            all.extend(InertiaElement::ALL.map(|element| Self::LinkInertia(link, element)));
        }
        all.extend((0..machine.payloads.len()).map(Self::PayloadMass));
        for &wheel in supports {
            all.extend(Axis::ALL.map(|axis| Self::WheelPosition(wheel, axis)));
            all.push(Self::WheelRadius(wheel));
        }
        if has_rule {
            all.push(Self::RollMomentDistribution);
        }
        if machine.contact.tyres_deflect {
            all.extend(supports.iter().copied().map(Self::TyreStiffness));
        }
        all.extend(BaseMotion::ALL.map(Self::BaseMotion));
        all
    }

    /// Name, composed of the names of the machine's parts.
    #[must_use]
    pub fn name(self, machine: &Machine) -> String {
        let joint = |j: usize| &machine.joints[j].name;
        let link = |l: usize| &machine.links[l].name;
        let wheel = |w: SupportId| machine.support(w).name.to_lowercase();
        match self {
            Self::JointPosition(j) => format!("{}.position", joint(j)),
            Self::JointVelocity(j) => format!("{}.rate", joint(j)),
            Self::JointAcceleration(j) => format!("{}.acceleration", joint(j)),
            Self::SpecificForce(axis) => format!("imu.specific_force_{}", axis.name()),
            Self::AngularVelocity(axis) => format!("imu.angular_velocity_{}", axis.name()),
            Self::AngularAcceleration(axis) => format!("imu.angular_acceleration_{}", axis.name()),
            Self::ToolForce(axis) => format!("tool.force_{}", axis.name()),
            Self::ToolMoment(axis) => format!("tool.moment_{}", axis.name()),
            Self::ActuatorForce(j) => {
                let joint = &machine.contact.actuated_joints[j];
                format!("{}.force", joint.name(&machine.linkages))
            }
            Self::LinkMass(l) => format!("{}.mass", link(l)),
            Self::LinkCom(l, axis) => format!("{}.com_{}", link(l), axis.name()),
            Self::LinkInertia(l, element) => format!("{}.inertia_{}", link(l), element.name()),
            Self::PayloadMass(p) => format!("payload_{}.mass", p + 1),
            Self::WheelPosition(w, axis) => format!("wheel_{}.position_{}", wheel(w), axis.name()),
            Self::WheelRadius(w) => format!("wheel_{}.radius", wheel(w)),
            Self::ArmPosition(axis) => format!("arm.position_{}", axis.name()),
            Self::ImuPosition(axis) => format!("imu.position_{}", axis.name()),
            Self::ImuRotation(axis) => format!("imu.rotation_{}", axis.name()),
            Self::RollMomentDistribution => "contact.roll_moment_distribution".into(),
            Self::TyreStiffness(w) => format!("wheel_{}.stiffness_share", wheel(w)),
            Self::BaseMotion(travel) => format!("base.{}", travel.name()),
        }
    }
}

/// Indices of the links that have mass.
pub(crate) fn links_with_mass(machine: &Machine) -> impl Iterator<Item = usize> + '_ {
    (0..machine.links.len()).filter(|&link| machine.links[link].inertia.mass > 0.0)
}

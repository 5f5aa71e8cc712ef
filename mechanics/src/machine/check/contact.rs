//! Contact between wheels and ground: free joints and the rule for the load split.

use super::checker::Checker;
use crate::machine::spec::Stiffness;
use crate::machine::{
    Contact, Ground, Linkage, MachineError, Split, SupportKind, SupportPolygon, TorqueJoint, Wheel,
};

impl Checker<'_> {
    pub(super) fn contact(
        &self,
        wheels: &[Wheel],
        polygon: &SupportPolygon,
        linkages: &[Linkage],
    ) -> Result<Contact, MachineError> {
        let spec = &self.spec.contact;
        let mut free_joints = Vec::new();
        for name in &spec.free_joints {
            let body = self.joint("contact.free_joints", name)?;
            let joint = self.torque_joint(body, wheels);
            let carried = &joint.supports_wheel;
            if !carried.iter().any(|&c| c) || carried.iter().all(|&c| c) {
                return Err(self.value_error(
                    "contact.free_joints",
                    "joints that carry some but not all wheels",
                    format!("\"{name}\""),
                ));
            }
            free_joints.push(joint);
        }
        if free_joints.len() + 3 > wheels.len() {
            let expected = format!("at most {} for {} wheels", wheels.len() - 3, wheels.len());
            return Err(self.value_error("contact.free_joints", expected, free_joints.len()));
        }
        let split = self.split(wheels, polygon, &free_joints)?;
        let rows = 3 + free_joints.len() + usize::from(split != Split::Springs);
        let mut actuated_joints = self.actuated_joints(linkages, wheels, rows)?;
        self.add_measured_loads(&mut actuated_joints, wheels, rows)?;
        let mut contact = Contact {
            split,
            free_joints,
            actuated_joints,
            traction_share: self.traction_share()?,
            radii_differ: wheels.iter().any(|w| w.radius != wheels[0].radius),
            tyres_deflect: spec.tyre_stiffness.is_some(),
            ground: spec.ground,
            mean_stiffness: None,
            warp: None,
        };
        contact.set_warp(wheels);
        Ok(contact)
    }

    /// D, unless springs determine the split by themselves.
    pub(super) fn roll_moment_distribution(&self) -> Result<Option<f64>, MachineError> {
        let spec = &self.spec.contact;
        match spec.roll_moment_distribution {
            Some(share) if !(0.0..=1.0).contains(&share) => {
                Err(self.value_error("contact.roll_moment_distribution", "0 to 1", share))
            }
            Some(share) => Ok(Some(share)),
            // On flat ground, springs of known stiffness determine the split by themselves.
            None if matches!(spec.tyre_stiffness, Some(Stiffness::PerWheel(_)))
                || (spec.tyre_stiffness.is_some() && spec.ground == Ground::Plane) =>
            {
                Ok(None)
            }
            None => Ok(Some(0.5)),
        }
    }

    fn split(
        &self,
        wheels: &[Wheel],
        polygon: &SupportPolygon,
        free_joints: &[TorqueJoint],
    ) -> Result<Split, MachineError> {
        let Some(share) = self.roll_moment_distribution()? else {
            return Ok(Split::Springs);
        };
        let rule = Split::by_roll_moment(share, polygon, wheels.len());
        if let Some(rule) = rule.filter(|_| free_joints.is_empty() && all_roll(wheels)) {
            return Ok(rule);
        }
        let rolling = wheels.iter().filter(|w| w.kind == SupportKind::Wheel);
        let stated = self.spec.contact.roll_moment_distribution.is_some();
        // with other supports, the rule is for the times on four wheels
        if stated && (rolling.count() != 4 || all_roll(wheels)) {
            return Err(self.value_error(
                "contact.roll_moment_distribution",
                "four wheels at four corners and no free joints",
                "a different machine",
            ));
        }
        Ok(Split::Springs)
    }
}

fn all_roll(wheels: &[Wheel]) -> bool {
    wheels.iter().all(|wheel| wheel.kind == SupportKind::Wheel)
}

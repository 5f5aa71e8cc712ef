//! Reference posture and reference loads of the machine file.

use std::collections::BTreeMap;

use super::checker::Checker;
use super::driving::Driving;
use crate::machine::linkage::LinkageInput;
use crate::machine::tree::TreeJoint;
use crate::machine::{JointKind, Linkage, MachineError, MachineSpec, Reference, ReferencePosture};

/// A joint whose position a posture may state.
pub(super) struct PostureJoint<'a> {
    pub(super) name: &'a str,
    pub(super) limits: Option<[f64; 2]>,
    pub(super) slides: bool,
}

impl MachineSpec {
    /// Rejects positions of joints that the machine does not measure, and positions that they cannot have.
    pub(super) fn check_posture(
        &self,
        place: &str,
        posture: &BTreeMap<String, f64>,
        joints: &[PostureJoint<'_>],
    ) -> Result<(), MachineError> {
        for (joint, position) in posture {
            let place = format!("{place}.{joint}");
            let fault = |expected: &str, found: String| {
                Err(MachineError::value(&self.file, &place, expected, found))
            };
            let Some(known) = joints.iter().find(|known| known.name == joint) else {
                let names: Vec<&str> = joints.iter().map(|known| known.name).collect();
                let expected = format!("a measured joint ({})", names.join(", "));
                return fault(&expected, format!("\"{joint}\""));
            };
            if !position.is_finite() {
                return fault("a position [rad or m]", position.to_string());
            }
            self.check_within_limits(&place, *position, known)?;
        }
        Ok(())
    }

    /// Rejects a position beyond the limits of the URDF by more than a measured one may be.
    fn check_within_limits(
        &self,
        place: &str,
        position: f64,
        joint: &PostureJoint<'_>,
    ) -> Result<(), MachineError> {
        let Some([least, greatest]) = joint.limits else {
            return Ok(());
        };
        let margin = self.plausibility.margin_of(joint.slides);
        // the unit, and the one for which it is likely mistaken
        let (unit, of_other) = match joint.slides {
            true => ("m", 1e-3),
            false => ("rad", 1_f64.to_radians()),
        };
        let is_within = |position: f64| (least - margin..=greatest + margin).contains(&position);
        if is_within(position) {
            return Ok(());
        }
        let converted = (position * of_other * 1e6).round() / 1e6;
        let remedy = match (is_within(position * of_other), joint.slides) {
            (true, true) => format!("It looks like millimetres: write {converted} (m)."),
            (true, false) => format!("It looks like degrees: write {converted} (rad)."),
            (false, _) => {
                "Check the position, its zero and its sign, and the limits in the URDF.".into()
            }
        };
        Err(MachineError::Implausible {
            file: self.file.clone(),
            place: place.into(),
            expected: format!(
                "a position within the limits of the joint in the URDF, {least} to {greatest} {unit}"
            ),
            found: format!("{position} {unit}"),
            remedy,
        })
    }
}

impl Checker<'_> {
    /// The reference before its loads are computed.
    pub(super) fn reference(&self, driving: &Driving) -> Result<Reference, MachineError> {
        let limits = &self.spec.limits;
        let stated = &limits.reference_posture;
        let measured = driving.joints.iter().map(|joint| joint.name.as_str());
        let ends = driving.linkages.iter().flat_map(|l| self.ends_of(l));
        let joints: Vec<PostureJoint<'_>> = measured
            .chain(ends)
            .map(|name| {
                let of_name = |joint: &&TreeJoint| joint.name == name;
                let mut joints = self.tree.bodies.iter().filter_map(|b| b.joint.as_ref());
                let joint = joints.find(of_name);
                PostureJoint {
                    name,
                    limits: joint.and_then(TreeJoint::stated_limits),
                    slides: joint.is_some_and(|joint| joint.kind == JointKind::Prismatic),
                }
            })
            .collect();
        self.spec
            .check_posture("limits.reference_posture", stated, &joints)?;
        let positions = driving.joints.iter().enumerate().map(|(index, joint)| {
            (stated.get(&joint.name).copied())
                .or_else(|| self.by_other_end(index, stated, driving))
                .or(joint.constant)
                .unwrap_or_else(|| self.nearest_to_zero(index, driving))
        });
        let optimal = limits.optimal_load.as_ref();
        let optimal = |name| optimal.and_then(|loads| loads.get(name)).copied();
        let wheels = self.spec.wheels.keys();
        Ok(Reference {
            posture: ReferencePosture {
                positions: positions.collect(),
                is_stated: !stated.is_empty(),
            },
            static_load: vec![f64::NAN; wheels.len()],
            optimal_load: wheels
                .map(|name| optimal(name).unwrap_or(f64::NAN))
                .collect(),
        })
    }

    /// Names of the pivot and the rod of a linkage.
    fn ends_of(&self, linkage: &Linkage) -> [&str; 2] {
        [linkage.bodies.pivot, linkage.bodies.rod].map(|body| {
            let joint = self.tree.bodies[body].joint.as_ref();
            joint.map_or("", |joint| joint.name.as_str())
        })
    }

    /// The position of a measured joint whose linkage is stated by its other end: the rod instead of the pivot, or
    /// the reverse. A machine file then suits logs that measure either.
    fn by_other_end(
        &self,
        joint: usize,
        stated: &BTreeMap<String, f64>,
        driving: &Driving,
    ) -> Option<f64> {
        let mut linkages = driving.linkages.iter();
        let linkage = linkages.find(|linkage| linkage.measured_joint == joint)?;
        let [pivot, rod] = self.ends_of(linkage).map(|name| stated.get(name).copied());
        match linkage.input {
            LinkageInput::PivotAngle => rod.map(|rod| linkage.pivot_at_rod(rod)),
            LinkageInput::RodLength => pivot.map(|pivot| linkage.rod_at_pivot(pivot)),
        }
    }

    /// The position of a measured joint that is nearest to zero within its limits (rad or m). For a measured rod it
    /// is the one at which the pivot is: a log that measures the pivot then has the same reference.
    fn nearest_to_zero(&self, joint: usize, driving: &Driving) -> f64 {
        let within = |position: f64, limits: Option<[f64; 2]>| {
            limits.map_or(position, |[least, greatest]| {
                position.clamp(least, greatest)
            })
        };
        let by_rod = |linkage: &&Linkage| {
            linkage.measured_joint == joint && linkage.input == LinkageInput::RodLength
        };
        let position = driving.linkages.iter().find(by_rod).map_or(0.0, |linkage| {
            let pivot = self.tree.bodies[linkage.bodies.pivot].joint.as_ref();
            let limits = pivot.and_then(TreeJoint::stated_limits);
            linkage.rod_at_pivot(within(0.0, limits))
        });
        within(position, driving.joints[joint].limits)
    }
}

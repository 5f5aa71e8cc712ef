//! Reference posture and reference loads of the machine file.

use std::collections::BTreeMap;

use super::checker::Checker;
use super::driving::Driving;
use crate::machine::linkage::LinkageInput;
use crate::machine::tree::TreeJoint;
use crate::machine::{Linkage, MachineError, MachineSpec, Reference, ReferencePosture};

impl MachineSpec {
    /// Rejects positions of joints that the machine does not measure.
    pub(super) fn check_posture(
        &self,
        place: &str,
        posture: &BTreeMap<String, f64>,
        joints: &[&str],
    ) -> Result<(), MachineError> {
        for (joint, position) in posture {
            let place = format!("{place}.{joint}");
            let fault = |expected: &str, found: String| {
                Err(MachineError::value(&self.file, place, expected, found))
            };
            if !joints.contains(&joint.as_str()) {
                let expected = format!("a measured joint ({})", joints.join(", "));
                return fault(&expected, format!("\"{joint}\""));
            }
            if !position.is_finite() {
                return fault("a position [rad or m]", position.to_string());
            }
        }
        Ok(())
    }
}

impl Checker<'_> {
    /// The reference before its loads are computed.
    pub(super) fn reference(&self, driving: &Driving) -> Result<Reference, MachineError> {
        let limits = &self.spec.limits;
        let stated = &limits.reference_posture;
        let names: Vec<&str> = (driving.joints.iter().map(|joint| joint.name.as_str()))
            .chain(driving.linkages.iter().flat_map(|l| self.ends_of(l)))
            .collect();
        self.spec
            .check_posture("limits.reference_posture", stated, &names)?;
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

//! Reference posture and reference loads of the machine file.

use std::collections::BTreeMap;

use super::checker::Checker;
use super::driving::Driving;
use crate::machine::linkage::LinkageInput;
use crate::machine::{MachineError, MachineSpec, MeasuredJoint, Reference, ReferencePosture};

impl MachineSpec {
    /// Rejects positions of joints that the machine does not measure.
    pub(super) fn check_posture(
        &self,
        place: &str,
        posture: &BTreeMap<String, f64>,
        joints: &[MeasuredJoint],
    ) -> Result<(), MachineError> {
        for (joint, position) in posture {
            let place = format!("{place}.{joint}");
            let fault = |expected: &str, found: String| {
                Err(MachineError::value(&self.file, place, expected, found))
            };
            if !joints.iter().any(|measured| measured.name == *joint) {
                let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
                let expected = format!("a measured joint ({})", names.join(", "));
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
        self.spec
            .check_posture("limits.reference_posture", stated, &driving.joints)?;
        let positions = driving.joints.iter().enumerate().map(|(index, joint)| {
            (stated.get(&joint.name).copied())
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

    /// The position of a measured joint that is nearest to zero within its limits (rad or m). For a measured rod it
    /// is the one at which the pivot is: a log that measures the pivot then has the same reference.
    fn nearest_to_zero(&self, joint: usize, driving: &Driving) -> f64 {
        let within = |position: f64, limits: Option<[f64; 2]>| {
            limits.map_or(position, |[least, greatest]| {
                position.clamp(least, greatest)
            })
        };
        let by_rod = |linkage: &&crate::machine::Linkage| {
            linkage.measured_joint == joint && linkage.input == LinkageInput::RodLength
        };
        let position = driving.linkages.iter().find(by_rod).map_or(0.0, |linkage| {
            let pivot = self.tree.bodies[linkage.bodies.pivot].joint.as_ref();
            let limits = pivot.and_then(|joint| joint.stated_limits());
            linkage.rod_at_pivot(within(0.0, limits))
        });
        within(position, driving.joints[joint].limits)
    }
}

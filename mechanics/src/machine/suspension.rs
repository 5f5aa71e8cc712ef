//! The active suspension: linkages whose cylinders lift and lower the platform.

use super::{LinkageInput, Machine, SuspensionControl};
use crate::suspension::hydraulics::HydraulicParameters;

/// The actuators of an active suspension.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspension {
    /// Indices of its linkages in [`Machine::linkages`].
    pub linkages: Vec<usize>,
    /// Smallest and largest cylinder stroke (m).
    pub stroke: [f64; 2],
    /// Largest stroke velocity (m/s).
    pub max_velocity: f64,
    /// Largest stroke acceleration (m/s^2).
    pub max_acceleration: f64,
    /// Cylinders, oil and valves of its actuators.
    pub hydraulics: HydraulicParameters,
    /// Settings of its controller.
    pub control: SuspensionControl,
}

impl Machine {
    /// Joint positions with every cylinder of the suspension at mid-stroke and the other joints unchanged.
    #[must_use]
    pub fn at_mid_stroke(&self, joint_positions: &[f64]) -> Vec<f64> {
        let mut positions = joint_positions.to_vec();
        let Some(suspension) = &self.suspension else {
            return positions;
        };
        let [least, greatest] = suspension.stroke;
        let middle = 0.5 * (least + greatest);
        for &linkage in &suspension.linkages {
            let linkage = &self.linkages[linkage];
            if let Some(position) = positions.get_mut(linkage.measured_joint) {
                *position = match linkage.input {
                    LinkageInput::RodLength => middle,
                    LinkageInput::PivotAngle => linkage.pivot_at_rod(middle),
                };
            }
        }
        positions
    }
}

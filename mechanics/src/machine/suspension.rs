//! The active suspension: linkages whose cylinders lift and lower the platform.

use super::hydraulics::HydraulicParameters;
use super::suspension_control::SuspensionControl;

/// The actuators of an active suspension.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspension {
    /// Indices of its linkages in [`Machine::linkages`](super::Machine::linkages).
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

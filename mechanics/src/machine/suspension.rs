//! The active suspension: linkages whose rods lift and lower the platform.

use super::hydraulics::HydraulicParameters;
use super::suspension_control::SuspensionControl;

/// The actuators of an active suspension.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspension {
    /// Indices of its linkages, into [`Machine::linkages`](super::Machine::linkages).
    pub linkages: Vec<usize>,
    /// Least and greatest rod coordinate (m).
    pub stroke: [f64; 2],
    /// Largest rod velocity (m/s).
    pub max_velocity: f64,
    /// Largest rod acceleration (m/s^2).
    pub max_acceleration: f64,
    /// Cylinders, oil and valves of its actuators.
    pub hydraulics: HydraulicParameters,
    /// How it is steered.
    pub control: SuspensionControl,
}

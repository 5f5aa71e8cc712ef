//! The wheels.

use nalgebra::Vector3;

use super::body::Seat;

/// Most wheels a machine may have; the load envelope looks at every way to stand on some of them.
pub const MAX_WHEELS: usize = 12;

/// A wheel.
#[derive(Debug, Clone)]
pub struct Wheel {
    /// Name in the machine file.
    pub name: String,
    /// The body whose point is the centre.
    pub body: usize,
    /// Centre in the body's frame (m).
    pub centre_in_body: Vector3<f64>,
    /// Radius without load (m).
    pub radius: f64,
    /// Vertical stiffness, where the machine file tells it (N/m).
    pub stiffness: Option<f64>,
    /// Vertical stiffness as a share of the mean of all wheels.
    pub relative_stiffness: f64,
    /// Centre in the base frame with all joints at zero (m).
    pub centre_at_zero: Vector3<f64>,
    /// What carries it.
    pub seat: Seat,
}

//! The wheels.

use nalgebra::Vector3;

use super::body::Mounting;
use super::support_spec::SupportKind;

/// Maximum number of wheels; the load envelope enumerates the possible sets of loaded wheels.
pub const MAX_WHEELS: usize = 12;

/// A wheel, or another support: a contact point fixed to a body.
#[derive(Debug, Clone)]
pub struct Wheel {
    /// Name in the machine file.
    pub name: String,
    /// Kind of the support.
    pub kind: SupportKind,
    /// The body that carries the wheel's centre.
    pub body: usize,
    /// Centre in the body's frame (m).
    pub centre_in_body: Vector3<f64>,
    /// Unloaded radius (m).
    pub radius: f64,
    /// Standard deviation of the radius (m) where that is only guessed.
    pub radius_sigma: Option<f64>,
    /// Vertical stiffness (N/m), where the machine file states it.
    pub stiffness: Option<f64>,
    /// Vertical stiffness relative to the mean of all wheels.
    pub relative_stiffness: f64,
    /// Centre in the base frame with all joints at zero (m).
    pub centre_at_zero: Vector3<f64>,
    /// The mount on the body that carries it.
    pub mounting: Mounting,
}

impl Wheel {
    /// The track that it is a point of.
    #[must_use]
    pub fn track(&self) -> Option<&str> {
        if self.kind != SupportKind::TrackPoint {
            return None;
        }
        self.name.rsplit_once('_').map(|(track, _)| track)
    }
}

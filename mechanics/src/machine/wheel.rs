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
    /// Deflection of tyres of unknown stiffness under the machine (m).
    const USUAL_SINK: f64 = 0.015;

    /// Whether the machine file states the stiffness of all these wheels.
    pub(crate) fn have_stiffness(wheels: &[Self]) -> bool {
        wheels.iter().all(|wheel| wheel.stiffness.is_some())
    }

    /// Extents of the places of these wheels along and across the machine (m).
    pub(super) fn extents(wheels: &[Self]) -> [f64; 2] {
        [0, 1].map(|axis: usize| {
            let values = || wheels.iter().map(|wheel| wheel.centre_at_zero[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        })
    }

    /// Vertical stiffness of each of these wheels (N/m): as stated where it is of all, else that of usual tyres under this weight (N).
    #[must_use]
    pub fn stiffnesses(wheels: &[Self], weight: f64) -> Vec<f64> {
        let is_stated = Self::have_stiffness(wheels);
        let usual = weight / (Self::USUAL_SINK * wheels.len() as f64);
        let stiffness = wheels.iter().map(|wheel| {
            let stated = wheel.stiffness.filter(|_| is_stated);
            stated.unwrap_or(usual * wheel.relative_stiffness)
        });
        stiffness.collect()
    }

    /// The track that it is a point of.
    #[must_use]
    pub fn track(&self) -> Option<&str> {
        if self.kind != SupportKind::TrackPoint {
            return None;
        }
        self.name.rsplit_once('_').map(|(track, _)| track)
    }
}

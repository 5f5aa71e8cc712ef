//! Assumptions where a sheet says nothing: the kinds of machines, their priors, and the list of assumptions.

mod assumption;
mod template;

pub use assumption::Assumption;
pub(crate) use assumption::Assumptions;
pub use template::Template;
pub(crate) use template::{Balance, Prior};

/// Mass per volume of a cylinder around a wheel with tyre and rim (kg/m^3).
pub(crate) const WHEEL_DENSITY: f64 = 1100.0;
/// Deflection of a tyre under its load on the sheet, as a share of its radius.
pub(crate) const TYRE_DEFLECTION: f64 = 0.04;
/// Deflection of the ground below a roller of a track (m).
pub(crate) const TRACK_DEFLECTION: f64 = 0.01;
/// Mass of a bogie beam or a pendulum axle as a share of the load that it carries.
pub(crate) const BEAM_SHARE: f64 = 0.06;
/// Density of steel (kg/m^3), for cylinders.
pub(crate) const STEEL: f64 = 7850.0;
/// Standard deviation of a mass on a sheet, as a share: the sheet describes a series, not one machine.
pub(crate) const SHEET_MASS_SIGMA: f64 = 0.02;
/// Largest difference between the operating mass and the sum of the axle loads, as a share: rounding.
pub(crate) const ROUNDING: f64 = 0.01;

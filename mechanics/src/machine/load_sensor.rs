//! Sensors that measure the load of supports: scales, load cells and load pins.

use super::{FieldSpec, SupportId};

/// A sensor that measures the load of a support, or the total load of several.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSensor {
    /// Its name, for columns and messages: in lower case, of letters, digits and underscores.
    pub name: String,
    /// The supports that it measures, on the ground or not.
    pub supports: Vec<SupportId>,
    /// Standard deviation of its systematic error (N).
    pub sigma: f64,
    /// Where the log contains it (N).
    pub field: FieldSpec,
}

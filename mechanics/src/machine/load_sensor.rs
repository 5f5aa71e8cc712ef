//! Sensors that measure the load of wheels: scales, load cells and load pins.

use super::FieldSpec;

/// A sensor that measures the load of a wheel, or the total load of several.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSensor {
    /// Its name, for columns and messages: in lower case, of letters, digits and underscores.
    pub name: String,
    /// Indices of the wheels.
    pub wheels: Vec<usize>,
    /// Standard deviation of its systematic error (N).
    pub sigma: f64,
    /// Where the log contains it (N).
    pub field: FieldSpec,
}

impl LoadSensor {
    /// The computed load that it measures, from those of all wheels (N).
    #[must_use]
    pub fn of(&self, loads: &[f64]) -> f64 {
        self.wheels.iter().map(|&wheel| loads[wheel]).sum()
    }

    /// Factors of the wheels' loads in what it measures.
    #[must_use]
    pub fn factors(&self, wheels: usize) -> Vec<f64> {
        let factor = |wheel| f64::from(u8::from(self.wheels.contains(&wheel)));
        (0..wheels).map(factor).collect()
    }
}

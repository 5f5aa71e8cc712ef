//! Sensors that measure the load of supports: scales, load cells and load pins.

use super::signals::{LoadSumFields, SignalsSpec};
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
    /// Field of the log that contains the load (N).
    pub field: FieldSpec,
}

impl LoadSensor {
    /// A name as part of a column: lower case, everything but letters and digits an underscore.
    #[must_use]
    pub(crate) fn column_name(name: &str) -> String {
        let letters = name.chars().map(|c| match c.is_ascii_alphanumeric() {
            true => c.to_ascii_lowercase(),
            false => '_',
        });
        let name: String = letters.collect();
        name.trim_matches('_').into()
    }
}

impl LoadSumFields {
    /// Returns the stated name, or else the names of the sensor's supports.
    pub(super) fn sensor_name(&self) -> String {
        let name = self.name.clone();
        name.unwrap_or_else(|| self.wheels.join("_"))
    }
}

impl SignalsSpec {
    /// Returns the field of each load sensor, with the sensor's name, in the order of
    /// [`Machine::load_sensors`](super::Machine::load_sensors).
    pub fn load_fields_mut(&mut self) -> impl Iterator<Item = (String, &mut FieldSpec)> {
        let singles = self.wheels.iter_mut();
        let singles = singles.map(|(name, fields)| (name.clone(), &mut fields.load));
        let sums = self.load_sums.iter_mut();
        let sums = sums.map(|fields| (fields.sensor_name(), &mut fields.load));
        let all = singles.chain(sums);
        all.map(|(name, load)| (LoadSensor::column_name(&name), load))
    }
}

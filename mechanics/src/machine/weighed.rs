//! `[weighed]`: weighing results, to validate a model.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{MachineError, MachineSpec, MeasuredJoint};

/// `[weighed]`: measured loads of the real machine at rest on level ground.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeighedSpec {
    /// Unit of all loads in this table.
    pub unit: WeighedUnit,
    /// Loads of single wheels, by name.
    #[serde(default)]
    pub wheels: BTreeMap<String, f64>,
    /// Total loads of several wheels on one scale: axles, sides, the whole machine.
    #[serde(default)]
    pub sums: Vec<WeighedSum>,
    /// Standard deviation of readings that state none, in the unit; if absent, the readings are treated as
    /// exact.
    #[serde(default)]
    pub sigma: f64,
    /// Joint positions during the weighing (rad or m). If absent, the posture under evaluation; in a stated
    /// posture, joints not listed are at zero.
    #[serde(default)]
    pub posture: BTreeMap<String, f64>,
}

/// One reading of a scale under several wheels.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeighedSum {
    /// Name of the reading; default: its wheels.
    pub name: Option<String>,
    /// The wheels on the scale.
    pub wheels: Vec<String>,
    /// The reading.
    pub load: f64,
    /// Standard deviation of the reading, in the unit.
    pub sigma: Option<f64>,
}

/// Unit of the readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum WeighedUnit {
    /// Newtons.
    #[serde(rename = "N")]
    Newton,
    /// Kilograms, multiplied by the machine file's gravity.
    #[serde(rename = "kg")]
    Kilogram,
}

impl WeighedUnit {
    /// One unit in newtons at this gravity (m/s^2).
    #[must_use]
    pub fn newtons(self, gravity: f64) -> f64 {
        match self {
            Self::Newton => 1.0,
            Self::Kilogram => gravity,
        }
    }
}

impl WeighedSum {
    /// Its name, or the names of its wheels.
    #[must_use]
    pub fn label(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.wheels.join(" + "))
    }
}

impl MachineSpec {
    /// Rejects loads of wheels and positions of joints that the machine does not have.
    pub(super) fn check_weighed(&self, joints: &[MeasuredJoint]) -> Result<(), MachineError> {
        let Some(weighed) = &self.weighed else {
            return Ok(());
        };
        let fault = |place: String, expected: &str, found: String| {
            Err(MachineError::value(&self.file, place, expected, found))
        };
        let readings = weighed.wheels.iter().map(|(wheel, &load)| {
            let place = format!("weighed.wheels.{wheel}");
            (place, std::slice::from_ref(wheel), load)
        });
        let sums = weighed.sums.iter().map(|sum| {
            let place = format!("weighed.sums \"{}\"", sum.label());
            (place, sum.wheels.as_slice(), sum.load)
        });
        let of_sums = weighed.sums.iter().filter_map(|sum| sum.sigma);
        for sigma in of_sums.chain([weighed.sigma]) {
            if !(sigma.is_finite() && sigma >= 0.0) {
                let expected = "a standard deviation that is not negative";
                return fault("weighed.sigma".into(), expected, sigma.to_string());
            }
        }
        for (place, wheels, load) in readings.chain(sums) {
            if !(load.is_finite() && load >= 0.0) {
                return fault(place, "a load that is not negative", load.to_string());
            }
            if wheels.is_empty() {
                return fault(place, "one wheel or more", "none".into());
            }
            for (i, wheel) in wheels.iter().enumerate() {
                if !self.wheels.contains_key(wheel) || wheels[..i].contains(wheel) {
                    let expected = "names of [wheels], each once";
                    return fault(place, expected, format!("\"{wheel}\""));
                }
            }
        }
        for (joint, position) in &weighed.posture {
            let place = format!("weighed.posture.{joint}");
            if !joints.iter().any(|measured| measured.name == *joint) {
                let names: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
                let expected = format!("a measured joint ({})", names.join(", "));
                return fault(place, &expected, format!("\"{joint}\""));
            }
            if !position.is_finite() {
                return fault(place, "a position [rad or m]", position.to_string());
            }
        }
        Ok(())
    }
}

//! `[weighed]`: weighing results, to validate a model.

use std::collections::BTreeMap;

use serde::Deserialize;

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

//! `[weighed]`: what scales said, to hold a model against.

use std::collections::BTreeMap;

use serde::Deserialize;

/// `[weighed]`: loads of the real machine, standing level and at rest.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeighedSpec {
    /// The unit of every load here.
    pub unit: WeighedUnit,
    /// Load of single wheels, by name.
    #[serde(default)]
    pub wheels: BTreeMap<String, f64>,
    /// Loads that several wheels had together on one scale: axles, sides, the whole machine.
    #[serde(default)]
    pub sums: Vec<WeighedSum>,
    /// Standard deviation of every reading that states none of its own, in the unit; absent: the
    /// readings count as exact.
    #[serde(default)]
    pub sigma: f64,
    /// Positions of joints while it was weighed (rad or m); absent: the posture that is looked at, a
    /// joint left out of a stated posture is at zero.
    #[serde(default)]
    pub posture: BTreeMap<String, f64>,
}

/// One reading of a scale under several wheels.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeighedSum {
    /// What to call it; default: the wheels.
    pub name: Option<String>,
    /// The wheels on the scale.
    pub wheels: Vec<String>,
    /// What it said.
    pub load: f64,
    /// Standard deviation of what it said, in the unit.
    pub sigma: Option<f64>,
}

/// In what scales were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum WeighedUnit {
    /// Newtons.
    #[serde(rename = "N")]
    Newton,
    /// Kilograms: times the machine file's gravity.
    #[serde(rename = "kg")]
    Kilogram,
}

impl WeighedUnit {
    /// What one unit is in newtons where gravity is so large (m/s^2).
    #[must_use]
    pub fn newtons(self, gravity: f64) -> f64 {
        match self {
            Self::Newton => 1.0,
            Self::Kilogram => gravity,
        }
    }
}

impl WeighedSum {
    /// Its name, or its wheels'.
    #[must_use]
    pub fn label(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.wheels.join(" + "))
    }
}

//! `[weighed]`: weighing results, to validate a model.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::exactly::exactly_if_any;

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
    /// Supports on the ground, by name. If absent, those that always stand there.
    #[serde(default)]
    pub supports: Vec<String>,
    /// Weighings in further postures.
    #[serde(default)]
    pub postures: Vec<WeighedPosture>,
}

/// `[[weighed.postures]]`: the machine weighed at rest in one posture, on ground of known or unknown slope.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeighedPosture {
    /// Name for messages; default: the number of the table.
    pub name: Option<String>,
    /// Joint positions as the log would show them (rad or m); joints not listed are at zero.
    #[serde(default)]
    pub posture: BTreeMap<String, f64>,
    /// Supports on the ground, by name. If absent, those that always stand there.
    #[serde(default)]
    pub supports: Vec<String>,
    /// Slope of the plane through the contact points (rad): how far it rises forward and to the left. Default: level.
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub slope: Option<[f64; 2]>,
    /// Standard deviation of either slope (rad); default: exact if a slope or level ground is stated.
    pub slope_sigma: Option<f64>,
    /// Whether the slope is unknown.
    #[serde(default)]
    pub slope_unknown: bool,
    /// Loads of single wheels, by name.
    #[serde(default)]
    pub wheels: BTreeMap<String, f64>,
    /// Total loads of several wheels.
    #[serde(default)]
    pub sums: Vec<WeighedSum>,
    /// Standard deviation of readings that state none; default: that of `[weighed]`.
    pub sigma: Option<f64>,
    /// Mean reading of the accelerometer at rest, in its own axes (m/s^2).
    #[serde(default, deserialize_with = "exactly_if_any")]
    pub specific_force: Option<[f64; 3]>,
    /// Standard deviation of that mean along each axis, without its bias (m/s^2).
    pub specific_force_sigma: Option<f64>,
    /// Whether the machine was weighed in the posture under evaluation: that of `[weighed]` itself, if it states none.
    #[serde(skip)]
    pub in_evaluated_posture: bool,
}

/// Slopes of ground that nobody measured are within this standard deviation (rad).
const UNKNOWN_SLOPE: f64 = 0.1;

impl WeighedSpec {
    /// Whether `[weighed]` itself has readings.
    #[must_use]
    pub fn has_own(&self) -> bool {
        !(self.wheels.is_empty() && self.sums.is_empty())
    }

    /// All weighings: that of `[weighed]` itself, if it has readings, then those of `[[weighed.postures]]`.
    #[must_use]
    pub fn weighings(&self) -> Vec<WeighedPosture> {
        let own = WeighedPosture {
            name: Some("[weighed]".into()),
            in_evaluated_posture: self.posture.is_empty(),
            posture: self.posture.clone(),
            supports: self.supports.clone(),
            wheels: self.wheels.clone(),
            sums: self.sums.clone(),
            ..WeighedPosture::default()
        };
        let more = self.postures.iter().enumerate().map(|(i, posture)| {
            let name = posture.name.clone();
            WeighedPosture {
                name: Some(name.unwrap_or_else(|| format!("weighed.postures {}", i + 1))),
                ..posture.clone()
            }
        });
        let all = self.has_own().then_some(own).into_iter().chain(more);
        all.map(|posture| WeighedPosture {
            sigma: posture.sigma.or(Some(self.sigma)),
            ..posture
        })
        .collect()
    }
}

impl WeighedPosture {
    /// Returns the name of the weighing.
    #[must_use]
    pub fn label(&self) -> &str {
        self.name.as_deref().unwrap_or("weighing")
    }

    /// Standard deviation of either slope (rad).
    #[must_use]
    pub fn slope_uncertainty(&self) -> f64 {
        match self.slope_unknown {
            true => UNKNOWN_SLOPE,
            false => self.slope_sigma.unwrap_or(0.0),
        }
    }
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
    /// Returns the name of the reading, or the names of its wheels.
    #[must_use]
    pub fn label(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.wheels.join(" + "))
    }
}

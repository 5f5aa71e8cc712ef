//! Measured wheel loads of the machine file: of wheels that the machine has, each sensor with a name of its own.

use super::checker::Checker;
use crate::machine::{FieldSpec, LoadSensor, MachineError, Wheel};

/// Standard deviation of a measured load that states none, as a share of the mean load of each of its wheels.
const DEFAULT_SIGMA_SHARE: f64 = 0.02;

impl Checker<'_> {
    /// The load sensors. `weight` is that of the machine (N).
    pub(super) fn load_sensors(
        &self,
        wheels: &[Wheel],
        weight: f64,
    ) -> Result<Vec<LoadSensor>, MachineError> {
        let signals = &self.spec.signals;
        let mut found: Vec<LoadSensor> = Vec::new();
        let single = signals.wheels.iter().map(|(name, fields)| {
            let place = format!("signals.wheels.{name}");
            let names = std::slice::from_ref(name);
            (place, name.clone(), names, &fields.load, fields.sigma)
        });
        let sums = signals.load_sums.iter().enumerate().map(|(i, fields)| {
            let place = format!("signals.load_sums {}", i + 1);
            let name = fields.name.clone();
            let name = name.unwrap_or_else(|| fields.wheels.join("_"));
            let names = fields.wheels.as_slice();
            (place, name, names, &fields.load, fields.sigma)
        });
        for (place, name, names, field, sigma) in single.chain(sums) {
            let name = column_name(&name);
            if name.is_empty() || found.iter().any(|other| other.name == name) {
                let expected = "a name of its own, of letters or digits";
                return Err(self.value_error(place, expected, format!("\"{name}\"")));
            }
            let wheels_of = self.wheels_of(&place, names, wheels)?;
            self.check_load(&place, field, sigma)?;
            let share = DEFAULT_SIGMA_SHARE * weight / wheels.len() as f64;
            found.push(LoadSensor {
                name,
                sigma: sigma.unwrap_or(share * wheels_of.len() as f64),
                wheels: wheels_of,
                field: field.clone(),
            });
        }
        Ok(found)
    }

    fn wheels_of(
        &self,
        place: &str,
        names: &[String],
        wheels: &[Wheel],
    ) -> Result<Vec<usize>, MachineError> {
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            match wheels.iter().position(|wheel| wheel.name == *name) {
                Some(wheel) if !found.contains(&wheel) => found.push(wheel),
                _ => {
                    let expected = "names of [wheels], each once";
                    return Err(self.value_error(place, expected, format!("\"{name}\"")));
                }
            }
        }
        if found.is_empty() {
            return Err(self.value_error(place, "one wheel or more", "none"));
        }
        Ok(found)
    }

    fn check_load(
        &self,
        place: &str,
        field: &FieldSpec,
        sigma: Option<f64>,
    ) -> Result<(), MachineError> {
        self.check_field(&format!("{place}.load"), field, true)?;
        match sigma.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
            None => Ok(()),
            Some(sigma) => {
                let place = format!("{place}.sigma");
                Err(self.value_error(place, "a positive standard deviation [N]", sigma))
            }
        }
    }
}

/// A name as part of a column: lower case, everything but letters and digits an underscore.
fn column_name(name: &str) -> String {
    let letters = name.chars().map(|c| match c.is_ascii_alphanumeric() {
        true => c.to_ascii_lowercase(),
        false => '_',
    });
    let name: String = letters.collect();
    name.trim_matches('_').into()
}

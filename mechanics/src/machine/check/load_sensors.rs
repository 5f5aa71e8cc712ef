//! Measured wheel loads of the machine file: of wheels that the machine has, each sensor with a name of its own.

use super::checker::Checker;
use crate::machine::{FieldSpec, LoadSensor, MachineError, SupportId, Supports};

/// Standard deviation of a measured load that states none, as a share of the mean load of each of its wheels.
const DEFAULT_SIGMA_SHARE: f64 = 0.02;

impl Checker<'_> {
    /// The load sensors. `weight` is that of the machine (N).
    pub(super) fn load_sensors(
        &self,
        supports: &Supports,
        weight: f64,
    ) -> Result<Vec<LoadSensor>, MachineError> {
        let signals = &self.spec.signals;
        let on_ground = match supports.at_rest().len() {
            0 => supports.all.len(),
            some => some,
        };
        let mut found: Vec<LoadSensor> = Vec::new();
        let single = signals.wheels.iter().map(|(name, fields)| {
            let place = format!("signals.wheels.{name}");
            let names = std::slice::from_ref(name);
            (place, name.clone(), names, &fields.load, fields.sigma)
        });
        let sums = signals.load_sums.iter().enumerate().map(|(i, fields)| {
            let place = format!("signals.load_sums {}", i + 1);
            let name = fields.sensor_name();
            let names = fields.wheels.as_slice();
            (place, name, names, &fields.load, fields.sigma)
        });
        for (place, name, names, field, sigma) in single.chain(sums) {
            let name = LoadSensor::column_name(&name);
            if name.is_empty() || found.iter().any(|other| other.name == name) {
                let expected = "a name of its own, of letters or digits";
                return Err(self.value_error(place, expected, format!("\"{name}\"")));
            }
            let measured = self.supports_of(&place, names, supports)?;
            self.check_load(&place, field, sigma)?;
            let share = DEFAULT_SIGMA_SHARE * weight / on_ground as f64;
            found.push(LoadSensor {
                name,
                sigma: sigma.unwrap_or(share * measured.len() as f64),
                supports: measured,
                field: field.clone(),
            });
        }
        Ok(found)
    }

    fn supports_of(
        &self,
        place: &str,
        names: &[String],
        supports: &Supports,
    ) -> Result<Vec<SupportId>, MachineError> {
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            let named = supports.named(name);
            if named.is_empty() || named.iter().any(|id| found.contains(id)) {
                let expected = "names of [wheels], [supports] or [tracks], each once";
                return Err(self.value_error(place, expected, format!("\"{name}\"")));
            }
            found.extend(named);
        }
        if found.is_empty() {
            return Err(self.value_error(
                place,
                "one or more names of [wheels], [supports] or [tracks]",
                "none",
            ));
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

//! Checks that identified parameters are those of this machine, and applies them.

use tipwatch_language::{say, word};

use crate::machine::{Identified, Machine, MachineError, MachineSpec, Note, Unknown};

/// Largest relative difference of numbers that must agree.
const SAME: f64 = 1e-6;

impl MachineSpec {
    /// The machine with its identified parameters.
    pub(super) fn with_identified(&self, machine: Machine) -> Result<Machine, MachineError> {
        match self.identified_of(&machine)? {
            Some(identified) => {
                let mut machine = machine.with_identified(identified);
                let from = self.identified.as_ref().map_or(&[][..], |spec| &spec.from);
                machine.notes.push(Note::from(say!(
                    "Parameters of the machine were identified from {}. Their joint uncertainty replaces that of \
                     [uncertainty].",
                    if from.is_empty() { word!("data that are not named").into() } else { from.join(", ") }
                )));
                Ok(machine)
            }
            None => Ok(machine),
        }
    }

    /// The identified parameters of the machine file, checked against a machine of it without them.
    ///
    /// # Errors
    /// They belong to another machine.
    pub fn identified_of(&self, machine: &Machine) -> Result<Option<Identified>, MachineError> {
        let Some(spec) = &self.identified else {
            return Ok(None);
        };
        let fault = |place: &str, expected: String, found: String| {
            let place = format!("identified.{place}");
            Err(MachineError::value(&self.file, place, expected, found))
        };
        let size = spec.parameters.len();
        let lists = [
            ("nominal", &spec.nominal),
            ("change", &spec.change),
            ("prior_sigma", &spec.prior_sigma),
            ("sigma", &spec.sigma),
        ];
        let weights = spec
            .direction
            .iter()
            .map(|d| ("direction.weights", &d.weights));
        for (key, list) in lists.into_iter().chain(weights) {
            if list.len() != size {
                let expected = format!("{size} numbers, one for each of identified.parameters");
                return fault(key, expected, list.len().to_string());
            }
            if key != "nominal" && !list.iter().all(|value| value.is_finite()) {
                return fault(key, "finite numbers".into(), format!("{list:?}"));
            }
        }
        if let Some(sigma) = spec.prior_sigma.iter().find(|sigma| **sigma <= 0.0) {
            return fault("prior_sigma", "positive numbers".into(), sigma.to_string());
        }
        for (key, value, least) in [
            ("model_share", spec.model_share, 0.0),
            ("sigma_factor", spec.sigma_factor, 1.0),
        ] {
            if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= least)) {
                let expected = format!("a number of at least {least}");
                return fault(key, expected, value.to_string());
            }
        }
        for direction in &spec.direction {
            if !(0.0..1.0).contains(&direction.share) {
                let expected = "a share from 0 to below 1".into();
                return fault("direction.share", expected, direction.share.to_string());
            }
            let length: f64 = direction.weights.iter().map(|w| w * w).sum();
            if (length - 1.0).abs() > SAME {
                return fault(
                    "direction.weights",
                    "a length of 1".into(),
                    length.sqrt().to_string(),
                );
            }
        }
        let known = Unknown::all(machine);
        let named = |name: &String| known.iter().find(|unknown| unknown.name(machine) == *name);
        let (mut identified, mut kept) = (Identified::default(), Vec::new());
        for (place, name) in spec.parameters.iter().enumerate() {
            let Some(&unknown) = named(name) else {
                // another log may have fewer sensors
                if may_be_absent(name) {
                    continue;
                }
                let expected = "a parameter of the machine with an uncertainty".into();
                return fault("parameters", expected, format!("\"{name}\""));
            };
            let (stated, now) = (spec.nominal[place], unknown.nominal(machine));
            let is_same = now.is_none_or(|now| (now - stated).abs() <= SAME * now.abs().max(1e-3));
            if !is_same {
                let expected = format!(
                    "{name} = {stated}, the value when it was identified (run tipwatch identify again)"
                );
                let found = now.map_or("none".into(), |now| now.to_string());
                return fault("nominal", expected, found);
            }
            kept.push(place);
            identified.unknowns.push(unknown);
        }
        let of = |list: &[f64]| kept.iter().map(|&place| list[place]).collect::<Vec<f64>>();
        identified.change = of(&spec.change);
        identified.prior_sigma = of(&spec.prior_sigma);
        identified.model_share = spec.model_share;
        identified.sigma_factor = spec.sigma_factor;
        identified.directions = spec.direction.clone();
        for direction in &mut identified.directions {
            direction.weights = of(&direction.weights);
        }
        for (&unknown, stated) in identified.unknowns.iter().zip(of(&spec.sigma)) {
            let sigma = identified.sigma(unknown).unwrap_or(f64::NAN);
            // rounding where the data removed nearly all of the variance
            let prior = unknown.stated_sigma(machine).max(stated);
            if !((sigma - stated).abs() <= 1e-3 * stated + SAME * prior) {
                let name = unknown.name(machine);
                let expected = format!("{sigma} for {name}, which follows from the directions");
                return fault("sigma", expected, stated.to_string());
            }
        }
        Ok(Some(identified))
    }
}

/// Whether a parameter exists only together with a sensor, which a log may lack.
fn may_be_absent(name: &str) -> bool {
    name.ends_with(".position") || name.starts_with("tool.") || name.starts_with("imu.")
}

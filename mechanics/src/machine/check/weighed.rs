//! Loads that scales told: of wheels and joints that the machine has.

use crate::machine::{MachineError, MachineSpec, MeasuredJoint, WeighedPosture, WeighedSpec};

impl MachineSpec {
    /// Rejects loads of wheels and positions of joints that the machine does not have.
    pub(super) fn check_weighed(&self, joints: &[MeasuredJoint]) -> Result<(), MachineError> {
        let Some(weighed) = &self.weighed else {
            return Ok(());
        };
        self.check_sigmas(weighed.sigma, "weighed.sigma")?;
        let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        let own = WeighedPosture {
            posture: weighed.posture.clone(),
            wheels: weighed.wheels.clone(),
            sums: weighed.sums.clone(),
            ..WeighedPosture::default()
        };
        self.check_weighing("weighed", &own, &names)?;
        for (i, posture) in weighed.postures.iter().enumerate() {
            let place = format!("weighed.postures {}", i + 1);
            self.check_weighing(&place, posture, &names)?;
            self.check_slope(&place, posture)?;
            let readings = posture.wheels.len() + posture.sums.len();
            if readings == 0 && posture.specific_force.is_none() {
                let expected = "wheels, sums or specific_force";
                return Err(MachineError::value(&self.file, place, expected, "none"));
            }
        }
        self.check_has_readings(weighed)
    }

    fn check_has_readings(&self, weighed: &WeighedSpec) -> Result<(), MachineError> {
        match weighed.posture.is_empty() || !weighed.wheels.is_empty() || !weighed.sums.is_empty() {
            true => Ok(()),
            false => {
                let expected = "wheels or sums of [weighed] in this posture";
                let place = "weighed.posture";
                Err(MachineError::value(&self.file, place, expected, "none"))
            }
        }
    }

    fn check_sigmas(&self, sigma: f64, place: &str) -> Result<(), MachineError> {
        if sigma.is_finite() && sigma >= 0.0 {
            return Ok(());
        }
        let expected = "a standard deviation that is not negative";
        Err(MachineError::value(
            &self.file,
            place,
            expected,
            sigma.to_string(),
        ))
    }

    fn check_weighing(
        &self,
        place: &str,
        weighing: &WeighedPosture,
        joints: &[&str],
    ) -> Result<(), MachineError> {
        let fault = |place: String, expected: &str, found: String| {
            Err(MachineError::value(&self.file, place, expected, found))
        };
        let readings = weighing.wheels.iter().map(|(wheel, &load)| {
            let place = format!("{place}.wheels.{wheel}");
            (place, std::slice::from_ref(wheel), load)
        });
        let sums = weighing.sums.iter().map(|sum| {
            let place = format!("{place}.sums \"{}\"", sum.label());
            (place, sum.wheels.as_slice(), sum.load)
        });
        let of_sums = weighing.sums.iter().filter_map(|sum| sum.sigma);
        for sigma in of_sums.chain(weighing.sigma) {
            self.check_sigmas(sigma, &format!("{place}.sigma"))?;
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
        self.check_posture(&format!("{place}.posture"), &weighing.posture, joints)
    }

    fn check_slope(&self, place: &str, weighing: &WeighedPosture) -> Result<(), MachineError> {
        let fault = |key: &str, expected: &str, found: String| {
            let place = format!("{place}.{key}");
            Err(MachineError::value(&self.file, place, expected, found))
        };
        let of_slope = [weighing.slope_sigma, weighing.specific_force_sigma];
        for sigma in of_slope.into_iter().flatten() {
            self.check_sigmas(
                sigma,
                &format!("{place}.slope_sigma or specific_force_sigma"),
            )?;
        }
        let steep = |angle: &f64| !(angle.abs() < 1.0);
        if let Some(slope) = weighing.slope.filter(|slope| slope.iter().any(steep)) {
            return fault("slope", "two angles below 1 rad", format!("{slope:?}"));
        }
        if weighing.slope_unknown && (weighing.slope.is_some() || weighing.slope_sigma.is_some()) {
            let found = "slope or slope_sigma".into();
            return fault("slope_unknown", "no slope where it is unknown", found);
        }
        if let Some(force) = weighing.specific_force {
            let length = force.iter().map(|f| f * f).sum::<f64>().sqrt();
            let share = length / self.gravity;
            // NaN is not plausible either
            if !(0.8..1.25).contains(&share) {
                let expected = format!("a vector about as long as gravity, {}", self.gravity);
                return fault("specific_force", &expected, format!("{force:?}"));
            }
        }
        Ok(())
    }
}

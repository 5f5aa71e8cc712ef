//! Loads that scales told: of wheels and joints that the machine has.

use crate::machine::{MachineError, MachineSpec, MeasuredJoint};

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
        let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        self.check_posture("weighed.posture", &weighed.posture, &names)
    }
}

//! Loads that scales told: of wheels and joints that the machine has.

use super::reference::PostureJoint;
use crate::machine::{Machine, MachineError, MachineSpec, SupportId, WeighedPosture, WeighedSpec};

impl MachineSpec {
    /// Rejects loads of wheels and positions of joints that the machine does not have.
    pub(super) fn check_weighed(&self, machine: &Machine) -> Result<(), MachineError> {
        let Some(weighed) = &self.weighed else {
            return Ok(());
        };
        self.check_sigmas(weighed.sigma, "weighed.sigma")?;
        let joints = machine.joints().iter().enumerate();
        let joints: Vec<PostureJoint<'_>> = joints
            .map(|(index, joint)| PostureJoint {
                name: &joint.name,
                limits: joint.limits,
                slides: machine.joint_slides(index),
            })
            .collect();
        let own = WeighedPosture {
            posture: weighed.posture.clone(),
            supports: weighed.supports.clone(),
            wheels: weighed.wheels.clone(),
            sums: weighed.sums.clone(),
            ..WeighedPosture::default()
        };
        self.check_weighing("weighed", &own, &joints, machine)?;
        for (i, posture) in weighed.postures.iter().enumerate() {
            let place = format!("weighed.postures {}", i + 1);
            self.check_weighing(&place, posture, &joints, machine)?;
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
        joints: &[PostureJoint<'_>],
        machine: &Machine,
    ) -> Result<(), MachineError> {
        let fault = |place: String, expected: &str, found: String| {
            Err(MachineError::value(&self.file, place, expected, found))
        };
        let on_ground = self.supports_of_weighing(place, weighing, machine)?;
        let supports = machine.supports();
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
            let mut weighed: Vec<SupportId> = Vec::new();
            for wheel in wheels {
                let named = supports.named(wheel);
                if named.is_empty() || named.iter().any(|id| weighed.contains(id)) {
                    let expected = "names of [wheels], [supports] or [tracks], each once";
                    return fault(place, expected, format!("\"{wheel}\""));
                }
                if !named.iter().all(|id| on_ground.contains(id)) {
                    let expected = format!(
                        "supports that are on the ground in this weighing ({}; state others in its key supports)",
                        supports.names(&on_ground)
                    );
                    return fault(place, &expected, format!("\"{wheel}\""));
                }
                weighed.extend(named);
            }
        }
        self.check_posture(&format!("{place}.posture"), &weighing.posture, joints)
    }

    /// The supports on the ground in a weighing.
    fn supports_of_weighing(
        &self,
        place: &str,
        weighing: &WeighedPosture,
        machine: &Machine,
    ) -> Result<Vec<SupportId>, MachineError> {
        let fault = |expected: &str, found: String| {
            let place = format!("{place}.supports");
            MachineError::value(&self.file, place, expected, found)
        };
        let is_unknown = |name: &&String| machine.supports().named(name).is_empty();
        if let Some(name) = weighing.supports.iter().find(is_unknown) {
            let expected = "names of [wheels], [supports] or [tracks]";
            return Err(fault(expected, format!("\"{name}\"")));
        }
        let on = weighing.stands_on(machine.supports());
        let expected = "supports on which the machine can stand";
        match machine.standing_on(&on) {
            Err(error) if !weighing.supports.is_empty() => Err(fault(expected, error.to_string())),
            _ => Ok(on),
        }
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

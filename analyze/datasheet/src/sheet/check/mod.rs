//! Refuses numbers that no machine of this kind has, with the likely correction.

mod arm;
mod axles;
mod joints;
mod outriggers;
mod range;
mod size;

use super::spec::Sheet;
use crate::error::SheetError;

impl Sheet {
    /// Checks every number by itself, and those that belong together.
    pub(crate) fn check(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        if self.name.trim().is_empty() || self.name.len() > 200 {
            let found = format!("{} characters", self.name.len());
            return Err(self.wrong("name", "a name of 1 to 200 characters", found, ""));
        }
        self.mass_in("mass", self.mass.si, prior.mass)?;
        for (place, length, most) in [
            ("length", self.length, 60.0),
            ("width", self.width, 30.0),
            ("height", self.height, 30.0),
            ("ground_clearance", self.ground_clearance, 5.0),
            ("centre_of_mass_height", self.centre_of_mass_height, 15.0),
        ] {
            if let Some(length) = length {
                self.length_in(place, length.si, [0.01, most])?;
            }
        }
        if let Some(angle) = self.tilt_angle {
            self.angle_in("tilt_angle", angle.si, [5.0, 70.0])?;
        }
        if self.tilt_angle.is_some() && self.centre_of_mass_height.is_some() {
            return Err(self.wrong(
                "tilt_angle",
                "either tilt_angle or centre_of_mass_height",
                "both",
                "Leave out the one that is less certain",
            ));
        }
        if let Some(k) = self.tyre_stiffness.map(|k| k.si)
            && !(1e3..=1e8).contains(&k)
        {
            let likely = "Tyres of such machines have 1e5 to 3e6 N/m";
            return Err(self.wrong(
                "tyre_stiffness",
                "1e3 to 1e8 N/m",
                format!("{k} N/m"),
                likely,
            ));
        }
        self.check_ground()?;
        self.check_size()?;
        self.check_joints()?;
        self.check_arm()?;
        self.check_outriggers()
    }
}

//! Articulation, slew and superstructure.

use super::arm::TWO_TURNS;
use crate::error::SheetError;
use crate::sheet::spec::Sheet;

/// Mass of a frame or superstructure as a share of the operating mass, at least.
const LEAST_FRAME_SHARE: f64 = 0.01;

impl Sheet {
    pub(super) fn check_joints(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        match (&self.articulation, prior.is_articulated) {
            (Some(joint), true) => {
                let wheelbase = self.axle_positions().last().map_or(0.0, |x| -x);
                self.length_in(
                    "articulation.behind",
                    joint.behind.si,
                    [0.05 * wheelbase, 0.95 * wheelbase],
                )?;
                self.angle_in("articulation.angle", joint.angle.si, [1.0, 90.0])?;
                if let Some(roll) = joint.roll {
                    self.angle_in("articulation.roll", roll.si, [0.5, 60.0])?;
                }
                if let Some(mass) = joint.front_mass {
                    self.part_in("articulation.front_mass", mass.si, LEAST_FRAME_SHARE)?;
                }
            }
            (None, true) => {
                let expected = "[articulation] with the place of the frame joint";
                return Err(self.wrong("articulation", expected, "none", ""));
            }
            (Some(_), false) => {
                let expected = format!("none for a {}", self.template);
                return Err(self.wrong("articulation", expected, "[articulation]", ""));
            }
            (None, false) => {}
        }
        if let Some(slew) = &self.slew {
            if !(slew.behind.si.abs() <= 30.0) {
                let found = format!("{} m", slew.behind.si);
                return Err(self.wrong(
                    "slew.behind",
                    "-30 to 30 m",
                    found,
                    "Write \"NUMBER mm\" for millimetres",
                ));
            }
            self.length_in("slew.height", slew.height.si, [0.01, 10.0])?;
            self.range(
                "slew",
                slew.range.map(|r| r.map(|a| a.si)),
                slew.at.map(|a| a.si),
                TWO_TURNS,
            )?;
        }
        match (&self.superstructure, prior.has_superstructure) {
            (Some(upper), true) => {
                self.length_in("superstructure.tail", upper.tail.si, [0.3, 15.0])?;
                if self.slew.is_none() {
                    return Err(self.wrong("slew", "[slew] below a superstructure", "none", ""));
                }
                if let Some(mass) = upper.mass {
                    self.part_in("superstructure.mass", mass.si, LEAST_FRAME_SHARE)?;
                }
                if let Some(com) = upper.centre_of_mass_behind
                    && !(com.si.abs() <= upper.tail.si)
                {
                    let expected = format!(
                        "a place within the tail swing radius of {} m",
                        upper.tail.si
                    );
                    let place = "superstructure.centre_of_mass_behind";
                    return Err(self.wrong(place, expected, format!("{} m", com.si), ""));
                }
                if let Some(width) = upper.width {
                    self.length_in("superstructure.width", width.si, [0.3, 15.0])?;
                }
                Ok(())
            }
            (None, true) => {
                let expected = "[superstructure] with its tail swing radius";
                Err(self.wrong("superstructure", expected, "none", ""))
            }
            (Some(_), false) => {
                let expected = format!("none for a {}", self.template);
                Err(self.wrong("superstructure", expected, "[superstructure]", ""))
            }
            (None, false) => Ok(()),
        }
    }
}

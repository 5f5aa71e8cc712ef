//! Articulation, slew and superstructure.

use super::arm::TWO_TURNS;
use super::range::{LENGTH_UNITS, in_other_unit};
use crate::error::SheetError;
use crate::prior::Balance;
use crate::sheet::spec::Sheet;

/// Mass of a frame or superstructure as a share of the operating mass, at least.
const LEAST_FRAME_SHARE: f64 = 0.01;

impl Sheet {
    pub(super) fn check_joints(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        match (&self.articulation, prior.is_articulated) {
            (Some(joint), true) => {
                let wheelbase = self.wheelbase();
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
            self.offset_in("slew.behind", slew.behind.si, 30.0)?;
            self.check_slew_of_excavator(slew.behind.si)?;
            self.length_in("slew.height", slew.height.si, [0.01, 10.0])?;
            self.range(
                "slew",
                slew.range.map(|r| r.map(|a| a.si)),
                slew.at.map(|a| a.si),
                TWO_TURNS,
            )?;
        }
        self.check_superstructure()
    }

    /// An excavator turns above its axles or tracks: it digs all round.
    fn check_slew_of_excavator(&self, behind: f64) -> Result<(), SheetError> {
        /// Shares of the wheelbase, and of the length of the tracks either way from their middle.
        const OF_WHEELBASE: [f64; 2] = [0.15, 0.85];
        const OF_TRACKS: f64 = 0.3;
        if self.template.prior().balance != Balance::Superstructure {
            return Ok(());
        }
        let wheelbase = self.wheelbase();
        let ([least, most], what) = match &self.tracks {
            Some(tracks) => (
                [-OF_TRACKS, OF_TRACKS].map(|share| share * tracks.length.si),
                "above the tracks",
            ),
            None => (
                OF_WHEELBASE.map(|share| share * wheelbase),
                "between the axles",
            ),
        };
        if (least..=most).contains(&behind) {
            return Ok(());
        }
        let expected = format!("{least:.3} to {most:.3} m, {what}");
        let likely = in_other_unit(behind.abs(), [0.0, most], LENGTH_UNITS);
        Err(self.wrong("slew.behind", expected, format!("{behind} m"), likely))
    }

    /// A counterweight that reached further would tip the machine without its arm.
    fn check_tail_of_excavator(&self, tail: f64) -> Result<(), SheetError> {
        /// Largest distance, as a multiple of the wheelbase or the length of the tracks.
        const FARTHEST: f64 = 1.4;
        let most = FARTHEST * self.length_on_ground();
        if self.template.prior().balance != Balance::Superstructure || tail <= most {
            return Ok(());
        }
        let expected = format!("at most {most:.3} m from the axis of the slew");
        let likely =
            "It looks like the diameter of the tail swing, or a length of the whole machine";
        Err(self.wrong("superstructure.tail", expected, format!("{tail} m"), likely))
    }

    fn check_superstructure(&self) -> Result<(), SheetError> {
        let prior = self.template.prior();
        match (&self.superstructure, prior.has_superstructure) {
            (Some(upper), true) => {
                self.length_in("superstructure.tail", upper.tail.si, [0.3, 15.0])?;
                self.check_tail_of_excavator(upper.tail.si)?;
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

//! The overall size of the machine against its parts.

use super::range::{LENGTH_UNITS, in_other_unit};
use crate::error::SheetError;
use crate::sheet::spec::{Axle, Sheet};

/// Height of the first pin of an arm as a multiple of the overall height, at most.
const HIGHEST_PIN: f64 = 2.0;
/// Mass by the box of length, width and height, least and most (kg/m^3): forwarders have 170, forklifts 700.
const DENSITY: [f64; 2] = [30.0, 2000.0];
/// Newtons by kilogram.
const NEWTONS: f64 = 9.81;
/// Clearance below the frame as a multiple of a wheel's radius, at most.
const HIGHEST_CLEARANCE: f64 = 1.6;

impl Sheet {
    /// The machine is as wide as its track, as long as its wheelbase, and not below the first pin of its arm.
    pub(super) fn check_size(&self) -> Result<(), SheetError> {
        let widest = self.widest_track();
        let longest = self.length_on_ground();
        for (place, length, least, of) in [
            ("width", self.width, widest, "the track"),
            ("length", self.length, longest, "the wheelbase"),
            (
                "height",
                self.height,
                self.arm.height.si / HIGHEST_PIN,
                "half the height of the arm's first pin (arm.height)",
            ),
        ] {
            let Some(length) = length.map(|length| length.si) else {
                continue;
            };
            if length >= least {
                continue;
            }
            // either of the two may be in another unit
            let likely = match in_other_unit(least, [0.0, length], LENGTH_UNITS).is_empty() {
                true => "",
                false => "Check the units of both",
            };
            let expected = format!("at least {least:.3} m, {of}");
            return Err(self.wrong(place, expected, format!("{length} m"), likely));
        }
        self.check_density()
    }

    /// Checks that the box of length, width and height weighs as much as machines of steel, air and a cab.
    fn check_density(&self) -> Result<(), SheetError> {
        let sizes = [self.length, self.width, self.height].map(|size| size.map(|size| size.si));
        let [Some(length), Some(width), Some(height)] = sizes else {
            return Ok(());
        };
        let (mass, volume) = (self.mass.si, length * width * height);
        let [least, most] = DENSITY.map(|density| density * volume);
        if (least..=most).contains(&mass) {
            return Ok(());
        }
        let likely = match (least..=most).contains(&(mass / NEWTONS)) {
            true => "It looks like newtons: divide by 9.81; or a size is in another unit",
            false => "Check the unit of the mass, and those of length, width and height",
        };
        let expected = format!(
            "{least:.0} to {most:.0} kg for a machine of {length:.3} m by {width:.3} m by {height:.3} m"
        );
        Err(self.wrong("mass", expected, format!("{mass} kg"), likely))
    }

    /// A wheel is lower than the machine, and its frame not far above the axle.
    pub(super) fn check_radius_in_machine(
        &self,
        index: usize,
        axle: &Axle,
        radius: f64,
    ) -> Result<(), SheetError> {
        let (place, what) = match (axle.tyre_radius, &axle.tyre) {
            (None, Some(name)) => (
                format!("axles[{index}].tyre"),
                format!("\"{name}\", whose radius is {radius:.3} m"),
            ),
            _ => (format!("axles[{index}].tyre_radius"), format!("{radius} m")),
        };
        let height = self.height.map(|height| height.si);
        if let Some(height) = height.filter(|height| 2.0 * radius > *height) {
            let expected = format!("a wheel that is lower than the machine of {height} m (height)");
            let likely = "Check the designation, the unit of the height, and that the radius is not the diameter";
            return Err(self.wrong(place, expected, what, likely));
        }
        let clearance = self.ground_clearance.map(|clearance| clearance.si);
        if let Some(clearance) = clearance.filter(|c| *c > HIGHEST_CLEARANCE * radius) {
            let expected = format!(
                "a radius of at least {:.3} m, because the frame is {clearance} m over the ground (ground_clearance)",
                clearance / HIGHEST_CLEARANCE
            );
            let likely = "Check the designation, and the unit of the clearance";
            return Err(self.wrong(place, expected, what, likely));
        }
        Ok(())
    }
}

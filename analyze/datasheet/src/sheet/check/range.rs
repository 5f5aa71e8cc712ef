//! One number within its range, and the unit in which it would be.

use crate::error::SheetError;
use crate::sheet::spec::Sheet;

const MASS_UNITS: &[(&str, f64)] = &[("t", 1000.0), ("lb", 0.453_592_37), ("g", 1e-3)];
pub(super) const LENGTH_UNITS: &[(&str, f64)] =
    &[("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("ft", 0.3048)];

impl Sheet {
    pub(super) fn mass_in(&self, place: &str, kg: f64, range: [f64; 2]) -> Result<(), SheetError> {
        if (range[0]..=range[1]).contains(&kg) {
            return Ok(());
        }
        let expected = format!(
            "{:.4} to {:.4} kg for a {}",
            range[0], range[1], self.template
        );
        let likely = in_other_unit(kg, range, MASS_UNITS);
        Err(self.wrong(place, trim(&expected), format!("{kg} kg"), likely))
    }

    /// The mass of a part: at most that of the machine, and at least this share of it, because tonnes without their
    /// unit are kilograms. Zero means none.
    pub(super) fn part_in(&self, place: &str, kg: f64, share: f64) -> Result<(), SheetError> {
        match kg == 0.0 {
            true => Ok(()),
            false => self.mass_in(place, kg, [share * self.mass.si, self.mass.si]),
        }
    }

    pub(super) fn length_in(&self, place: &str, m: f64, range: [f64; 2]) -> Result<(), SheetError> {
        if (range[0]..=range[1]).contains(&m) {
            return Ok(());
        }
        let expected = format!("{:.4} to {:.4} m", range[0], range[1]);
        let likely = in_other_unit(m, range, LENGTH_UNITS);
        Err(self.wrong(place, trim(&expected), format!("{m} m"), likely))
    }

    /// A place along the machine, ahead or behind: zero, or far enough to be meant.
    pub(super) fn offset_in(&self, place: &str, m: f64, most: f64) -> Result<(), SheetError> {
        /// Smallest offset that is meant, as a share of the wheelbase or the length of the tracks.
        const MEANT: f64 = 2e-3;
        let least = MEANT * self.length_on_ground();
        let far = m.abs();
        if m == 0.0 || (least..=most).contains(&far) {
            return Ok(());
        }
        let (expected, likely) = match far < least {
            true => (
                format!("0, or at least {least:.4} m from it"),
                format!("It looks like a number in m: write \"{} m\"", 1e3 * m),
            ),
            false => (
                format!("-{most} to {most} m"),
                in_other_unit(far, [least, most], LENGTH_UNITS),
            ),
        };
        Err(self.wrong(place, trim(&expected), format!("{m} m"), likely))
    }

    pub(super) fn angle_in(
        &self,
        place: &str,
        angle: f64,
        degrees: [f64; 2],
    ) -> Result<(), SheetError> {
        let found = angle.to_degrees();
        if (degrees[0] - 1e-9..=degrees[1] + 1e-9).contains(&found) {
            return Ok(());
        }
        let expected = format!("{} to {} degrees", degrees[0], degrees[1]);
        let likely = match (degrees[0]..=degrees[1]).contains(&found.to_degrees()) {
            true => format!("It looks like radians: write \"{found} rad\""),
            false => String::new(),
        };
        Err(self.wrong(place, expected, format!("{found} degrees"), likely))
    }

    /// A range is in order, of a size that this joint can have, and holds the posture of the sheet.
    pub(super) fn range(
        &self,
        place: &str,
        range: Option<[f64; 2]>,
        at: Option<f64>,
        largest: f64,
    ) -> Result<(), SheetError> {
        /// Smallest range of a joint that moves (degrees).
        const SMALLEST: f64 = 2.0;
        let degrees = |a: f64| (a.to_degrees() * 1e6).round() * 1e-6;
        let Some([least, most]) = range else {
            return Ok(());
        };
        let span = degrees(most) - degrees(least);
        let found = || format!("{} to {} degrees", degrees(least), degrees(most));
        if !(least < most) {
            let expected = "a smallest and a larger angle";
            return Err(self.wrong(format!("{place}.range"), expected, found(), ""));
        }
        if !(SMALLEST..=largest).contains(&span) {
            let expected = format!("a range of {SMALLEST} to {largest} degrees");
            let likely = match span {
                _ if (SMALLEST..=largest).contains(&span.to_degrees()) => format!(
                    "It looks like radians: write [\"{} rad\", \"{} rad\"]",
                    degrees(least),
                    degrees(most)
                ),
                _ if (SMALLEST..=largest).contains(&span.to_radians()) && span > 2.0 * largest => {
                    "It looks like degrees that were multiplied by 57.3: state the angles in degrees".into()
                }
                _ if (SMALLEST..=largest).contains(&(0.1 * span)) => {
                    "It looks like tenths of a degree: state the angles in degrees; leave out the range of a joint that turns \
                     endlessly"
                        .into()
                }
                _ => "State the angles in degrees; leave out the range of a joint that turns endlessly".into(),
            };
            return Err(self.wrong(format!("{place}.range"), expected, found(), likely));
        }
        match at {
            Some(at) if !(least - 1e-9..=most + 1e-9).contains(&at) => {
                let expected = format!("an angle within the range of {}", found());
                Err(self.wrong(
                    format!("{place}.at"),
                    expected,
                    format!("{} degrees", degrees(at)),
                    "",
                ))
            }
            _ => Ok(()),
        }
    }
}

/// A length or a mass in other units that would be plausible: the unit that brings it nearest to the middle of the
/// range.
pub(super) fn in_other_unit(si: f64, range: [f64; 2], units: &[(&str, f64)]) -> String {
    let [least, largest] = range;
    let middle = (least.max(0.02 * largest) * largest).sqrt();
    let fits = |factor: f64| (least..=largest).contains(&(si * factor));
    let off = |factor: f64| (si * factor / middle).ln().abs();
    let found = units
        .iter()
        .filter(|(_, factor)| fits(*factor))
        .min_by(|(_, a), (_, b)| off(*a).total_cmp(&off(*b)));
    found.map_or(String::new(), |(unit, _)| {
        format!("It looks like a number in {unit}: write \"{si} {unit}\"")
    })
}

/// Without trailing zeros of decimals.
fn trim(text: &str) -> String {
    let words = text.split(' ').map(|word| match word.contains('.') {
        true => word.trim_end_matches('0').trim_end_matches('.'),
        false => word,
    });
    words.collect::<Vec<_>>().join(" ")
}

//! Outriggers.

use crate::error::SheetError;
use crate::sheet::spec::{OutriggersSet, Sheet};

impl Sheet {
    pub(super) fn check_outriggers(&self) -> Result<(), SheetError> {
        if self.outriggers.len() > 4 {
            let found = self.outriggers.len().to_string();
            return Err(self.wrong("outriggers", "at most 4 pairs", found, ""));
        }
        for (index, pair) in self.outriggers.iter().enumerate() {
            let place = |key: &str| format!("outriggers[{index}].{key}");
            self.length_in(&place("base"), pair.base.si, [0.3, 20.0])?;
            self.check_base(&place("base"), pair.base.si)?;
            self.offset_in(&place("behind"), pair.behind.si, 30.0)?;
            if let Some(pad) = pair.pad {
                self.length_in(&place("pad"), pad.si, [0.02, 3.0])?;
            }
            let Some(OutriggersSet::Signals { left, right }) = &pair.set else {
                continue;
            };
            for (side, switch) in [("left", left), ("right", right)] {
                let empty = [("topic", &switch.topic), ("field", &switch.field)];
                if let Some((key, _)) = empty.into_iter().find(|(_, text)| text.is_empty()) {
                    let place = place(&format!("set.{side}.{key}"));
                    return Err(self.wrong(place, "a name", "an empty text", ""));
                }
                if let Some(above) = switch.above.filter(|above| !above.is_finite()) {
                    let place = place(&format!("set.{side}.above"));
                    return Err(self.wrong(place, "a finite number", above.to_string(), ""));
                }
            }
        }
        Ok(())
    }

    /// Outriggers widen the base on which the machine stands.
    fn check_base(&self, place: &str, base: f64) -> Result<(), SheetError> {
        /// Smallest distance between the pads, as a share of the widest track.
        const WIDENS: f64 = 0.8;
        let widest = self.widest_track();
        if base >= WIDENS * widest {
            return Ok(());
        }
        let expected = format!(
            "at least {:.3} m between the middles of the pads, because the track is {widest} m",
            WIDENS * widest
        );
        let likely = match base {
            _ if 2.0 * base >= widest => {
                "It looks like the distance from the middle of the machine: give both sides together"
            }
            _ if 3.3 * base >= widest => {
                "It looks like a number in metres that was written in another unit, or like the side of a pad (pad)"
            }
            _ => "It looks like the side of a pad: that is the key pad",
        };
        Err(self.wrong(place, expected, format!("{base} m"), likely))
    }
}

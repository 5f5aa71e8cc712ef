//! Outriggers.

use super::range::{LENGTH_UNITS, in_other_unit};
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
            if !(pair.behind.si.abs() <= 30.0) {
                let likely = in_other_unit(pair.behind.si.abs(), [0.0, 30.0], LENGTH_UNITS);
                let found = format!("{} m", pair.behind.si);
                return Err(self.wrong(place("behind"), "-30 to 30 m", found, likely));
            }
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
}

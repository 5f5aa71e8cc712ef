//! Validation of the active suspension's linkages and limits.

use super::checker::Checker;
use crate::machine::{MachineError, Suspension};

impl Checker<'_> {
    pub(super) fn suspension(&self) -> Result<Option<Suspension>, MachineError> {
        let Some(spec) = &self.spec.suspension else {
            return Ok(None);
        };
        let [least, greatest] = spec.stroke;
        if !(least < greatest) {
            return Err(self.value_error(
                "suspension.stroke",
                "[smallest, largest] in metres",
                format!("[{least}, {greatest}]"),
            ));
        }
        for (key, value) in [
            ("suspension.max_velocity", spec.max_velocity),
            ("suspension.max_acceleration", spec.max_acceleration),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(self.value_error(key, "a positive number", value));
            }
        }
        self.check_ranges("suspension.hydraulics", &spec.hydraulics.numbers())?;
        if let Some((key, expected, found)) = spec.hydraulics.fault() {
            let place = format!("suspension.hydraulics.{key}");
            return Err(self.value_error(place, expected, found));
        }
        let index = |name: &String| {
            let found = self.spec.linkage.iter().position(|l| &l.name == name);
            found.ok_or_else(|| {
                self.value_error(
                    "suspension.linkages",
                    "names of [[linkage]] tables",
                    format!("\"{name}\""),
                )
            })
        };
        self.check_control(&spec.control)?;
        Ok(Some(Suspension {
            linkages: spec.linkages.iter().map(index).collect::<Result<_, _>>()?,
            stroke: spec.stroke,
            max_velocity: spec.max_velocity,
            max_acceleration: spec.max_acceleration,
            hydraulics: spec.hydraulics.parameters(greatest - least),
            control: spec.control.clone(),
        }))
    }
}

//! Validation of the wheels and their support polygon.

use nalgebra::Point3;

use super::checker::Checker;
use crate::machine::spec::Stiffness;
use crate::machine::support_set::polygon_of;
use crate::machine::{MAX_WHEELS, MachineError, SupportKind, SupportPolygon, Wheel, WheelSpec};

impl Checker<'_> {
    pub(super) fn wheels(&self) -> Result<Vec<Wheel>, MachineError> {
        let specs = &self.spec.wheels;
        if !(3..=MAX_WHEELS).contains(&specs.len()) {
            let expected = format!("3 to {MAX_WHEELS} tables [wheels.NAME]");
            return Err(self.value_error("wheels", expected, specs.len()));
        }
        let stiffness = self.stiffness()?;
        let mean = stiffness.iter().sum::<f64>() / stiffness.len() as f64;
        let mut wheels: Vec<Wheel> = Vec::new();
        for ((name, wheel), stiffness) in specs.iter().zip(stiffness) {
            let table = wheel.origin.kind.table();
            let index = self.link(&format!("{table}.{name}.link"), &wheel.link)?;
            let link = &self.tree.links[index];
            let kind = wheel.origin.kind;
            let least = if kind == SupportKind::Wheel {
                0.0
            } else {
                -1e-12
            };
            if !(wheel.radius.is_finite() && wheel.radius > least) {
                return Err(self.value_error(
                    format!("{}.{name}.radius", kind.table()),
                    "a positive length [m]",
                    wheel.radius,
                ));
            }
            if let Some(same) = wheels
                .iter()
                .find(|w| w.name.to_lowercase() == name.to_lowercase())
            {
                let found = format!("\"{name}\" and \"{}\"", same.name);
                return Err(self.value_error(
                    "wheels",
                    "names that differ by more than case",
                    found,
                ));
            }
            let [x, y, z] = wheel.origin.xyz;
            if !(x.is_finite() && y.is_finite() && z.is_finite()) {
                let place = format!("{table}.{name}");
                return Err(self.value_error(
                    place,
                    "finite coordinates [m]",
                    format!("{x}, {y}, {z}"),
                ));
            }
            let centre_in_body = match kind {
                SupportKind::Wheel => link.body_from_link.translation.vector,
                _ => (link.body_from_link * Point3::new(x, y, z)).coords,
            };
            wheels.push(Wheel {
                name: name.clone(),
                kind,
                body: link.body,
                centre_in_body,
                radius: wheel.radius,
                radius_sigma: None,
                stiffness: self.spec.contact.tyre_stiffness.as_ref().map(|_| stiffness),
                relative_stiffness: stiffness / mean,
                centre_at_zero: (self.tree.bodies[link.body].base_from_body
                    * Point3::from(centre_in_body))
                .coords,
                mounting: self.mounting(index),
            });
        }
        Ok(wheels)
    }

    /// Stiffness by wheel, sorted by name; 1 for all if the machine file states none (N/m or 1).
    fn stiffness(&self) -> Result<Vec<f64>, MachineError> {
        let specs = self.spec.wheels.iter();
        let Some(stated) = &self.spec.contact.tyre_stiffness else {
            if let Some((name, spec)) = specs.clone().find(|(_, w)| w.origin.stiffness.is_some()) {
                return Err(self.value_error(
                    "contact.tyre_stiffness",
                    format!(
                        "a stiffness of the tyres beside that of {}.{name}",
                        spec.origin.kind.table()
                    ),
                    "none",
                ));
            }
            return Ok(specs.map(|_| 1.0).collect());
        };
        if let Stiffness::PerWheel(by_name) = stated
            && let Some(stranger) = by_name.keys().find(|n| !self.spec.wheels.contains_key(*n))
        {
            return Err(self.value_error(
                "contact.tyre_stiffness",
                "names of [wheels]",
                format!("\"{stranger}\""),
            ));
        }
        let of_wheel = |(name, spec): (&String, &WheelSpec)| {
            if let Some(own) = spec.origin.stiffness {
                return Ok(own);
            }
            match stated {
                Stiffness::PerWheel(by_name) => by_name.get(name).copied().ok_or_else(|| {
                    self.value_error(
                        "contact.tyre_stiffness",
                        "a value for every wheel",
                        format!("none for \"{name}\""),
                    )
                }),
                Stiffness::All(value) if spec.origin.kind == SupportKind::Wheel => Ok(*value),
                // a jack is no tyre
                Stiffness::All(_) => Err(self.value_error(
                    format!("{}.{name}.stiffness", spec.origin.kind.table()),
                    "its vertical stiffness [N/m], because contact.tyre_stiffness is stated",
                    "none",
                )),
            }
        };
        let values = specs.map(of_wheel).collect::<Result<Vec<f64>, _>>()?;
        match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            Some(value) => {
                Err(self.value_error("contact.tyre_stiffness", "positive numbers [N/m]", value))
            }
            None => Ok(values),
        }
    }

    pub(super) fn polygon(&self, wheels: &[Wheel]) -> Result<SupportPolygon, MachineError> {
        polygon_of(wheels).ok_or_else(|| {
            self.value_error(
                "wheels",
                "contact points that span an area",
                "contact points in one line",
            )
        })
    }
}

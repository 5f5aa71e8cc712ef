//! Validation of the wheels and their support polygon.

use nalgebra::{Point3, Vector2, Vector3};

use super::checker::Checker;
use crate::geometry::contact_plane::ContactPlane;
use crate::machine::spec::Stiffness;
use crate::machine::{MAX_WHEELS, MachineError, SupportPolygon, Wheel};

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
            let index = self.link(&format!("wheels.{name}.link"), &wheel.link)?;
            let link = &self.tree.links[index];
            if !(wheel.radius.is_finite() && wheel.radius > 0.0) {
                return Err(self.value_error(
                    format!("wheels.{name}.radius"),
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
            let centre_in_body = link.body_from_link.translation.vector;
            wheels.push(Wheel {
                name: name.clone(),
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

    /// Tyre stiffness by wheel, sorted by name; 1 for all if the machine file states none (N/m or 1).
    fn stiffness(&self) -> Result<Vec<f64>, MachineError> {
        let names = self.spec.wheels.keys();
        let values: Vec<f64> = match &self.spec.contact.tyre_stiffness {
            None => names.map(|_| 1.0).collect(),
            Some(Stiffness::All(value)) => names.map(|_| *value).collect(),
            Some(Stiffness::PerWheel(by_name)) => {
                if let Some(stranger) = by_name.keys().find(|n| !self.spec.wheels.contains_key(*n))
                {
                    return Err(self.value_error(
                        "contact.tyre_stiffness",
                        "names of [wheels]",
                        format!("\"{stranger}\""),
                    ));
                }
                let missing = |n: &String| {
                    self.value_error(
                        "contact.tyre_stiffness",
                        "a value for every wheel",
                        format!("none for \"{n}\""),
                    )
                };
                names
                    .map(|n| by_name.get(n).copied().ok_or_else(|| missing(n)))
                    .collect::<Result<_, _>>()?
            }
        };
        match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
            Some(value) => {
                Err(self.value_error("contact.tyre_stiffness", "positive numbers [N/m]", value))
            }
            None => Ok(values),
        }
    }

    pub(super) fn polygon(&self, wheels: &[Wheel]) -> Result<SupportPolygon, MachineError> {
        let centres: Vec<Vector3<f64>> = wheels.iter().map(|w| w.centre_at_zero).collect();
        let radii: Vec<f64> = wheels.iter().map(|w| w.radius).collect();
        let plane = ContactPlane::through(&centres, &radii, true);
        let points: Vec<Vector2<f64>> = centres
            .iter()
            .zip(wheels)
            .map(|(c, w)| (c - plane.normal * w.radius).xy())
            .collect();
        let names: Vec<&str> = wheels.iter().map(|w| w.name.as_str()).collect();
        SupportPolygon::build(&points, &names).ok_or_else(|| {
            self.value_error(
                "wheels",
                "contact points that span an area",
                "contact points in one line",
            )
        })
    }
}

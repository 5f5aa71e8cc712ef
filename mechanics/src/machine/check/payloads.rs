//! Validation of payloads.

use nalgebra::Matrix3;

use super::checker::Checker;
use crate::machine::spec::{MassSignal, PayloadMass, PayloadSpec};
use crate::machine::{Inertia, Link, MachineError, MassMoments, Payload};

impl Checker<'_> {
    pub(super) fn payloads(&self, links: &[Link]) -> Result<Vec<Payload>, MachineError> {
        self.spec
            .payload
            .iter()
            .enumerate()
            .map(|(i, spec)| {
                let place = format!("payload {}", i + 1);
                let link = &links[self.link(&format!("{place}: link"), &spec.link)?];
                let mass = self.payload_mass(&place, spec)?;
                let [xx, yy, zz, xy, xz, yz] = spec.inertia;
                let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                let inertia = Inertia {
                    mass: mass.kg,
                    com: spec.com.into(),
                    about_com,
                };
                inertia.check().map_err(|fault| {
                    self.value_error(place.clone(), fault.expected, fault.found)
                })?;
                let window_s = [
                    spec.from.unwrap_or(f64::NEG_INFINITY),
                    spec.to.unwrap_or(f64::INFINITY),
                ];
                if !(window_s[0] < window_s[1]) {
                    return Err(self.value_error(
                        place,
                        "from before to",
                        format!("{} and {}", window_s[0], window_s[1]),
                    ));
                }
                let inertia = inertia.transformed(&link.body_from_link);
                Ok(Payload {
                    body: link.body,
                    group: link.group,
                    mass_sigma: spec.mass_sigma,
                    is_estimated: mass.is_estimated,
                    is_by_row: mass.signal.is_some(),
                    signal: mass.signal,
                    moments: MassMoments::from(&inertia),
                    inertia,
                    window_s,
                })
            })
            .collect()
    }

    fn payload_mass(&self, place: &str, spec: &PayloadSpec) -> Result<StatedMass, MachineError> {
        let is_stated = matches!(spec.mass, PayloadMass::Known(_));
        if !is_stated && spec.inertia != [0.0; 6] {
            return Err(self.value_error(
                format!("{place}: inertia"),
                "none: a payload whose mass is estimated or logged is treated as a point mass",
                format!("{:?}", spec.inertia),
            ));
        }
        match &spec.mass {
            PayloadMass::Known(mass) => Ok(StatedMass {
                kg: *mass,
                is_estimated: false,
                signal: None,
            }),
            PayloadMass::Word(word) if word == "estimate" => Ok(StatedMass {
                kg: 0.0,
                is_estimated: true,
                signal: None,
            }),
            PayloadMass::Word(word) => {
                let expected = "a mass [kg], \"estimate\", or { signal = { topic, field } }";
                Err(self.value_error(format!("{place}: mass"), expected, format!("\"{word}\"")))
            }
            PayloadMass::Signal(mass) => {
                self.check_field(&format!("{place}: mass.signal"), &mass.signal, true)?;
                if !(mass.max_age > 0.0) {
                    let place = format!("{place}: mass.max_age");
                    return Err(self.value_error(place, "a positive time [s]", mass.max_age));
                }
                if !spec.mass_sigma.is_some_and(|sigma| sigma > 0.0) {
                    return Err(self.value_error(
                        format!("{place}: mass_sigma"),
                        "a positive standard deviation of the logged mass [kg], such as 2 % of what the scale can weigh",
                        spec.mass_sigma.map_or("none".into(), |sigma| sigma.to_string()),
                    ));
                }
                Ok(StatedMass {
                    kg: 1.0,
                    is_estimated: false,
                    signal: Some(mass.clone()),
                })
            }
        }
    }
}

/// The mass of a payload as the machine file has it.
struct StatedMass {
    /// Zero if it is to be estimated, 1 if a signal states it.
    kg: f64,
    is_estimated: bool,
    signal: Option<MassSignal>,
}

//! Validation of payloads.

use nalgebra::Matrix3;

use super::checker::Checker;
use crate::machine::spec::{PayloadMass, PayloadSpec};
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
                let (mass, is_estimated) = self.payload_mass(&place, spec)?;
                let [xx, yy, zz, xy, xz, yz] = spec.inertia;
                let about_com = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                let inertia = Inertia {
                    mass,
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
                    is_estimated,
                    moments: MassMoments::from(&inertia),
                    inertia,
                    window_s,
                })
            })
            .collect()
    }

    /// The mass as stated, or zero if it is to be estimated.
    fn payload_mass(&self, place: &str, spec: &PayloadSpec) -> Result<(f64, bool), MachineError> {
        match &spec.mass {
            PayloadMass::Known(mass) => Ok((*mass, false)),
            PayloadMass::Word(word) if word == "estimate" && spec.inertia == [0.0; 6] => {
                Ok((0.0, true))
            }
            PayloadMass::Word(word) if word == "estimate" => Err(self.value_error(
                place,
                "no inertia with mass = \"estimate\": a payload of unknown mass is treated as a point mass",
                format!("{:?}", spec.inertia),
            )),
            PayloadMass::Word(word) => Err(self.value_error(
                place,
                "a mass [kg] or \"estimate\"",
                format!("\"{word}\""),
            )),
        }
    }
}

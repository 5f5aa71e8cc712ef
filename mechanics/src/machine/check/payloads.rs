//! Validation of payloads.

use nalgebra::Matrix3;

use super::checker::Checker;
use crate::machine::spec::{MassSignal, PayloadMass, PayloadSpec};
use crate::machine::{
    ActuatedJoint, Inertia, Lift, Link, Machine, MachineError, MassMoments, Payload,
    PayloadQuantity, PayloadSignal,
};

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
                    lift: None,
                    moments: MassMoments::from(&inertia),
                    inertia,
                    window_s,
                })
            })
            .collect()
    }

    /// Adds the signals of the masses of a machine's payloads. The first linkage with a bound force that carries a payload of
    /// unknown mass weighs it.
    ///
    /// # Errors
    /// The linkage's force has no error, or weighs another payload at the same time.
    pub(super) fn add_payload_signals(&self, machine: &mut Machine) -> Result<(), MachineError> {
        let mut signals: Vec<PayloadSignal> = Vec::new();
        for index in 0..machine.payloads.len() {
            if let Some(mass) = &machine.payloads[index].signal {
                signals.push(PayloadSignal {
                    quantity: PayloadQuantity::Mass(index),
                    field: mass.signal.clone(),
                });
            }
            if machine.payloads[index].is_estimated {
                machine.payloads[index].lift = self.lift(machine, index, &mut signals);
                self.check_lift(&machine.payloads, index)?;
            }
        }
        machine.payload_signals = signals;
        Ok(())
    }

    /// Checks that a force has an error of its own, and weighs one payload only.
    fn check_lift(&self, payloads: &[Payload], index: usize) -> Result<(), MachineError> {
        let payload = &payloads[index];
        let Some(lift) = &payload.lift else {
            return Ok(());
        };
        let name = &self.spec.linkage[lift.linkage].name;
        for (key, value) in [
            ("force_sigma", lift.force_sigma),
            ("friction_share", lift.friction_share),
        ] {
            if !(value.is_finite() && value > 0.0) {
                let place = format!("linkage.{name}.{key}");
                let expected =
                    "a positive number, as its force weighs a payload (mass = \"estimate\")";
                return Err(self.value_error(place, expected, value));
            }
        }
        let [from_s, to_s] = payload.window_s;
        let shares = |of: &Payload| {
            let is_same = (of.lift.as_ref()).is_some_and(|other| other.linkage == lift.linkage);
            is_same && of.window_s[0] < to_s && from_s < of.window_s[1]
        };
        match payloads[..index].iter().position(shares) {
            None => Ok(()),
            Some(other) => Err(self.value_error(
                format!("payload {}: mass", index + 1),
                format!(
                    "a known mass or a signal, or a time (from, to) of its own: one force, of linkage {name}, tells one mass"
                ),
                format!("\"estimate\", as payload {} at the same time", other + 1),
            )),
        }
    }

    fn lift(
        &self,
        machine: &Machine,
        payload: usize,
        signals: &mut Vec<PayloadSignal>,
    ) -> Option<Lift> {
        let linkages = self.spec.linkage.iter().enumerate();
        let mut bound = linkages.map(|(linkage, spec)| (linkage, spec, self.spec.signals_of(spec)));
        let body = machine.payloads[payload].body;
        let (linkage, spec, mut fields) = bound.find(|(linkage, _, fields)| {
            let pivot = machine.linkages[*linkage].bodies.pivot;
            !fields.is_empty() && machine.is_carried_by(body, pivot)
        })?;
        let mut actuated = machine.contact.actuated_joints.iter();
        let joint = actuated.position(|joint| joint.linkage() == Some(linkage));
        if joint.is_some() {
            fields.clear();
        }
        let places = fields.into_iter().enumerate().map(|(signal, field)| {
            let quantity = PayloadQuantity::Lift { linkage, signal };
            let known = signals.iter().position(|known| known.quantity == quantity);
            known.unwrap_or_else(|| {
                let field = field.clone();
                signals.push(PayloadSignal { quantity, field });
                signals.len() - 1
            })
        });
        let coefficients = ActuatedJoint::bound_signals(self.spec, spec);
        Some(Lift {
            linkage,
            joint,
            signals: places.zip(coefficients).collect(),
            force_sigma: spec.force_sigma,
            friction_share: spec.friction_share,
        })
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

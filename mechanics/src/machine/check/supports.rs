//! Supports that come and go: when they stand on the ground, and their measured loads.

use super::checker::Checker;
use crate::machine::spec::WheelSpec;
use crate::machine::supports::TRANSITION_S;
use crate::machine::{
    ActuatedJoint, Contact, ForceSource, MAX_WHEELS, MachineError, MeasuredJoint, Presence,
    PresenceSpec, SupportId, SupportKind, Supports, Wheel,
};

impl Checker<'_> {
    /// All supports of the machine, and when each of them stands on the ground.
    pub(super) fn supports(
        &self,
        wheels: &[Wheel],
        contact: &Contact,
        joints: &[MeasuredJoint],
        optimal_load: &[f64],
    ) -> Result<Supports, MachineError> {
        let specs = self.spec.wheels.iter();
        let presence = specs.map(|(name, spec)| self.presence(name, spec));
        let transition_s = self.spec.contact.transition.unwrap_or(TRANSITION_S);
        if !(transition_s.is_finite() && transition_s >= 0.0) {
            let expected = "a time that is not negative [s]";
            return Err(self.value_error("contact.transition", expected, transition_s));
        }
        Ok(Supports {
            all: wheels.to_vec(),
            presence: presence.collect::<Result<_, _>>()?,
            switches: self.spec.support_switches(),
            transition_s,
            optimal_load: optimal_load.to_vec(),
            spins: (joints.iter())
                .map(|joint| joint.spins_wheel.map(SupportId::new))
                .collect(),
            free_joints: contact.free_joints.clone(),
            actuated_joints: contact.actuated_joints.clone(),
            roll_moment_distribution: self.roll_moment_distribution()?,
        })
    }

    fn presence(&self, name: &str, spec: &WheelSpec) -> Result<Presence, MachineError> {
        let kind = spec.origin.kind;
        let place = format!("{}.{name}", kind.table());
        let told = spec.told();
        if let Some(told) = told {
            let key = match kind {
                SupportKind::Wheel | SupportKind::TrackPoint => "raised",
                SupportKind::Foot => "set",
            };
            self.check_presence(&format!("{place}.{key}"), told)?;
        }
        if told.is_some() && !spec.raised_by.is_empty() {
            return Err(self.value_error(place, "raised or raised_by", "both"));
        }
        let names: Vec<&String> = self.spec.wheels.keys().collect();
        let raised_by = spec.raised_by.iter().map(|by| {
            let index = names.iter().position(|known| *known == by);
            let foot = |&index: &usize| {
                let wheel = &self.spec.wheels[names[index]];
                wheel.origin.kind == SupportKind::Foot
            };
            index.filter(foot).map(SupportId::new).ok_or_else(|| {
                let expected = "names of [supports]";
                self.value_error(format!("{place}.raised_by"), expected, format!("\"{by}\""))
            })
        });
        let raised_by = raised_by.collect::<Result<Vec<SupportId>, _>>()?;
        if let Some(load) = &spec.origin.force {
            self.check_field(&format!("{place}.force"), &load.field, false)?;
            for (key, value) in [
                ("force_sigma", load.sigma),
                ("friction_share", load.friction_share),
            ] {
                if !(value.is_finite() && value >= 0.0) {
                    let place = format!("{place}.{key}");
                    return Err(self.value_error(place, "a number that is not negative", value));
                }
            }
        }
        Ok(Presence {
            told: told.cloned(),
            raised_by,
            load: spec.origin.force.clone(),
        })
    }

    fn check_presence(&self, place: &str, told: &PresenceSpec) -> Result<(), MachineError> {
        match told {
            PresenceSpec::Always(_) => Ok(()),
            PresenceSpec::Spans(spans) => {
                let mut last = f64::NEG_INFINITY;
                for &[from, to] in spans {
                    if !(from < to && from >= last) {
                        let expected = "spans [from, to] in rising order that do not overlap [s]";
                        return Err(self.value_error(place, expected, format!("[{from}, {to}]")));
                    }
                    last = to;
                }
                Ok(())
            }
            PresenceSpec::Signal(switch) => {
                self.check_field(place, &switch.number, false)?;
                if !switch.above.is_finite() {
                    let place = format!("{place}.above");
                    return Err(self.value_error(place, "a finite number", switch.above));
                }
                if !(switch.max_age > 0.0) {
                    let place = format!("{place}.max_age");
                    return Err(self.value_error(place, "a positive time [s]", switch.max_age));
                }
                Ok(())
            }
        }
    }

    /// Adds the supports whose load is measured to the measured forces.
    pub(super) fn add_measured_loads(
        &self,
        joints: &mut Vec<ActuatedJoint>,
        wheels: &[Wheel],
        rows: usize,
    ) -> Result<(), MachineError> {
        for (support, (wheel, spec)) in wheels.iter().zip(self.spec.wheels.values()).enumerate() {
            let Some(load) = &spec.origin.force else {
                continue;
            };
            joints.push(ActuatedJoint {
                source: ForceSource::Support {
                    name: wheel.name.clone(),
                    support: SupportId::new(support),
                    wheel: Some(support),
                },
                steps: Vec::new(),
                signals: vec![1.0],
                force_sigma: load.sigma,
                friction_share: load.friction_share,
            });
        }
        if rows + joints.len() > MAX_WHEELS {
            let expected = format!("at most {} measured forces", MAX_WHEELS - rows);
            return Err(self.value_error("supports", expected, joints.len()));
        }
        Ok(())
    }
}

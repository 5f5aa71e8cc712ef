//! The signals that tell which supports are on the ground: each once, of however many supports it tells.

use super::spec::{MachineSpec, WheelSpec};
use super::support_id::SupportId;
use super::support_spec::{PresenceSpec, SupportKind, SwitchSpec};

/// A signal that tells whether some supports are set or raised.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportSwitch {
    /// Number that is read, and the value from which the switch is on.
    pub spec: SwitchSpec,
    /// The supports that the switch tells of, in order.
    pub supports: Vec<SupportId>,
}

impl WheelSpec {
    /// Returns the condition under which a wheel or track is raised, or another support is set; `None` if the machine file states
    /// none.
    #[must_use]
    pub fn told(&self) -> Option<&PresenceSpec> {
        match self.origin.kind {
            SupportKind::Wheel | SupportKind::TrackPoint => self.raised.as_ref(),
            SupportKind::Foot => self.origin.set.as_ref(),
        }
    }

    /// Returns that condition, to change it.
    pub fn told_mut(&mut self) -> Option<&mut PresenceSpec> {
        match self.origin.kind {
            SupportKind::Wheel | SupportKind::TrackPoint => self.raised.as_mut(),
            SupportKind::Foot => self.origin.set.as_mut(),
        }
    }
}

impl MachineSpec {
    /// The signals that tell of its supports, in the order of the first support of each.
    #[must_use]
    pub fn support_switches(&self) -> Vec<SupportSwitch> {
        let mut switches: Vec<SupportSwitch> = Vec::new();
        for (index, wheel) in self.wheels.values().enumerate() {
            let Some(PresenceSpec::Signal(spec)) = wheel.told() else {
                continue;
            };
            let support = SupportId::new(index);
            match switches.iter_mut().find(|switch| switch.spec == *spec) {
                Some(switch) => switch.supports.push(support),
                None => switches.push(SupportSwitch {
                    spec: spec.clone(),
                    supports: vec![support],
                }),
            }
        }
        switches
    }
}

//! The measured forces by which nothing is computed.

use super::checker::Checker;
use crate::machine::{ActuatedJoint, ArmForce, ForceSignal, Machine, MachineError};

impl Checker<'_> {
    /// Adds the bound forces of linkages by which nothing is computed, and their signals, both in the order of the linkages.
    pub(super) fn add_arm_forces(&self, machine: &mut Machine) -> Result<(), MachineError> {
        for (linkage, spec) in self.spec.linkage.iter().enumerate() {
            if let Some([least, greatest]) = spec.rests_within
                && !(least < greatest && (greatest - least).is_finite())
            {
                return Err(self.value_error(
                    format!("linkage.{}.rests_within", spec.name),
                    "two positions, the smaller one first",
                    format!("[{least}, {greatest}]"),
                ));
            }
            let fields = self.spec.signals_of(spec);
            if fields.is_empty() || !leaves_results(machine, linkage) {
                continue;
            }
            self.check_force_errors(spec)?;
            let first = machine.force_signals.len();
            let coefficients = ActuatedJoint::bound_signals(self.spec, spec);
            machine.arm_forces.push(ArmForce {
                linkage,
                signals: (first..).zip(coefficients).collect(),
                force_sigma: spec.force_sigma,
                friction_share: spec.friction_share,
                rests_within: spec.rests_within,
            });
            let signals = fields.into_iter().enumerate();
            (machine.force_signals).extend(signals.map(|(signal, field)| ForceSignal {
                linkage,
                signal,
                field: field.clone(),
            }));
        }
        Ok(())
    }
}

/// Whether no result rests on the force of a linkage: it carries no wheels, and no payload of unknown mass, which would be
/// determined by it or would make the force unknown.
fn leaves_results(machine: &Machine, linkage: usize) -> bool {
    let pivot = machine.linkages[linkage].bodies.pivot;
    let mut wheels = machine.wheels.iter();
    let mut payloads = machine.payloads.iter();
    !wheels.any(|wheel| machine.is_carried_by(wheel.body, pivot))
        && !payloads.any(|it| it.is_estimated && machine.is_carried_by(it.body, pivot))
}

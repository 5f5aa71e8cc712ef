//! What a log cannot have shown: the sensors whose signs and order its motion did not test.

use tipwatch_mechanics::estimation::plausibility::{Excitation, Unshown};
use tipwatch_mechanics::machine::Machine;

/// A note on what only the check at the machine finds; `None` if the motion showed everything.
#[must_use]
pub(crate) fn note(machine: &Machine, excitation: &Excitation) -> Option<String> {
    text(machine, &excitation.unshown())
}

fn text(machine: &Machine, unshown: &[Unshown]) -> Option<String> {
    let joints = unshown.iter().filter_map(|it| match it {
        Unshown::Joint(joint) => Some(machine.joints()[*joint].name.as_str()),
        Unshown::Turn | Unshown::Travel => None,
    });
    let joints: Vec<&str> = joints.collect();
    let mut parts = Vec::new();
    if !joints.is_empty() {
        parts.push(format!(
            "the encoders of {} (sign, order, standstill: alone they lean the standing platform by less than 1 mrad)",
            joints.join(", ")
        ));
    }
    if unshown.contains(&Unshown::Turn) {
        parts.push("signs about the vertical (the machine turns by less than 0.5 rad)".into());
    }
    if unshown.contains(&Unshown::Travel) {
        parts.push("the direction of travel (the machine goes less than 1 m)".into());
    }
    (!parts.is_empty()).then(|| {
        format!(
            "Not tested by the motion of this log: {}. An error there is found only by a check at the machine.",
            parts.join("; ")
        )
    })
}

//! Evidence for implausible inputs.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::machine::Policy;

use crate::events::{Event, InputFault};
use crate::page::{number, with_unit};

/// Ending of the names of orientation signals.
const ATTITUDE: &str = ".attitude";
/// Ending of the names of specific forces.
const SPECIFIC_FORCE: &str = ".specific_force";
/// Beginning of the names of joints.
const JOINTS: &str = "joint_states.";

/// Ending of the names of forces that are compared with the required ones.
const REQUIRED_FORCE: &str = " against masses and joints";

/// The fault and its size, the number of samples, and the effect on the loads.
pub(super) fn evidence(event: &Event, fault: &InputFault) -> Vec<String> {
    let limit = fault.limit.map_or(String::new(), |limit| {
        say!(" (limit {})", with_unit(limit, event.unit))
    });
    let worst = say!("up to {}{limit}", with_unit(event.worst, event.unit));
    let is_of_gravity = fault.kind == FaultKind::Disagreement && event.subject.ends_with(ATTITUDE);
    let description = match fault.kind {
        FaultKind::NotFinite => word!("NaN or infinite values").to_string(),
        FaultKind::OutOfRange => say!("Out of range: {worst}"),
        FaultKind::Saturated => say!(
            "One axis repeats {} {}, the end of its range: the true value lies beyond",
            number(event.worst),
            event.unit
        ),
        FaultKind::Outlier => say!("Single samples far from those around them: by {worst}"),
        FaultKind::JointLimit => say!("Beyond a joint limit of the URDF: {worst}"),
        FaultKind::ImpossibleRate => say!("Changes too fast: {worst}"),
        FaultKind::Frozen => say!("Frozen for {:.2} s", event.worst),
        FaultKind::NotUnit => say!("Quaternion of length {}", number(event.worst)),
        FaultKind::Disagreement if is_of_gravity => {
            say!("Attitude and specific force disagree on the direction of gravity: {worst}")
        }
        FaultKind::Contradiction => {
            let looks = (fault.explanation.as_ref()).map_or(String::new(), |explanation| {
                say!("; it looks as if {explanation}")
            });
            match event.unit {
                _ if event.subject.starts_with(JOINTS) => say!(
                    "The position jumps by {} {} and stays there: before or since then it is wrong, and which is unknown{looks}",
                    number(event.worst),
                    event.unit
                ),
                _ if event.subject.ends_with(ATTITUDE) => say!(
                    "The inclination jumps by {} {} and stays there, and the gyro did not turn: the attitude is wrong before or since \
                     then, or all that this sensor shows{looks}",
                    number(event.worst),
                    event.unit
                ),
                _ if event.subject.ends_with(SPECIFIC_FORCE) => say!(
                    "The specific force steps by {} {} and stays there, and no velocity changes as that requires: the accelerometer is \
                     wrong before or since then{looks}",
                    number(event.worst),
                    event.unit
                ),
                "-" => say!(
                    "The signals contradict each other, and which one is wrong is unknown{looks}. Logarithm of the likelihood \
                     ratio against sound sensors: {} (counts from {} on)",
                    number(event.worst),
                    fault.limit.map_or(word!("any").into(), number)
                ),
                _ if event.subject.ends_with(REQUIRED_FORCE) => say!(
                    "Measured force and the force that masses and motion require differ: {worst}. The force, a position, a mass or a \
                     load is wrong, or the arm rests on something"
                ),
                _ => say!(
                    "The signals contradict each other; which one is wrong is unknown: {worst}"
                ),
            }
        }
        FaultKind::Disagreement => {
            say!("Velocity differs from the derivative of the position: {worst}")
        }
    };
    let samples = match fault.samples {
        1 => word!("1 sample affected").to_string(),
        samples => say!("{samples} samples affected"),
    };
    let effect = match fault.policy {
        // one of the two is wrong, and loads depend on the specific force alone
        _ if is_of_gravity => word!("Loads use the specific force and are unchanged"),
        Policy::Invalid | Policy::Widen if fault.kind == FaultKind::Contradiction => {
            word!(
                "Loads are computed and doubted: they are right only if the signals that they rest on are"
            )
        }
        Policy::Invalid | Policy::Widen if fault.kind == FaultKind::Outlier => {
            word!("They were left out, and the estimate bridges them")
        }
        // whatever the policy: there is no value to use
        _ if fault.kind == FaultKind::NotFinite => {
            word!("They count as missing: the estimate bridges them up to the longest gap")
        }
        Policy::Invalid => word!("Rows that depend on it are invalid"),
        Policy::Widen => word!("Results that depend on it have a larger standard deviation"),
        Policy::Report => word!("The values were used as logged"),
    };
    vec![description, samples, effect.to_string()]
}

//! Implausible inputs in words.

use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::machine::Policy;

use crate::base::number::number;
use crate::events::{Event, InputFault};

/// How the subjects of orientations end.
const ATTITUDE: &str = ".attitude";

/// What was wrong, how much, and what became of the rows.
pub(super) fn how_bad(event: &Event, fault: &InputFault) -> String {
    let worst = format!("{} {}", number(event.worst), event.unit);
    let limit = fault.limit.map_or(String::new(), |limit| {
        format!(" (limit {} {})", number(limit), event.unit)
    });
    let samples = match fault.samples {
        1 => "1 sample".to_string(),
        samples => format!("{samples} samples"),
    };
    let is_of_gravity = fault.kind == FaultKind::Disagreement && event.subject.ends_with(ATTITUDE);
    let what = match fault.kind {
        FaultKind::NotFinite => "NaN or infinite values".to_string(),
        FaultKind::OutOfRange => format!("out of range, up to {worst}{limit}"),
        FaultKind::JointLimit => {
            format!("beyond a joint limit of the URDF, as far as {worst}{limit}")
        }
        FaultKind::ImpossibleRate => format!("changes as fast as {worst}{limit}"),
        FaultKind::Frozen => format!("frozen for {:.2} s", event.worst),
        FaultKind::NotUnit => format!("a quaternion of length {}", number(event.worst)),
        FaultKind::Disagreement if is_of_gravity => {
            format!(
                "gravity by the attitude is not what the specific force feels, up to {worst} apart{limit}"
            )
        }
        FaultKind::Disagreement => {
            format!("the rate is not the derivative of the position, up to {worst} apart{limit}")
        }
    };
    let rows = match fault.policy {
        // one of the two is wrong, and loads rest on the other alone
        _ if is_of_gravity => "loads rest on the specific force and stay as they are",
        Policy::Invalid => "what rests on it is not valid",
        Policy::Widen => "what rests on it has a wider standard deviation",
        Policy::Report => "it was used all the same",
    };
    format!("{what}; {samples}; {rows}")
}

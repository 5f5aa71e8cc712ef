//! What the loads rest on and cannot be trusted: signals that contradict each other, and joints that are not measured any more.

use tipwatch_language::{say, word};
use tipwatch_mechanics::machine::{FaultKind, Policy};

use crate::analysis::{Analysis, Undecided};
use crate::events::{Event, EventKind};
use crate::page::capital;
use crate::report::findings::input_list;

/// Most signals that are told, the first ones.
const MOST: usize = 2;
/// Beginning of the names of joints.
const JOINTS: &str = "joint_states.";

/// Tells in one sentence which signals cannot be trusted, since when, and what it looks like; `None` where all can be.
#[must_use]
pub fn doubted(analysis: &Analysis) -> Option<String> {
    // a gross input says more
    if !analysis.gross_inputs.is_empty() {
        return None;
    }
    let mut doubted: Vec<&Event> = analysis.events.iter().filter(|it| is_doubted(it)).collect();
    doubted.sort_by_key(|event| event.start_ns);
    let mut first: Vec<&Event> = Vec::new();
    for event in doubted {
        if first.iter().all(|known| known.subject != event.subject) {
            first.push(event);
        }
    }
    let told: Vec<String> = first
        .iter()
        .take(MOST)
        .map(|it| signal(analysis, it))
        .collect();
    let more = first.len() - told.len();
    let mut told = told.join("; ");
    if more > 0 {
        told += &say!("; and {more} more");
    }
    let coverage = &analysis.coverage;
    let contradicted = (coverage.doubted_s > 0.0).then_some(Undecided::Doubted {
        doubted_s: coverage.doubted_s,
        computable_s: coverage.computable_s,
    });
    match contradicted.map(|reason| capital(&reason.to_string())) {
        None if told.is_empty() => None,
        None => Some(say!("Not to be relied on: {}.", told)),
        Some(reason) if told.is_empty() => Some(format!("{reason}.")),
        Some(reason) => Some(format!("{reason}: {told}.")),
    }
}

/// Whether an event is that the loads rest on a signal that another one contradicts, or on a joint that is not measured.
fn is_doubted(event: &Event) -> bool {
    let Some(fault) = event.fault.as_ref() else {
        return false;
    };
    let is_joint = event.subject.starts_with(JOINTS) && fault.policy != Policy::Report;
    event.kind == EventKind::InputFault
        && match fault.kind {
            FaultKind::Contradiction => fault.loads_are_right.is_some() || is_joint,
            FaultKind::Frozen => is_joint,
            _ => false,
        }
}

/// A signal, since when it is doubted, and what it looks like.
fn signal(analysis: &Analysis, event: &Event) -> String {
    let fault = event.fault.as_ref();
    // signals that contradict each other have an explanation
    let looks = match fault.and_then(|fault| fault.explanation.as_ref()) {
        Some(explanation) => say!(", as if {explanation}"),
        None => word!(", which repeats one value").into(),
    };
    let signal = input_list(std::slice::from_ref(&event.subject));
    let from_s = analysis.rows.seconds_at(event.start_ns);
    match event.end_ns {
        Some(end_ns) => {
            let to_s = analysis.rows.seconds_at(end_ns);
            say!("{signal} from t = {from_s:.2} to {to_s:.2} s{looks}")
        }
        None => say!("{signal} from t = {from_s:.2} s{looks}"),
    }
}

//! Computed loads that a measured rotation contradicts.

use tipwatch_mechanics::machine::Machine;

use super::result::ExplainedFall;
use crate::events::{Event, EventKind};

/// Lowers the certainty of events by the loads that contradict a measured rotation which the machine as stated does not explain.
/// A platform that rotates about an edge stands on the wheels of that edge: where the loads lift these meanwhile, or tip the
/// machine about another edge, that is only as probable as the stated machine is right all the same.
pub(crate) fn doubt_contradicted(
    machine: &Machine,
    explained: &[ExplainedFall],
    events: &mut [Event],
) {
    for fall in explained.iter().filter(|fall| !fall.is_as_stated()) {
        let edge = fall.edge.to_lowercase();
        let is_own = |event: &&Event| {
            event.is_measured() && event.subject == edge && event.start_ns == fall.onset_ns
        };
        let Some(span_ns) = events.iter().find(is_own).map(Event::span_ns) else {
            continue;
        };
        let own = machine.edge_named(&edge).into_iter();
        let carrying: Vec<String> = own
            .flat_map(|own| {
                machine
                    .wheels()
                    .iter()
                    .zip(&machine.polygon().edges()[own].carries)
            })
            .filter(|(_, carries)| **carries)
            .map(|(wheel, _)| wheel.name.to_lowercase())
            .collect();
        let is_contradicted = |event: &Event| match event.kind {
            EventKind::WheelLight | EventKind::WheelLift => carrying.contains(&event.subject),
            EventKind::EdgeTipping | EventKind::TipOver => event.subject != edge,
            EventKind::InputGap | EventKind::InputFault | EventKind::LiftNotExcluded => false,
        };
        let loads_are_right = fall.stated().map_or(0.0, |it| it.probability);
        let contradicted = events.iter_mut().filter(|event| {
            // what measures its own load needs no machine
            let is_by_machine = event.rests_on_loads() && event.measured_load_n.is_none();
            is_by_machine && event.overlaps(span_ns) && is_contradicted(event)
        });
        for event in contradicted {
            event.doubt_by(
                vec![format!("rotation about the {edge} edge")],
                loads_are_right,
            );
        }
    }
}

//! Computed loads that a measured rotation contradicts.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::SURE_SIGMAS;

use super::result::ExplainedFall;
use crate::events::{Bound, Event, EventKind};

/// The time in which a rotation surely lasts, first and last (ns). What ended before stood on other wheels.
fn surely_rotates_ns(rotation: &Event) -> [i64; 2] {
    let [start_ns, end_ns] = rotation.span_ns();
    let margin_s = SURE_SIGMAS * rotation.start_sigma_s.unwrap_or(0.0);
    [start_ns.saturating_add((margin_s * 1e9) as i64), end_ns]
}

/// Lowers the certainty of events by the loads that contradict a measured rotation which the machine as stated does not explain.
/// A platform that rotates about an edge stands on the wheels of that edge: where the loads lift these meanwhile, or tip the
/// machine about another edge, that is only as probable as the stated machine is right all the same.
///
/// A load that nobody stated takes from the wheels off the edge what the stated machine still gives them: they left the ground
/// when their computed loads show it, or earlier.
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
        let Some(rotation) = events.iter().find(is_own) else {
            continue;
        };
        let span_ns = surely_rotates_ns(rotation);
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
        if !fall.has_unstated_load() {
            continue;
        }
        // the last wheel off the edge, which the rotation itself dates, left with it
        let is_dated_by_loads = |event: &Event| {
            matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift)
                && !carrying.contains(&event.subject)
                && event.rests_on_loads()
                && event.measured_load_n.is_none()
                && event.start_bound == Bound::At
                && event.start_ns != fall.onset_ns
        };
        let dated = events.iter_mut();
        for event in dated.filter(|it| it.overlaps(span_ns) && is_dated_by_loads(it)) {
            event.start_bound = Bound::AtOrBefore;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ends_within_the_error_of_an_onset_is_before_the_rotation() {
        let rotation = Event {
            start_sigma_s: Some(0.2),
            end_ns: Some(9_000_000_000),
            ..Event::blank(EventKind::EdgeTipping, 2_600_000_000, "left".into())
        };
        let lift = |end_ns| Event {
            end_ns: Some(end_ns),
            ..Event::blank(EventKind::WheelLift, 2_300_000_000, "fl".into())
        };
        let span_ns = surely_rotates_ns(&rotation);
        assert_eq!(span_ns, [3_000_000_000, 9_000_000_000]);
        assert!(!lift(2_700_000_000).overlaps(span_ns));
        assert!(lift(3_100_000_000).overlaps(span_ns));
    }
}

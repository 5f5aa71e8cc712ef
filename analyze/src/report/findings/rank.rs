//! Which events come first.

use crate::events::{Event, EventKind};

/// The smaller, the more important.
pub(in crate::report) fn rank(kind: EventKind) -> usize {
    match kind {
        EventKind::TipOver => 0,
        EventKind::EdgeTipping => 1,
        EventKind::WheelLift => 2,
        EventKind::WheelLight => 3,
        EventKind::LiftNotExcluded => 4,
        EventKind::InputGap => 5,
        EventKind::InputFault => 6,
    }
}

/// The order of events where only the first are shown: facts first, the gravest, the earliest.
pub(in crate::report) fn importance(event: &Event) -> (bool, usize, i64) {
    (!event.is_fact(), rank(event.kind), event.start_ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fact_comes_before_a_graver_event_that_is_none() {
        let event = |kind, start_ns, certainty| Event {
            certainty,
            ..Event::blank(kind, start_ns, "fl".into())
        };
        let mut events = [
            event(EventKind::TipOver, 1, Some(0.3)),
            event(EventKind::WheelLight, 2, None),
            event(EventKind::WheelLift, 4, Some(0.9)),
            event(EventKind::WheelLift, 3, Some(0.6)),
        ];
        events.sort_by_key(importance);
        assert_eq!(events.map(|event| event.start_ns), [3, 4, 2, 1]);
    }

    #[test]
    fn the_worst_kind_comes_first() {
        use EventKind::{EdgeTipping, InputGap, TipOver, WheelLift, WheelLight};
        let mut kinds = [InputGap, WheelLight, TipOver, WheelLift, EdgeTipping];
        kinds.sort_by_key(|&kind| rank(kind));
        assert_eq!(
            kinds,
            [TipOver, EdgeTipping, WheelLift, WheelLight, InputGap]
        );
    }
}

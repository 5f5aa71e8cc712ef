//! The events of a summary: by kind, the worst of each in full.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::events::Event;

/// The events of a kind.
#[derive(Debug, Serialize, JsonSchema)]
pub struct EventGroup<'a> {
    count: usize,
    /// The lowest load, the largest moment, rotation or duration, or the fault of most samples; the first of several.
    worst: EventSummary<'a>,
}

/// An event, and its start on the clock of the rows.
#[derive(Debug, Serialize, JsonSchema)]
struct EventSummary<'a> {
    /// Start since the first row.
    start_s: f64,
    #[serde(flatten)]
    event: &'a Event,
}

/// Groups the events by the name of their kind; `first_ns` is the time of the first row.
pub(super) fn groups(events: &[Event], first_ns: i64) -> BTreeMap<&'static str, EventGroup<'_>> {
    let mut found: BTreeMap<&'static str, (usize, &Event)> = BTreeMap::new();
    for event in events {
        let (count, worst) = found.entry(event.kind.name()).or_insert((0, event));
        *count += 1;
        if event.severity() > worst.severity() {
            *worst = event;
        }
    }
    let mut groups = BTreeMap::new();
    for (kind, (count, event)) in found {
        let worst = EventSummary {
            start_s: (event.start_ns - first_ns) as f64 * 1e-9,
            event,
        };
        groups.insert(kind, EventGroup { count, worst });
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::EventKind;

    #[test]
    fn of_each_kind_the_worst_is_shown() {
        let event = |kind: EventKind, worst: f64| Event {
            worst,
            ..Event::blank(kind, worst as i64, "fl".into())
        };
        let events = [
            event(EventKind::WheelLight, 300.0),
            event(EventKind::WheelLight, 100.0),
            event(EventKind::WheelLight, f64::NAN),
            event(EventKind::TipOver, 0.3),
            event(EventKind::TipOver, 0.5),
        ];
        let found = groups(&events, 0);
        let shown: Vec<_> = (found.iter())
            .map(|(kind, group)| (*kind, group.count, group.worst.event.worst))
            .collect();
        assert_eq!(shown, [("tip_over", 2, 0.5), ("wheel_light", 3, 100.0)]);
    }
}

//! The events of a summary: by kind, the worst of each in full.

use std::collections::BTreeMap;

use super::document::{EventGroup, EventSummary, FaultSummary, RotationSummary};
use crate::events::{Event, MeasuredRotation, ShownBy};

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
    let group = |(kind, (count, worst))| {
        let worst = summary(worst, first_ns);
        (kind, EventGroup { count, worst })
    };
    found.into_iter().map(group).collect()
}

fn summary(event: &Event, first_ns: i64) -> EventSummary<'_> {
    EventSummary {
        kind: event.kind.name(),
        subject: &event.subject,
        start_ns: event.start_ns,
        end_ns: event.end_ns,
        start_s: (event.start_ns - first_ns) as f64 * 1e-9,
        start_sigma_s: event.start_sigma_s,
        start_bound: event.start_bound.name(),
        end_bound: event.end_bound.name(),
        worst: event.worst,
        unit: event.unit,
        worst_ns: event.worst_ns,
        lead_s: event.lead_s,
        certainty: event.certainty,
        certainty_any_split: event.certainty_any_split,
        split_dependent: event.split_dependent,
        split_flips_at: event.split_flips_at,
        load_range_n: event.load_range_n,
        judged_ns: event.judged_ns,
        any_split_ns: event.any_split_ns,
        rotation_rad: event.rotation_rad,
        shown_by: event.shown_by.map(ShownBy::name),
        measured_rotation: event.measured_rotation.as_ref().map(rotation),
        causes: event.causes.as_ref(),
        counterfactuals: &event.counterfactuals,
        fault: event.fault.as_ref().map(|fault| FaultSummary {
            kind: fault.kind.name(),
            policy: fault.policy.name(),
            limit: fault.limit,
            samples: fault.samples,
            explanation: fault.explanation.as_deref(),
            loads_are_right: fault.loads_are_right,
        }),
        doubt: event.doubt.as_ref(),
    }
}

fn rotation(measured: &MeasuredRotation) -> RotationSummary {
    let no_return = measured.no_return;
    RotationSummary {
        shown_by: measured.witness.name(),
        sigma_rad: measured.sigma_rad,
        onset_in_log: measured.onset_in_log,
        ten_degrees_ns: measured.ten_degrees_ns,
        no_return_rad: no_return.map(|it| it.rotation_rad),
        no_return_sigma_rad: no_return.and_then(|it| it.sigma_rad),
        no_return_ns: no_return.and_then(|it| it.at_ns),
        at_rest_ns: measured.at_rest_ns,
    }
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
            .map(|(kind, group)| (*kind, group.count, group.worst.worst))
            .collect();
        assert_eq!(shown, [("tip_over", 2, 0.5), ("wheel_light", 3, 100.0)]);
    }
}

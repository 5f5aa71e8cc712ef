//! Events that are one story: a wheel grows light, lifts, and the machine tips; or several wheels at once.

use crate::events::{Event, EventCauses, EventKind};

/// Events this close in time are one incident (ns).
const MERGED_NS: i64 = 500_000_000;
/// Steps of a kind that begin and end this close in time are told as one (ns).
const SAME_NS: i64 = 50_000_000;

/// Events of the machine that overlap in time, or nearly.
#[derive(Debug, Clone)]
pub(in crate::report) struct Incident<'a> {
    /// In order of their start.
    pub(in crate::report) events: Vec<&'a Event>,
}

/// The incidents of a log: those that are facts first, the gravest before others, of equal ones the earliest. What the report
/// names as what happened is the first of them.
pub(in crate::report) fn incidents(events: &[Event]) -> Vec<Incident<'_>> {
    let mut observed: Vec<&Event> = events.iter().filter(|it| it.kind.is_observed()).collect();
    observed.sort_by_key(|event| (event.start_ns, event.kind.rank()));
    let mut found: Vec<Incident<'_>> = Vec::new();
    let mut end_ns = i64::MIN;
    for event in observed {
        let ends_ns = event.end_ns.unwrap_or(i64::MAX);
        match found.last_mut() {
            Some(incident) if event.start_ns <= end_ns.saturating_add(MERGED_NS) => {
                incident.events.push(event);
                end_ns = end_ns.max(ends_ns);
            }
            _ => {
                found.push(Incident {
                    events: vec![event],
                });
                end_ns = ends_ns;
            }
        }
    }
    found.sort_by_key(|incident| {
        let gravest = incident.gravest();
        (!gravest.is_fact(), gravest.kind.rank(), incident.start_ns())
    });
    found
}

/// The graver event that one became: a light wheel lifts, a tipping goes on to the side. It tells the story of both.
pub(in crate::report) fn led_to<'a>(events: &'a [Event], event: &Event) -> Option<&'a Event> {
    let graver = match event.kind {
        EventKind::WheelLight => EventKind::WheelLift,
        EventKind::EdgeTipping => EventKind::TipOver,
        _ => return None,
    };
    events.iter().find(|other| {
        other.kind == graver
            && other.subject == event.subject
            && other.is_fact()
            && other.overlaps(event.span_ns())
    })
}

impl<'a> Incident<'a> {
    /// The event that the incident is named after: the gravest that is a fact, or of all if none is.
    pub(in crate::report) fn gravest(&self) -> &'a Event {
        match self.events.iter().min_by_key(|event| event.importance()) {
            Some(event) => event,
            None => unreachable!("an incident has an event"),
        }
    }

    /// The gravest event, facts first, of which it was asked whether it would have happened otherwise.
    pub(in crate::report) fn asked(&self) -> Option<&'a Event> {
        let events = self.events.iter().copied();
        let asked =
            events.filter(|event| !event.counterfactuals.is_empty() && self.is_of_gravest(event));
        asked.min_by_key(|event| event.importance())
    }

    /// Whether an event goes on until the gravest begins, or nearly: one that was over before is another story.
    fn is_of_gravest(&self, event: &Event) -> bool {
        let is_over = |end_ns: i64| end_ns.saturating_add(MERGED_NS) < self.gravest().start_ns;
        !event.end_ns.is_some_and(is_over)
    }

    /// Whether the gravest event, or one that goes on until it begins, has causes.
    pub(in crate::report) fn has_causes(&self) -> bool {
        let mut events = self.events.iter();
        events.any(|event| event.causes.is_some() && self.is_of_gravest(event))
    }

    pub(in crate::report) fn start_ns(&self) -> i64 {
        self.events.first().map_or(i64::MIN, |event| event.start_ns)
    }

    /// The events like the gravest, in order of their start.
    pub(in crate::report) fn like_the_gravest(&self) -> impl Iterator<Item = &'a Event> {
        let (kind, is_stated) = (self.gravest().kind, self.gravest().is_fact());
        let alike = move |event: &&Event| event.kind == kind && event.is_fact() == is_stated;
        self.events.iter().copied().filter(alike)
    }

    /// Returns the steps of the incident: the facts in order of their start, of each wheel or edge once for each kind. A tip-over
    /// is an edge tipping that went on, so that tipping is no step of its own.
    pub(in crate::report) fn steps(&self) -> Vec<&'a Event> {
        let facts = || self.events.iter().copied().filter(|event| event.is_fact());
        let went_on = |event: &Event| {
            let is_its_end =
                |other: &Event| other.kind == EventKind::TipOver && other.subject == event.subject;
            event.kind == EventKind::EdgeTipping && facts().any(is_its_end)
        };
        let mut steps: Vec<&Event> = Vec::new();
        for event in facts().filter(|event| !went_on(event)) {
            let is_same = |step: &&Event| step.kind == event.kind && step.subject == event.subject;
            if !steps.iter().any(is_same) {
                steps.push(event);
            }
        }
        steps
    }

    /// The steps, those together that differ in the wheel alone. A wheel that lifts is light from then on: where it was not light
    /// before, that is no step of its own.
    pub(in crate::report) fn joined_steps(&self) -> Vec<Vec<&'a Event>> {
        let steps = self.steps();
        let lifts_with = |light: &Event| {
            let mut lifts = steps
                .iter()
                .filter(|step| step.kind == EventKind::WheelLift);
            light.kind == EventKind::WheelLight
                && lifts.any(|lift| {
                    let since_ns = light.start_ns.saturating_sub(lift.start_ns);
                    lift.subject == light.subject && since_ns >= -SAME_NS
                })
        };
        let mut joined: Vec<Vec<&Event>> = Vec::new();
        for &step in steps.iter().filter(|step| !lifts_with(step)) {
            match joined.iter_mut().find(|group| is_alike(group[0], step)) {
                Some(group) => group.push(step),
                None => joined.push(vec![step]),
            }
        }
        joined
    }

    /// The first event of a kind that is a fact.
    pub(in crate::report) fn first(&self, kind: EventKind) -> Option<&'a Event> {
        let of_kind = |event: &&&Event| event.kind == kind && event.is_fact();
        self.events.iter().find(of_kind).copied()
    }

    /// The event with causes of a loss of load that leads here: that of the gravest, else of the next.
    pub(in crate::report) fn with_causes(&self) -> Option<&'a Event> {
        let lost = |event: &&&Event| {
            event.causes.as_ref().is_some_and(EventCauses::is_loss) && self.is_of_gravest(event)
        };
        let known = self.events.iter().filter(lost);
        known.min_by_key(|event| event.importance()).copied()
    }
}

/// Whether two steps differ in the wheel alone, within the uncertainty of their times.
fn is_alike(one: &Event, other: &Event) -> bool {
    let is_of_wheels = matches!(one.kind, EventKind::WheelLight | EventKind::WheelLift);
    let ends_alike = match (one.end_ns, other.end_ns) {
        (Some(one_ns), Some(other_ns)) => one_ns.abs_diff(other_ns) <= SAME_NS as u64,
        (one_ns, other_ns) => one_ns == other_ns,
    };
    is_of_wheels
        && one.kind == other.kind
        && [one.start_bound, one.end_bound] == [other.start_bound, other.end_bound]
        && one.start_ns.abs_diff(other.start_ns) <= SAME_NS as u64
        && ends_alike
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{Counterfactual, Reply, Supposition};

    fn event(kind: EventKind, subject: &str, span_s: [i64; 2]) -> Event {
        Event {
            end_ns: Some(span_s[1] * 1_000_000_000),
            ..Event::blank(kind, span_s[0] * 1_000_000_000, subject.into())
        }
    }

    #[test]
    fn light_lift_and_tip_are_one_story_and_a_later_one_is_another() {
        let events = [
            event(EventKind::TipOver, "left", [4, 9]),
            event(EventKind::WheelLight, "rl", [20, 21]),
            event(EventKind::WheelLift, "fr", [3, 9]),
            event(EventKind::WheelLight, "fr", [2, 9]),
            event(EventKind::InputGap, "imu", [2, 3]),
        ];
        let found = incidents(&events);
        let kinds = |incident: &Incident<'_>| -> Vec<EventKind> {
            incident.events.iter().map(|event| event.kind).collect()
        };
        assert_eq!(found.len(), 2);
        assert_eq!(
            kinds(&found[0]),
            [
                EventKind::WheelLight,
                EventKind::WheelLift,
                EventKind::TipOver
            ]
        );
        assert_eq!(found[0].gravest().kind, EventKind::TipOver);
        assert_eq!(kinds(&found[1]), [EventKind::WheelLight]);
    }

    #[test]
    fn a_fall_is_one_step_and_not_the_tipping_that_it_began_as_too() {
        let events = [
            event(EventKind::EdgeTipping, "left", [3, 9]),
            event(EventKind::TipOver, "left", [3, 9]),
            event(EventKind::EdgeTipping, "front", [4, 5]),
            event(EventKind::WheelLift, "fr", [5, 6]),
            event(EventKind::WheelLift, "fr", [7, 8]),
        ];
        let found = incidents(&events);
        let steps = found[0].steps();
        let steps: Vec<_> = steps
            .iter()
            .map(|step| (step.kind, step.subject.as_str()))
            .collect();
        let expected = [
            (EventKind::TipOver, "left"),
            (EventKind::EdgeTipping, "front"),
            (EventKind::WheelLift, "fr"),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn an_event_that_becomes_a_graver_one_is_no_story_of_its_own() {
        let events = [
            event(EventKind::WheelLight, "fr", [2, 9]),
            event(EventKind::WheelLift, "fr", [3, 9]),
            event(EventKind::EdgeTipping, "left", [4, 9]),
            event(EventKind::TipOver, "left", [4, 9]),
            event(EventKind::WheelLight, "rr", [2, 9]),
            event(EventKind::WheelLight, "fr", [20, 21]),
        ];
        let became = |place: usize| led_to(&events, &events[place]).map(|event| event.kind);
        assert_eq!(became(0), Some(EventKind::WheelLift));
        assert_eq!(became(2), Some(EventKind::TipOver));
        assert!(
            [1, 3, 4, 5]
                .into_iter()
                .all(|place| became(place).is_none())
        );
    }

    #[test]
    fn steps_that_differ_in_the_wheel_alone_are_joined() {
        let events = [
            event(EventKind::WheelLight, "rr", [2, 9]),
            event(EventKind::WheelLift, "fr", [3, 9]),
            event(EventKind::WheelLight, "fr", [3, 9]),
            event(EventKind::WheelLift, "rr", [3, 9]),
            event(EventKind::TipOver, "right", [3, 9]),
        ];
        let found = incidents(&events);
        let joined = found[0].joined_steps();
        let joined: Vec<Vec<_>> = (joined.iter())
            .map(|group| group.iter().map(|e| (e.kind, e.subject.as_str())).collect())
            .collect();
        // a wheel that is light only because it lifts is no step of its own
        let expected = [
            vec![(EventKind::WheelLight, "rr")],
            vec![(EventKind::TipOver, "right")],
            vec![(EventKind::WheelLift, "fr"), (EventKind::WheelLift, "rr")],
        ];
        assert_eq!(joined, expected);
    }

    #[test]
    fn what_is_less_likely_than_not_names_no_incident() {
        let events = [
            event(EventKind::WheelLight, "fr", [2, 9]),
            Event {
                certainty: Some(0.3),
                ..event(EventKind::WheelLift, "fr", [3, 4])
            },
        ];
        let found = incidents(&events);
        assert_eq!(found[0].gravest().kind, EventKind::WheelLight);
        assert!(found[0].first(EventKind::WheelLift).is_none());
        assert_eq!(
            incidents(&events[1..])[0].gravest().kind,
            EventKind::WheelLift
        );
    }

    #[test]
    fn what_is_asked_about_is_what_is_told() {
        let asked = |certainty: f64| {
            let counterfactuals = vec![Counterfactual {
                supposed: Supposition::LevelGround,
                posture_ns: None,
                base_rests: true,
                reply: Reply::default(),
            }];
            let [mut tipping, mut lift] = [
                event(EventKind::EdgeTipping, "left", [2, 3]),
                event(EventKind::WheelLift, "fr", [2, 3]),
            ];
            tipping.certainty = Some(certainty);
            tipping.counterfactuals.clone_from(&counterfactuals);
            lift.counterfactuals = counterfactuals;
            let events = [tipping, lift];
            let found = incidents(&events);
            let asked = found[0].asked().map(|event| event.kind);
            assert_eq!(asked, Some(found[0].gravest().kind));
            asked
        };
        assert_eq!(asked(0.3), Some(EventKind::WheelLift));
        assert_eq!(asked(0.9), Some(EventKind::EdgeTipping));
    }

    #[test]
    fn what_was_over_before_the_fall_does_not_tell_its_causes() {
        let causes = || {
            Some(EventCauses {
                since_ns: 0,
                since_is_steady: true,
                at_ns: 0,
                otf_before_n: 100.0,
                otf_n: 0.0,
                shares: Vec::new(),
            })
        };
        let mut events = [
            event(EventKind::WheelLight, "fl", [1, 9]),
            event(EventKind::EdgeTipping, "right", [2, 3]),
            event(EventKind::TipOver, "right", [6, 9]),
        ];
        events[1].causes = causes();
        events[1].counterfactuals = vec![Counterfactual {
            supposed: Supposition::LevelGround,
            posture_ns: None,
            base_rests: true,
            reply: Reply::default(),
        }];
        let found = incidents(&events);
        assert_eq!(found.len(), 1);
        assert!(found[0].with_causes().is_none());
        assert!(found[0].asked().is_none());
        assert!(!found[0].has_causes());
        events[0].causes = causes();
        let found = incidents(&events);
        assert!(found[0].has_causes());
        let kind = found[0].with_causes().map(|event| event.kind);
        assert_eq!(kind, Some(EventKind::WheelLight));
    }

    #[test]
    fn an_incident_that_is_a_fact_comes_before_a_graver_one_that_is_none() {
        let events = [
            Event {
                certainty: Some(0.3),
                ..event(EventKind::EdgeTipping, "left", [2, 3])
            },
            event(EventKind::WheelLift, "fr", [20, 21]),
        ];
        let kinds: Vec<EventKind> = incidents(&events)
            .iter()
            .map(|incident| incident.gravest().kind)
            .collect();
        assert_eq!(kinds, [EventKind::WheelLift, EventKind::EdgeTipping]);
    }
}

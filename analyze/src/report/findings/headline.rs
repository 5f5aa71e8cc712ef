//! First lines of findings about an incident or an event.

use tipwatch_language::{is_english, say, word};

use super::enumerated;
use super::incident::Incident;
use super::scene::Scene;
use crate::events::{Bound, Event, EventKind, EventTimes, Finding};
use crate::page::{number, probability};

/// Below this confidence under any split, a finding is not shown without knowing the split.
const LEAST_CONFIDENCE: f64 = 0.5;
/// Most wheels or edges of an incident that are told one by one.
const MOST_NAMED: usize = 4;
/// Most steps of an incident's course.
const MOST_STEPS: usize = 8;

impl Scene {
    /// One finding for all events of an incident.
    pub(super) fn of_incident(&self, incident: &Incident<'_>) -> Finding {
        let gravest = incident.gravest();
        let alike: Vec<&Event> = incident.like_the_gravest().collect();
        let mut evidence: Vec<String> = Vec::new();
        if incident.events.len() > 1 {
            evidence.extend(self.course(incident));
        }
        evidence.extend(self.evidence(gravest));
        let mut of_stated = incident.events.iter();
        let of_stated = of_stated.find_map(|event| self.of_stated_machine(event));
        evidence
            .extend(of_stated.map(|text| say!("Times and loads of {}: {text}", self.word.many)));
        let others = alike
            .iter()
            .filter(|event| event.subject != gravest.subject);
        let others = others.take(MOST_NAMED);
        evidence
            .extend(others.map(|event| format!("{}: {}", self.subject(event), self.worst(event))));
        if gravest.causes.is_none()
            && let Some((event, causes)) = incident
                .with_causes()
                .and_then(|event| Some((event, event.causes.as_ref()?)))
        {
            evidence.extend(self.causes(event, causes));
        }
        evidence.extend(self.not_facts(incident));
        Finding {
            headline: self.headline(gravest, &alike),
            evidence,
        }
    }

    /// Returns the finding about a single event.
    pub(super) fn finding(&self, event: &Event) -> Finding {
        Finding {
            headline: self.headline(event, &[event]),
            evidence: self.evidence(event),
        }
    }

    fn headline(&self, gravest: &Event, alike: &[&Event]) -> String {
        let confidence = match self.confidence(alike) {
            Some(confidence) if gravest.is_fact() => say!(" (confidence {})", confidence),
            _ => String::new(),
        };
        let [under, any] = self.split_clauses(gravest);
        let statement = format!(
            "{} {}{confidence}{under}{any}",
            self.statement(gravest, alike),
            self.when(gravest, alike)
        );
        match gravest.certainty.filter(|_| !gravest.is_fact()) {
            Some(certainty) => say!(
                "Less likely than not (probability {}): {}",
                probability(certainty),
                match is_english() {
                    true => statement[..1].to_lowercase() + &statement[1..],
                    false => statement,
                }
            ),
            None => statement,
        }
    }

    /// The confidence in the first event of each wheel or edge that has one, each by its name where they differ.
    pub(super) fn confidence(&self, alike: &[&Event]) -> Option<String> {
        let mut told: Vec<(String, String)> = Vec::new();
        for event in alike {
            let subject = self.subject(event);
            if let Some(certainty) = event.certainty
                && told.iter().all(|(known, _)| *known != subject)
            {
                told.push((subject, probability(certainty)));
            }
        }
        let (_, first) = told.first()?;
        if told.iter().all(|(_, confidence)| confidence == first) {
            return Some(first.clone());
        }
        let each = told.iter();
        let each = each.map(|(subject, confidence)| format!("{subject} {confidence}"));
        Some(each.collect::<Vec<_>>().join(", "))
    }

    /// Start and duration of the gravest event, the first of several alike.
    fn when(&self, gravest: &Event, alike: &[&Event]) -> String {
        let times = self.times();
        let start = times.start(gravest);
        let of_subject = alike
            .iter()
            .filter(|it| it.subject == gravest.subject)
            .count();
        match of_subject {
            1 if alike.len() == 1 => times.told(gravest),
            1 => say!("from {start}, when {} began", self.subject(gravest)),
            times => say!(
                "{times} times, first from {start} {}",
                self.times().lasting(gravest)
            ),
        }
    }

    /// Returns the wording of the times of the log's events.
    fn times(&self) -> EventTimes {
        EventTimes {
            zero_ns: self.start_ns,
            is_sparse: self.is_sparse,
            goes_on: self.goes_on,
        }
    }

    /// The onset of an event with its band, and whether it may have been earlier.
    pub(in crate::report) fn start(&self, event: &Event) -> String {
        self.times().start(event)
    }

    /// A time of the end of an event with its band.
    pub(in crate::report) fn end(&self, event: &Event, end_ns: i64) -> String {
        self.times().end(event, end_ns)
    }

    /// The events of an incident in order of time, each wheel or edge once for each kind.
    fn course(&self, incident: &Incident<'_>) -> Option<String> {
        let told = incident.joined_steps();
        let mut steps = Vec::new();
        for group in told.iter().take(MOST_STEPS) {
            let event = group[0];
            let end = match event.end_ns {
                Some(end_ns) if end_ns > event.start_ns => {
                    let later = match event.end_bound {
                        Bound::At | Bound::AtOrBefore => "",
                        Bound::AtOrAfter => word!(" or later"),
                    };
                    say!(" to {}{later}", self.end(event, end_ns))
                }
                _ => String::new(),
            };
            steps.push(say!(
                "{} from {}{end}",
                self.joined_step(group),
                self.start(event)
            ));
        }
        let more = told.len().saturating_sub(MOST_STEPS);
        if more > 0 {
            steps.push(say!("and {more} more"));
        }
        (!steps.is_empty()).then(|| say!("Course: {}", steps.join("; ")))
    }

    /// Events that differ in the wheel alone as one step of their incident's course.
    pub(in crate::report) fn joined_step(&self, group: &[&Event]) -> String {
        let subjects = enumerated(&self.subjects_of(group));
        let named = format!("{} {subjects}", self.word_of(group).many);
        match group {
            [only] => self.step(only),
            [first, ..] if first.kind == EventKind::WheelLight => say!("{} light", named),
            _ => say!("{} off the ground", named),
        }
    }

    /// An event as a step of its incident's course.
    pub(in crate::report) fn step(&self, event: &Event) -> String {
        let subject = self.subject(event);
        match event.kind {
            EventKind::WheelLight => say!("{} light", self.support(event)),
            EventKind::WheelLift => say!("{} off the ground", self.support(event)),
            EventKind::EdgeTipping => say!("tipping about the {subject} edge"),
            EventKind::TipOver => say!("tipping over about the {subject} edge"),
            EventKind::LiftNotExcluded | EventKind::InputGap | EventKind::InputFault => {
                self.kind(event)
            }
        }
    }

    /// Describes graver events that the incident could include, but less likely than not; `None` without any.
    fn not_facts(&self, incident: &Incident<'_>) -> Option<String> {
        let gravest = incident.gravest();
        let unlikely = incident.events.iter();
        let unlikely = unlikely.filter(|event| gravest.is_fact() && !event.is_fact());
        let graver = unlikely.filter(|event| event.kind.rank() <= gravest.kind.rank());
        let texts = graver.take(MOST_NAMED).map(|event| {
            let chance = event.certainty.map_or(word!("unknown").into(), probability);
            say!("{} from {} ({chance})", self.step(event), self.start(event))
        });
        let texts: Vec<String> = texts.collect();
        (!texts.is_empty()).then(|| say!("Less likely than not: {}", texts.join("; ")))
    }

    /// Returns the note that an event by loads rests on the machine as stated, where that machine does not explain how the
    /// platform turned. A lift that begins with the rotation is shown by the rotation.
    pub(in crate::report) fn of_stated_machine(&self, event: &Event) -> Option<&'static str> {
        let is_by_loads = matches!(event.kind, EventKind::WheelLight | EventKind::WheelLift);
        let is_by_loads = is_by_loads && !self.unexplained_ns.contains(&event.start_ns);
        (is_by_loads && !self.unexplained_ns.is_empty())
            .then(|| word!("by the machine as stated, which does not explain the fall"))
    }

    /// The assumption about the split that an event rests on, all of it or its beginning.
    pub(in crate::report) fn condition(&self, event: &Event) -> Option<String> {
        let rests_on_it = event.any_split_ns.is_some() || event.split_dependent == Some(true);
        (rests_on_it && !self.is_split_stated).then(|| say!("if {}", self.split_rule))
    }

    /// The assumption about the split that a finding rests on, and what holds without it.
    pub(in crate::report) fn split_clauses(&self, event: &Event) -> [String; 2] {
        let Some(condition) = self.condition(event) else {
            return [String::new(), String::new()];
        };
        let under = format!(", {condition}");
        if let Some(any_split_ns) = event.any_split_ns {
            let since_s = self.seconds(any_split_ns);
            return [
                under,
                say!("; from t = {since_s:.2} s on however the {}", self.sharing),
            ];
        }
        let range = (event.load_range_n).map_or(String::new(), |[least_n, largest_n]| {
            say!(" ({} to {} N)", number(least_n), number(largest_n))
        });
        let without = match event.certainty_any_split.filter(|&p| p >= LEAST_CONFIDENCE) {
            Some(certainty) => say!(
                "; confidence {} however the {}{range}",
                probability(certainty),
                self.sharing
            ),
            None => say!(
                "; it cannot be shown without knowing how the {}{range}",
                self.sharing
            ),
        };
        [under, without]
    }

    /// Describes the assumptions on which a confidence rests besides the stated uncertainties.
    pub(in crate::report) fn split_in_certainty(&self, event: &Event) -> String {
        if self.is_split_stated || event.split_dependent != Some(true) {
            return String::new();
        }
        let without = match event.certainty_any_split.filter(|&p| p >= LEAST_CONFIDENCE) {
            Some(certainty) => say!("{} however the {}", probability(certainty), self.sharing),
            None => say!(
                "it cannot be shown without knowing how the {}",
                self.sharing
            ),
        };
        say!(", if {}; {without}", self.split_rule)
    }

    fn statement(&self, event: &Event, alike: &[&Event]) -> String {
        let subjects = self.subjects_of(alike);
        let word = self.word_of(alike);
        let (wheels, edges) = match subjects.len() {
            1 => (word.head, word!("edge")),
            _ => (word.heads, word!("edges")),
        };
        let subject = enumerated(&subjects);
        match event.kind {
            EventKind::TipOver => say!("The machine tipped over about the {subject} {edges}"),
            EventKind::EdgeTipping if event.is_undecided() && self.goes_on => {
                say!("The machine was tipping about the {subject} {edges} at the last row,")
            }
            EventKind::EdgeTipping if event.is_undecided() => {
                say!("The machine was tipping about the {subject} {edges} when the log ended,")
            }
            EventKind::EdgeTipping => {
                say!("The machine was tipping about the {subject} {edges}")
            }
            EventKind::WheelLift if subjects.len() > 1 => {
                say!("{wheels} {subject} were off the ground")
            }
            EventKind::WheelLift => say!("{wheels} {subject} was off the ground"),
            EventKind::WheelLight if subjects.len() > 1 => {
                say!("{wheels} {subject} were below their load limits")
            }
            EventKind::WheelLight => say!("{wheels} {subject} was below its load limit"),
            EventKind::LiftNotExcluded => {
                say!(
                    "Between rows, a lift of {} {subject} cannot be excluded",
                    word.one
                )
            }
            EventKind::InputGap => say!("Input {subject} had no data"),
            EventKind::InputFault => say!("Input {subject} was implausible"),
        }
    }

    /// The wheels or edges of some events, each once.
    pub(in crate::report) fn subjects_of(&self, events: &[&Event]) -> Vec<String> {
        let mut subjects: Vec<String> = Vec::new();
        for event in events {
            let subject = self.subject(event);
            if !subjects.contains(&subject) {
                subjects.push(subject);
            }
        }
        subjects
    }
}

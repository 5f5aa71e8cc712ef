//! Judges a log by the rules of a policy.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use tipwatch_language::say;
use tipwatch_mechanics::machine::EDGES_OF_FOUR;

use super::LEAST_OF_A_FACT;
use super::facts::{EventFacts, LogFacts, OpenFall, WheelFacts};
use super::rules::{Check, Events, Policy, Rule, WhenUnknown};
use crate::analysis::Undecided;
use crate::events::EventKind;
use crate::events::support_words::edge_word;

/// The judgement of a log: `policy.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// The policy's name.
    pub policy: String,
    /// SHA-256 of its file; `None` for `--fail-on`.
    pub policy_sha256: Option<String>,
    /// Whether the log satisfies every rule.
    pub passed: bool,
    /// Reason why the log, or a rule, decides nothing; `None` if all decide.
    pub undecided: Option<String>,
    /// Outcome of each rule.
    pub rules: Vec<RuleOutcome>,
}

/// The outcome of a rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RuleOutcome {
    /// Name of the rule.
    pub rule: String,
    /// Whether the rule is satisfied.
    pub passed: bool,
    /// Whether the log decides the rule. A rule that is not decided is not satisfied.
    pub decided: bool,
    /// Expected and found values.
    pub found: String,
}

impl Judgement {
    /// The violated rules.
    pub fn violated(&self) -> impl Iterator<Item = &RuleOutcome> {
        self.rules.iter().filter(|outcome| !outcome.passed)
    }

    /// Whether the log shows that a rule is violated, other than by deciding nothing.
    #[must_use]
    pub fn is_broken_by_evidence(&self) -> bool {
        self.violated().any(|outcome| outcome.decided)
    }
}

impl Policy {
    /// Judges a log, of whose time at least `min_valid` must be computable.
    #[must_use]
    pub fn judge(&self, facts: &LogFacts, events: &[EventFacts], min_valid: f64) -> Judgement {
        let undecided = facts.undecided(min_valid);
        let rules = self.rules.iter().map(|rule| match &undecided {
            None => rule.judge(facts, events),
            Some(reason) => rule.judge_undecided(facts, events, reason),
        });
        let rules: Vec<RuleOutcome> = rules.collect();
        let reason = undecided.as_ref().map(ToString::to_string);
        let open = rules.iter().find(|outcome| !outcome.decided);
        let reason = reason.or_else(|| open.map(|outcome| outcome.found.clone()));
        self.judgement(rules, reason)
    }

    /// Judges a log that could not be analysed.
    #[must_use]
    pub fn judge_failed(&self, reason: &str) -> Judgement {
        let outcome = RuleOutcome {
            rule: "every log can be analysed".into(),
            passed: self.accepts_failed_logs,
            decided: self.accepts_failed_logs,
            found: say!("not decided: the log could not be analysed: {reason}"),
        };
        self.judgement(vec![outcome], Some(reason.into()))
    }

    fn judgement(&self, rules: Vec<RuleOutcome>, undecided: Option<String>) -> Judgement {
        Judgement {
            policy: self.name.clone(),
            policy_sha256: self.file.as_ref().and_then(|file| file.sha256.clone()),
            passed: rules.iter().all(|outcome| outcome.passed),
            undecided,
            rules,
        }
    }
}

impl Rule {
    fn judge(&self, facts: &LogFacts, events: &[EventFacts]) -> RuleOutcome {
        let (passed, decided, found) = match &self.check {
            Check::Events { which, at_most } => {
                let judged = which.judge(*at_most, facts.start_ns, &facts.wheels, events);
                let open = facts.open_fall.as_ref();
                match open.filter(|open| judged.0 && which.is_broken_by(open, *at_most, events)) {
                    Some(open) => (false, false, say!("not decided: {}", open.found)),
                    None => judged,
                }
            }
            Check::Number {
                quantity: (_, of),
                at_least,
                at_most,
                unknown,
            } => {
                let (passed, found) = judge_number(of(facts), *at_least, *at_most, *unknown);
                (passed, true, found)
            }
        };
        RuleOutcome {
            rule: self.name.clone(),
            passed,
            decided,
            found,
        }
    }

    /// A log that decides nothing satisfies no rule. Events in the time that is computable break their
    /// rule all the same.
    fn judge_undecided(
        &self,
        facts: &LogFacts,
        events: &[EventFacts],
        reason: &Undecided,
    ) -> RuleOutcome {
        let outcome = self.judge(facts, events);
        let is_broken_by_value = !outcome.passed && outcome.decided && self.has_value(facts);
        if reason.leaves_events() && is_broken_by_value {
            return outcome;
        }
        if let Check::Events { .. } = self.check {
            // what gyro and attitude show stands, whichever other input is wrong
            let measured = events
                .iter()
                .filter(|event| event.is_measured == Some(true));
            let of_measured = self.judge(facts, &measured.cloned().collect::<Vec<_>>());
            if !of_measured.passed && of_measured.decided {
                return of_measured;
            }
        }
        RuleOutcome {
            passed: false,
            decided: false,
            found: say!("not decided: {reason}"),
            ..outcome
        }
    }

    /// Whether the quantity that the rule checks is known.
    fn has_value(&self, facts: &LogFacts) -> bool {
        match &self.check {
            Check::Events { .. } => true,
            Check::Number {
                quantity: (_, of), ..
            } => of(facts).is_some(),
        }
    }
}

impl Events {
    /// Returns whether the events satisfy the rule, whether they decide it, and what was expected and found.
    fn judge(
        &self,
        at_most: u64,
        start_ns: i64,
        wheels: &[WheelFacts],
        events: &[EventFacts],
    ) -> (bool, bool, String) {
        let seconds = |event: &EventFacts| (event.start_ns - start_ns) as f64 * 1e-9;
        let mut counted: Vec<&EventFacts> = events.iter().filter(|it| self.counts(it)).collect();
        if counted.is_empty() && self.kind == EventKind::WheelLift && self.subjects.is_empty() {
            // every wheel off the edge of a tipping is off the ground, also where no load is known
            let tipping = Self {
                kind: EventKind::EdgeTipping,
                ..self.clone()
            };
            counted.extend(events.iter().filter(|event| tipping.counts(event)));
        }
        let mut found = say!("expected at most {at_most}, found {}", counted.len());
        if let Some(first) = counted.first() {
            found.push_str(&say!(
                " (the first: {} at t = {:.2} s)",
                subject_in_words(first),
                seconds(first)
            ));
        }
        let passed = counted.len() as u64 <= at_most;
        if let Some(unknown) = self.unknown_subject(wheels, events).filter(|_| passed) {
            let wheels: Vec<&str> = wheels.iter().map(|it| &*it.name).collect();
            let found = say!(
                "not decided: expected the name of a wheel or an edge of the machine, found \"{unknown}\"; its wheels are {}",
                wheels.join(", ")
            );
            return (false, false, found);
        }
        let is_open = |event: &&&EventFacts| event.is_open == Some(true);
        let sure = counted.iter().filter(|event| !is_open(event)).count() as u64;
        if let Some(open) = counted.iter().find(|event| is_open(event))
            && !passed
            && sure <= at_most
        {
            let found = say!(
                "not decided: from t = {:.2} s the platform rotated; the ground may equally have given way under it, or the machine may \
                 be propped",
                seconds(open)
            );
            return (false, false, found);
        }
        let is_falling = |event: &&EventFacts| {
            event.kind == EventKind::EdgeTipping
                && event.end_ns.is_none()
                && event
                    .certainty
                    .is_none_or(|certainty| certainty >= LEAST_OF_A_FACT)
        };
        match events.iter().find(is_falling) {
            Some(open) if passed && counted.is_empty() && self.kind == EventKind::TipOver => {
                let edge = edge_word(&open.subject);
                let found = say!(
                    "not decided: from t = {:.2} s until the end of the log the machine was tipping about the {edge} edge",
                    seconds(open)
                );
                (false, false, found)
            }
            _ => (passed, true, found),
        }
    }

    /// Whether a possible fall would be one event more than allowed: a tipping about its edge, and a lift of every wheel off it.
    fn is_broken_by(&self, fall: &OpenFall, at_most: u64, events: &[EventFacts]) -> bool {
        let counted = events.iter().filter(|event| self.counts(event)).count() as u64;
        let of_it = match self.kind {
            EventKind::TipOver | EventKind::EdgeTipping => std::slice::from_ref(&fall.edge),
            EventKind::WheelLift | EventKind::WheelLight => &fall.off_edge,
            _ => &[],
        };
        let is_meant =
            |subject: &String| self.subjects.is_empty() || self.subjects.contains(subject);
        let more = of_it.iter().filter(|subject| is_meant(subject)).count() as u64;
        more > 0 && counted + more > at_most
    }

    /// A subject that the machine of this log does not have: no event can ever be its.
    fn unknown_subject(&self, wheels: &[WheelFacts], events: &[EventFacts]) -> Option<&str> {
        let is_wheel = |name: &str| wheels.iter().any(|wheel| *wheel.name == *name);
        let is_edge = |name: &str| {
            let mut ends = name.match_indices('_');
            EDGES_OF_FOUR.contains(&name)
                || ends.any(|(at, _)| is_wheel(&name[..at]) && is_wheel(&name[at + 1..]))
        };
        let is_known = |subject: &&String| {
            let is_seen = events.iter().any(|event| *event.subject == **subject);
            is_seen
                || match self.kind {
                    EventKind::WheelLight | EventKind::WheelLift | EventKind::LiftNotExcluded => {
                        is_wheel(subject)
                    }
                    EventKind::EdgeTipping | EventKind::TipOver => is_edge(subject),
                    // a signal has no gap or fault in most logs
                    EventKind::InputGap | EventKind::InputFault => true,
                }
        };
        let unknown = self.subjects.iter().find(|subject| !is_known(subject));
        unknown.map(String::as_str)
    }

    fn counts(&self, event: &EventFacts) -> bool {
        let edges = || std::iter::once(&event.subject).chain(&event.other_edge);
        let is_named = |edge: &str| self.subjects.iter().any(|subject| subject == edge);
        event.kind == self.kind
            && event.certainty.is_none_or(|p| p >= self.min_certainty)
            && event.duration_s >= self.min_duration_s
            && (self.subjects.is_empty() || edges().any(|edge| is_named(edge)))
            && !(self.ignore_split_dependent && event.split_dependent == Some(true))
    }
}

fn judge_number(
    value: Option<f64>,
    at_least: Option<f64>,
    at_most: Option<f64>,
    unknown: WhenUnknown,
) -> (bool, String) {
    let expected = match (at_least, at_most) {
        (Some(least), Some(most)) => say!("expected {least} to {most}"),
        (Some(least), None) => say!("expected at least {least}"),
        (None, most) => say!("expected at most {}", most.unwrap_or(f64::INFINITY)),
    };
    let Some(value) = value else {
        let passed = unknown == WhenUnknown::Pass;
        return (passed, say!("{expected}, found no computable value"));
    };
    let kept =
        at_least.is_none_or(|least| value >= least) && at_most.is_none_or(|most| value <= most);
    (kept, say!("{expected}, found {value:.6}"))
}

/// The subject of an event as a reader reads it.
fn subject_in_words(event: &EventFacts) -> Cow<'_, str> {
    match event.kind {
        EventKind::EdgeTipping | EventKind::TipOver => edge_word(&event.subject),
        _ => (&*event.subject).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(certainty: Option<f64>, duration_s: f64, split_dependent: bool) -> EventFacts {
        EventFacts {
            kind: EventKind::WheelLift,
            subject: "fl".into(),
            start_ns: 0,
            end_ns: None,
            duration_s,
            worst: None,
            unit: "N".into(),
            worst_ns: 0,
            lead_s: None,
            certainty,
            certainty_any_split: certainty,
            start_sigma_s: None,
            split_dependent: Some(split_dependent),
            main_cause: None,
            main_cause_percent: None,
            doubted_by: None,
            is_measured: None,
            is_open: None,
            other_edge: None,
        }
    }

    fn tipping(end_ns: Option<i64>) -> EventFacts {
        EventFacts {
            kind: EventKind::EdgeTipping,
            subject: "left".into(),
            end_ns,
            ..event(Some(0.99), 1.0, false)
        }
    }

    #[test]
    fn a_tipping_counts_as_a_lift_where_no_load_is_known() {
        let lifts = Events::all_of(EventKind::WheelLift);
        assert!(!lifts.judge(0, 0, &[], &[tipping(Some(1))]).0);
        assert!(
            lifts
                .judge(1, 0, &[], &[tipping(Some(1)), event(None, 1.0, false)])
                .0
        );
    }

    #[test]
    fn a_log_that_ends_in_a_fall_does_not_decide_on_a_tip_over() {
        let falls = Events::all_of(EventKind::TipOver);
        let (passed, decided, _) = falls.judge(0, 0, &[], &[tipping(None)]);
        assert!(!passed && !decided);
        let (passed, decided, _) = falls.judge(0, 0, &[], &[tipping(Some(1))]);
        assert!(passed && decided);
    }

    #[test]
    fn a_fall_that_may_have_begun_is_one_more_for_its_edge_alone() {
        let fall = OpenFall {
            edge: "left".into(),
            off_edge: vec!["fr".into(), "rr".into()],
            found: "the log ends".into(),
        };
        let rule = Events::all_of(EventKind::TipOver);
        let over = EventFacts {
            kind: EventKind::TipOver,
            ..tipping(Some(1))
        };
        assert!(rule.is_broken_by(&fall, 0, &[]) && !rule.is_broken_by(&fall, 1, &[]));
        assert!(rule.is_broken_by(&fall, 1, &[over]));
        let of_right = Events {
            subjects: vec!["right".into()],
            ..rule
        };
        assert!(!of_right.is_broken_by(&fall, 0, &[]));
        let lifts = Events::all_of(EventKind::WheelLift);
        assert!(lifts.is_broken_by(&fall, 1, &[]) && !lifts.is_broken_by(&fall, 2, &[]));
        let of_left = Events {
            subjects: vec!["fl".into()],
            ..lifts
        };
        assert!(!of_left.is_broken_by(&fall, 0, &[]));
        assert!(Events::all_of(EventKind::EdgeTipping).is_broken_by(&fall, 0, &[]));
    }

    #[test]
    fn a_fall_about_one_of_two_edges_counts_for_either() {
        let over = EventFacts {
            other_edge: Some("rear".into()),
            ..tipping(None)
        };
        for (edge, passes) in [("left", false), ("rear", false), ("right", true)] {
            let rule = Events {
                subjects: vec![edge.into()],
                ..Events::all_of(EventKind::EdgeTipping)
            };
            let (passed, ..) = rule.judge(0, 0, &[], std::slice::from_ref(&over));
            assert_eq!(passed, passes, "{edge}");
        }
    }

    #[test]
    fn ground_that_may_have_given_way_decides_no_tip_over() {
        let falls = Events::all_of(EventKind::EdgeTipping);
        let open = EventFacts {
            is_open: Some(true),
            certainty: Some(0.4),
            ..tipping(None)
        };
        let (passed, decided, _) = falls.judge(0, 0, &[], std::slice::from_ref(&open));
        assert!(!passed && !decided);
        let (passed, decided, _) = falls.judge(0, 0, &[], &[open.clone(), tipping(Some(1))]);
        assert!(!passed && decided, "another one is sure");
        let (passed, decided, _) = falls.judge(1, 0, &[], &[open]);
        assert!(passed && decided, "one is allowed");
    }

    #[test]
    fn a_rule_may_ignore_unsure_short_and_split_dependent_events() {
        let all = Events::all_of(EventKind::WheelLift);
        assert!(all.counts(&event(Some(0.1), 0.05, true)));
        let sure = Events {
            min_certainty: 0.9,
            min_duration_s: 0.2,
            ignore_split_dependent: true,
            ..all.clone()
        };
        assert!(sure.counts(&event(Some(0.9), 0.2, false)));
        assert!(
            sure.counts(&event(None, 0.2, false)),
            "unknown is not unlikely"
        );
        assert!(!sure.counts(&event(Some(0.8), 0.2, false)));
        assert!(!sure.counts(&event(Some(0.9), 0.1, false)));
        assert!(!sure.counts(&event(Some(0.9), 0.2, true)));
        let others = Events {
            subjects: vec!["rr".into()],
            ..all
        };
        assert!(!others.counts(&event(Some(1.0), 1.0, false)));
        // a wheel that the machine does not have is no evidence that it stood
        let wheel = |name: &str| WheelFacts {
            name: name.into(),
            static_load_n: None,
            least_otf_n: None,
            least_load_n: None,
            largest_load_n: None,
        };
        let (passed, decided, _) = others.judge(0, 0, &[wheel("fl"), wheel("rl")], &[]);
        assert!(!passed && !decided);
        let (passed, decided, _) = others.judge(0, 0, &[wheel("fl"), wheel("rr")], &[]);
        assert!(passed && decided);
        let edge = |name: &str| Events {
            kind: EventKind::TipOver,
            subjects: vec![name.into()],
            ..others.clone()
        };
        let wheels = [wheel("l_1"), wheel("l_2")];
        for (name, is_known) in [("left", true), ("l_1_l_2", true), ("l_1_l_3", false)] {
            assert_eq!(edge(name).judge(0, 0, &wheels, &[]).1, is_known, "{name}");
        }
        let kind = Events::all_of(EventKind::TipOver);
        assert!(!kind.counts(&event(Some(1.0), 1.0, false)));
    }

    #[test]
    fn a_name_that_is_not_known_is_refused_with_its_rule() {
        for key in ["event", "quantity"] {
            let text = format!("[[rule]]\n{key} = 'nothing'\nat_most = 0\n");
            let error = format!("{:#}", Policy::from_text(&text, "a.toml").unwrap_err());
            let place = format!("a.toml: rule 1: {key}: expected one of ");
            assert!(error.starts_with(&place), "{error}");
        }
    }

    #[test]
    fn unknown_values_pass_only_if_the_rule_allows_it() {
        let judged = |value, unknown| judge_number(value, Some(0.1), Some(0.5), unknown).0;
        assert!(judged(Some(0.1), WhenUnknown::Fail) && judged(Some(0.5), WhenUnknown::Fail));
        assert!(!judged(Some(0.6), WhenUnknown::Pass) && !judged(Some(0.0), WhenUnknown::Pass));
        assert!(!judged(None, WhenUnknown::Fail) && judged(None, WhenUnknown::Pass));
    }
}

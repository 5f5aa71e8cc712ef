//! The evidence for what a finding says of an event.

use tipwatch_language::{decimals, is_english, message, say, told, word};
use tipwatch_mechanics::estimation::rotation::RotationWitness;

use super::enumerated;
use super::scene::Scene;
use crate::events::support_words::edge_word;
use crate::events::{
    Counterfactual, Event, EventCauses, EventKind, MeasuredRotation, NO_LEAN, ShownBy, Supposition,
};
use crate::page::{input_in_words, number, percent, probability, readable, short, with_unit};
use crate::report::faults;

/// Causes with a smaller share of the lost load are summed up as others (%).
const LEAST_PERCENT: f64 = 2.0;
/// Most causes that a finding names.
const MOST_CAUSES: usize = 4;

impl Scene {
    pub(super) fn evidence(&self, event: &Event) -> Vec<String> {
        if let Some(fault) = &event.fault {
            return faults::evidence(event, fault);
        }
        let mut evidence = vec![self.worst(event)];
        evidence.extend(event.measured_load_n.map(|load_n| {
            let support = self.word_of(&[event]).one;
            say!(
                "The load sensor of this {support} showed {} N in the mean",
                number(load_n)
            )
        }));
        if event.kind == EventKind::EdgeTipping
            && let Some(rotation) = event.rotation_rad
        {
            let least = match event.is_undecided() {
                true => word!("; a tip-over needs 10° or more"),
                false => "",
            };
            let degrees = rotation.to_degrees();
            evidence.push(say!(
                "Rotation about the edge: {degrees:.1}° outwards{least}"
            ));
        }
        if let Some(measured) = &event.measured_rotation {
            evidence.extend(self.measured_rotation(event, measured));
        }
        if let Some((lead_s, from)) = self.lead(event) {
            evidence.push(say!(
                "Lead time: {lead_s:.2} s after {from} fell below its load limit and stayed there"
            ));
        }
        if event.split_dependent == Some(true) {
            evidence.push(self.split_evidence(event));
            evidence.extend(event.split_flips_at.map(|share| {
                say!(
                    "With {} of the difference between the sides on the front axle it would just have stayed on the ground",
                    percent(share)
                )
            }));
            if !self.is_split_stated {
                evidence.push(self.deciding(self.wheel(&event.subject).into_iter()));
            }
        } else if event.any_split_ns.is_some() && !self.is_split_stated {
            evidence.push(say!(
                "Before that, equilibrium leaves the split of the load between the {} open. {}",
                self.word.many,
                self.deciding(self.wheel(&event.subject).into_iter())
            ));
        }
        if let Some(doubt) = &event.doubt {
            evidence.push(say!(
                "Doubted: signals contradict each other then or later ({}). The probability that the loads are right all the same, \
                 {}, is in the confidence",
                input_list(&doubt.subjects),
                probability(doubt.loads_are_right)
            ));
        }
        if !event.untested.is_empty() {
            let signs = event.untested.iter().map(|sign| {
                let (other, with_it) = (
                    probability(sign.reversed),
                    probability(sign.certainty_if_reversed),
                );
                format!("{} ({other}; {with_it})", sign.joint)
            });
            evidence.push(say!(
                "Rests on signs of encoders that neither the motion of this log nor a commissioning has proven: {}. In brackets: the \
                 probability of the other sign, and that of this event with it; both are in the confidence",
                enumerated(&signs.collect::<Vec<_>>())
            ));
        }
        if let Some(causes) = &event.causes {
            evidence.extend(self.causes(event, causes));
        }
        evidence.extend(self.otherwise(event));
        evidence
    }

    /// Describes the rotation that gyro and attitude show, and the part of it that the loads do not show.
    fn measured_rotation(&self, event: &Event, measured: &MeasuredRotation) -> Vec<String> {
        let from = decimals(format!("{:.2} s", self.seconds(event.start_ns)));
        let rotated = say!(
            "the platform rotated by {:.0}° about the {} edge from t = {from}",
            event.rotation_rad.unwrap_or(f64::NAN).to_degrees(),
            edge_word(&event.subject)
        );
        let mut evidence = vec![say!(
            "Measured by {}: {rotated}{}",
            witness(measured.witness),
            match event.shown_by {
                Some(ShownBy::Rotation) => word!("; the computed loads do not show it"),
                _ => "",
            }
        )];
        if let Some(other) = &measured.other_edge {
            evidence.push(say!(
                "The edge is open: {} by the attitude, {} by the gyro; the axes of one of them are wrong",
                edge_word(&event.subject),
                edge_word(other)
            ));
        }
        if !measured.onset_in_log {
            // a part of a log may be dated by what was recorded before it
            let why = match event.start_sigma_s {
                None => word!(
                    "The onset is not in the log: the platform rotated already in the first sample that shows it"
                ),
                Some(_) => word!(
                    "The onset is, or may be, before the first row: the platform rotated already in it"
                ),
            };
            evidence.push(why.into());
        }
        if let Some(no_return_rad) = measured.no_return_rad {
            let sigma = measured.no_return_sigma_rad;
            let sigma = sigma.map_or(String::new(), |sigma| {
                decimals(format!(" ± {:.1}", 2.0 * sigma.to_degrees()))
            });
            let passed = match (measured.no_return_ns, measured.no_return_time_sigma_s) {
                (None, _) => word!("not passed").to_string(),
                (Some(at_ns), Some(sigma_s)) => say!(
                    "passed at t = {:.2} ± {:.2} s",
                    self.seconds(at_ns),
                    (2.0 * sigma_s).max(0.01)
                ),
                // what is within its band at the end may not have been passed
                (Some(at_ns), None) => say!("reached at t = {:.2} s", self.seconds(at_ns)),
            };
            let masses = match measured.no_return_load_kg {
                Some(load_kg) => {
                    say!("with {load_kg:.0} kg on the tool beyond the stated masses")
                }
                None => word!("by the stated masses").to_string(),
            };
            evidence.push(say!(
                "Point of no return {masses}: {:.1}{sigma}°, {passed}",
                no_return_rad.to_degrees()
            ));
        }
        let beyond = self.off_by_stops(event);
        if !beyond.is_empty() {
            evidence.push(say!(
                "Beyond the stop of its axle {} left the ground, too",
                enumerated(&beyond)
            ));
        }
        if let Some(at_rest_ns) = measured.at_rest_ns {
            let at_s = self.seconds(at_rest_ns);
            evidence.push(say!("At rest on its side from t = {at_s:.2} s or earlier"));
        }
        if let Some(rested_ns) = measured.rested_ns {
            let at_s = self.seconds(rested_ns);
            evidence.push(say!(
                "At rest between wheels and side from t = {at_s:.2} s, where gravity lets no machine rest, and by the loads it stands \
                 on its {}: the ground gave way under it, or something that is not measured props it",
                self.word.many
            ));
        }
        evidence
    }

    fn split_evidence(&self, event: &Event) -> String {
        let open = match self.is_split_stated {
            true => say!(
                "Rests on this, as the machine file states: {}. Without it equilibrium leaves the load open",
                self.split_rule
            ),
            false => say!(
                "Equilibrium leaves the split of the load between the {} open",
                self.word.many
            ),
        };
        match (event.load_range_n, event.judged_ns) {
            (Some([least_n, largest_n]), Some(judged_ns)) => say!(
                "{open}: {} to {} N on this {}, at t = {:.2} s",
                number(least_n),
                number(largest_n),
                self.word_of(&[event]).one,
                self.seconds(judged_ns)
            ),
            _ => open,
        }
    }

    pub(super) fn worst(&self, event: &Event) -> String {
        let worst = match event.kind {
            _ if !event.worst.is_finite() => word!("not computable").to_string(),
            _ => with_unit(event.worst, event.unit),
        };
        let at = say!("at t = {:.2} s", self.seconds(event.worst_ns));
        match event.kind {
            EventKind::TipOver if event.worst.is_finite() => {
                say!(
                    "Rotation about the edge: {:.1}° outwards, {at}",
                    event.worst.to_degrees()
                )
            }
            EventKind::TipOver => say!("Rotation about the edge: {worst}, {at}"),
            EventKind::EdgeTipping if !event.worst.is_finite() => {
                word!("Overturning moment: not computed").to_string()
            }
            EventKind::EdgeTipping => say!("Maximum overturning moment: {worst}, {at}"),
            EventKind::WheelLift => say!("Minimum overturning force (OTF): {worst}, {at}"),
            EventKind::WheelLight => {
                say!("Minimum load: {worst}{}, {at}", self.shares(event))
            }
            EventKind::LiftNotExcluded => say!(
                "Smallest overturning force (OTF) that the greatest rates and accelerations allow, less two standard deviations: {worst}, after the row {at}"
            ),
            EventKind::InputGap | EventKind::InputFault => {
                say!(
                    "No value{} for {:.2} s; nothing is computed there",
                    self.expected_of(event),
                    event.worst
                )
            }
        }
    }

    /// Describes the messages that an input with a gap should have: of its topic, at its rate. Empty where several topics are
    /// meant.
    fn expected_of(&self, event: &Event) -> String {
        let mut inputs = self.inputs.iter().filter(|it| it.subject == event.subject);
        let (Some(input), None) = (inputs.next(), inputs.next()) else {
            return String::new();
        };
        let rate = input
            .rate_hz
            .map_or(String::new(), |rate| say!(" at {} Hz", short(rate)));
        say!(
            " of {}, where {}{rate} was expected,",
            input.topic,
            input.type_name
        )
    }

    /// Describes the lost load, since when it was lost, and the largest causes.
    pub(super) fn causes(&self, event: &Event, causes: &EventCauses) -> Vec<String> {
        if !causes.is_loss() {
            return Vec::new();
        }
        let lost_n = causes.otf_before_n - causes.otf_n;
        let since_s = self.seconds(causes.since_ns);
        let since = match causes.since_is_steady {
            true => say!("since the machine was last steady, at t = {since_s:.2} s"),
            false => say!(
                "since t = {since_s:.2} s (it was never steady before with every {} above its limit)",
                self.word.one
            ),
        };
        let fall = say!(
            "Overturning force (OTF) down by {} N to {} N {since}, up to t = {:.2} s",
            number(lost_n),
            number(causes.otf_n),
            self.seconds(causes.at_ns),
        );
        let mut told = vec![
            fall,
            say!("Taken by computed cause: {}", shares_in_words(causes)),
        ];
        told.extend(self.not_shown(event, causes));
        told
    }

    /// Describes the answers whether the event would have happened otherwise.
    fn otherwise(&self, event: &Event) -> Option<String> {
        let answered: Vec<String> = (event.counterfactuals.iter())
            .filter_map(|answer| {
                Some(format!(
                    "{}: {}",
                    self.supposed(answer),
                    answer.reply.in_words()?
                ))
            })
            .collect();
        // beside answers, the probability as recorded that the same evaluation gives
        let recorded = event.counterfactuals.first();
        let recorded = recorded.and_then(|answer| answer.reply.recorded_in_words());
        let recorded = recorded.filter(|_| !answered.is_empty());
        let recorded = recorded.map(|chance| say!("as recorded, by the same evaluation: {chance}"));
        let open = self.unanswered(&event.counterfactuals).into_iter();
        let open = open.map(|(suppositions, why)| say!("{suppositions}: open ({why})"));
        let answers: Vec<String> = recorded.into_iter().chain(answered).chain(open).collect();
        (!answers.is_empty()).then(|| match event.kind {
            EventKind::WheelLift => say!("Would it have lifted {}", answers.join("; ")),
            _ => say!("Would it have tipped {}", answers.join("; ")),
        })
    }

    /// Returns the suppositions without an answer: every reason once, with the suppositions that share it.
    pub(in crate::report) fn unanswered(
        &self,
        answers: &[Counterfactual],
    ) -> Vec<(String, &'static str)> {
        let mut reasons: Vec<(Vec<String>, &'static str)> = Vec::new();
        for answer in answers.iter().filter(|it| it.reply.probability.is_none()) {
            let why = told(
                answer
                    .reply
                    .why_not
                    .unwrap_or(message!("the reason is unknown")),
            );
            match reasons.iter_mut().find(|(_, other)| *other == why) {
                Some((suppositions, _)) => suppositions.push(self.supposed(answer)),
                None => reasons.push((vec![self.supposed(answer)], why)),
            }
        }
        let reasons = reasons.into_iter();
        reasons
            .map(|(suppositions, why)| (enumerated(&suppositions), why))
            .collect()
    }

    pub(in crate::report) fn supposed(&self, answer: &Counterfactual) -> String {
        match (answer.supposed, answer.posture_ns) {
            (Supposition::LevelGround, _) => word!("on level ground").into(),
            (Supposition::HalfSpeed, _) if answer.base_rests => {
                word!("with the arm at half the speed").into()
            }
            (Supposition::HalfSpeed, _) => word!("with machine and arm at half the speed").into(),
            (Supposition::WithoutLoad, _) => word!("without the load").into(),
            (Supposition::ArmIn, None) => word!("with the arm in its reference posture").into(),
            (Supposition::ArmIn, Some(at_ns)) => {
                say!("with the arm as at t = {:.2} s", self.seconds(at_ns))
            }
        }
    }

    fn shares(&self, event: &Event) -> String {
        let Some(wheel) = self.wheel(&event.subject) else {
            return String::new();
        };
        let limit = wheel
            .limit_n
            .map_or(String::new(), |limit| say!(", limit {} N", number(limit)));
        format!(" ({}{limit})", wheel.share(event.worst))
    }
}

/// Inputs in words.
pub(in crate::report) fn input_list(subjects: &[String]) -> String {
    let subjects = subjects.iter().map(|subject| {
        let of_loads = subject.strip_prefix("loads below zero off the ");
        match of_loads.and_then(|rest| rest.strip_suffix(" edge")) {
            Some(edge) if !is_english() => {
                say!("loads below zero off the {} edge", edge_word(edge))
            }
            _ if subject == NO_LEAN => word!("loads without the lean that they cause").into(),
            _ => input_in_words(subject),
        }
    });
    subjects.collect::<Vec<_>>().join("; ")
}

fn witness(witness: RotationWitness) -> &'static str {
    match witness {
        RotationWitness::Both => word!("gyro and attitude"),
        RotationWitness::GyroAlone => word!("the gyro alone"),
        RotationWitness::AttitudeAlone => word!("the attitude alone"),
        RotationWitness::GyroNotAttitude => word!("the gyro, which the attitude contradicts"),
        RotationWitness::OtherEdges => {
            word!("the attitude, and by the gyro as far about another edge")
        }
        RotationWitness::AttitudeNotGyro => word!("the attitude, which the gyro contradicts"),
    }
}

/// Shares of the causes as text: the largest by amount, added load negative, the rest as others, in whole per
/// cent that add up to 100.
fn shares_in_words(causes: &EventCauses) -> String {
    let mut named: Vec<(&str, f64)> = (causes.shares.iter())
        .filter(|share| share.percent.abs() >= LEAST_PERCENT)
        .map(|share| (share.cause, share.taken_n))
        .collect();
    named.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    named.truncate(MOST_CAUSES);
    named.sort_by(|a, b| b.1.total_cmp(&a.1));
    let others = causes.otf_before_n - causes.otf_n - named.iter().map(|(_, n)| n).sum::<f64>();
    let named = named
        .into_iter()
        .map(|(cause, taken_n)| (readable(cause), taken_n));
    let others = (others.abs() >= 0.5).then(|| (word!("others").to_string(), others));
    let all = named.chain(others);
    let all: Vec<String> = all
        .map(|(cause, taken_n)| format!("{cause} {} N", number(taken_n)))
        .collect();
    all.join(", ")
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::machine::SupportKind;

    use super::*;
    use crate::events::CauseShare;
    use crate::events::Reply;
    use crate::events::support_words::SupportWord;
    use crate::report::deciding::Deciding;
    use crate::report::findings::scene::{InputFacts, WheelFacts};

    fn scene() -> Scene {
        let wheel = |name: &str| WheelFacts {
            name: name.into(),
            kind: SupportKind::Wheel,
            static_n: 10_000.0,
            limit_n: Some(500.0),
            deciding: vec![Deciding::Weighing],
        };
        Scene {
            start_ns: 1_000_000_000_000,
            wheels: vec![wheel("FL"), wheel("RL")],
            split_rule: "all wheels are springs of the same stiffness under a rigid frame".into(),
            sharing: "wheels share the load".into(),
            word: SupportWord::of_kind(SupportKind::Wheel),
            is_split_stated: false,
            unexplained_ns: Vec::new(),
            is_sparse: false,
            goes_on: false,
            inputs: vec![InputFacts {
                subject: "actuator.lift".into(),
                topic: "/lift/force".into(),
                type_name: "std_msgs/msg/Float64".into(),
                rate_hz: Some(50.0),
            }],
            stops: Vec::new(),
        }
    }

    #[test]
    fn a_gap_names_the_input_its_topic_and_what_was_expected() {
        let gap = event(EventKind::InputGap, "actuator.lift", 1.5, "s");
        let scene = scene();
        assert_eq!(scene.subject(&gap), "actuator lift");
        let expected = scene.expected_of(&gap);
        for part in ["/lift/force", "std_msgs/msg/Float64", "50"] {
            assert!(expected.contains(part), "{expected}");
        }
        let unknown = event(EventKind::InputGap, "imu", 1.5, "s");
        assert_eq!(scene.expected_of(&unknown), "");
    }

    fn event(kind: EventKind, subject: &str, worst: f64, unit: &'static str) -> Event {
        Event {
            worst,
            unit,
            end_ns: Some(1_003_000_000_000),
            worst_ns: 1_002_750_000_000,
            ..Event::blank(kind, 1_002_500_000_000, subject.into())
        }
    }

    #[test]
    fn each_wheel_has_the_confidence_in_its_first_event() {
        let lift = |subject: &str, certainty: f64| Event {
            certainty: Some(certainty),
            ..event(EventKind::WheelLift, subject, 0.0, "N")
        };
        let (sure, doubtful) = (lift("fl", 1.0), lift("fl", 0.69));
        let scene = scene();
        let told = probability(1.0);
        assert_eq!(scene.confidence(&[&sure, &doubtful]), Some(told.clone()));
        let other = lift("rl", 0.69);
        let both = format!("FL {told}, RL {}", probability(0.69));
        assert_eq!(scene.confidence(&[&sure, &other]), Some(both));
    }

    #[test]
    fn headline_says_what_when_and_how_certain() {
        let light = Event {
            certainty: Some(0.97),
            ..event(EventKind::WheelLight, "rl", 250.0, "N")
        };
        let finding = scene().finding(&light);
        assert_eq!(
            finding.to_string(),
            "Wheel RL was below its load limit from t = 2.50 s for 0.50 s (confidence 97 %)\n    \
             Minimum load: 250 N (2.5 % of its static load, limit 500 N), at t = 2.75 s"
        );
    }

    #[test]
    fn lead_time_and_doubt_are_evidence() {
        let doubtful = Event {
            lead_s: Some(0.4),
            lead_from: Some("fl".into()),
            certainty: Some(0.98),
            certainty_any_split: Some(0.0),
            load_range_n: Some([0.0, 5300.0]),
            judged_ns: Some(1_002_750_000_000),
            split_dependent: Some(true),
            start_sigma_s: Some(0.04),
            ..event(EventKind::WheelLift, "rl", -80.0, "N")
        };
        let finding = scene().finding(&doubtful);
        assert_eq!(
            finding.headline,
            "Wheel RL was off the ground from t = 2.50 ± 0.08 s for 0.50 s (confidence 98 %), if all wheels are springs \
             of the same stiffness under a rigid frame; it cannot be shown without knowing how the wheels share the load \
             (0 to 5300 N)"
        );
        assert_eq!(
            finding.evidence,
            [
                "Minimum overturning force (OTF): -80.0 N, at t = 2.75 s",
                "Lead time: 0.40 s after wheel FL fell below its load limit and stayed there",
                "Equilibrium leaves the split of the load between the wheels open: 0 to 5300 N on this wheel, \
                 at t = 2.75 s",
                "To decide it: weighing the wheels where the machine stood"
            ]
        );
    }

    #[test]
    fn a_reason_without_an_answer_is_told_once() {
        let answer = |supposed, why_not| Counterfactual {
            supposed,
            posture_ns: None,
            base_rests: false,
            reply: Reply {
                otf_n: Some(400.0),
                why_not: Some(why_not),
                ..Reply::default()
            },
        };
        let answers = [
            answer(Supposition::LevelGround, "a"),
            answer(Supposition::HalfSpeed, "b"),
            answer(Supposition::WithoutLoad, "a"),
            Counterfactual {
                reply: Reply {
                    probability: Some(0.5),
                    ..Reply::default()
                },
                ..answer(Supposition::ArmIn, "a")
            },
        ];
        let expected = [
            ("on level ground and without the load".to_string(), "a"),
            ("with machine and arm at half the speed".to_string(), "b"),
        ];
        assert_eq!(scene().unanswered(&answers), expected);
    }

    #[test]
    fn an_edge_tipping_that_lasts_is_no_tip_over() {
        let open = Event {
            end_ns: None,
            rotation_rad: Some(0.07),
            ..event(EventKind::EdgeTipping, "left", 900.0, "N m")
        };
        let text = scene().finding(&open).to_string();
        assert!(
            text.starts_with(
                "The machine was tipping about the left edge when the log ended, from"
            ),
            "{text}"
        );
        assert!(
            text.contains("4.0° outwards; a tip-over needs 10° or more"),
            "{text}"
        );
    }

    #[test]
    fn shares_are_signed_and_add_up() {
        let share = |cause, percent| CauseShare {
            cause,
            taken_n: 10.0 * percent,
            percent,
        };
        let causes = EventCauses {
            since_ns: 1_000_500_000_000,
            since_is_steady: false,
            at_ns: 0,
            otf_before_n: 1000.0,
            otf_n: 0.0,
            shares: vec![
                share("arm_weight", 96.6),
                share("slope", 12.6),
                share("warp", 1.2),
                share("arm_motion", -10.4),
            ],
        };
        assert_eq!(
            shares_in_words(&causes),
            "arm weight 966 N, slope 126 N, arm motion -104 N, others 12.0 N"
        );
        let lift = event(EventKind::WheelLift, "fl", 0.0, "N");
        let evidence = scene().causes(&lift, &causes);
        assert!(evidence[0].contains("since t = 0.50 s"), "{evidence:?}");
        assert!(
            evidence[2].contains("until t = 2.50 s is not known"),
            "{evidence:?}"
        );
    }

    #[test]
    fn an_open_tip_over_lasts_until_the_end_of_the_log() {
        let open = Event {
            end_ns: None,
            ..event(EventKind::TipOver, "left", 0.5, "rad")
        };
        let finding = scene().finding(&open);
        assert_eq!(
            finding.headline,
            "The machine tipped over about the left edge from t = 2.50 s until the end of the log"
        );
        assert!(finding.evidence[0].contains("28.6°"));
    }

    #[test]
    fn missing_values_are_stated_as_such() {
        let finding = scene().finding(&event(EventKind::WheelLift, "fl", f64::NAN, "N"));
        let text = finding.to_string();
        assert!(text.contains("not computable") && !text.contains("NaN"));
    }

    #[test]
    fn zero_has_no_sign() {
        let finding = scene().finding(&event(EventKind::WheelLight, "fl", -1e-13, "N"));
        let worst = &finding.evidence[0];
        assert!(
            worst.contains("Minimum load: 0 N (0.0 % of its static load"),
            "{worst}"
        );
    }
}

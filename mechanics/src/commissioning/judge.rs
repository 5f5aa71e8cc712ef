//! Answers the questions from the comparisons.
//!
//! A property is proven if the relations that show it agree and if every alternative, applied to the signals, puts a
//! relation that agrees now certainly beyond what a good machine shows. A contradiction is pinned on the signals whose
//! correction makes all relations agree. As long as something is contradicted, a relation in which it takes part proves
//! nothing.

use super::assessment::{Answers, Assessment, Figure, Item, Status};
use super::correction::{Correction, Subject, factor_text, right_angles, signed_permutations};
use super::estimate::{Estimate, Relation};
use super::evidence::{Comparison, Evidence, subjects};
use super::grid::STEP_S;
use super::question::{Question, Setting, questions};
use super::recording::Recording;
use super::roles::{Role, Roles};
use super::signals::Signals;
use super::steps::steps;
use super::travel::Source;
use std::cell::RefCell;

use crate::machine::Machine;
use crate::state::Sensors;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// A correction that would explain the contradictions.
struct Explanation {
    correction: Correction,
    /// How many relations agree with it.
    agreeing: usize,
}

/// Answers all questions about the sensors of a machine.
#[must_use]
pub fn assess(
    machine: &Machine,
    sensors: &Sensors,
    recording: &Recording,
    answers: &Answers,
) -> Assessment {
    let joints: Vec<Vec<usize>> = sensors.joints.iter().map(|s| s.joints.clone()).collect();
    let roles = Roles::new(machine);
    let signals = Signals::read(machine, recording, &joints);
    let comparison = signals
        .as_ref()
        .map(|signals| Comparison::new(machine, &roles, signals));
    let setting = Setting {
        machine,
        sensors,
        roles: &roles,
        source: comparison
            .as_ref()
            .map_or(Source::Nothing, |c| c.travel.source),
        measured: joints.concat(),
        skids: roles
            .joints(|role| matches!(role, Role::Steer { .. }))
            .is_empty(),
    };
    let questions = questions(&setting);
    let judge = Judge::new(comparison.as_ref(), &setting);
    let items = questions
        .iter()
        .map(|question| judge.item(question, answers))
        .collect();
    Assessment {
        items,
        steps: comparison.as_ref().map(steps).unwrap_or_default(),
        explanations: judge.explanation_texts(),
        duration_s: signals
            .as_ref()
            .map_or(0.0, |signals| signals.bins as f64 * STEP_S),
    }
}

/// The comparisons, and what explains their contradictions.
struct Judge<'a> {
    machine: &'a Machine,
    comparison: Option<&'a Comparison<'a>>,
    base: Evidence,
    explanations: Vec<Explanation>,
    wheels: Vec<usize>,
    source: Source,
    /// Evidence under corrections asked for before.
    known: RefCell<Vec<(Correction, Evidence)>>,
}

impl<'a> Judge<'a> {
    fn new(comparison: Option<&'a Comparison<'a>>, setting: &Setting<'a>) -> Self {
        let base = comparison.map_or(Evidence(Vec::new()), |c| {
            c.evidence(&Correction::None, None)
        });
        let mut judge = Self {
            machine: setting.machine,
            comparison,
            explanations: Vec::new(),
            wheels: setting
                .roles
                .joints(|role| matches!(role, Role::Wheel { .. })),
            source: setting.source,
            known: RefCell::new(Vec::new()),
            base,
        };
        judge.explanations = judge.explain(setting);
        judge
    }

    fn evidence(&self, correction: &Correction) -> Option<Evidence> {
        let comparison = self.comparison?;
        if let Some((_, known)) = self
            .known
            .borrow()
            .iter()
            .find(|(other, _)| other == correction)
        {
            return Some(known.clone());
        }
        let found = comparison.evidence(correction, Some(&self.base));
        self.known.borrow_mut().push((*correction, found.clone()));
        Some(found)
    }

    /// The corrections after which nothing contradicts and more agrees than before.
    fn explain(&self, setting: &Setting<'_>) -> Vec<Explanation> {
        let has_contradiction = self.base.contradictions().next().is_some();
        let unexplained: Vec<Relation> = self.base.unexplained().map(|e| e.relation).collect();
        if !has_contradiction && unexplained.is_empty() {
            return Vec::new();
        }
        let before = self.base.agreeing();
        let mut found: Vec<Explanation> = Vec::new();
        for correction in candidates(setting, &self.base) {
            let Some(evidence) = self.evidence(&correction) else {
                continue;
            };
            let agreeing = evidence.agreeing();
            let explains = unexplained
                .iter()
                .all(|&relation| evidence.agrees(relation));
            let is_better =
                agreeing > before || (is_omission(&correction) && agreeing + 3 >= before);
            if evidence.contradictions().next().is_some()
                || !is_better
                || !(has_contradiction || explains)
            {
                continue;
            }
            // Of one sensor, the first of the equally good ones: right angles and usual units come first.
            let same = found
                .iter_mut()
                .find(|other| other.correction.subjects() == correction.subjects());
            match same {
                Some(other) if agreeing > other.agreeing => {
                    *other = Explanation {
                        correction,
                        agreeing,
                    }
                }
                Some(_) => {}
                None => found.push(Explanation {
                    correction,
                    agreeing,
                }),
            }
        }
        let is_specific = |e: &Explanation| !is_omission(&e.correction);
        if found.iter().any(is_specific) {
            found.retain(is_specific);
        }
        let most = found.iter().map(|e| e.agreeing).max().unwrap_or(0);
        found.retain(|e| e.agreeing + 1 >= most);
        found
    }

    fn explanation_texts(&self) -> Vec<String> {
        let texts = self
            .explanations
            .iter()
            .map(|e| e.correction.fault(self.machine));
        texts.collect()
    }

    /// Contradicting estimates, and unexplained leans that a correction explains.
    fn contradictions(&self) -> Vec<&Estimate> {
        let mut all: Vec<&Estimate> = self.base.contradictions().collect();
        if !self.explanations.is_empty() {
            all.extend(self.base.unexplained());
        }
        all
    }

    /// Whether a relation takes part in something contradicted.
    fn is_tainted(&self, relation: Relation) -> bool {
        self.contradictions().iter().any(|e| e.relation == relation)
    }

    fn item(&self, question: &Question, answers: &Answers) -> Item {
        let (status, sigmas, text) = self.answer(question);
        let mut item = Item {
            key: question.key.clone(),
            signal: question.signal.clone(),
            property: question.property.into(),
            status,
            figure: self.figure(question),
            sigmas,
            text,
            motion: question.motion.clone(),
            asks: question.asks.map(Into::into),
        };
        if question.asks.is_some() && item.status == Status::NotShown {
            match answers.get(&item.key) {
                Some(true) => {
                    item.status = Status::Confirmed;
                    item.text = "a person confirmed it; the signals alone do not show it".into();
                }
                Some(false) => {
                    item.status = Status::Contradicted;
                    item.text = "a person denied it".into();
                }
                None => {}
            }
        }
        item
    }

    fn answer(&self, question: &Question) -> (Status, Option<f64>, String) {
        let contradictions = self.contradictions();
        let own = self
            .explanations
            .iter()
            .filter(|e| e.correction.subjects().contains(&question.subject));
        let mut own = own.peekable();
        let shows = |e: &&Estimate| self.shows(question, e.relation);
        if own.peek().is_some() && self.is_about(question, own) {
            let all = self.explanation_texts();
            let found = contradictions
                .iter()
                .map(|e| describe(self.machine, e))
                .collect::<Vec<_>>();
            return (
                Status::Contradicted,
                None,
                format!("{}. Found: {}", likely(&all), list(&found)),
            );
        }
        if let Some(estimate) = contradictions.iter().copied().find(shows) {
            let found = describe(self.machine, estimate);
            if !self.explanations.is_empty() {
                let all = self.explanation_texts();
                let text = format!(
                    "{found}, which another signal explains: {}. Correct that, and repeat",
                    list(&all)
                );
                return (Status::NotShown, None, text);
            }
            let text = match estimate.relation {
                Relation::Rate(_) => format!(
                    "{found}: relative to the change of the position the velocity is {}",
                    factor_text(estimate.value)
                ),
                Relation::Still(_) => {
                    format!("{found}: the joint seems to move while its reading stands still")
                }
                Relation::Mount(_) | Relation::DriveDirection => {
                    format!("{found}: correct [imu] rpy of the machine file, or the mounting")
                }
                _ => format!("{found}; no correction of a single signal explains it"),
            };
            return (Status::Contradicted, None, text);
        }
        let agrees = |group: &Vec<Relation>| {
            group
                .iter()
                .any(|&r| self.base.agrees(r) && !self.is_tainted(r))
        };
        if !question.needed.iter().all(agrees) {
            return (
                Status::NotShown,
                None,
                format!("missing: {}", question.motion),
            );
        }
        let mut least = f64::INFINITY;
        for alternative in &question.alternatives {
            let excluded = self
                .evidence(alternative)
                .and_then(|evidence| evidence.excludes(&self.base));
            match excluded {
                Some(sigmas) => least = least.min(sigmas),
                None => {
                    let text = format!(
                        "it could also be that {}. To exclude it: {}",
                        alternative.fault(self.machine),
                        question.motion
                    );
                    return (Status::NotShown, None, text);
                }
            }
        }
        let sigmas = least.is_finite().then_some(least);
        let own = question
            .needed
            .iter()
            .flatten()
            .filter(|&&r| self.base.agrees(r))
            .filter_map(|&r| self.base.of(r));
        let found = own
            .take(3)
            .map(|e| describe(self.machine, e))
            .collect::<Vec<_>>();
        (Status::Proven, sigmas, list(&found))
    }

    /// Whether an explanation concerns this question, and not only its sensor.
    fn is_about<'e>(
        &self,
        question: &Question,
        mut own: impl Iterator<Item = &'e Explanation>,
    ) -> bool {
        let is_listed = |correction: &Correction| question.alternatives.contains(correction);
        let shows = self
            .contradictions()
            .iter()
            .any(|e| self.shows(question, e.relation));
        own.any(|e| is_listed(&e.correction)) || shows
    }

    /// Whether a relation answers a question.
    fn shows(&self, question: &Question, relation: Relation) -> bool {
        let of_joint = |joint: usize| match relation {
            Relation::Range(other) | Relation::Still(other) => {
                other == joint && !question.key.ends_with(".velocity")
            }
            _ => false,
        };
        let is_needed = question
            .needed
            .iter()
            .flatten()
            .any(|&needed| needed == relation);
        let is_direct = match question.subject {
            Subject::Joint(joint) => of_joint(joint),
            // Every comparison with the odometry shows the odometry.
            Subject::Odometry => matches!(relation, Relation::Drive(..)),
            _ => false,
        };
        is_needed && subjects(relation, self.source, &self.wheels).contains(&question.subject)
            || is_needed && question.subject == Subject::Travel
            || is_direct
    }

    fn figure(&self, question: &Question) -> Option<Figure> {
        let mut relations = question.needed.iter().flatten();
        let estimate = relations.find_map(|&relation| self.base.of(relation))?;
        let known = estimate.value.is_finite() && estimate.sigma.is_finite();
        known.then_some(Figure {
            value: estimate.value,
            sigma: estimate.sigma,
            expected: estimate.expected,
        })
    }
}

/// Whether a correction only leaves a signal out.
fn is_omission(correction: &Correction) -> bool {
    matches!(
        correction,
        Correction::WithoutAttitude | Correction::WithoutOdometryTurning
    )
}

/// Everything that may explain a contradiction: right angles, signs, places and usual factors first, then the turn and the
/// factors that the estimates suggest.
fn candidates(setting: &Setting<'_>, base: &Evidence) -> Vec<Correction> {
    let mut all: Vec<Correction> = right_angles()
        .into_iter()
        .map(Correction::TurnImu)
        .collect();
    all.extend([1, 2, 3].map(Correction::TurnOdometry));
    all.extend(signed_permutations().into_iter().map(Correction::GyroAxes));
    let degrees = 180.0 / std::f64::consts::PI;
    all.extend([-1.0, 1.0 / degrees, degrees, 0.5, 2.0].map(Correction::ScaleGyro));
    all.extend([-1.0, 9.806_65, 1.0 / 9.806_65, 0.5, 2.0].map(Correction::ScaleForce));
    all.extend([0.5, 2.0, 1.0 / 3.6, 3.6, 0.001, 1000.0].map(Correction::ScaleOdometry));
    let movable = setting
        .measured
        .iter()
        .filter(|&&joint| *setting.roles.of(joint) != Role::Constant);
    let movable: Vec<usize> = movable.copied().collect();
    for (place, &joint) in movable.iter().enumerate() {
        let factors = [-1.0, 1.0 / degrees, degrees, 0.5, 2.0, 0.001];
        all.extend(factors.map(|factor| Correction::ScaleJoint(joint, factor)));
        all.extend(
            movable[place + 1..]
                .iter()
                .map(|&other| Correction::SwapJoints(joint.min(other), joint.max(other))),
        );
    }
    all.extend(
        [(-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(r, p)| Correction::AttitudeSigns(r, p)),
    );
    all.extend([
        Correction::WithoutAttitude,
        Correction::WithoutOdometryTurning,
    ]);
    let inverse = |relation: Relation| {
        let value = base.of(relation)?.value;
        (value.is_finite() && value.abs() > 1e-3).then(|| 1.0 / value)
    };
    all.extend(inverse(Relation::Gravity).map(Correction::ScaleForce));
    // Specific force per acceleration: an odometry that is twice too fast makes it a half.
    all.extend(
        base.of(Relation::Drive(0, 0))
            .map(|e| e.value)
            .filter(|v| v.is_finite())
            .map(Correction::ScaleOdometry),
    );
    for relation in base.0.iter().map(|e| e.relation) {
        match relation {
            Relation::Turn(_, 2) => all.extend(inverse(relation).map(Correction::ScaleGyro)),
            Relation::Wheel(joint) | Relation::Steer(joint) => {
                all.extend(inverse(relation).map(|factor| Correction::ScaleJoint(joint, factor)));
            }
            _ => {}
        }
    }
    all.extend(small_turns(base).map(Correction::TurnImu));
    all
}

/// Turns of the IMU by the angles that driving in a circle has shown.
fn small_turns(base: &Evidence) -> impl Iterator<Item = Matrix3<f64>> {
    let angle = |relation| base.of(relation).map_or(0.0, |e: &Estimate| e.value);
    let [x, y] = [0, 1].map(|axis| angle(Relation::Mount(axis)).clamp(-1.0, 1.0).asin());
    let z = -angle(Relation::DriveDirection);
    // The IMU turned by R measures R' f; the correction applies R.
    let turns = [
        Vector3::new(x, y, 0.0),
        Vector3::new(0.0, 0.0, z),
        Vector3::new(x, y, z),
    ];
    turns.into_iter().map(|turn| *Rotation3::new(turn).matrix())
}

/// "likely A, or B".
fn likely(explanations: &[String]) -> String {
    match explanations {
        [one] => format!("likely {one}"),
        all => format!("either {}", all.join(", or ")),
    }
}

fn list(texts: &[String]) -> String {
    const MOST: usize = 4;
    match texts.len() {
        0..=MOST => texts.join("; "),
        more => format!("{}; and {} more", texts[..MOST].join("; "), more - MOST),
    }
}

/// An estimate as a phrase.
fn describe(machine: &Machine, estimate: &Estimate) -> String {
    let name = |joint: usize| &machine.joints[joint].name;
    let axis = |k: usize| ["x", "y", "z"][k];
    let Estimate {
        value,
        sigma,
        expected,
        ..
    } = *estimate;
    let plain = |what: String| format!("{what} {value:.3} ± {sigma:.3}, expected {expected}");
    let degrees = |what: &str| {
        format!(
            "{what} {:.1} ± {:.1} degrees, expected 0",
            value.to_degrees(),
            sigma.to_degrees()
        )
    };
    match estimate.relation {
        Relation::Gravity => plain("specific force at rest, over gravity:".into()),
        Relation::Up => degrees("specific force at rest against the machine's up direction:"),
        Relation::Drive(row, column) => plain(format!(
            "specific force {} per acceleration {} by the travel:",
            ["forward", "to the left"][row],
            ["forward", "to the left"][column]
        )),
        Relation::DriveDirection => {
            degrees("direction of the specific force against the acceleration by the travel:")
        }
        Relation::Mount(k) => degrees(&format!(
            "tilt of the IMU about {}, apart from the slope:",
            axis(k)
        )),
        Relation::AttitudeTilt(k) => plain(format!(
            "tilt by the specific force per tilt by the orientation, along {}:",
            axis(k)
        )),
        Relation::AttitudeUp => {
            degrees("up by the orientation against the specific force at rest:")
        }
        Relation::Turn(source, k) => plain(format!(
            "angular velocity about {} per yaw rate by {}:",
            axis(k),
            source.words()
        )),
        Relation::Wheel(joint) => plain(format!("rotation of {} per travel:", name(joint))),
        Relation::WheelSide(joint) => plain(format!(
            "rotation of {} in a curve, by the side that it is on:",
            name(joint)
        )),
        Relation::WheelCurve(joint) => plain(format!(
            "rotation of {} off its path in curves, as a share:",
            name(joint)
        )),
        Relation::Steer(joint) => plain(format!(
            "angle of {} per angle at which its wheel does not slip:",
            name(joint)
        )),
        Relation::SteerOff(joint) => plain(format!(
            "angle of {} off that at which its wheel does not slip, as a share:",
            name(joint)
        )),
        Relation::Lean(joint) if value < -1.2 => format!(
            "the platform does not lean as the motion of {} should make it",
            name(joint)
        ),
        Relation::Lean(joint) if value > 10.0 => format!(
            "the positions of {} are impossible: a linkage cannot close",
            name(joint)
        ),
        Relation::Lean(joint) => format!(
            "lean of the platform per lean by the motion of {}: {:.2} ± {:.2}, expected 1",
            name(joint),
            value.exp(),
            value.exp() * sigma
        ),
        Relation::LeanUnexplained(joint) => format!(
            "{:.0} ± {:.0} % of the platform's lean do not follow {}",
            value * 100.0,
            sigma * 100.0,
            name(joint)
        ),
        Relation::Still(joint) => format!(
            "the platform leans by {:.2} mrad as if {} moved",
            value * 1e3,
            name(joint)
        ),
        Relation::Rate(joint) => plain(format!(
            "velocity of {} per change of its position:",
            name(joint)
        )),
        Relation::Range(joint) => format!(
            "{} goes beyond its limits by {:.0} % of their span",
            name(joint),
            value * 100.0
        ),
    }
}

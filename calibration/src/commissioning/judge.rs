//! Answers the questions from the comparisons.
//!
//! A property is proven if the relations that show it agree and if every alternative, applied to the signals, puts a
//! relation that agrees now certainly beyond what a good machine shows. A contradiction is pinned on the signals whose
//! correction makes all relations agree. As long as something is contradicted, a relation in which it takes part proves
//! nothing.

use std::cell::RefCell;

use super::assessment::{Answers, Assessment, Figure, Item, Status};
use super::candidates::{candidates, is_omission};
use super::correction::{Correction, Subject, factor_text};
use super::describe::{describe, likely, list};
use super::estimate::{Estimate, Relation};
use super::evidence::{Comparison, Evidence, subjects};
use super::grid::STEP_S;
use super::question::{Question, Setting, questions};
use super::recording::Recording;
use super::roles::{Role, Roles};
use super::signals::Signals;
use super::steps::steps;
use super::travel::Source;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensors;

/// A correction that would explain the contradictions.
struct Explanation {
    correction: Correction,
    /// Number of relations that agree under the correction.
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

    /// The evidence under a correction if nothing in it contradicts.
    fn without_contradiction(&self, correction: &Correction) -> Option<Evidence> {
        let found = (self.comparison?).without_contradiction(correction, &self.base)?;
        self.known.borrow_mut().push((*correction, found.clone()));
        Some(found)
    }

    /// The corrections after which nothing contradicts and more agrees than before.
    fn explain(&self, setting: &Setting<'_>) -> Vec<Explanation> {
        let has_contradiction = self.base.contradictions().next().is_some();
        let doubtful: Vec<Relation> = self.base.doubtful().map(|e| e.relation).collect();
        if !has_contradiction && doubtful.is_empty() {
            return Vec::new();
        }
        let before = self.base.agreeing();
        let mut found: Vec<Explanation> = Vec::new();
        for correction in candidates(setting, &self.base) {
            let is_of_joint = matches!(
                correction,
                Correction::ScaleJoint(..) | Correction::FlipJoints(_) | Correction::SwapJoints(..)
            );
            if !has_contradiction && !is_of_joint {
                continue;
            }
            // Axes of the accelerometer alone that are turned, where a turn of the whole IMU explains it.
            let is_turned = |e: &Explanation| matches!(e.correction, Correction::TurnImu(_));
            if let Correction::ForceAxes(axes) = correction
                && axes.determinant() > 0.0
                && found.iter().any(is_turned)
            {
                continue;
            }
            let Some(evidence) = self.without_contradiction(&correction) else {
                continue;
            };
            let agreeing = evidence.agreeing();
            let is_better =
                agreeing > before || (is_omission(&correction) && agreeing + 3 >= before);
            if !is_better {
                continue;
            }
            // Doubts alone count where a correction removes all of them, and the signals as they are are excluded beside it.
            let removes = || doubtful.iter().all(|&relation| evidence.agrees(relation));
            if !(has_contradiction || removes() && self.base.excludes(&evidence).is_some()) {
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

    /// Contradicting estimates; without any, the doubtful ones that a correction explains.
    fn contradictions(&self) -> Vec<&Estimate> {
        let all: Vec<&Estimate> = self.base.contradictions().collect();
        match all.is_empty() && !self.explanations.is_empty() {
            true => self.base.doubtful().collect(),
            false => all,
        }
    }

    /// Whether a relation is contradicted, or doubtful where only doubts are explained.
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
            range: None,
            recorded: None,
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
        self.say_where(question, &mut item);
        item
    }

    /// States the positions at which a joint is right: of a proven joint those at which it moved and was compared, of a confirmed
    /// one those of the whole recording, which a person has seen.
    fn say_where(&self, question: &Question, item: &mut Item) {
        let (Subject::Joint(joint), Some(comparison)) = (question.subject, self.comparison) else {
            return;
        };
        item.range = match item.status {
            _ if question.key.ends_with(".velocity") => None,
            Status::Proven => comparison.compared_range(joint),
            Status::Confirmed => comparison.recorded_range(joint),
            Status::Contradicted | Status::NotShown => None,
        };
        item.recorded = comparison
            .recorded_range(joint)
            .filter(|_| item.range.is_some());
        // once
        let told = item.range.filter(|_| !question.key.ends_with(".sign"));
        if let Some([least, greatest]) = told {
            let unit = if self.machine.joint_slides(joint) {
                "m"
            } else {
                "rad"
            };
            item.text += &format!(", at {least:.3} to {greatest:.3} {unit}");
            if let Some([from, to]) = self.machine.joints()[joint].limits {
                item.text += &format!(" of {from:.3} to {to:.3} {unit}");
            }
        }
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
        let turned = |e: &Explanation| e.correction.subjects().contains(&Subject::Mounting);
        if question.subject == Subject::Mounting && self.explanations.iter().any(turned) {
            let all = self.explanation_texts();
            let text = format!("{}. Correct that, and repeat", likely(&all));
            return (Status::NotShown, None, text);
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
        let compares = subjects(relation, self.source, &self.wheels);
        let is_own = compares.contains(&question.subject) || question.subject == Subject::Travel;
        is_needed && is_own || is_direct
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

//! Guesses about a machine, from its URDF and the log.

use std::collections::BTreeMap;

use tipwatch_ingest::Log;
use tipwatch_mechanics::machine::{JointMotion, Outline, OutlineLink};

use super::arm;
use super::can::Candidate;
use super::joints::{self, JointGuess};
use super::linkages::{self, LinkageGuess};
use super::signals::Topics;
use super::wheels::{self, Wheel};
use super::words::{SUPPORT, has_word};

/// All guesses.
#[derive(Clone)]
pub(super) struct Guesses {
    pub(super) outline: Outline,
    pub(super) wheels: Vec<Wheel>,
    pub(super) rejected: Vec<String>,
    pub(super) linkages: Vec<LinkageGuess>,
    pub(super) joints: Vec<JointGuess>,
    /// Moving joints without a known position.
    pub(super) unknown: Vec<String>,
    /// Signals that may be the position of an unknown joint, by unit and motion.
    pub(super) candidates: BTreeMap<String, Vec<Candidate>>,
    /// Joints that are held still on request, and the joints of cylinders that drive a measured joint.
    pub(super) frozen: Vec<String>,
    /// Cylinders of measured joints that are held still: their joints become free once their eyes are known.
    pub(super) held: Vec<LinkageGuess>,
    /// Answers of a person for the positions of frozen joints, by joint.
    pub(super) stated: BTreeMap<String, StatedPosition>,
    pub(super) arm: Option<arm::Guess>,
    pub(super) tool: Option<arm::Guess>,
}

impl Guesses {
    pub(super) fn of(outline: Outline, topics: &Topics, log: &Log) -> Self {
        let logged = topics.joints();
        let (wheels, rejected) = wheels::wheels(&outline);
        let linkages = linkages::linkages(&outline, &logged);
        let arm = arm::root(&outline, &wheels);
        let tool = arm
            .as_ref()
            .and_then(|arm| arm::tool(&outline, &arm.link, topics.wrench_frame.as_deref()));
        let mut joints = Vec::new();
        let mut unknown = Vec::new();
        for (link, described) in outline.links.iter().enumerate() {
            let Some(joint) = described.joint.as_ref().filter(|_| described.moves()) else {
                continue;
            };
            let follows = |l: &LinkageGuess| {
                l.cylinder == joint.name || {
                    // one of the two is enough
                    let of_linkage = [&l.pivot, &l.rod];
                    of_linkage.contains(&&joint.name)
                        && of_linkage.iter().any(|name| logged.contains(name))
                }
            };
            let is_wheel = wheels.iter().any(|wheel| wheel.link == link);
            let is_known = logged.contains(&joint.name) || joint.mimics || is_wheel;
            if is_known || linkages.iter().any(follows) {
                continue;
            }
            let others = outline.links.iter().filter_map(|link| link.joint.as_ref());
            let others = others.filter(|it| it.name != joint.name);
            let others: Vec<&str> = others.map(|it| it.name.as_str()).collect();
            let states = &topics.joint_states;
            match joints::find(joint, &others, states, log.topics(), &topics.can) {
                Some(guess) => joints.push(guess),
                None => unknown.push(joint.name.clone()),
            }
        }
        unknown.extend(without_contested(&mut joints));
        // a known pivot makes its rod redundant, and vice versa
        let found = |name: &String| joints.iter().any(|guess| guess.joint == *name);
        let redundant: Vec<&String> = (linkages.iter())
            .filter_map(|l| match (found(&l.pivot), found(&l.rod)) {
                (true, _) => Some(&l.rod),
                (_, true) => Some(&l.pivot),
                _ => None,
            })
            .collect();
        unknown.retain(|name| !redundant.contains(&name));
        let candidates = unknown.iter().map(|joint| {
            let mut fitting = fitting(&outline, joint, topics);
            let is_bound = |it: &Candidate| {
                let source = it.text.trim_start_matches("{ ").trim_end_matches(" }");
                let mut fields = joints.iter().flat_map(|guess| &guess.fields);
                fields.any(|field| field.source == source)
            };
            fitting.retain(|it| !is_bound(it));
            name_apart(&mut fitting);
            (joint.clone(), fitting)
        });
        Self {
            candidates: candidates.collect(),
            arm,
            tool,
            wheels,
            rejected,
            linkages,
            joints,
            unknown,
            frozen: Vec::new(),
            held: Vec::new(),
            stated: BTreeMap::new(),
            outline,
        }
    }

    /// Holds every joint still that no message measures and no guess drives.
    pub(super) fn freeze(&mut self, logged: &[String]) {
        let is_measured =
            |name: &String| logged.contains(name) || self.joints.iter().any(|j| j.joint == *name);
        let (idle, driving): (Vec<_>, Vec<_>) = self
            .linkages
            .drain(..)
            .partition(|linkage| is_measured(&linkage.pivot));
        self.linkages = driving;
        let mut frozen = std::mem::take(&mut self.frozen);
        frozen.append(&mut self.unknown);
        frozen.extend(idle.iter().flat_map(LinkageGuess::passive_joints).cloned());
        frozen.retain(|name| !logged.contains(name));
        self.frozen = frozen;
        self.held.extend(idle);
    }

    /// Leaves to the sheet the joints that it holds still, and its cylinders, whose rods follow their pivots.
    pub(super) fn leave_to_sheet(&mut self, constant: &[String]) {
        let pivots_unknown: Vec<&LinkageGuess> = (self.linkages.iter())
            .filter(|linkage| self.unknown.contains(&linkage.pivot))
            .collect();
        let is_rod = |name: &String| pivots_unknown.iter().any(|linkage| linkage.rod == *name);
        let mut unknown = self.unknown.clone();
        unknown.retain(|joint| !constant.contains(joint) && !is_rod(joint));
        self.unknown = unknown;
        self.joints.retain(|guess| !constant.contains(&guess.joint));
        self.linkages.clear();
    }

    /// Moves a cylinder that was held still, now that the places of its eyes are known.
    pub(super) fn release(&mut self, name: &str, eyes: [[f64; 3]; 2]) {
        let held = self.held.iter().position(|linkage| linkage.name == name);
        if let Some(held) = held {
            let linkage = self.held.remove(held);
            self.frozen
                .retain(|joint| !linkage.passive_joints().contains(&joint));
            self.linkages.push(linkage);
        }
        for linkage in self.linkages.iter_mut().filter(|it| it.name == name) {
            linkage.eyes = Some(eyes);
        }
    }

    /// Joints with horizontal axes between base and wheels, which may carry no torque.
    pub(super) fn pivots(&self) -> Vec<String> {
        let carries_wheel = |link: usize| {
            let mut wheels = self.wheels.iter();
            wheels.any(|w| w.link != link && self.outline.is_below(w.link, link))
        };
        let links = self.outline.links.iter().enumerate();
        let pivots = links.filter_map(|(index, link)| {
            let joint = link.joint.as_ref()?;
            let is_horizontal =
                joint.motion != JointMotion::Prismatic && joint.axis_in_base.z.abs() < 0.5;
            (link.moves() && is_horizontal && carries_wheel(index)).then(|| joint.name.clone())
        });
        pivots.collect()
    }

    /// Links on which the machine may stand besides its wheels, such as outriggers and blades: by their names, moving ones that carry
    /// nothing, and neither of the arm nor of a wheel.
    pub(super) fn feet(&self) -> Vec<String> {
        let links = &self.outline.links;
        let moves = |mut link: usize| loop {
            match (links[link].moves(), links[link].parent) {
                (true, _) => break true,
                (false, Some(parent)) => link = parent,
                (false, None) => break false,
            }
        };
        let arm = self.arm.as_ref();
        let arm = arm.and_then(|arm| links.iter().position(|link| link.name == arm.link));
        let others = || self.wheels.iter().map(|wheel| wheel.link).chain(arm);
        let is_of_another =
            |link: usize| others().any(|other| link == other || self.outline.is_below(link, other));
        let carries = |link: usize| links.iter().any(|it| it.parent == Some(link));
        let is_named = |link: usize| has_word(&links[link].name, &SUPPORT);
        let feet = (0..links.len()).filter(|&link| is_named(link) && moves(link) && !carries(link));
        let feet = feet.filter(|&link| !is_of_another(link));
        feet.map(|link| links[link].name.clone()).collect()
    }

    /// The mass that a joint carries (kg), and its share of the whole.
    pub(super) fn carried_mass(&self, joint: &str) -> [f64; 2] {
        let links = &self.outline.links;
        let is_of = |link: &OutlineLink| link.joint.as_ref().is_some_and(|j| j.name == joint);
        let total: f64 = links.iter().map(|link| link.mass).sum();
        let carried = links.iter().position(is_of).map_or(0.0, |carrier| {
            let below = (0..links.len()).filter(|&link| self.outline.is_below(link, carrier));
            below.map(|link| links[link].mass).sum()
        });
        [carried, carried / total]
    }

    /// Returns the position at which a joint is held still: zero, or its limit next to zero (rad or m).
    pub(super) fn rest(&self, joint: &str) -> f64 {
        let mut joints = self
            .outline
            .links
            .iter()
            .filter_map(|link| link.joint.as_ref());
        let limits = joints.find(|j| j.name == joint).and_then(|j| j.limits);
        limits.map_or(0.0, |[least, most]| 0.0_f64.clamp(least, most))
    }
}

/// The position of a joint that no joint states have, as a person states it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum StatedPosition {
    /// A fixed position (rad or m).
    Constant(f64),
    /// The table of a signal.
    Signal(String),
}

/// Takes away the guesses that name the same number for several joints, and returns these joints.
fn without_contested(joints: &mut Vec<JointGuess>) -> Vec<String> {
    let source = |guess: &JointGuess| guess.fields.first().map(|it| it.source.clone());
    let sources: Vec<_> = joints.iter().map(source).collect();
    let is_contested = |guess: &JointGuess| {
        let mine = source(guess);
        sources.iter().filter(|other| **other == mine).count() > 1
    };
    let (contested, clear): (Vec<_>, Vec<_>) = joints.drain(..).partition(is_contested);
    *joints = clear;
    contested.into_iter().map(|guess| guess.joint).collect()
}

/// The signals that may be the position of a joint: those of its unit that its name names, whatever their motion; else those
/// that move no further than it can, and that name no other joint.
fn fitting(outline: &Outline, joint: &str, topics: &Topics) -> Vec<Candidate> {
    let joints = outline.links.iter().filter_map(|link| link.joint.as_ref());
    let Some(joint) = joints.clone().find(|it| it.name == joint) else {
        return Vec::new();
    };
    let unit = match joint.motion {
        JointMotion::Prismatic => "m",
        _ => "rad",
    };
    let found = topics.can.positions(unit);
    let names = |it: &Candidate, joint: &str| joints::is_named(joint, &it.message, &it.signal);
    let (named, mut rest): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|it| names(it, &joint.name));
    if !named.is_empty() {
        return named;
    }
    let others: Vec<&str> = joints.map(|it| it.name.as_str()).collect();
    rest.retain(|it| {
        let of_other = others.iter().any(|other| names(it, other));
        it.moves() && joints::can_go(joint, it.span) && !of_other
    });
    rest
}

/// Distinguishes signals of the same name by their messages.
fn name_apart(candidates: &mut [Candidate]) {
    let signals: Vec<String> = candidates.iter().map(|it| it.signal.clone()).collect();
    for it in candidates {
        if signals.iter().filter(|other| **other == it.signal).count() > 1 {
            it.signal = format!("{}.{}", it.message, it.signal);
        }
    }
}

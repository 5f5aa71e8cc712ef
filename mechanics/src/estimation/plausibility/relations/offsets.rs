//! Joints whose position jumped and stayed there: an encoder that was set anew, or slipped, or one that froze in motion and has lost
//! counts. It was wrong before, or is wrong
//! since then, by a constant. Both sides count for themselves, and rows since the jump are doubted, until
//!
//! - it jumps back: what it shows now agrees with what it showed at first, as far as the joint cannot have moved meanwhile. Of one that
//!   has lost counts nobody knows how far back is;
//! - the arm has moved so that the platform leans as the position requires, and not as one without the jump would
//!   ([`super::lean`]). If it leans as the latter, that is a contradiction of its own, and the doubt stays. Of one that has lost counts
//!   the lean decides nothing: it is off by something else than what is supposed, too.

use super::super::explanation::Explanation;
use super::super::fault::{Finding, Part};
use super::super::notice::Notice;
use super::super::signal_doubt::SignalDoubt;
use super::lean::LeanRelation;
use crate::machine::{FaultKind, Machine, Proof, Proofs};

/// The jumps that stand.
#[derive(Debug, Clone)]
pub(super) struct Offsets {
    standing: Vec<Offset>,
    /// The greatest speed of each joint (rad/s or m/s).
    fastest: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Offset {
    joint: usize,
    /// Stamp of the jump (ns); `None` if the joint jumped before the first sample.
    since_ns: Option<i64>,
    /// Sum of the jumps, and the part of it that may be motion (rad or m).
    by: f64,
    moved: f64,
}

impl Offset {
    /// Whether the size of the jump is known, so that the lean may decide between this offset and none. It is unknown for a joint
    /// that has lost counts.
    fn is_determined(&self) -> bool {
        self.by.abs() > self.moved
    }
}

impl Offsets {
    /// Creates the list without jumps, with room for one of each joint.
    pub(super) fn new(machine: &Machine) -> Self {
        let joints = 0..machine.joints().len();
        let fastest: Vec<f64> = joints
            .map(|joint| machine.greatest_joint_rate(joint))
            .collect();
        Self {
            standing: Vec::with_capacity(fastest.len()),
            fastest,
        }
    }

    /// Returns the doubts about joints whose jumps stand.
    pub(super) fn doubts(&self) -> impl Iterator<Item = SignalDoubt> {
        self.standing.iter().map(|it| SignalDoubt {
            signal: Proof::Joint(it.joint),
            by: it.by,
            moved: it.moved,
        })
    }

    /// Remembers the jump of a joint before the first sample. Returns the error of the joint, if that is known.
    pub(super) fn remember(&mut self, joint: usize, by: f64, moved: f64) -> Option<f64> {
        self.standing.retain(|it| it.joint != joint);
        let offset = Offset {
            joint,
            since_ns: None,
            by,
            moved,
        };
        self.standing.push(offset);
        offset.is_determined().then_some(by)
    }

    /// Trusts the present positions of these joints, as a person says.
    pub(super) fn trust(&mut self, signals: Proofs) {
        self.standing
            .retain(|it| !signals.has(Proof::Joint(it.joint)));
    }

    /// Takes the jumps among the findings of a sample by itself.
    pub(super) fn take(
        &mut self,
        findings: &mut Vec<Finding>,
        mut lean: Option<&mut LeanRelation>,
    ) {
        let jump = |finding: &Finding| match finding.part {
            Part::Joint(joint) if finding.kind == FaultKind::Contradiction => Some(joint),
            _ => None,
        };
        for finding in findings.iter() {
            if let Some(joint) = jump(finding) {
                self.add(joint, finding);
                if let Some(lean) = &mut lean {
                    let known = self.of(joint).filter(|it| it.is_determined());
                    lean.suppose_offset(joint, known.map(|it| it.by));
                }
            }
        }
        findings.retain(|finding| jump(finding).is_none());
    }

    fn add(&mut self, joint: usize, jump: &Finding) {
        let (by, moved) = (jump.measure, jump.amount.value);
        let Some(known) = self.standing.iter_mut().find(|it| it.joint == joint) else {
            self.standing.push(Offset {
                joint,
                since_ns: Some(jump.since_ns),
                by,
                moved,
            });
            return;
        };
        let added = Offset {
            by,
            moved,
            ..*known
        };
        let (is_lost, was_lost) = (!added.is_determined(), !known.is_determined());
        let before = known.by;
        known.by += by;
        known.moved += moved;
        if is_lost || was_lost {
            known.moved = known.moved.max(known.by.abs());
        }
        // zero is not known to be right, and what is off by zero has stopped
        if (is_lost || was_lost) && known.by == 0.0 {
            known.by = by;
        }
        // while it showed another place, the joint may have gone on; one that slips again, or loses counts, comes no closer
        let returns = !is_lost && !was_lost && known.by.abs() < 0.5 * before.abs();
        let gone = match known.since_ns.filter(|_| returns) {
            Some(since_ns) => {
                let meanwhile_s = jump.since_ns.saturating_sub(since_ns).max(0) as f64 * 1e-9;
                self.fastest[joint] * meanwhile_s
            }
            None => 0.0,
        };
        if returns && known.by.abs() <= known.moved + gone {
            self.standing.retain(|it| it.joint != joint);
        }
    }

    /// Ends the doubts that the lean of the platform refutes.
    pub(super) fn end_refuted(&mut self, lean: &LeanRelation) {
        self.standing.retain(|it| !lean.refutes_offset(it.joint));
    }

    fn of(&self, joint: usize) -> Option<&Offset> {
        self.standing.iter().find(|it| it.joint == joint)
    }

    /// Returns the notice that a joint contradicts itself since it jumped; for a joint that jumped before the first sample, since
    /// that sample, at `stamp_ns`.
    pub(super) fn standing(&mut self, joint: usize, stamp_ns: i64) -> Option<Notice> {
        let known = self.standing.iter_mut().find(|it| it.joint == joint)?;
        let since_ns = *known.since_ns.get_or_insert(stamp_ns);
        let offset = Notice::offset(since_ns, known.by, known.moved);
        Some(offset.explained(Explanation::JointOffset(joint)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::fault::{Amount, Component};
    use super::*;
    use crate::machine::Policy;
    use crate::state::Sensor;

    /// Returns the error of a joint after jumps, each with the part of it that may be motion, and that part of the error; `None`
    /// once the joint is back.
    fn off(jumps: &[[f64; 2]]) -> Option<[f64; 2]> {
        let mut offsets = Offsets {
            standing: Vec::new(),
            fastest: vec![0.0],
        };
        for (&[by, moved], stamp_ns) in jumps.iter().zip(1..) {
            let jump = Finding {
                sensor: Sensor::Joints(0),
                part: Part::Joint(0),
                kind: FaultKind::Contradiction,
                component: Component::Value,
                policy: Policy::Invalid,
                since_ns: stamp_ns,
                possible_since_ns: stamp_ns,
                stamp_ns,
                measure: by,
                limit: f64::NAN,
                amount: Amount {
                    value: moved,
                    rate: 0.0,
                },
                explanation: None,
            };
            offsets.add(0, &jump);
        }
        offsets.of(0).map(|it| [it.by, it.moved])
    }

    #[test]
    fn a_jump_back_ends_the_doubt_and_a_loss_of_counts_never_does() {
        assert_eq!(off(&[[1.5, 0.02], [-1.5, 0.02]]), None);
        assert!(off(&[[1.5, 0.02], [1.5, 0.02]]).is_some());
        // it has lost counts twice, or slipped and lost some, or lost some and slipped
        for jumps in [
            [[-0.9, 0.9], [0.5, 0.5]],
            [[-0.9, 0.9], [0.9, 0.9]],
            [[1.5, 0.02], [-0.9, 0.9]],
            [[-0.9, 0.9], [-1.5, 0.02]],
            // by as much as is supposed, which may be the wrong way
            [[-0.9, 0.9], [0.85, 0.02]],
            [[-0.9, 0.9], [0.9, 0.02]],
        ] {
            let [by, moved] = off(&jumps).expect("it stands");
            assert!(by != 0.0 && by.abs() <= moved, "{jumps:?} {by} {moved}");
        }
    }
}

//! Joints whose position jumped and stayed there: an encoder that was set anew, or slipped. It was wrong before, or is wrong
//! since then, by a constant. Both sides count for themselves, and rows since the jump are doubted, until
//!
//! - it jumps back: what it shows now agrees with what it showed at first;
//! - the arm has moved so that the platform leans as the position requires, and not as one without the jump would
//!   ([`super::lean`]). If it leans as the latter, that is a contradiction of its own, and the doubt stays.

use super::super::explanation::Explanation;
use super::super::fault::{Finding, Part};
use super::super::notice::Notice;
use super::lean::LeanRelation;
use crate::machine::FaultKind;

/// The jumps that stand.
#[derive(Debug, Clone, Default)]
pub(super) struct Offsets(Vec<Offset>);

#[derive(Debug, Clone, Copy)]
struct Offset {
    joint: usize,
    since_ns: i64,
    /// Sum of the jumps (rad or m), and what of it may be motion.
    by: f64,
    moved: f64,
}

impl Offsets {
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
                    lean.suppose_offset(joint, self.of(joint).map(|it| it.by));
                }
            }
        }
        findings.retain(|finding| jump(finding).is_none());
    }

    fn add(&mut self, joint: usize, jump: &Finding) {
        let (by, moved) = (jump.measure, jump.amount.value);
        let Some(known) = self.0.iter_mut().find(|it| it.joint == joint) else {
            self.0.push(Offset {
                joint,
                since_ns: jump.since_ns,
                by,
                moved,
            });
            return;
        };
        known.by += by;
        known.moved += moved;
        if known.by.abs() <= known.moved {
            self.0.retain(|it| it.joint != joint);
        }
    }

    /// Ends the doubts that the lean of the platform refutes.
    pub(super) fn end_refuted(&mut self, lean: &LeanRelation) {
        self.0.retain(|it| !lean.refutes_offset(it.joint));
    }

    fn of(&self, joint: usize) -> Option<&Offset> {
        self.0.iter().find(|it| it.joint == joint)
    }

    /// That a joint contradicts itself since it jumped.
    pub(super) fn standing(&self, joint: usize) -> Option<Notice> {
        let known = self.of(joint)?;
        Some(Notice {
            explanation: Some(Explanation::JointOffset(joint)),
            ..Notice::offset(known.since_ns, known.by, known.moved)
        })
    }
}

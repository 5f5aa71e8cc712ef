//! Measurements that would decide how the load is split where equilibrium leaves it open: none that the log has already.

use tipwatch_language::{say, word};

use crate::analysis::Analysis;
use crate::events::support_words::SupportWord;

/// A measurement, or a statement, that would decide it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Deciding {
    /// Of these loads, which nothing measures.
    Weighing,
    /// Of loads that are measured, but leave the split open.
    MoreExactLoads,
    /// In the cylinders of a suspension, of which no force is logged.
    CylinderPressures,
    FlatGround,
}

impl Deciding {
    /// Returns the measurements that would decide the loads of some wheels or other supports, by their indices.
    pub(super) fn of(analysis: &Analysis, wheels: &[usize]) -> Vec<Self> {
        let machine = &analysis.machine;
        let forces = || machine.contact().actuated_joints.iter();
        let is_measured = |wheel: &usize| {
            let mut cells = analysis.measured_loads.sensors.iter();
            forces().any(|force| force.support_place() == Some(*wheel))
                || cells.any(|cell| cell.sensor.places(machine).eq([*wheel]))
        };
        let mut ways = vec![match wheels.iter().all(is_measured) {
            true => Self::MoreExactLoads,
            false => Self::Weighing,
        }];
        if machine.suspension().is_some() && !forces().any(|force| force.linkage().is_some()) {
            ways.push(Self::CylinderPressures);
        }
        if machine.contact().mean_stiffness.is_none() {
            ways.push(Self::FlatGround);
        }
        ways
    }

    /// In a few words, of a list.
    pub(super) fn short(self) -> &'static str {
        match self {
            Self::Weighing => word!("weighing"),
            Self::MoreExactLoads => word!("more exact measured loads"),
            Self::CylinderPressures => word!("cylinder pressures"),
            Self::FlatGround => word!("known flat ground"),
        }
    }

    /// Describes the measurement, for wheels or other supports with this name.
    fn in_full(self, word: SupportWord) -> String {
        match self {
            Self::Weighing => say!("weighing the {} where the machine stood", word.many),
            Self::MoreExactLoads => self.short().into(),
            Self::CylinderPressures => {
                word!("logging the pressures of the cylinders that carry the wheels").into()
            }
            Self::FlatGround => say!(
                "stating flat ground and the stiffness of the {} in the machine file, if the ground was flat",
                if word.is_wheel() {
                    word!("tyres")
                } else {
                    word.many
                }
            ),
        }
    }

    /// All of them as one sentence without a period.
    pub(super) fn sentence(ways: &[Self], word: SupportWord) -> String {
        let ways: Vec<String> = ways.iter().map(|way| way.in_full(word)).collect();
        say!("To decide it: {}", ways.join(word!("; or ")))
    }
}

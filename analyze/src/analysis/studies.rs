//! All studies of a log: one line for each.

use tipwatch_mechanics::State;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::studies::monte_carlo::Band;

use super::accelerometer_bias::RemovedBias;
use super::digest::{Digest, DigestPass};
use super::imu_check::MountingCheck;
use super::margin::{MarginPass, Margins};
use super::measured_torques::TorquesUsed;
use super::model_comparison::{ModelComparison, ModelStudy};
use super::of_events::{EventStudy, FoundEvents};
use super::posture_range::PostureRange;
use super::prediction::PredictionSeen;
use super::quasi_static::{Exclusion, ExclusionPass};
use super::sensitivity::{SensitivityPass, SensitivityStudy};
use super::study::{Block, KnownRow, StudiedLog, Study};
use super::tested_signs::TestedSigns;
use crate::base::rows::Rows;
use crate::events::Event;

/// Declares the studies and their findings: one line of name, study and what it finds for each.
macro_rules! studies {
    ($($(#[doc = $about:literal])+ $name:ident: $study:ty => $found:ty,)+) => {
        /// All studies of a log.
        pub(super) struct Studies<'a> {
            $($(#[doc = $about])+ pub(super) $name: $study,)+
        }

        /// The findings of all studies.
        pub(super) struct Found {
            $($(#[doc = $about])+ pub(super) $name: $found,)+
        }

        impl<'a> Study<'a> for Studies<'a> {
            type Found = Found;

            fn begin(log: &StudiedLog<'a>) -> Self {
                Self { $($name: Study::begin(log),)+ }
            }

            fn take(&mut self, block: &Block<'a>) {
                $(self.$name.take(block);)+
            }

            fn take_row(&mut self, row: &KnownRow<'_>) {
                $(self.$name.take_row(row);)+
            }

            fn take_part(&mut self, machine: &Machine, rows: &Rows) {
                $(self.$name.take_part(machine, rows);)+
            }
        }

        impl From<Studies<'_>> for Found {
            fn from(studies: Studies<'_>) -> Self {
                Self { $($name: studies.$name.into(),)+ }
            }
        }
    };
}

studies! {
    /// The reasons of all rows.
    reasons: Vec<Reasons> => Vec<Reasons>,
    /// The events of the machine.
    events: EventStudy<'a> => FoundEvents,
    /// Derivatives of the loads on each set of supports; none for models without them.
    sensitivity: SensitivityStudy => Vec<SensitivityPass>,
    /// Comparisons with the other models.
    comparisons: ModelStudy => Vec<Result<ModelComparison, String>>,
    /// Bands of the drawn machines.
    bands: Vec<Band> => Vec<Band>,
    /// Key figures.
    digest: DigestPass<'a> => Digest,
    /// The margins.
    margins: MarginPass<'a> => Margins,
    /// Lifts that cannot be excluded between rows.
    exclusion: ExclusionPass<'a> => (Vec<Event>, Option<Exclusion>),
    /// Predicted lifts.
    predictions: PredictionSeen => PredictionSeen,
    /// The specific force of steady rows.
    mounting: MountingCheck => MountingCheck,
    /// Signs and order of sensors that the motion tests.
    signs: TestedSigns => TestedSigns,
    /// Rows in which measured torques determined the load split.
    torques: TorquesUsed => TorquesUsed,
    /// The bias that was subtracted from the accelerometer.
    bias: RemovedBias => RemovedBias,
    /// The range of each joint.
    postures: PostureRange => Vec<[f64; 2]>,
}

impl<'a> Studies<'a> {
    /// Hands a block to every study: as a whole, row by row, and part by part.
    pub(super) fn take_all(&mut self, block: &Block<'a>) {
        self.take(block);
        for (_, machine, rows) in block.parts.iter().filter_map(|part| part.standing.as_ref()) {
            let mut state = State::zero(machine);
            for row in (0..rows.len()).filter(|&row| !rows.reasons[row].leave_state_unknown()) {
                rows.states.get(row, &mut state);
                self.take_row(&KnownRow {
                    machine,
                    rows,
                    row,
                    state: &state,
                });
            }
            self.take_part(machine, rows);
        }
    }
}

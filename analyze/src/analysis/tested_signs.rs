//! Signs and order of sensors: which of them the motion of a log tests.

use tipwatch_language::{say, word};
use tipwatch_mechanics::estimation::plausibility::{Excitation, Unshown};
use tipwatch_mechanics::machine::{Machine, Note, NoteKind, Proof, SessionProofs};

use super::notes::{NotedLog, Notes};
use super::study::{KnownRow, StudiedLog, Study};

/// Evidence of the motion on signs and order of the sensors.
pub(super) struct TestedSigns(Excitation);

impl Study<'_> for TestedSigns {
    type Found = Self;

    fn begin(log: &StudiedLog<'_>) -> Self {
        Self(Excitation::new(log.machine))
    }

    fn take_row(&mut self, row: &KnownRow<'_>) {
        self.0.take(row.rows.times_ns[row.row], row.state);
    }
}

impl Notes for TestedSigns {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let untested = self.0.statement(&log.loaded.machine, word!("this log"));
        let untested = untested.map(|text| Note::new(NoteKind::Untested, text));
        untested.into_iter().collect()
    }
}

impl TestedSigns {
    /// The joints of the arm whose encoder reads exactly zero in every sample of the log.
    pub(super) fn of_zeros(&self, machine: &Machine, shown: SessionProofs) -> Option<Note> {
        let unshown = self.0.unshown();
        let only_zeros = shown.unchanged.shared_with(shown.at_zero);
        let joints = unshown.iter().filter_map(|it| match it {
            Unshown::Joint(joint) if only_zeros.has(Proof::Joint(*joint)) => {
                Some(machine.joints()[*joint].name.as_str())
            }
            _ => None,
        });
        let joints: Vec<&str> = joints.collect();
        (!joints.is_empty()).then(|| {
            let text = say!(
                "The position of {} is exactly 0 in every sample. So reads an encoder that nobody reads, too: if the arm stood \
                 elsewhere, the loads are those of another posture.",
                joints.join(", ")
            );
            Note::new(NoteKind::Untested, text)
        })
    }
}

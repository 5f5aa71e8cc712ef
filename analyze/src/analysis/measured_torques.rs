//! The share of rows in which measured torques determined the load split.

use tipwatch_language::say;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{Machine, Note};

use super::notes::{NotedLog, Notes};
use super::study::{StudiedLog, Study};
use crate::base::rows::Rows;

/// Counts rows with known supports, and those among them whose load split follows from measured torques.
#[derive(Debug, Clone, Default)]
pub struct TorquesUsed {
    rows: usize,
    /// Number of rows in which measured forces determined the load split.
    pub rows_by_forces: usize,
}

impl Study<'_> for TorquesUsed {
    type Found = Self;

    fn begin(_: &StudiedLog<'_>) -> Self {
        Self::default()
    }

    fn take_part(&mut self, _: &Machine, rows: &Rows) {
        self.rows += rows.len();
        if let Some(used) = rows.outcomes.known_column(Quantity::MeasuredTorques) {
            self.rows_by_forces += used.iter().filter(|&&torques| torques > 0.0).count();
        }
    }
}

impl Notes for TorquesUsed {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let sensors = &log.loaded.matched.sensors;
        let machine = &log.loaded.machine;
        let mut linkages: Vec<&str> = (sensors.actuators.iter())
            .map(|signal| &machine.contact().actuated_joints[signal.joint])
            .map(|joint| joint.name(machine.linkages()))
            .collect();
        linkages.dedup();
        let linkages = linkages.join(", ");
        let text = match (linkages.is_empty(), self.rows_by_forces) {
            (true, _) => return Vec::new(),
            (false, 0) => say!(
                "The forces of {} were not used: they are missing in every row, or the model cannot use them.",
                linkages
            ),
            (false, with) => say!(
                "In {:.1} % of the rows the measured forces of {} determined the load split. There \
                 the split rule has no effect, and envelope and standard deviations follow from the forces.",
                100.0 * with as f64 / self.rows as f64,
                linkages
            ),
        };
        vec![text.into()]
    }
}

//! Second step: the states of the rows, and the findings from the samples alone. After it the samples are forgotten.

use anyhow::{Result, bail};
use tipwatch_mechanics::machine::Note;
use tipwatch_mechanics::state::Reason;

use super::super::clock::ClockOffsets;
use super::super::estimate::{SignalQuality, estimate_on_one_clock};
use super::super::health::{self, SensorHealth};
use super::super::inputs::{self, GrossInput};
use super::super::task::Task;
use super::read::ReadLog;
use crate::base::estimated::EstimatedRows;

/// The states of a log.
pub(in crate::analysis) struct EstimatedLog {
    pub(super) rows: EstimatedRows,
    pub(super) samples: SampleFindings,
}

/// Findings from the samples of a log alone.
pub(in crate::analysis) struct SampleFindings {
    pub(super) quality: SignalQuality,
    /// The offsets between the clocks of its topics.
    pub(super) clock: ClockOffsets,
    /// Grossly wrong inputs. While there is any, no row is valid.
    pub(super) gross_inputs: Vec<GrossInput>,
    /// Reason why the slope of the ground is unknown, if it is.
    pub(super) note_on_slope: Option<Note>,
    /// Note that nothing tests the mounting of the IMU, if nothing does.
    pub(super) untested_mounting: Option<Note>,
    /// Note on the ground that gave way under the standing machine, with the time, if it did.
    pub(super) note_on_ground: Option<Note>,
    pub(super) health: Vec<SensorHealth>,
}

impl EstimatedLog {
    /// Estimates the states of all rows in the requested time range.
    ///
    /// # Errors
    /// No row remains, or samples cannot be read.
    pub(in crate::analysis) fn estimate(task: &Task<'_>, read: &mut ReadLog) -> Result<Self> {
        let (loaded, forces) = (&mut read.loaded, &mut read.forces);
        let (mut rows, quality, clock) = estimate_on_one_clock(loaded, forces, &task.options)?;
        let rotations = &quality.rotations;
        let gross_inputs = inputs::gross_inputs(&task.log, task.file, loaded, &rows, rotations)?;
        let note_on_slope = inputs::notes_on_slope(loaded).map(Note::from);
        let untested_mounting = inputs::untested_mounting(loaded);
        let health = health::of(loaded, &quality.counts);
        loaded.check_read()?;
        loaded.forget_samples();
        if !gross_inputs.is_empty() {
            for reasons in &mut rows.reasons {
                reasons.add(Reason::GrossInput);
            }
        }
        if rows.is_empty() {
            bail!(
                "{}: expected usable joint states in the requested time range, found none",
                task.path.display()
            );
        }
        Ok(Self {
            rows,
            samples: SampleFindings {
                quality,
                clock,
                gross_inputs,
                note_on_slope,
                untested_mounting,
                note_on_ground: None,
                health,
            },
        })
    }
}

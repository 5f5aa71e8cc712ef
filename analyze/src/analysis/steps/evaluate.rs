//! Fifth step: the table, of which every row can be computed from here on.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use tipwatch_binding::Commissioning;
use tipwatch_mechanics::estimation::plausibility::SignalDoubt;
use tipwatch_mechanics::machine::{Commissioned, Note};
use tipwatch_mechanics::state::Reason;

use super::super::estimate::first_posture;
use super::super::evaluation::{self, OtherModels};
use super::super::ground::MovedGround;
use super::super::provenance::commissioning;
use super::super::rotations;
use super::super::standing_rows::{StandingRows, min_loads};
use super::super::task::Task;
use super::super::verdicts;
use super::estimate::{EstimatedLog, SampleFindings};
use super::prepare::PreparedMachine;
use super::read::ReadLog;
use crate::base::options::Estimator;
use crate::base::support_sets::SupportSets;
use crate::base::table::Table;
use crate::base::verdicts::{MonitorRecord, ProofRecord};
use crate::events::{FoundRotation, Stories, Turning};

/// The table of a log.
pub(in crate::analysis) struct EvaluatedLog {
    pub(super) table: Table,
    pub(super) samples: SampleFindings,
    /// Rotations of the platform about an edge.
    pub(super) rotations: Vec<FoundRotation>,
    /// Rotation of the platform about each edge at the end of the log, if a fall may have begun.
    pub(super) turning: Vec<Turning>,
    /// The models to compare with.
    pub(super) others: OtherModels,
    /// The commissioning of the machine and its file.
    pub(super) commissioning: Option<(PathBuf, Commissioning)>,
}

impl EvaluatedLog {
    /// Makes the table. Its rows are computed on request.
    pub(in crate::analysis) fn evaluate(
        task: &Task<'_>,
        read: &ReadLog,
        estimated: EstimatedLog,
        prepared: &PreparedMachine,
    ) -> Result<Self> {
        let (loaded, scope, options) = (&read.loaded, read.scope, &task.options);
        let EstimatedLog {
            mut rows,
            mut samples,
        } = estimated;
        let posture = first_posture(&loaded.machine, &rows);
        let has_odometry = loaded.matched.sensors.odometry;
        let machine = &loaded.machine;
        let model = evaluation::model(machine, options.model, &posture, has_odometry, options)?;
        let mut gross = samples.gross_inputs.iter();
        let are_hidden = gross.any(|input| input.kind.hides_rotations());
        let quality = &mut samples.quality;
        let (rotations, rotating, turning) = match task.is_recorded() && !are_hidden {
            true => (
                std::mem::take(&mut quality.rotations),
                std::mem::take(&mut quality.rotating),
                std::mem::take(&mut quality.turning),
            ),
            false => Default::default(),
        };
        if !task.is_recorded() {
            // how the platform moved in the recorded fall belongs to that fall, not to what is supposed
            let falls = quality.rotations.iter().map(FoundRotation::span_ns);
            let falls: Vec<[i64; 2]> = falls.collect();
            rows.add_reason(&falls, Reason::SupportsUnknown);
        }
        // the causal estimator follows them itself, and the smoother knows nothing of what was before
        let inherited: &[SignalDoubt] = match options.estimator {
            Estimator::Smoother => &loaded.signal_doubts.inherited.doubts,
            Estimator::Causal => &[],
        };
        let record = match scope.sensitivities {
            true => verdicts::monitor_record(&task.log, inherited)?,
            false => MonitorRecord::default(),
        };
        if record.is_contradicted {
            let reasons = rows.reasons.iter_mut();
            reasons.for_each(|reasons| reasons.add(Reason::Contradiction));
        }
        let doubted = record.doubted_rows.iter();
        let doubted: Vec<[i64; 2]> = doubted.map(|&time_ns| [time_ns; 2]).collect();
        rows.add_reason(&doubted, Reason::Contradiction);
        let commissioning = commissioning(task.file, loaded)?;
        let commissioned =
            (commissioning.as_ref()).map_or(Commissioned::NONE, |(_, found)| found.proven(machine));
        let named = prepared.named(machine);
        let mut table = Table::new(named, rows, scope, &model, record)
            .rotating(rotating)
            .supposing(!task.is_recorded())
            .turning_by_gyro(loaded.matched.sensors.imu)
            .resting_on(ProofRecord {
                needed: machine.needed_proofs(&loaded.matched.sensors),
                commissioned,
                shown: std::mem::take(&mut quality.shown),
            });
        if let Some((named, sets)) = &prepared.on_supports {
            table = table.on_supports(named, SupportSets::clone(sets));
        }
        if options.estimator == Estimator::Causal {
            // the smoother knows what follows: its states would predict what they have seen
            table = table.predicting(std::mem::take(&mut quality.commands));
        }
        if let Some(quasi_static) = &read.quasi_static {
            quasi_static.apply(&mut table);
        } else if options.estimator == Estimator::Smoother && task.is_recorded() {
            // in retrospect alone: the live monitor has no memory of where the machine came to stand
            let falls = rotations.iter().filter(|it| it.spell.rested_ns.is_none());
            let falls: Vec<[i64; 2]> = falls.map(FoundRotation::span_ns).collect();
            if let Some(ground) = MovedGround::of(named, &table, &falls) {
                samples.note_on_ground = ground.note(table.times_ns[0]).map(Note::from);
                table.widen_by(Arc::new(ground));
            }
        }
        if options.estimator == Estimator::Smoother && !rotations.is_empty() {
            let rotated = {
                let standing = StandingRows::all(named, &table, min_loads);
                let stories = Stories {
                    machine: named,
                    table: &table,
                    scope,
                    rotations: &rotations,
                };
                rotations::told(&stories, &standing, &prepared.measured_loads)
            };
            table.rotated(rotated);
        }
        let others = match &prepared.on_supports {
            Some(_) => OtherModels::none(),
            None => OtherModels::new(named, &posture, has_odometry, options),
        };
        Ok(Self {
            table,
            samples,
            rotations,
            turning,
            others,
            commissioning,
        })
    }
}

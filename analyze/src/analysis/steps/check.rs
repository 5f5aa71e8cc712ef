//! Fourth step: comparison of sensors with each other, beside the states: measured loads, cylinder forces, lengths.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reason;

use super::super::measured_loads::{Comparison, LoadComparison};
use super::super::redundancy;
use super::super::task::Task;
use super::estimate::EstimatedLog;
use super::prepare::PreparedMachine;
use super::read::ReadLog;
use crate::base::estimated::EstimatedRows;
use crate::base::options::Estimator;
use crate::events::Event;
use crate::load::MeasuredLoads;

/// Results of comparing the sensors.
#[derive(Default)]
pub(in crate::analysis) struct CheckedLog {
    /// Measured against computed loads.
    pub(super) load_comparison: LoadComparison,
    /// Sensors that contradict each other.
    pub(super) contradicted: Vec<Event>,
}

impl CheckedLog {
    /// Compares the sensors of a log. Nothing is compared under hypotheses, or by a model without bands.
    pub(in crate::analysis) fn check(
        task: &Task<'_>,
        read: &ReadLog,
        estimated: &mut EstimatedLog,
        prepared: &PreparedMachine,
    ) -> Self {
        if !(read.scope.sensitivities && task.is_recorded()) {
            return Self::default();
        }
        let (loaded, rows) = (&read.loaded, &mut estimated.rows);
        let motion = read.quasi_static.as_ref().map(|found| found.rows.as_ref());
        let measured = prepared.measured_loads.as_ref();
        let load_comparison = Comparison {
            standing: &loaded.standing(),
            rows,
            measured,
            motion,
        }
        .compare();
        if task.options.estimator == Estimator::Smoother {
            follow_loads(&loaded.machine, rows, measured, &load_comparison);
        }
        let contradicted = match estimated.samples.gross_inputs.is_empty() {
            true => redundancy::contradictions(&task.log, task.file, loaded, &read.forces, rows),
            false => Vec::new(),
        };
        Self {
            load_comparison,
            contradicted,
        }
    }
}

/// Replaces computed loads by measured ones where all supports are measured and the measured loads contradict the computed ones;
/// slowly measured loads hold their last sample. Where no load on the tool explains the difference, either may be wrong: such
/// rows are in doubt.
///
/// This takes the whole log. The rows of the causal estimator are doubted from when past rows contradict each other, as live, and
/// follow no measured load.
fn follow_loads(
    machine: &Machine,
    rows: &mut EstimatedRows,
    measured: &MeasuredLoads,
    comparison: &LoadComparison,
) {
    let followed = comparison.contradictions.iter();
    let followed = followed.filter(|span| span.is_followed());
    let spans: Vec<[i64; 2]> = followed.map(|span| [span.start_ns, span.end_ns]).collect();
    let (held, times_ns) = match spans.is_empty() {
        true => Default::default(),
        false => (measured.held.clone(), rows.times_ns.clone()),
    };
    rows.change(machine, &spans, move |row, state| {
        // what is unknown stays unknown
        state.follows_supports = state.follows_supports * 0.0 + 1.0;
        for (joint, force) in state.actuator_force.iter_mut().enumerate() {
            if force.is_nan() {
                *force = held.at(joint, times_ns[row]);
            }
        }
    });
    let open = comparison.contradictions.iter();
    let open = open.filter(|span| !span.is_explained());
    let spans: Vec<[i64; 2]> = open.map(|span| [span.start_ns, span.end_ns]).collect();
    rows.add_reason(&spans, Reason::Contradiction);
}

//! Third step: the machine as it was in this log, with its payloads and reference loads, on each set of its supports.

use std::sync::Arc;

use anyhow::{Error, Result};
use tipwatch_language::say;
use tipwatch_mechanics::machine::Machine;

use super::super::Analysis;
use super::super::advice::{Hypothesis, SupposedStates};
use super::super::payload::{self, EstimatedPayload};
use super::super::supports;
use super::super::task::Task;
use super::estimate::EstimatedLog;
use super::read::ReadLog;
use crate::base::state_source::StateSource;
use crate::base::support_sets::{SupportSet, SupportSets};
use crate::load::MeasuredLoads;

/// Data prepared for the machine of a log. The machine itself is that of [`ReadLog`], and does not change any more.
pub(in crate::analysis) struct PreparedMachine {
    pub(super) measured_loads: Arc<MeasuredLoads>,
    /// Payload masses estimated from cylinder forces.
    pub(super) payloads: Vec<EstimatedPayload>,
    /// Sets of supports with the machine that names the results on all of them, if supports come and go.
    pub(super) on_supports: Option<(Machine, SupportSets)>,
}

impl PreparedMachine {
    /// Completes the machine of the log by the parameters that the log determines.
    ///
    /// # Errors
    /// The stated reference posture has no static loads, or a requested result is not computed for supports that come and go.
    pub(in crate::analysis) fn prepare(
        task: &Task<'_>,
        read: &mut ReadLog,
        estimated: &mut EstimatedLog,
    ) -> Result<Self> {
        let (loaded, rows) = (&mut read.loaded, &mut estimated.rows);
        supports::check_options(loaded, &task.options)?;
        let measured_loads = Arc::new(MeasuredLoads::read(&task.log, task.file, loaded));
        let of_payloads =
            payload::follow_signals(&task.log, task.file, loaded, rows, task.options.estimator)?;
        loaded.notes.extend(of_payloads);
        let payloads = payload::estimate_all(task.file, &mut loaded.machine, &read.forces, rows)?;
        if let Err(error) = loaded.machine.set_reference_loads() {
            let is_stated = loaded.machine.reference().posture.is_stated;
            // a gross input explains more than its consequence, and forbids every conclusion already
            if is_stated && estimated.samples.gross_inputs.is_empty() {
                return Err(error.into());
            }
            // The loads do not need the reference. Without it utilisation is unknown, and no row is safe.
            let note = say!("Utilisation is unknown: {error}.");
            loaded.notes.push(note);
        }
        let recorded_by = loaded.machine.clone();
        let Some((hypotheses, recorded)) = task.supposed else {
            let unchanged = (&recorded_by, &Ok as &dyn Fn(Machine) -> _);
            let on_supports = supports::of_rows(loaded, unchanged, &rows.times_ns, read.scope);
            return Ok(Self {
                measured_loads,
                payloads,
                on_supports,
            });
        };
        // what is supposed changes no reference load
        let suppose =
            |machine: Machine| Hypothesis::machine(hypotheses, &machine.measured_at_base());
        loaded.machine = suppose(recorded_by.clone()).map_err(Error::msg)?;
        let mut on_supports =
            supports::of_rows(loaded, (&recorded_by, &suppose), &rows.times_ns, read.scope);
        if let Some((_, supports)) = &mut on_supports {
            supports.are_measured = false;
        }
        let standing = match &on_supports {
            Some((_, supports)) => of_sets(recorded, supports),
            None => vec![[recorded.machine.measured_at_base(), loaded.machine.clone()]],
        };
        let sets = on_supports.as_ref().map(|(_, supports)| supports.clone());
        let times = (rows.times_ns.clone(), rows.first);
        rows.look_through(|recorded| -> Arc<dyn StateSource> {
            let hypotheses = hypotheses.to_vec();
            let standing = (standing, sets);
            Arc::new(SupposedStates::new(
                recorded,
                recorded_by,
                standing,
                hypotheses,
                times,
            ))
        });
        Ok(Self {
            measured_loads,
            payloads,
            on_supports,
        })
    }

    /// The machine that names the results, of the machine of the log.
    pub(super) fn named<'a>(&'a self, machine: &'a Machine) -> &'a Machine {
        let named = self.on_supports.as_ref().map(|(named, _)| named);
        named.unwrap_or(machine)
    }
}

/// The machine as recorded and as supposed, on each of its sets of supports.
fn of_sets(recorded: &Analysis, supposed: &SupportSets) -> Vec<[Machine; 2]> {
    let as_recorded = recorded.rows.supports();
    let of_set = |set: &SupportSet| {
        let mut same = as_recorded.into_iter().flat_map(|supports| &supports.sets);
        let same = same.find(|it| it.machine.stands_on() == set.machine.stands_on());
        let recorded = same.map_or(&set.machine, |same| &same.machine);
        [recorded.measured_at_base(), set.machine.clone()]
    };
    supposed.sets.iter().map(of_set).collect()
}

//! One pass over the rows of a log: everything that an analysis needs of all of them is gathered block by block.

use std::sync::Arc;

use anyhow::Result;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::studies::monte_carlo::Band;
use tipwatch_mechanics::{OutcomeColumns, Scope};

use super::digest::{Digest, DigestPass};
use super::evaluation::OtherModels;
use super::model_comparison::{ComparedModel, ModelComparison};
use super::monte_carlo::{MonteCarlo, MonteCarloPass};
use super::notes::Seen;
use super::quasi_static::{Exclusion, ExclusionPass};
use super::sensitivity::SensitivityPass;
use crate::base::options::Options;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::events::{AnyPass, Event, Found, FoundRotation, OnSet, Stories};
use crate::load::MeasuredLoads;

/// Receives the rows of a log block by block, in order.
pub trait RowSink: Send {
    /// Takes the next rows.
    ///
    /// # Errors
    /// They cannot be written.
    fn take(&mut self, rows: &Arc<Rows>) -> Result<()>;

    /// Is told that all events that begin before a row, which is at this time (ns), are among these. After the last row
    /// there is no such row, and no time.
    ///
    /// # Errors
    /// Rows cannot be written.
    fn settle(&mut self, _row: usize, _time_ns: Option<i64>, _events: &[Event]) -> Result<()> {
        Ok(())
    }
}

/// Keeps no row: for what the analysis itself gathers.
impl RowSink for () {
    fn take(&mut self, _rows: &Arc<Rows>) -> Result<()> {
        Ok(())
    }
}

/// What a sink can know before the first row.
#[derive(Debug, Clone, Copy)]
pub struct Prepared<'a> {
    /// The machine, with its reference loads.
    pub machine: &'a Machine,
    /// The table, of which only times are known.
    pub table: &'a Table,
    /// The options used.
    pub options: &'a Options,
    /// The events of the inputs.
    pub input_events: &'a [Event],
    /// The measured loads.
    pub measured_loads: &'a Arc<MeasuredLoads>,
}

/// What the pass found.
pub(super) struct Gathered {
    pub(super) found: Found,
    /// On each set of supports; one for a machine that is always on the same ones; none without derivatives.
    pub(super) sensitivity: Vec<SensitivityPass>,
    pub(super) comparisons: Vec<Result<ModelComparison, String>>,
    pub(super) monte_carlo: Option<MonteCarlo>,
    pub(super) seen: Seen,
    pub(super) digest: Digest,
    /// Intervals between rows in which a lift cannot be excluded.
    pub(super) not_excluded: Vec<Event>,
    pub(super) exclusion: Option<Exclusion>,
}

/// Computes all rows and hands them to everything that needs them.
///
/// # Errors
/// The sink fails.
pub(super) fn gather(
    prepared: Prepared<'_>,
    min_loads_n: Option<&[f64]>,
    sets: &[OnSet<'_>],
    rotations: &[FoundRotation],
    scope: Scope,
    others: &OtherModels,
    sink: &mut dyn RowSink,
) -> Result<Gathered> {
    let Prepared {
        machine,
        table,
        options,
        measured_loads,
        ..
    } = prepared;
    let draws = options.monte_carlo;
    let monte_carlo = draws.map(|draws| MonteCarloPass::new(machine, draws));
    let mut bands: Vec<Vec<Band>> = Vec::new();
    let mut events = AnyPass::new(
        machine,
        table,
        min_loads_n,
        sets,
        scope,
        rotations,
        measured_loads,
    );
    let stories = Stories {
        machine,
        table,
        scope,
        rotations,
    };
    let studied = match scope.sensitivities {
        true => standing_machines(machine, table),
        false => Vec::new(),
    };
    let mut sensitivity: Vec<SensitivityPass> =
        studied.into_iter().map(SensitivityPass::new).collect();
    let mut seen = Seen::new(machine);
    let mut digest = DigestPass::new(machine, table, min_loads_n);
    let mut exclusion = ExclusionPass::new(machine, table);
    let mut compared = Vec::new();
    for (other, model) in &others.models {
        compared.push(match model {
            Ok(_) => Ok(ComparedModel::new(
                *other,
                machine.wheels().len(),
                table.times_ns[0],
            )),
            Err(error) => Err(error.clone()),
        });
    }
    let with = |rows: &Rows| More {
        others: others.evaluate(rows),
        bands: (monte_carlo.as_ref()).map(|study| study.bands(machine, &rows.states)),
    };
    table.blocks(with, |blocks| -> Result<()> {
        let mut taken = Vec::with_capacity(blocks.len());
        for (rows, more) in blocks {
            let models = compared.iter_mut().flatten().zip(&more.others);
            models.for_each(|(compared, others)| compared.take(&rows, others));
            bands.extend(more.bands);
            taken.push(Arc::new(rows));
        }
        let (written, ()) = rayon::join(
            || taken.iter().try_for_each(|rows| sink.take(rows)),
            || {
                for rows in &taken {
                    events.take(rows);
                    on_each_set(machine, table, scope, rows, &mut |set, machine, rows| {
                        seen.take(machine, rows);
                        if let Some(sensitivity) = sensitivity.get_mut(set) {
                            sensitivity.take(rows);
                        }
                    });
                    digest.take(rows);
                    exclusion.take(rows);
                }
            },
        );
        written?;
        let settled = stories.settled(events.settled());
        let time_ns = table.times_ns.get(settled).copied();
        match time_ns {
            Some(_) => {
                let told = stories.told(events.events().to_vec(), settled);
                sink.settle(settled, time_ns, &told)
            }
            // events that are still open become known at the end
            None => Ok(()),
        }
    })?;
    let mut found = events.finish();
    found.events = stories.told(found.events, table.len());
    let (not_excluded, exclusion) = exclusion.finish();
    sink.settle(table.len(), None, &found.events)?;
    Ok(Gathered {
        found,
        sensitivity,
        comparisons: (compared.into_iter())
            .map(|compared| compared.and_then(ComparedModel::finish))
            .collect(),
        monte_carlo: monte_carlo.map(|study| study.finish(bands)),
        seen,
        digest: digest.finish(),
        not_excluded,
        exclusion,
    })
}

/// The machine on each of its sets of supports; itself if it is always on the same ones.
fn standing_machines<'a>(machine: &'a Machine, table: &'a Table) -> Vec<&'a Machine> {
    match table.supports() {
        Some(supports) => supports.sets.iter().map(|set| &set.machine).collect(),
        None => vec![machine],
    }
}

/// Shows rows, those on each set of supports with the index of the set and the machine on it.
fn on_each_set(
    machine: &Machine,
    table: &Table,
    scope: Scope,
    rows: &Rows,
    show: &mut dyn FnMut(usize, &Machine, &Rows),
) {
    let Some(supports) = table.supports() else {
        show(0, machine, rows);
        return;
    };
    for (part, index) in supports.spans_within(rows.first..rows.first + rows.len()) {
        if let Some(index) = index {
            let set = &supports.sets[index];
            show(index, &set.machine, &rows.on_set(set, scope, part));
        }
    }
}

/// What is computed with each block.
struct More {
    others: Vec<OutcomeColumns>,
    bands: Option<Vec<Band>>,
}

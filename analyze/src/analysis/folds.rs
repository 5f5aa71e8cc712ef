//! One pass over the rows of a log: everything that an analysis needs of all of them is gathered block by block.

use std::sync::Arc;

use anyhow::Result;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::studies::monte_carlo::Band;
use tipwatch_mechanics::{OutcomeColumns, Scope};

use super::digest::{Digest, DigestPass};
use super::evaluation::OtherModels;
use super::model_comparison::{ComparedModel, ModelComparison};
use super::monte_carlo::{MonteCarlo, MonteCarloPass};
use super::notes::Seen;
use super::quasi_static::{Exclusion, ExclusionPass};
use super::sensitivity::SensitivityPass;
use super::standing_rows::StandingRows;
use crate::base::options::Options;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::events::{Event, EventPass, FoundRotation, LowestOtf, Stories};
use crate::load::MeasuredLoads;

/// Receives the rows of a log block by block, in order.
pub trait RowSink: Send {
    /// Takes the next rows.
    ///
    /// # Errors
    /// The rows cannot be written.
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

/// Keeps no row: for an analysis without outputs of single rows.
impl RowSink for () {
    fn take(&mut self, _rows: &Arc<Rows>) -> Result<()> {
        Ok(())
    }
}

/// Context for a sink before the first row.
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

/// Results of the pass.
pub(super) struct Gathered {
    /// The events of the machine, in no order.
    pub(super) events: Vec<Event>,
    /// The smallest OTF in these events.
    pub(super) lowest: Option<LowestOtf>,
    /// The reasons of all rows.
    pub(super) reasons: Vec<Reasons>,
    /// Derivatives on each set of supports; one for a machine that is always on the same ones; none without derivatives.
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
    standing: &[StandingRows<'_>],
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
    let mut studied: Vec<Studied<'_>> = (standing.iter())
        .map(|standing| Studied {
            standing,
            events: EventPass::new(
                standing.machine,
                standing.rows(),
                standing.min_loads_n.as_deref(),
                scope,
                rotations,
                measured_loads,
            ),
            sensitivity: (scope.sensitivities).then(|| SensitivityPass::new(standing.machine)),
        })
        .collect();
    let mut reasons = Vec::with_capacity(table.len());
    let stories = Stories {
        machine,
        table,
        scope,
        rotations,
    };
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
                    reasons.extend_from_slice(&rows.reasons);
                    for (part, place) in StandingRows::parts_of(rows, table) {
                        for (index, studied) in studied.iter_mut().enumerate() {
                            match place == Some(index) {
                                true => {
                                    let rows = studied.standing.part(rows, part.clone(), scope);
                                    seen.take(studied.standing.machine, &rows);
                                    studied.take(&rows);
                                }
                                false => studied.skip(rows.first + part.start, part.len()),
                            }
                        }
                    }
                    digest.take(rows);
                    exclusion.take(rows);
                }
            },
        );
        written?;
        let settled = studied.iter().map(|studied| studied.events.settled());
        let settled = stories.settled(settled.min().unwrap_or(reasons.len()));
        let time_ns = table.times_ns.get(settled).copied();
        match time_ns {
            Some(_) => {
                let known = studied.iter().flat_map(|studied| studied.events.events());
                let told = stories.told(known.cloned().collect(), settled);
                sink.settle(settled, time_ns, &told)
            }
            // events that are still open become known at the end
            None => Ok(()),
        }
    })?;
    let (mut events, mut lowest, mut sensitivity) = (Vec::new(), None, Vec::new());
    for studied in studied {
        let (found, of_found) = studied.events.finish();
        events.extend(found);
        lowest = LowestOtf::lower(lowest, of_found);
        sensitivity.extend(studied.sensitivity);
    }
    let events = stories.told(events, table.len());
    let (not_excluded, exclusion) = exclusion.finish();
    sink.settle(table.len(), None, &events)?;
    Ok(Gathered {
        events,
        lowest,
        reasons,
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

/// The machine on one set of supports, with the results gathered of the rows in which it stands on them.
struct Studied<'a> {
    standing: &'a StandingRows<'a>,
    events: EventPass<'a>,
    /// None without derivatives.
    sensitivity: Option<SensitivityPass>,
}

impl Studied<'_> {
    /// Takes the next rows on these supports.
    fn take(&mut self, rows: &Arc<Rows>) {
        self.events.take(rows);
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.take(rows);
        }
    }

    /// Takes the next rows of the log, which are on others.
    fn skip(&mut self, first: usize, count: usize) {
        let reasons = &self.standing.rows().reasons;
        self.events.skip(&reasons[first..first + count]);
    }
}

/// Further results of a block: outcomes of other models, and bands.
struct More {
    others: Vec<OutcomeColumns>,
    bands: Option<Vec<Band>>,
}

//! One pass over the rows of a log: everything that an analysis needs of all of them is gathered block by block.

use std::sync::Arc;

use anyhow::Result;
use tipwatch_mechanics::machine::Machine;

use super::monte_carlo::DrawnMachines;
use super::studies::{Found, Studies};
use super::study::{Block, StudiedLog, Study};
use crate::base::options::Options;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::events::{Event, Stories};
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

/// Computes all rows, hands them to the sink and to all studies, and returns what these found.
///
/// # Errors
/// The sink fails.
pub(super) fn gather<'a>(
    log: &StudiedLog<'a>,
    drawn: Option<&DrawnMachines>,
    sink: &mut dyn RowSink,
) -> Result<Found> {
    let table = log.table;
    let stories = Stories {
        machine: log.machine,
        table,
        scope: log.scope,
        rotations: log.rotations,
    };
    let mut studies = Studies::begin(log);
    let with = |rows: &Rows| {
        let bands = drawn.map(|drawn| drawn.bands(log.machine, &rows.states));
        (log.others.evaluate(rows), bands.unwrap_or_default())
    };
    table.blocks(with, |blocks| -> Result<()> {
        let blocks = blocks.into_iter();
        let (all, more): (Vec<Arc<Rows>>, Vec<_>) =
            blocks.map(|(rows, more)| (Arc::new(rows), more)).unzip();
        let (written, ()) = rayon::join(
            || all.iter().try_for_each(|rows| sink.take(rows)),
            || {
                for (rows, (others, bands)) in all.iter().zip(more) {
                    studies.take_all(&Block::new(log, rows, others, bands));
                }
            },
        );
        written?;
        let settled = stories.settled(studies.events.settled(studies.reasons.len()));
        let time_ns = table.times_ns.get(settled).copied();
        match time_ns {
            Some(_) => {
                let told = stories.told(studies.events.known(), settled);
                sink.settle(settled, time_ns, &told)
            }
            // events that are still open become known at the end
            None => Ok(()),
        }
    })?;
    let mut found = Found::from(studies);
    found.events.all = stories.told(std::mem::take(&mut found.events.all), table.len());
    sink.settle(table.len(), None, &found.events.all)?;
    Ok(found)
}

//! Studies of the rows of a log: each gathers one finding, block by block, in a single pass over the rows.

use std::ops::Range;
use std::sync::Arc;

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::studies::monte_carlo::Band;
use tipwatch_mechanics::{OutcomeColumns, Scope, State};

use super::evaluation::OtherModels;
use super::standing_rows::StandingRows;
use crate::base::rows::Rows;
use crate::base::table::Table;
use crate::events::FoundRotation;
use crate::load::MeasuredLoads;

/// A study. Each method does nothing unless the study has a use for it.
pub(super) trait Study<'a>: Sized {
    /// What it finds: what it is itself, or what it becomes after the last row.
    type Found: From<Self>;

    /// Begins before the first row.
    fn begin(log: &StudiedLog<'a>) -> Self;

    /// Takes the next block of the log.
    fn take(&mut self, _block: &Block<'a>) {}

    /// Takes the next row whose state and supports are known.
    fn take_row(&mut self, _row: &KnownRow<'_>) {}

    /// Takes the next part of a block in which the machine stands on the same supports, after its rows.
    fn take_part(&mut self, _machine: &Machine, _rows: &Rows) {}
}

/// The log that is studied.
#[derive(Clone, Copy)]
pub(super) struct StudiedLog<'a> {
    /// The machine that names the results.
    pub(super) machine: &'a Machine,
    /// The table, of which only times are known.
    pub(super) table: &'a Table,
    pub(super) scope: Scope,
    /// Load below which each wheel is light (N); `None` if unknown.
    pub(super) min_loads_n: Option<&'a [f64]>,
    /// The machine on each set of its supports.
    pub(super) standing: &'a [StandingRows<'a>],
    pub(super) rotations: &'a [FoundRotation],
    pub(super) measured_loads: &'a MeasuredLoads,
    pub(super) others: &'a OtherModels,
}

/// Rows of a log, with all that is computed of them.
pub(super) struct Block<'a> {
    pub(super) rows: Arc<Rows>,
    /// Outcomes of the other models.
    pub(super) others: Vec<OutcomeColumns>,
    /// Bands of the drawn machines, if a Monte Carlo study is requested.
    pub(super) bands: Vec<Band>,
    /// Its rows by supports.
    pub(super) parts: Vec<Part<'a>>,
}

/// Rows of a block in which the machine stands on the same supports.
pub(super) struct Part<'a> {
    /// The rows, counted from the first of the log.
    pub(super) span: Range<usize>,
    /// The place of its supports, the machine on them, and the rows; `None` where the supports are unknown.
    pub(super) standing: Option<(usize, &'a Machine, Arc<Rows>)>,
}

/// A row whose state and supports are known.
pub(super) struct KnownRow<'a> {
    pub(super) machine: &'a Machine,
    pub(super) rows: &'a Rows,
    /// Its index among these rows.
    pub(super) row: usize,
    pub(super) state: &'a State<f64>,
}

impl KnownRow<'_> {
    pub(super) fn reasons(&self) -> &Reasons {
        &self.rows.reasons[self.row]
    }
}

impl<'a> Block<'a> {
    /// Divides a block by the supports of its rows.
    pub(super) fn new(
        log: &StudiedLog<'a>,
        rows: &Arc<Rows>,
        others: Vec<OutcomeColumns>,
        bands: Vec<Band>,
    ) -> Self {
        let parts = StandingRows::parts_of(rows, log.table).into_iter();
        let parts = parts.map(|(part, place)| Part {
            span: rows.first + part.start..rows.first + part.end,
            standing: place.and_then(|place| {
                let standing = log.standing.get(place)?;
                let of_part = standing.part(rows, part, log.scope);
                Some((place, standing.machine, of_part))
            }),
        });
        Self {
            parts: parts.collect(),
            rows: Arc::clone(rows),
            others,
            bands,
        }
    }
}

/// The reasons of all rows.
impl Study<'_> for Vec<Reasons> {
    type Found = Self;

    fn begin(log: &StudiedLog<'_>) -> Self {
        Self::with_capacity(log.table.len())
    }

    fn take(&mut self, block: &Block<'_>) {
        self.extend_from_slice(&block.rows.reasons);
    }
}

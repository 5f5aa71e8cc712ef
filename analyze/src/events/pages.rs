//! Rows around events: the blocks that were just computed, and others computed once more.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use nalgebra::Vector3;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Reasons;
use tipwatch_mechanics::{Quantity, State};

use super::row_derivatives::RowDerivatives;
use crate::base::rows::Rows;
use crate::base::table::Table;

/// Most blocks of the pass that are kept.
const MOST_BLOCKS: usize = 16;
/// Rows before a row without derivatives in which a standard deviation is looked for.
pub(super) const MOST_ROWS_BACK: usize = 400;
/// Rows that are computed at once where the pass has gone on.
const ROWS_ANEW: usize = 64;
/// Most windows of rows computed anew that are kept.
const MOST_WINDOWS: usize = 64;

/// The rows up to the end of the pass.
pub(super) struct Pages<'a> {
    machine: &'a Machine,
    table: &'a Table,
    /// Times of all rows of the log (ns).
    pub(super) times_ns: &'a [i64],
    /// Reasons of the rows up to now.
    reasons: Vec<Reasons>,
    /// Blocks by their first row.
    blocks: BTreeMap<usize, Arc<Rows>>,
    /// Windows computed anew, the latest first.
    windows: RefCell<VecDeque<Rows>>,
    derivatives: RefCell<Option<RowDerivatives>>,
}

impl<'a> Pages<'a> {
    /// Whether the loads are those of a supposition.
    pub(super) fn is_supposed(&self) -> bool {
        self.table.is_supposed()
    }

    /// Whether a gyro measured how the platform turned.
    pub(super) fn has_gyro(&self) -> bool {
        self.table.has_gyro()
    }

    pub(super) fn new(machine: &'a Machine, table: &'a Table) -> Self {
        Self {
            machine,
            table,
            times_ns: &table.times_ns,
            reasons: Vec::with_capacity(table.len()),
            blocks: BTreeMap::new(),
            windows: RefCell::default(),
            derivatives: RefCell::default(),
        }
    }

    /// Adds rows that belong to other supports.
    pub(super) fn skip(&mut self, reasons: &[Reasons]) {
        self.reasons.extend_from_slice(reasons);
    }

    /// Adds the next block.
    pub(super) fn add(&mut self, rows: &Arc<Rows>) {
        self.reasons.extend_from_slice(&rows.reasons);
        self.blocks.insert(rows.first, Arc::clone(rows));
        while self.blocks.len() > MOST_BLOCKS {
            self.blocks.pop_first();
        }
    }

    /// Lets go of the blocks before a row.
    pub(super) fn forget_before(&mut self, row: usize) {
        while let Some((&first, rows)) = self.blocks.first_key_value()
            && first + rows.len() <= row
        {
            self.blocks.remove(&first);
        }
    }

    /// Number of rows up to now.
    pub(super) fn known(&self) -> usize {
        self.reasons.len()
    }

    /// Number of rows of the log.
    pub(super) fn len(&self) -> usize {
        self.times_ns.len()
    }

    /// Time of a row (s) after the first one of the log.
    pub(super) fn seconds(&self, row: usize) -> f64 {
        self.table.seconds(row)
    }

    /// A time (s) after the first row of the log, in ns.
    pub(super) fn time_ns(&self, at_s: f64) -> i64 {
        self.times_ns[0] + (at_s * 1e9).round() as i64
    }

    /// Returns the row at a time (s), or the next one.
    pub(super) fn row_from(&self, at_s: f64) -> usize {
        self.at(self.time_ns(at_s))
    }

    /// The row at a time, or the next one.
    pub(super) fn at(&self, time_ns: i64) -> usize {
        self.table.at(time_ns)
    }

    /// Whether a row is valid.
    pub(super) fn is_valid(&self, row: usize) -> bool {
        self.reasons[row].leave_valid()
    }

    /// Whether a row has meaningful loads: no gap, no warm-up, wheels on the ground.
    pub(super) fn is_meaningful(&self, row: usize) -> bool {
        self.reasons[row].leave_loads()
    }

    /// A result of a row.
    pub(super) fn value(&self, quantity: Quantity, row: usize) -> f64 {
        self.of(row, |rows, at| rows.value(quantity, at))
    }

    /// Reads the state of a row.
    pub(super) fn state(&self, row: usize, state: &mut State<f64>) {
        self.of(row, |rows, at| rows.states.get(at, state));
    }

    /// Upward direction of a row in base axes, if the log has an attitude.
    pub(super) fn up_in_base(&self, machine: &Machine, row: usize) -> Option<Vector3<f64>> {
        let mut state = State::zero(machine);
        self.state(row, &mut state);
        state.base.known_up()
    }

    /// Standard deviation of a weighted sum of OTF at a row, or at the nearest row before it, but not before
    /// `least_row`, that has derivatives (N).
    pub(super) fn sigma_near(&self, row: usize, factors: &[f64], least_row: usize) -> Option<f64> {
        let mut derivatives = self.derivatives.borrow_mut();
        let derivatives = derivatives.get_or_insert_with(|| RowDerivatives::new(self.machine));
        (least_row.min(row)..=row)
            .rev()
            .take(MOST_ROWS_BACK)
            .find_map(|row| {
                let read = |state: &mut State<f64>| self.state(row, state);
                derivatives.sigma(self.machine, row, factors, read)
            })
    }

    fn of<R>(&self, row: usize, read: impl FnOnce(&Rows, usize) -> R) -> R {
        let block = self.blocks.range(..=row).next_back();
        if let Some((&first, rows)) = block
            && row < first + rows.len()
        {
            return read(rows, row - first);
        }
        let mut windows = self.windows.borrow_mut();
        let holds = |rows: &Rows| (rows.first..rows.first + rows.len()).contains(&row);
        match windows.iter().position(holds) {
            Some(0) => {}
            Some(place) => windows.swap(0, place),
            None => {
                let first = row - row % ROWS_ANEW;
                let last = (first + ROWS_ANEW).min(self.len());
                windows.push_front(self.table.window(first..last));
                windows.truncate(MOST_WINDOWS);
            }
        }
        let rows = &windows[0];
        read(rows, row - rows.first)
    }
}

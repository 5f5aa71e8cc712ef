//! The states of many rows, in columns.

use std::ops::Range;

use super::machine_state::State;
use crate::machine::Machine;
use crate::number::Lanes;

/// The states of many rows, with one column per number of a [`State`].
#[derive(Debug, Clone)]
pub struct StateColumns {
    columns: Vec<Vec<f64>>,
    rows: usize,
}

impl StateColumns {
    /// `rows` unknown states: NaN throughout.
    #[must_use]
    pub fn unknown(machine: &Machine, rows: usize) -> Self {
        Self {
            columns: vec![vec![f64::NAN; rows]; State::<f64>::size(machine)],
            rows,
        }
    }

    /// No rows, with memory for `rows`.
    #[must_use]
    pub fn with_capacity(machine: &Machine, rows: usize) -> Self {
        let columns = 0..State::<f64>::size(machine);
        Self {
            columns: columns.map(|_| Vec::with_capacity(rows)).collect(),
            rows: 0,
        }
    }

    /// Removes rows from the end, or adds unknown ones. Keeps the memory.
    pub fn resize(&mut self, rows: usize) {
        for column in &mut self.columns {
            column.resize(rows, f64::NAN);
        }
        self.rows = rows;
    }

    /// Appends the rows of the same machine's states.
    pub fn append(&mut self, other: &Self) {
        for (column, other) in self.columns.iter_mut().zip(&other.columns) {
            column.extend_from_slice(other);
        }
        self.rows += other.rows;
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Some consecutive rows.
    #[must_use]
    pub fn block(&self, rows: Range<usize>) -> Self {
        let columns = self.columns.iter();
        Self {
            columns: columns
                .map(|column| column[rows.clone()].to_vec())
                .collect(),
            rows: rows.len(),
        }
    }

    /// Copies a column into `values`.
    pub fn column_values(&self, column: usize, values: &mut Vec<f64>) {
        values.clone_from(&self.columns[column]);
    }

    /// A column, to be written.
    pub fn column_mut(&mut self, column: usize) -> &mut [f64] {
        &mut self.columns[column]
    }

    /// Sets a row from its numbers, in column order.
    pub fn set_values(&mut self, row: usize, values: &[f64]) {
        for (column, &value) in self.columns.iter_mut().zip(values) {
            column[row] = value;
        }
    }

    /// Sets a row.
    pub fn set(&mut self, row: usize, state: &mut State<f64>) {
        let mut columns = self.columns.iter_mut();
        state.for_each_value(|value| {
            if let Some(column) = columns.next() {
                column[row] = *value;
            }
        });
    }

    /// Reads a row into `state`.
    pub fn get(&self, row: usize, state: &mut State<f64>) {
        let mut columns = self.columns.iter();
        state.for_each_value(|value| {
            if let Some(column) = columns.next() {
                *value = column[row];
            }
        });
    }

    /// Reads consecutive rows from `first` into lanes; repeats the last row before `end` where they run out.
    pub(crate) fn get_lanes(&self, first: usize, end: usize, state: &mut State<Lanes>) {
        let mut columns = self.columns.iter();
        state.for_each_value(|value| {
            let Some(column) = columns.next() else { return };
            *value = match column.get(first..first + Lanes::COUNT) {
                Some(&[a, b, c, d]) if first + Lanes::COUNT <= end => {
                    Lanes::from_array([a, b, c, d])
                }
                _ => Lanes::from_array(std::array::from_fn(|lane| {
                    column[(first + lane).min(end - 1)]
                })),
            };
        });
    }
}

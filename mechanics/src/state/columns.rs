//! The states of many rows, in columns.

use std::ops::Range;

use super::machine_state::State;
use crate::machine::Machine;
use crate::number::Lanes;

/// Rows of a tile: their values of one number fill a line of the cache.
const TILE: usize = 8;

/// The states of many rows, with one column per number of a [`State`].
///
/// The columns are cut into tiles of a few rows, tile after tile. So all numbers of a row are close to each other, and
/// columns whose length is a power of two do not compete for the same places of the cache.
#[derive(Debug, Clone)]
pub struct StateColumns {
    /// Values of each tile: its part of each column. Rows beyond the last one are unspecified.
    tiles: Vec<[f64; TILE]>,
    /// Number of columns.
    width: usize,
    rows: usize,
}

impl StateColumns {
    /// Rows of a tile.
    pub const TILE: usize = TILE;

    /// `rows` unknown states: NaN throughout.
    #[must_use]
    pub fn unknown(machine: &Machine, rows: usize) -> Self {
        let width = State::<f64>::size(machine);
        Self {
            tiles: vec![[f64::NAN; TILE]; width * rows.div_ceil(TILE)],
            width,
            rows,
        }
    }

    /// Removes rows from the end, or adds unknown ones. Keeps the memory.
    pub fn resize(&mut self, rows: usize) {
        let before = self.rows;
        let tiles = self.width * rows.div_ceil(TILE);
        self.tiles.resize(tiles, [f64::NAN; TILE]);
        self.rows = rows;
        for row in before..rows.min(before.next_multiple_of(TILE)) {
            for place in self.row_mut(row) {
                *place = f64::NAN;
            }
        }
    }

    /// Appends the rows of the same machine's states.
    pub fn append(&mut self, other: &Self) {
        if self.rows.is_multiple_of(TILE) {
            self.tiles.extend_from_slice(&other.tiles);
            self.rows += other.rows;
            return;
        }
        let before = self.rows;
        self.resize(before + other.rows);
        for row in 0..other.rows {
            let places = self.row_mut(before + row);
            places.zip(other.row(row)).for_each(|(to, from)| *to = from);
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Some consecutive rows.
    #[must_use]
    pub fn block(&self, rows: Range<usize>) -> Self {
        if !rows.start.is_multiple_of(TILE) {
            return self.picked(rows);
        }
        let tiles = rows.start / TILE..rows.end.div_ceil(TILE);
        let tiles = tiles.start * self.width..tiles.end.max(tiles.start) * self.width;
        Self {
            tiles: self.tiles[tiles].to_vec(),
            width: self.width,
            rows: rows.len(),
        }
    }

    /// The rows with these indices.
    #[must_use]
    pub fn picked(&self, rows: impl ExactSizeIterator<Item = usize>) -> Self {
        let mut picked = Self {
            tiles: vec![[f64::NAN; TILE]; self.width * rows.len().div_ceil(TILE)],
            width: self.width,
            rows: rows.len(),
        };
        for (row, from) in rows.enumerate() {
            let places = picked.row_mut(row);
            places.zip(self.row(from)).for_each(|(to, from)| *to = from);
        }
        picked
    }

    /// Takes the columns apart: of each, the number of all rows if they have the same one, to the bit, and the other
    /// columns tile by tile.
    #[must_use]
    pub fn constant_and_varying(&self) -> (Vec<Option<f64>>, Vec<[f64; TILE]>) {
        let mut constants: Vec<Option<f64>> = match self.rows {
            0 => vec![None; self.width],
            _ => self.row(0).map(Some).collect(),
        };
        for (tile, parts) in self.tiles.chunks(self.width).enumerate() {
            let known = (self.rows - tile * TILE).min(TILE);
            for (constant, part) in constants.iter_mut().zip(parts) {
                let is_same = |of_all: &f64| {
                    let mut part = part[..known].iter();
                    part.all(|value| value.to_bits() == of_all.to_bits())
                };
                *constant = constant.filter(is_same);
            }
        }
        let varies = constants.iter().filter(|constant| constant.is_none());
        let mut varying = Vec::with_capacity(varies.count() * self.rows.div_ceil(TILE));
        for parts in self.tiles.chunks(self.width) {
            let parts = constants.iter().zip(parts);
            varying.extend(parts.filter_map(|(constant, part)| constant.is_none().then_some(part)));
        }
        (constants, varying)
    }

    /// Joins the parts into which [`Self::constant_and_varying`] divides a state. Missing parts are unknown.
    #[must_use]
    pub fn of_constant_and_varying(
        rows: usize,
        constants: &[Option<f64>],
        varying: &[[f64; TILE]],
    ) -> Self {
        let mut varying = varying.iter();
        let mut tiles = Vec::with_capacity(constants.len() * rows.div_ceil(TILE));
        for _ in 0..rows.div_ceil(TILE) {
            tiles.extend(constants.iter().map(|constant| match constant {
                Some(constant) => [*constant; TILE],
                None => varying.next().copied().unwrap_or([f64::NAN; TILE]),
            }));
        }
        Self {
            tiles,
            width: constants.len(),
            rows,
        }
    }

    /// The numbers of a column, row by row.
    pub fn column(&self, column: usize) -> impl Iterator<Item = f64> {
        let parts = self.tiles.iter().skip(column).step_by(self.width);
        parts.flatten().copied().take(self.rows)
    }

    /// Sets a column from its first row on.
    pub fn set_column(&mut self, column: usize, values: impl IntoIterator<Item = f64>) {
        let parts = self.tiles.iter_mut().skip(column).step_by(self.width);
        let places = parts.flatten().take(self.rows);
        places.zip(values).for_each(|(to, from)| *to = from);
    }

    /// Sets a row from its numbers, in column order.
    pub fn set_values(&mut self, row: usize, values: &[f64]) {
        let places = self.row_mut(row);
        places.zip(values).for_each(|(to, from)| *to = *from);
    }

    /// Sets a row.
    pub fn set(&mut self, row: usize, state: &mut State<f64>) {
        let mut places = self.row_mut(row);
        state.for_each_value(|value| {
            if let Some(place) = places.next() {
                *place = *value;
            }
        });
    }

    /// Reads a row into `state`.
    pub fn get(&self, row: usize, state: &mut State<f64>) {
        let mut values = self.row(row);
        state.for_each_value(|value| {
            if let Some(known) = values.next() {
                *value = known;
            }
        });
    }

    /// Reads consecutive rows from `first` into lanes; repeats the last row before `end` where they run out.
    pub(crate) fn get_lanes(&self, first: usize, end: usize, state: &mut State<Lanes>) {
        let place = first % TILE;
        if place.is_multiple_of(Lanes::COUNT) && first + Lanes::COUNT <= end {
            let mut parts = self.tile(first).iter();
            state.for_each_value(|value| {
                let part = parts.next().and_then(|part| part[place..].first_chunk());
                if let Some(&lanes) = part {
                    *value = Lanes::from_array(lanes);
                }
            });
            return;
        }
        let mut lanes: [_; Lanes::COUNT] =
            std::array::from_fn(|lane| self.row((first + lane).min(end - 1)));
        state.for_each_value(|value| {
            let values = lanes.each_mut().map(Iterator::next);
            *value = Lanes::from_array(values.map(|known| known.unwrap_or(f64::NAN)));
        });
    }

    /// The tile of a row.
    fn tile(&self, row: usize) -> &[[f64; TILE]] {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        let tile = row / TILE;
        &self.tiles[tile * self.width..(tile + 1) * self.width]
    }

    fn row(&self, row: usize) -> impl Iterator<Item = f64> {
        self.tile(row).iter().map(move |part| part[row % TILE])
    }

    fn row_mut(&mut self, row: usize) -> impl Iterator<Item = &mut f64> {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        let tile = row / TILE;
        let tile = &mut self.tiles[tile * self.width..(tile + 1) * self.width];
        tile.iter_mut().map(move |part| &mut part[row % TILE])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows whose numbers say where they are.
    fn counted(rows: Range<usize>) -> StateColumns {
        let mut columns = StateColumns {
            tiles: Vec::new(),
            width: 3,
            rows: 0,
        };
        columns.resize(rows.len());
        for (place, row) in rows.enumerate() {
            columns.set_values(place, &[0.0, 0.1, 0.2].map(|part| row as f64 + part));
        }
        columns
    }

    fn all(columns: &StateColumns) -> Vec<Vec<f64>> {
        (0..columns.width())
            .map(|column| columns.column(column).collect())
            .collect()
    }

    #[test]
    fn rows_are_cut_and_joined_anywhere() {
        let whole = counted(0..37);
        assert_eq!(whole.rows(), 37);
        assert_eq!(all(&whole)[1][36], 36.1);
        for start in 0..37 {
            for end in start..=37 {
                let block = whole.block(start..end);
                assert_eq!(all(&block), all(&counted(start..end)), "{start}..{end}");
            }
            let mut joined = whole.block(0..start);
            joined.append(&whole.block(start..37));
            assert_eq!(all(&joined), all(&whole), "{start}");
        }
    }

    #[test]
    fn constant_and_varying_columns_are_put_together_again() {
        for rows in [0, 1, 7, 8, 9, 37] {
            let mut columns = counted(0..rows);
            columns.set_column(0, std::iter::repeat_n(-0.0, rows));
            let (constants, varying) = columns.constant_and_varying();
            // a single row varies in nothing
            let expected = usize::from(rows > 1) * 2 * rows.div_ceil(TILE);
            assert_eq!(varying.len(), expected, "{rows} rows");
            let again = StateColumns::of_constant_and_varying(rows, &constants, &varying);
            assert_eq!(again.rows(), rows);
            let bits = |columns: &StateColumns| -> Vec<Vec<u64>> {
                let all = all(columns).into_iter();
                all.map(|column| column.into_iter().map(f64::to_bits).collect())
                    .collect()
            };
            assert_eq!(bits(&again), bits(&columns), "{rows} rows");
        }
    }

    #[test]
    fn rows_that_are_added_are_unknown() {
        for (before, kept, after) in [(13, 13, 15), (13, 3, 30), (8, 0, 1), (16, 11, 12)] {
            let mut columns = counted(0..before);
            columns.resize(kept);
            columns.resize(after);
            for (known, column) in all(&counted(0..kept)).iter().zip(all(&columns)) {
                assert_eq!(column.len(), after);
                assert_eq!(column[..kept], known[..]);
                assert!(column[kept..].iter().all(|value| value.is_nan()));
            }
        }
    }

    #[test]
    fn columns_are_set_from_their_first_row() {
        let mut columns = counted(0..11);
        columns.set_column(1, (0..11).map(|row| -f64::from(row)));
        let found = all(&columns);
        assert_eq!(found[0], all(&counted(0..11))[0]);
        assert_eq!(found[1][10], -10.0);
    }
}

//! Rows on end in which a measured number stands still bit for bit although the computed one changes: a sensor or a transmission that
//! has stopped, which the tolerance of the comparison may hide.

use super::compared::Compared;

/// Such rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standstill {
    first: Compared,
    last_ns: i64,
    rows: usize,
    /// The row with the largest change of the computed number.
    worst: Compared,
}

impl Standstill {
    /// Begins with a row.
    #[must_use]
    pub fn begin(row: Compared) -> Self {
        Self {
            first: row,
            last_ns: row.time_ns,
            rows: 1,
            worst: row,
        }
    }

    /// Takes the next row: one with another measured number begins anew.
    pub fn take(&mut self, row: Compared) {
        if row.measured.to_bits() != self.first.measured.to_bits() {
            *self = Self::begin(row);
            return;
        }
        self.last_ns = row.time_ns;
        self.rows += 1;
        if self.change_to(&row).abs() >= self.change_to(&self.worst).abs() {
            self.worst = row;
        }
    }

    /// The largest change of the computed number and the time of it (ns), if that is more than `least`, which the sensor must have
    /// noticed, and the standstill is long enough.
    #[must_use]
    pub fn missed(&self, least: f64) -> Option<(i64, f64)> {
        let change = self.change_to(&self.worst);
        let is_long = Compared::is_long(self.first.time_ns, self.last_ns, self.rows);
        (is_long && change.abs() > least).then_some((self.worst.time_ns, change))
    }

    fn change_to(&self, row: &Compared) -> f64 {
        row.computed - self.first.computed
    }
}

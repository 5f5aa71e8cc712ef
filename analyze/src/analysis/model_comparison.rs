//! Differences between the wheel loads of two models.

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::say;
use tipwatch_mechanics::{OutcomeColumns, Quantity};

use crate::base::options::ModelKind;
use crate::base::rows::Rows;

/// Another model compared with the chosen one, over the rows valid for both.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelComparison {
    /// The other model.
    pub other: ModelKind,
    /// Differences by wheel.
    pub wheels: Vec<LoadDifference>,
    /// Rows compared.
    pub rows: usize,
}

/// OTF difference, other model minus chosen model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LoadDifference {
    /// Mean (N).
    pub mean_n: f64,
    /// Root mean square (N).
    pub rms_n: f64,
    /// Largest absolute value (N).
    pub largest_n: f64,
    /// Time of the largest difference (ns).
    pub largest_ns: i64,
}

/// Compares another model block by block.
#[derive(Debug)]
pub(crate) struct ComparedModel {
    other: ModelKind,
    rows: usize,
    wheels: Vec<Differences>,
}

/// Sums of the OTF differences of a wheel.
#[derive(Debug, Clone, Copy)]
struct Differences {
    sum: f64,
    squares: f64,
    /// The largest absolute value, and its time.
    largest: (f64, i64),
}

impl ComparedModel {
    /// Returns the comparison before the first row; `start_ns` is its time.
    pub(crate) fn new(other: ModelKind, wheels: usize, start_ns: i64) -> Self {
        let none = Differences {
            sum: 0.0,
            squares: 0.0,
            largest: (0.0, start_ns),
        };
        Self {
            other,
            rows: 0,
            wheels: vec![none; wheels],
        }
    }

    /// Compares the OTF of the next rows.
    pub(crate) fn take(&mut self, rows: &Rows, others: &OutcomeColumns) {
        let pairs: Vec<(&[f64], &[f64])> = (0..self.wheels.len())
            .map(|wheel| {
                let otf = Quantity::Otf(wheel);
                (rows.outcomes.column(otf), others.column(otf))
            })
            .collect();
        for row in 0..rows.len() {
            let is_known = rows.is_valid(row) && pairs.iter().all(|(_, b)| b[row].is_finite());
            if !is_known {
                continue;
            }
            self.rows += 1;
            for (found, (ours, theirs)) in self.wheels.iter_mut().zip(&pairs) {
                let difference = theirs[row] - ours[row];
                found.sum += difference;
                found.squares += difference * difference;
                if difference.abs() > found.largest.0 {
                    found.largest = (difference.abs(), rows.times_ns[row]);
                }
            }
        }
    }

    /// The comparison over all rows.
    ///
    /// # Errors
    /// No row is valid for both models.
    pub(crate) fn finish(self) -> Result<ModelComparison, String> {
        if self.rows == 0 {
            return Err(say!(
                "model {}: expected rows with attitude and motion, found none",
                self.other.name()
            ));
        }
        let count = self.rows as f64;
        let wheels = self.wheels.iter().map(|found| LoadDifference {
            mean_n: found.sum / count,
            rms_n: (found.squares / count).sqrt(),
            largest_n: found.largest.0,
            largest_ns: found.largest.1,
        });
        Ok(ModelComparison {
            other: self.other,
            wheels: wheels.collect(),
            rows: self.rows,
        })
    }
}

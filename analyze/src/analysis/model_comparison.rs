//! Differences between the wheel loads of two models.

use schemars::JsonSchema;
use serde::Serialize;
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

/// Compares the OTF of `other` with that of the rows.
pub(crate) fn compare(rows: &Rows, other: ModelKind, others: &OutcomeColumns) -> ModelComparison {
    let wheels = (rows.outcomes.quantities.iter())
        .filter(|quantity| matches!(quantity, Quantity::Otf(_)))
        .count();
    let otf = |columns: &'_ OutcomeColumns, wheel| columns.column(Quantity::Otf(wheel)).to_vec();
    let pairs: Vec<(Vec<f64>, Vec<f64>)> = (0..wheels)
        .map(|wheel| (otf(&rows.outcomes, wheel), otf(others, wheel)))
        .collect();
    let known = |row: &usize| rows.is_valid(*row) && pairs.iter().all(|(_, b)| b[*row].is_finite());
    let compared: Vec<usize> = (0..rows.len()).filter(known).collect();
    let wheels = pairs
        .iter()
        .map(|(ours, theirs)| difference(rows, &compared, ours, theirs));
    ModelComparison {
        other,
        wheels: wheels.collect(),
        rows: compared.len(),
    }
}

fn difference(rows: &Rows, compared: &[usize], ours: &[f64], theirs: &[f64]) -> LoadDifference {
    let (mut sum, mut squares, mut largest) = (0.0, 0.0, (0.0_f64, rows.times_ns[0]));
    for &row in compared {
        let difference = theirs[row] - ours[row];
        sum += difference;
        squares += difference * difference;
        if difference.abs() > largest.0 {
            largest = (difference.abs(), rows.times_ns[row]);
        }
    }
    let count = compared.len() as f64;
    LoadDifference {
        mean_n: sum / count,
        rms_n: (squares / count).sqrt(),
        largest_n: largest.0,
        largest_ns: largest.1,
    }
}

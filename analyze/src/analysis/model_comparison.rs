//! Differences between the wheel loads of two models.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use tipwatch_language::say;
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::{OutcomeColumns, Quantity};

use super::study::{Block, StudiedLog, Study};
use crate::base::options::ModelKind;
use crate::base::rows::Rows;

/// Another model compared with the chosen one, over the rows valid for both.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "OtherModelSummary")]
pub struct ModelComparison {
    /// The other model.
    #[serde(skip)]
    pub other: ModelKind,
    /// Its name.
    pub name: &'static str,
    /// Rows compared.
    #[serde(rename = "rows_compared")]
    pub rows: usize,
    /// OTF difference by wheel, other model minus this one.
    pub difference: BTreeMap<String, LoadDifference>,
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

/// Compares the other models block by block; an error tells why one cannot be computed.
#[derive(Debug)]
pub(super) struct ModelStudy(Vec<Result<ComparedModel, String>>);

impl Study<'_> for ModelStudy {
    type Found = Vec<Result<ModelComparison, String>>;

    fn begin(log: &StudiedLog<'_>) -> Self {
        let (machine, start_ns) = (log.machine, log.table.times_ns[0]);
        let models = log.others.models.iter().map(|(other, model)| match model {
            Ok(_) => Ok(ComparedModel::new(*other, machine, start_ns)),
            Err(error) => Err(error.clone()),
        });
        Self(models.collect())
    }

    fn take(&mut self, block: &Block<'_>) {
        let models = self.0.iter_mut().flatten().zip(&block.others);
        models.for_each(|(compared, others)| compared.take(&block.rows, others));
    }
}

impl From<ModelStudy> for Vec<Result<ModelComparison, String>> {
    fn from(ModelStudy(models): ModelStudy) -> Self {
        let models = models.into_iter();
        models
            .map(|model| model.and_then(ComparedModel::finish))
            .collect()
    }
}

/// Compares another model block by block.
#[derive(Debug)]
struct ComparedModel {
    other: ModelKind,
    rows: usize,
    wheels: Vec<(String, Differences)>,
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
    fn new(other: ModelKind, machine: &Machine, start_ns: i64) -> Self {
        let none = Differences {
            sum: 0.0,
            squares: 0.0,
            largest: (0.0, start_ns),
        };
        let wheels = machine.wheels().iter();
        Self {
            other,
            rows: 0,
            wheels: wheels
                .map(|wheel| (wheel.name.to_lowercase(), none))
                .collect(),
        }
    }

    /// Compares the OTF of the next rows.
    fn take(&mut self, rows: &Rows, others: &OutcomeColumns) {
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
            for ((_, found), (ours, theirs)) in self.wheels.iter_mut().zip(&pairs) {
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
    fn finish(self) -> Result<ModelComparison, String> {
        if self.rows == 0 {
            return Err(say!(
                "model {}: expected rows with attitude and motion, found none",
                self.other.name()
            ));
        }
        let count = self.rows as f64;
        let difference = |found: &Differences| LoadDifference {
            mean_n: found.sum / count,
            rms_n: (found.squares / count).sqrt(),
            largest_n: found.largest.0,
            largest_ns: found.largest.1,
        };
        let wheels = self.wheels.into_iter();
        Ok(ModelComparison {
            other: self.other,
            name: self.other.name(),
            rows: self.rows,
            difference: wheels
                .map(|(name, found)| (name, difference(&found)))
                .collect(),
        })
    }
}

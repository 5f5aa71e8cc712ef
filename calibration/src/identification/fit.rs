//! The most probable unknowns: Gauss-Newton steps with weights that outliers and correlated residuals lose.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use serde::Serialize;
use tipwatch_mechanics::machine::{Machine, SupportId};

use crate::identification::data::{Data, Instant};
use crate::identification::jacobian::{Columns, by_adjoint, by_differences, has_adjoint};
use crate::identification::model::Changed;
use crate::identification::noise::covariance_root;
use crate::identification::prior::Prior;

/// Most Gauss-Newton steps with the same weights of the sources.
const MOST_STEPS: usize = 12;
/// Steps below this many prior standard deviations end the iteration.
const SMALL_STEP: f64 = 1e-4;
/// Rounds of weights from residuals.
const ROUNDS: usize = 3;
/// Residuals up to this many standard deviations have full weight, and none beyond the second number (Huber, with an
/// end).
const FULL_WEIGHT: f64 = 2.5;
const NO_WEIGHT: f64 = 8.0;
/// Fewest instants among which one can be out of the others.
const FEWEST: usize = 5;
/// A change of a predicted reading by this share of the largest one makes a posture of its own.
const OWN_POSTURE: f64 = 0.05;

/// An instant that is used.
struct Row<'a> {
    instant: &'a Instant,
    source: usize,
    root: Cholesky<f64, Dyn>,
    /// Place among the instants without an adjoint.
    difference: Option<usize>,
}

/// Residuals and derivatives of an instant, of covariance one.
struct Whitened {
    residual: DVector<f64>,
    derivatives: DMatrix<f64>,
}

/// Use of a log or a weighing in the identification.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceUse {
    /// Its name.
    pub name: String,
    /// Instants that were fitted.
    pub instants: usize,
    /// Instants that could not be used: a lifted wheel, or a number that cannot be computed.
    pub left_out: usize,
    /// Instants without weight, because they are far off the others.
    pub outliers: usize,
    /// Equivalent number of independent instants.
    #[serde(rename = "independent_instants")]
    pub effective: f64,
    /// Instants after which residuals count as independent.
    #[serde(skip)]
    correlated: f64,
    /// Residuals are this many times as large as stated, at least one; they have that much less weight.
    #[serde(rename = "residuals_over_stated")]
    pub scale: f64,
}

/// The result of a fit.
#[derive(Debug)]
pub(crate) struct Fit {
    /// Unknowns, in prior standard deviations.
    pub(crate) unknowns: DVector<f64>,
    /// Inverse covariance of the unknowns and then of the channels' constant errors.
    pub(crate) precision: DMatrix<f64>,
    pub(crate) sources: Vec<SourceUse>,
}

/// A problem that is being solved.
struct Problem<'a> {
    machine: &'a Machine,
    /// The sets of supports of the data.
    sets: Vec<Arc<[SupportId]>>,
    prior: &'a Prior,
    columns: Columns,
    rows: Vec<Row<'a>>,
    /// The instants without an adjoint.
    without: Vec<&'a Instant>,
    /// Column of each channel's constant error, after the unknowns, and its standard deviation.
    biases: Vec<Option<(usize, f64)>>,
    size: usize,
    /// Whether each source is a log.
    is_log: Vec<bool>,
}

/// Fits the unknowns of `machine` to the data; `None` if no instant can be used.
pub(crate) fn fit(machine: &Machine, prior: &Prior, data: &Data) -> Option<Fit> {
    let sets = data.sets();
    let start = Changed::new(machine, &sets, &prior.unknowns, &prior.changes(&prior.mean));
    let all: Vec<(usize, &Instant)> = (data.sources.iter().enumerate())
        .flat_map(|(source, of)| of.instants.iter().map(move |instant| (source, instant)))
        .collect();
    let usable = all.par_iter().map(|&(source, instant)| {
        let root = covariance_root(&start, instant)?;
        let is_known = start
            .predict(instant, [0.0; 2])
            .iter()
            .all(|v| v.is_finite());
        is_known.then_some(Row {
            instant,
            source,
            root,
            difference: None,
        })
    });
    let mut rows: Vec<Row<'_>> = usable.collect::<Vec<_>>().into_iter().flatten().collect();
    if rows.is_empty() {
        return None;
    }
    let mut without = Vec::new();
    for row in rows.iter_mut().filter(|row| !has_adjoint(row.instant)) {
        row.difference = Some(without.len());
        without.push(row.instant);
    }
    let unknowns = prior.unknowns.len();
    let mut size = unknowns;
    let biases = data.channels.iter().map(|channel| {
        (channel.bias_sigma > 0.0).then(|| {
            size += 1;
            (size - 1, channel.bias_sigma)
        })
    });
    let biases = biases.collect();
    let problem = Problem {
        machine,
        prior,
        columns: Columns::new(&start, &prior.unknowns),
        sets,
        without,
        rows,
        biases,
        size,
        is_log: data.sources.iter().map(|source| source.is_log).collect(),
    };
    Some(problem.solve(data))
}

impl Problem<'_> {
    fn solve(&self, data: &Data) -> Fit {
        let mut at = DVector::zeros(self.size);
        let unknowns = self.prior.unknowns.len();
        at.rows_mut(0, unknowns).copy_from(&self.prior.mean);
        let mut sources: Vec<SourceUse> = (data.sources.iter().enumerate())
            .map(|(source, of)| {
                let used = self.rows.iter().filter(|row| row.source == source).count();
                SourceUse {
                    name: of.name.clone(),
                    instants: used,
                    left_out: of.instants.len() - used,
                    outliers: 0,
                    effective: used as f64,
                    correlated: 1.0,
                    scale: 1.0,
                }
            })
            .collect();
        let mut differences = self.differences(&at);
        let mut whitened = self.whitened(&at, &differences);
        for round in 0..ROUNDS {
            if round > 0 {
                differences = self.differences(&at);
                whitened = self.whitened(&at, &differences);
            }
            for _ in 0..MOST_STEPS {
                let weights = self.weights(&whitened, &mut sources);
                let (precision, slope) = self.normal_equations(&at, &whitened, &weights);
                let Some(root) = Cholesky::new(precision) else {
                    break;
                };
                let step = root.solve(&slope);
                let length = step.amax();
                let taken = self.take_step(&mut at, &step, &whitened, &weights);
                whitened = self.whitened(&at, &differences);
                if !taken || length < SMALL_STEP {
                    break;
                }
            }
            if round + 1 < ROUNDS {
                self.learn_correlation(data, &whitened, &mut sources);
            }
        }
        let weights = self.weights(&whitened, &mut sources);
        let (precision, _) = self.normal_equations(&at, &whitened, &weights);
        Fit {
            unknowns: at.rows(0, unknowns).into_owned(),
            precision,
            sources,
        }
    }

    /// Goes along a step as far as it lowers the cost; whether it did.
    fn take_step(
        &self,
        at: &mut DVector<f64>,
        step: &DVector<f64>,
        whitened: &[Whitened],
        weights: &[f64],
    ) -> bool {
        let residuals: Vec<DVector<f64>> = whitened.iter().map(|w| w.residual.clone()).collect();
        let before = self.cost(at, &residuals, weights);
        let mut share = 1.0;
        for _ in 0..8 {
            let next = &*at + step * share;
            let changed = self.changed(&next);
            if changed.is_possible() {
                let cost = self.cost(&next, &self.residuals(&changed, &next), weights);
                if cost <= before {
                    *at = next;
                    return true;
                }
            }
            share *= 0.5;
        }
        false
    }

    fn cost(&self, at: &DVector<f64>, residuals: &[DVector<f64>], weights: &[f64]) -> f64 {
        let unknowns = self.prior.unknowns.len();
        let off = at.rows(0, unknowns) - &self.prior.mean;
        let biases = at.rows(unknowns, self.size - unknowns).norm_squared();
        let prior = off.dot(&(&self.prior.precision * &off)) + biases;
        let data = residuals
            .iter()
            .zip(weights)
            .filter(|(_, weight)| **weight > 0.0);
        prior
            + data
                .map(|(r, weight)| weight * r.norm_squared())
                .sum::<f64>()
    }

    fn changed(&self, at: &DVector<f64>) -> Changed {
        let unknowns = at.rows(0, self.prior.unknowns.len()).into_owned();
        let changes = self.prior.changes(&unknowns);
        Changed::new(self.machine, &self.sets, &self.prior.unknowns, &changes)
    }

    /// Residuals of covariance one.
    fn residuals(&self, changed: &Changed, at: &DVector<f64>) -> Vec<DVector<f64>> {
        let rows = self.rows.par_iter();
        rows.map(|row| self.residual(row, changed, at)).collect()
    }

    fn residual(&self, row: &Row<'_>, changed: &Changed, at: &DVector<f64>) -> DVector<f64> {
        let predicted = changed.predict(row.instant, [0.0; 2]);
        let readings = row.instant.readings.iter().zip(predicted);
        let left = readings.map(|(reading, predicted)| {
            let bias = self.biases[reading.channel].map_or(0.0, |(place, sigma)| at[place] * sigma);
            reading.value - predicted - bias
        });
        let left = DVector::from_iterator(row.instant.readings.len(), left);
        lower_solved(&row.root, left)
    }

    /// Derivatives of the instants without an adjoint.
    fn differences(&self, at: &DVector<f64>) -> Vec<DMatrix<f64>> {
        let unknowns = at.rows(0, self.prior.unknowns.len()).into_owned();
        let (changes, prior) = (self.prior.changes(&unknowns), self.prior);
        by_differences(
            (self.machine, &self.sets),
            &prior.unknowns,
            &prior.sigmas,
            &changes,
            &self.without,
        )
    }

    fn whitened(&self, at: &DVector<f64>, differences: &[DMatrix<f64>]) -> Vec<Whitened> {
        let changed = self.changed(at);
        let rows = self.rows.par_iter();
        rows.map(|row| {
            let unknowns = match row.difference {
                Some(place) => differences[place].clone(),
                None => by_adjoint(&changed, &self.columns, &self.prior.sigmas, row.instant),
            };
            let mut derivatives = unknowns.resize_horizontally(self.size, 0.0);
            for (place, reading) in row.instant.readings.iter().enumerate() {
                if let Some((column, sigma)) = self.biases[reading.channel] {
                    derivatives[(place, column)] = sigma;
                }
            }
            row.root
                .l_dirty()
                .solve_lower_triangular_mut(&mut derivatives);
            Whitened {
                residual: self.residual(row, &changed, at),
                derivatives,
            }
        })
        .collect()
    }

    /// Weight of every row: of its source, and by how far it is out of the others. All weighings are judged together.
    fn weights(&self, whitened: &[Whitened], sources: &mut [SourceUse]) -> Vec<f64> {
        let size = |w: &Whitened| (w.residual.norm_squared() / w.residual.len() as f64).sqrt();
        let sizes: Vec<f64> = whitened.iter().map(size).collect();
        let usual = |is_of: &dyn Fn(usize) -> bool| {
            let of = (0..self.rows.len()).filter(|&row| is_of(self.rows[row].source));
            let of: Vec<f64> = of.map(|row| sizes[row]).collect();
            // A few say nothing about the spread of their errors.
            match of.len() {
                0..FEWEST => f64::INFINITY,
                _ => median(of).max(1.0),
            }
        };
        let of_weighings = usual(&|source| !self.is_log[source]);
        let of_logs: Vec<f64> = (0..sources.len())
            .map(|log| usual(&|source| source == log))
            .collect();
        sources.iter_mut().for_each(|source| source.outliers = 0);
        let weight = |(row, of): (usize, &Row<'_>)| {
            let usual = if self.is_log[of.source] {
                of_logs[of.source]
            } else {
                of_weighings
            };
            let derivatives = &whitened[row].derivatives;
            let is_known = sizes[row].is_finite() && derivatives.iter().all(|v| v.is_finite());
            let robust = match sizes[row] / usual {
                _ if !is_known => 0.0,
                out if out <= FULL_WEIGHT => 1.0,
                out if out <= NO_WEIGHT => FULL_WEIGHT / out,
                _ => 0.0,
            };
            let source = &mut sources[of.source];
            source.outliers += usize::from(robust == 0.0);
            robust / (source.scale.powi(2) * source.correlated)
        };
        self.rows.iter().enumerate().map(weight).collect()
    }

    /// Learns from the residuals how large they are and how many instants are independent.
    fn learn_correlation(&self, data: &Data, whitened: &[Whitened], sources: &mut [SourceUse]) {
        for (index, source) in sources.iter_mut().enumerate() {
            if !data.sources[index].is_log {
                continue;
            }
            let rows: Vec<usize> = (0..self.rows.len())
                .filter(|&row| self.rows[row].source == index)
                .filter(|&row| whitened[row].residual.iter().all(|v| v.is_finite()))
                .collect();
            if rows.is_empty() {
                continue;
            }
            let channels = rows.iter().map(|&row| whitened[row].residual.len());
            let channels = channels.min().unwrap_or(0);
            let mut correlated = rows.len() as f64 / self.postures(&rows) as f64;
            for channel in 0..channels {
                let series: Vec<f64> = rows
                    .iter()
                    .map(|&row| whitened[row].residual[channel])
                    .collect();
                correlated = correlated.max(correlated_samples(&series));
            }
            source.correlated = correlated.max(1.0);
            source.effective = source.instants as f64 / source.correlated;
            let squares = rows.iter().map(|&row| {
                let residual = &whitened[row].residual;
                residual.norm_squared() / residual.len() as f64
            });
            source.scale = median(squares.collect()).sqrt().max(1.0);
        }
    }

    /// Number of stretches between which the readings of a log change.
    fn postures(&self, rows: &[usize]) -> usize {
        let values = |row: usize| self.rows[row].instant.readings.iter().map(|r| r.value);
        let largest = rows
            .iter()
            .flat_map(|&row| values(row))
            .fold(0.0_f64, |a, b| a.max(b.abs()));
        let mut count = 1;
        let mut last = rows[0];
        for &row in rows {
            let mut pairs = values(row).zip(values(last));
            if pairs.any(|(a, b)| (a - b).abs() > OWN_POSTURE * largest) {
                count += 1;
                last = row;
            }
        }
        count
    }

    fn normal_equations(
        &self,
        at: &DVector<f64>,
        whitened: &[Whitened],
        weights: &[f64],
    ) -> (DMatrix<f64>, DVector<f64>) {
        let unknowns = self.prior.unknowns.len();
        let mut precision = DMatrix::identity(self.size, self.size);
        precision
            .view_mut((0, 0), (unknowns, unknowns))
            .copy_from(&self.prior.precision);
        let mut slope = -at;
        let off = &self.prior.mean - at.rows(0, unknowns);
        slope
            .rows_mut(0, unknowns)
            .copy_from(&(&self.prior.precision * off));
        // Rows of one matrix: a single product is far faster than many small ones.
        let used: Vec<(&Whitened, f64)> = (whitened.iter().zip(weights))
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(w, weight)| (w, weight.sqrt()))
            .collect();
        let height = used.iter().map(|(w, _)| w.residual.len()).sum();
        let mut stacked = DMatrix::zeros(height, self.size);
        let mut right = DVector::zeros(height);
        let mut first = 0;
        for (w, root) in used {
            let rows = w.residual.len();
            stacked
                .rows_mut(first, rows)
                .copy_from(&(&w.derivatives * root));
            right.rows_mut(first, rows).copy_from(&(&w.residual * root));
            first += rows;
        }
        precision += stacked.tr_mul(&stacked);
        slope += stacked.tr_mul(&right);
        (precision, slope)
    }
}

fn lower_solved(root: &Cholesky<f64, Dyn>, mut values: DVector<f64>) -> DVector<f64> {
    root.l_dirty().solve_lower_triangular_mut(&mut values);
    values
}

fn median(mut values: Vec<f64>) -> f64 {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(1.0)
}

/// Correlations below this end the sum.
const LEAST: f64 = 0.05;

/// Number of samples after which residuals count as independent, at least one:
/// ```text
///     tau = 1 + 2 sum over k of c_k / c_0,      c_k = sum over t of e_t e_(t+k)
/// ```
/// up to the first small term. The mean is not subtracted: an error that stays the same through a whole log is one
/// sample of that error.
fn correlated_samples(residuals: &[f64]) -> f64 {
    let count = residuals.len();
    let lag = |k: usize| -> f64 {
        let pairs = residuals.iter().zip(&residuals[k..]);
        pairs.map(|(a, b)| a * b).sum()
    };
    let zero = match count {
        0 => return 1.0,
        _ => lag(0),
    };
    if !(zero > 0.0) {
        return 1.0;
    }
    let mut sum = 1.0;
    for k in 1..count {
        let correlation = lag(k) / zero;
        if !(correlation > LEAST) {
            break;
        }
        sum += 2.0 * correlation;
    }
    sum.min(count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_error_is_one_sample_and_alternating_ones_are_independent() {
        assert_eq!(correlated_samples(&[]), 1.0);
        assert_eq!(correlated_samples(&[0.0; 9]), 1.0);
        // sums of a finite series: half of the samples lie before the other half
        let constant = correlated_samples(&[0.7; 400]);
        assert!(constant > 300.0, "{constant}");
        let alternating: Vec<f64> = (0..400).map(|t| f64::from(1 - 2 * (t % 2))).collect();
        assert_eq!(correlated_samples(&alternating), 1.0);
    }

    #[test]
    fn val_a_first_order_process_has_its_known_correlation_time() {
        // e_t = a e_(t-1) + noise: tau = (1 + a) / (1 - a)
        let (mut e, mut seed, a) = (0.0_f64, 1_u64, 0.8);
        let series: Vec<f64> = (0..40_000)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                e = a * e + (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0;
                e
            })
            .collect();
        let found = correlated_samples(&series);
        assert!((found - 9.0).abs() < 1.2, "{found}");
    }
}

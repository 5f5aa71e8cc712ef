//! Test whether weighings agree with each other, whatever the machine weighs.
//!
//! The loads of the supports in each posture are unknown, and so is the weight, which is the same in all postures:
//! ```text
//!     y = C N + e,      sum of N in posture p = W cos(slope of p)
//! ```
//! Readings beyond the rank of these equations are redundant. Their residuals r after least squares, in standard
//! deviations, have the distribution of chi-square with as many degrees of freedom.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use tipwatch_mechanics::machine::{Machine, SupportId};

use crate::identification::data::{Data, Instant, Measured, Reading, Situation};

/// Quantile of the normal distribution beyond which weighings contradict each other: chance does so once in a thousand.
const BEYOND: f64 = 3.09;
/// Singular values below this share of the largest count as zero.
const RANK: f64 = 1e-9;
/// A sum that differs from that of other readings by less than this share of their joint standard deviation was
/// calculated from them.
const CALCULATED: f64 = 0.05;
/// Readings are equally suspect if their disagreements, in standard deviations, differ by less than this share.
const EQUALLY: f64 = 1e-3;
/// Standard deviation of the weight being the same, as a share of it: rounding.
const SAME_WEIGHT: f64 = 1e-7;

/// Agreement of weighings with each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Agreement {
    /// Sum of the squared residuals of the redundant readings, in standard deviations.
    pub chi_square: f64,
    /// Number of redundant readings.
    pub redundant: usize,
    /// The readings that disagree most with all others. Several are equally suspect where no further reading tells which of
    /// them is wrong: of two axles and the whole machine, any one.
    pub suspects: Vec<Disagreement>,
}

/// A reading against what all other weighings say of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Disagreement {
    /// Name of the weighing.
    pub weighing: String,
    /// Name of the channel.
    #[serde(rename = "reading")]
    pub channel: String,
    /// The reading minus what the others say (N).
    #[serde(rename = "difference_n")]
    pub difference: f64,
    /// Standard deviation of that difference (N).
    #[serde(rename = "difference_sigma_n")]
    pub sigma: f64,
}

impl Agreement {
    /// Whether the weighings contradict each other.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        // Wilson and Hilferty: the cube root of chi-square is nearly normal
        let freedom = self.redundant as f64;
        let spread = 2.0 / (9.0 * freedom);
        let normal = ((self.chi_square / freedom).cbrt() - (1.0 - spread)) / spread.sqrt();
        normal > BEYOND
    }
}

/// Tests how well the weighings of `data` agree with each other; `None` if no reading is redundant.
#[must_use]
pub fn agreement(machine: &Machine, data: &Data) -> Option<Agreement> {
    let weighings = data.sources.iter().filter(|source| !source.is_log);
    let weighings: Vec<(&str, &Instant)> = weighings
        .flat_map(|of| {
            of.instants
                .iter()
                .map(|instant| (of.name.as_str(), instant))
        })
        .filter(|(_, instant)| instant.readings.iter().any(|r| r.what.is_load()))
        .collect();
    // equal postures have the same loads
    let mut postures: Vec<(&Instant, usize)> = Vec::new();
    // the weight is in the last column
    let mut columns = 0;
    let mut first_of = Vec::with_capacity(weighings.len());
    for (_, instant) in &weighings {
        let known = postures.iter().find(|(other, _)| is_same(other, instant));
        first_of.push(known.map_or(columns, |(_, first)| *first));
        if known.is_none() {
            postures.push((instant, columns));
            columns += instant.supports.len();
        }
    }
    let weight = machine.mass() * machine.gravity();
    let mut equations = Vec::new();
    let mut names = Vec::new();
    for ((name, instant), first) in weighings.iter().zip(first_of) {
        for reading in &instant.readings {
            let Measured::Load { supports } = &reading.what else {
                continue;
            };
            let mut factors = DVector::zeros(columns + 1);
            let places = supports.iter();
            let places = places.filter_map(|id| instant.supports.iter().position(|on| on == id));
            places.for_each(|place| factors[first + place] = 1.0);
            equations.push((factors, reading.value, reading.sigma));
            names.push((*name, reading.channel));
        }
    }
    for (instant, first) in postures {
        let (cosine, sigma) = normal_share(instant);
        let mut factors = DVector::zeros(columns + 1);
        (factors.rows_mut(first, instant.supports.len())).fill(1.0);
        factors[columns] = -cosine;
        equations.push((factors, 0.0, weight * sigma.hypot(SAME_WEIGHT)));
    }
    let residuals = Residuals::of(&equations)?;
    let off: Vec<Option<(f64, f64)>> = (0..names.len()).map(|row| residuals.without(row)).collect();
    let size = |row: usize| off[row].map_or(0.0, |(off, sigma)| (off / sigma).abs());
    let most = (0..names.len()).map(size).fold(0.0, f64::max);
    let suspects = (0..names.len()).filter(|&row| size(row) >= (1.0 - EQUALLY) * most);
    let disagreement = |row: usize| {
        let (difference, sigma) = off[row]?;
        let (weighing, channel) = names[row];
        let stated = equations[row].2;
        Some(Disagreement {
            weighing: weighing.into(),
            channel: data.channels[channel].name.clone(),
            difference: difference * stated,
            sigma: sigma * stated,
        })
    };
    let suspects: Vec<Disagreement> = suspects.filter_map(disagreement).collect();
    (!suspects.is_empty()).then(|| Agreement {
        chi_square: residuals.scaled.norm_squared(),
        redundant: residuals.redundant,
        suspects,
    })
}

/// Residuals of equations in standard deviations.
struct Residuals {
    scaled: DVector<f64>,
    /// Share of the error of each equation that its residual shows: 1 less the leverage.
    shown: Vec<f64>,
    redundant: usize,
}

impl Residuals {
    fn of(equations: &[(DVector<f64>, f64, f64)]) -> Option<Self> {
        let (first, ..) = equations.first()?;
        let (rows, columns) = (equations.len(), first.len());
        let matrix = DMatrix::from_fn(rows, columns, |row, column| {
            equations[row].0[column] / equations[row].2
        });
        let right = equations.iter().map(|(_, value, sigma)| value / sigma);
        let right = DVector::from_iterator(rows, right);
        if !(matrix.iter().chain(right.iter())).all(|value| value.is_finite()) {
            return None;
        }
        let decomposed = matrix.svd(true, false);
        let directions = decomposed.u?;
        let values = &decomposed.singular_values;
        let least = values.max() * RANK;
        let told: Vec<usize> = (0..values.len()).filter(|&k| values[k] > least).collect();
        let redundant = rows - told.len();
        if redundant == 0 {
            return None;
        }
        let mut scaled = right.clone();
        let mut shown = vec![1.0; rows];
        for &k in &told {
            let direction = directions.column(k);
            scaled -= direction * direction.dot(&right);
            for (shown, part) in shown.iter_mut().zip(direction.iter()) {
                *shown -= part * part;
            }
        }
        Some(Self {
            scaled,
            shown,
            redundant,
        })
    }

    /// Returns the difference of a reading from what the others predict of it, and the standard deviation of the difference, both
    /// in the reading's own standard deviations; `None` if the others say nothing of the reading.
    fn without(&self, row: usize) -> Option<(f64, f64)> {
        let shown = self.shown[row];
        (shown > 1e-9).then(|| (self.scaled[row] / shown, shown.sqrt().recip()))
    }
}

/// Share of the weight that presses on the ground, and its standard deviation.
fn normal_share(instant: &Instant) -> (f64, f64) {
    let Situation::AtRest {
        slope, slope_sigma, ..
    } = &instant.situation
    else {
        return (1.0, 0.0);
    };
    let rise = slope[0].tan().hypot(slope[1].tan());
    let cosine = 1.0 / rise.hypot(1.0);
    let by_slope = rise * cosine * slope_sigma;
    (cosine, by_slope.hypot(0.5 * slope_sigma.powi(2)))
}

/// Whether the loads of two weighings must be the same: of equal supports, joint positions and exactly known slopes.
fn is_same(a: &Instant, b: &Instant) -> bool {
    let parts = |of: &Instant| match &of.situation {
        Situation::AtRest {
            positions,
            slope,
            slope_sigma,
        } if *slope_sigma == 0.0 => Some((positions.clone(), *slope)),
        _ => None,
    };
    a.supports == b.supports && parts(a).is_some() && parts(a) == parts(b)
}

/// The readings of an instant that were calculated as sums of others of it, and tell nothing more.
#[must_use]
pub fn calculated_sums(readings: &[Reading]) -> Vec<usize> {
    let all = 0..readings.len();
    all.filter(|&sum| is_calculated(readings, sum)).collect()
}

fn is_calculated(readings: &[Reading], sum: usize) -> bool {
    let Measured::Load { supports: whole } = &readings[sum].what else {
        return false;
    };
    // each chain of disjoint parts of the sum: (supports covered, next reading to try, their total, their variance)
    let mut chains = vec![(0_usize, 0_usize, 0.0_f64, 0.0_f64, Vec::new())];
    while let Some((covered, from, total, variance, parts)) = chains.pop() {
        if covered == whole.len() {
            let own = readings[sum].sigma;
            let off = (readings[sum].value - total).abs();
            let rounding = 1e-9 * readings[sum].value.abs();
            if off <= CALCULATED * (variance + own * own).sqrt() + rounding {
                return true;
            }
            continue;
        }
        for next in from..readings.len() {
            let Measured::Load { supports: part } = &readings[next].what else {
                continue;
            };
            let is_part = next != sum
                && part.len() < whole.len()
                && part.iter().all(|id| whole.contains(id))
                && !parts
                    .iter()
                    .any(|&other: &usize| overlap(&readings[other], part));
            if is_part {
                let mut parts = parts.clone();
                parts.push(next);
                let sigma = readings[next].sigma;
                chains.push((
                    covered + part.len(),
                    next + 1,
                    total + readings[next].value,
                    variance + sigma * sigma,
                    parts,
                ));
            }
        }
    }
    false
}

fn overlap(reading: &Reading, supports: &[SupportId]) -> bool {
    match &reading.what {
        Measured::Load { supports: others } => supports.iter().any(|id| others.contains(id)),
        _ => false,
    }
}

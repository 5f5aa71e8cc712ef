//! Check of load readings against the bands that the identified machine states, and the width that the bands need.
//!
//! The band of a reading of n supports is that of their computed load and of the sensor together:
//! ```text
//!     s^2 = s_parameters^2 + n (m F / k)^2 + s_sensor^2
//! ```
//! with m the model share, F the normal force and k the number of supports on the ground. Where less than 95.4 % of the
//! readings lie within 2 s, m is too small. It is then the one at which these many do. The same holds for what each reading
//! shows beside the split between the diagonals, whose open part hides errors of everything else, and for the readings
//! that were fitted: the largest m counts.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use tipwatch_mechanics::machine::{Identified, Machine};
use tipwatch_mechanics::{
    Scope, State, Workspace, combination_sigma, evaluate_one, resting_on_slope, resting_state,
    self_equilibrated_loads,
};

use crate::identification::data::{Data, Instant, Measured, Situation};
use crate::identification::model::{Changed, places};

/// Share of a normal distribution within two standard deviations.
const WITHIN: f64 = 0.954_499_736;
/// Fewest readings by which the fit has not been chosen; with fewer, all are judged.
const FEWEST: usize = 20;
/// A reading whose variance is that of the split to this share shows only the split, while it lies within two standard deviations.
const ONLY_SPLIT: f64 = 0.9;

/// Readings of loads against the bands of the identified machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BandCheck {
    /// Number of readings: those that were held back, all if these are few.
    pub readings: usize,
    /// Share of them within two standard deviations, by the stated model share.
    pub inside_two_sigma: f64,
    /// Residuals are this many times as large as stated: twice this many standard deviations hold 95.4 % of what each reading
    /// shows beside the split between the diagonals, which is open. `None` if all that is read is that split: then nothing
    /// stands against what was stated.
    #[serde(rename = "residuals_over_stated")]
    pub excess: Option<f64>,
    /// The stated model share.
    #[serde(rename = "stated_model_share")]
    pub stated_share: f64,
    /// The model share at which two standard deviations hold 95.4 % of the readings, of those that were fitted too, and of
    /// what they show beside the split; at least the stated one.
    pub model_share: f64,
}

/// A reading of a load.
struct Judged {
    reading: Residual,
    /// Residual beside the split between the diagonals, which is open; `None` if nothing remains beside the split.
    beside_split: Option<Residual>,
}

/// A residual and its band.
#[derive(Clone, Copy)]
struct Residual {
    residual: f64,
    /// Variance by parameters, slope and sensor (N^2).
    variance: f64,
    /// Variance that a model share of one adds (N^2).
    per_share: f64,
    /// Part of the variance that is the split's (N^2).
    of_split: f64,
}

impl Residual {
    /// Whether the residual shows nothing beside how the supports share the load.
    fn shows_only_split(&self) -> bool {
        self.of_split >= ONLY_SPLIT * self.variance && self.ratio(0.0) <= 2.0
    }

    fn is_known(&self) -> bool {
        self.residual.is_finite() && self.variance.is_finite() && self.per_share > 0.0
    }

    /// Returns the residual in standard deviations at this model share.
    fn ratio(&self, share: f64) -> f64 {
        self.residual.abs() / (self.variance + share.powi(2) * self.per_share).sqrt()
    }

    /// The model share at which it lies at two standard deviations; 0 if it lies within without one.
    fn needed(&self) -> f64 {
        let missing = 0.25 * self.residual.powi(2) - self.variance;
        (missing.max(0.0) / self.per_share).sqrt()
    }
}

/// Number of these outside two standard deviations.
fn outside(of: &[Residual], share: f64) -> usize {
    of.iter().filter(|of| of.ratio(share) > 2.0).count()
}

/// The model share that these show, at least the stated one.
fn share_of(of: &[Residual], stated_share: f64) -> f64 {
    // chance puts some outside
    let expected = (1.0 - WITHIN) * of.len() as f64;
    let is_narrow = outside(of, stated_share) as f64 > expected + 2.0 * expected.sqrt() + 1.0;
    match is_narrow {
        true => at_share(of.iter().map(Residual::needed).collect()).max(stated_share),
        false => stated_share,
    }
}

impl BandCheck {
    /// Judges the readings by `machine`, which is without identified parameters; `None` without a load to judge.
    pub(crate) fn of(
        machine: &Machine,
        identified: &Identified,
        [fitted, held]: [&Data; 2],
    ) -> Option<Self> {
        let stated_share = machine.uncertainty().model_share;
        let mut uncertainty = *machine.uncertainty();
        uncertainty.model_share = 0.0;
        let known = (machine.clone())
            .with_uncertainty(uncertainty)
            .with_identified(identified.clone());
        let of_held = judged(machine, &known, identified, held);
        let of_fitted = judged(machine, &known, identified, fitted);
        let shares = [&of_held, &of_fitted].into_iter().flat_map(|judged| {
            [readings(judged), beside_split(judged)].map(|of| share_of(&of, stated_share))
        });
        let model_share = shares.fold(stated_share, f64::max);
        let mut judged = of_held;
        if judged.len() < FEWEST {
            judged.extend(of_fitted);
        }
        let count = judged.len();
        if count == 0 {
            return None;
        }
        let beside = beside_split(&judged).into_iter();
        let beside: Vec<f64> = beside.map(|of| of.ratio(stated_share)).collect();
        Some(Self {
            readings: count,
            inside_two_sigma: 1.0 - outside(&readings(&judged), stated_share) as f64 / count as f64,
            excess: (!beside.is_empty()).then(|| 0.5 * at_share(beside)),
            stated_share,
            model_share,
        })
    }
}

fn readings(judged: &[Judged]) -> Vec<Residual> {
    judged.iter().map(|of| of.reading).collect()
}

fn beside_split(judged: &[Judged]) -> Vec<Residual> {
    judged.iter().filter_map(|of| of.beside_split).collect()
}

/// The value that [`WITHIN`] of all do not exceed.
fn at_share(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (WITHIN * values.len() as f64).ceil() as usize;
    values[place.clamp(1, values.len()) - 1]
}

/// The readings of loads whose bands are known.
fn judged(machine: &Machine, known: &Machine, identified: &Identified, data: &Data) -> Vec<Judged> {
    let sets = data.sets();
    let changed = Changed::new(machine, &sets, &identified.unknowns, &identified.change);
    let on_sets: Vec<Machine> = (sets.iter())
        .filter_map(|set| known.standing_on(set).ok())
        .collect();
    let instants: Vec<&Instant> = (data.sources.iter())
        .flat_map(|source| &source.instants)
        .filter(|instant| instant.readings.iter().any(|r| r.what.is_load()))
        .collect();
    let of = instants.par_iter().flat_map_iter(|instant| {
        let on = on_sets
            .iter()
            .find(|on| *on.stands_on() == *instant.supports);
        on.map_or(Vec::new(), |on| of_instant(&changed, on, data, instant))
    });
    of.collect()
}

fn of_instant(changed: &Changed, known: &Machine, data: &Data, instant: &Instant) -> Vec<Judged> {
    let (machine, state) = placed(changed, known, instant);
    let scope = Scope {
        sensitivities: true,
        ..Scope::LOADS
    };
    let mut workspace = Workspace::with_scope(&machine, scope);
    let outcome = evaluate_one(&machine, &state, &mut workspace);
    let normal_force = outcome.normal_force;
    // around a lifted wheel the band is that of its lift
    if !outcome.load.iter().all(|load| *load > 0.0) {
        return Vec::new();
    }
    let count = machine.wheels().len();
    let predicted = changed.predict(instant, [0.0; 2]);
    let by_slope = changed.by_slope(instant);
    let readings = instant.readings.iter().enumerate();
    let read = readings.filter_map(|(row, reading)| {
        let Measured::Load { supports } = &reading.what else {
            return None;
        };
        let mut factors = DVector::zeros(count);
        places(&machine, supports).for_each(|place| factors[place] = 1.0);
        let bias = data.channels[reading.channel].bias_sigma;
        Some(Read {
            residual: reading.value - predicted[row],
            factors,
            sensor: if bias > 0.0 { bias } else { reading.sigma },
            by_slope: by_slope.iter().map(|by| by[row]).collect(),
        })
    });
    let read: Vec<Read> = read
        .filter(|read| read.residual.is_finite() && read.factors.sum() > 0.0)
        .collect();
    // Of a sum of readings: residual, variance without what the model leaves out, and what a share of one adds.
    let (beside, moved) = without_split(&read, self_equilibrated_loads(&workspace), normal_force);
    let sum = |weights: &DVector<f64>, moved: &[DVector<f64>]| {
        let mut factors = DVector::zeros(count);
        let mut by_slope = vec![0.0; by_slope.len()];
        let (mut residual, mut of_sensors) = (0.0, 0.0);
        for (read, &weight) in read.iter().zip(weights) {
            factors += &read.factors * weight;
            residual += read.residual * weight;
            of_sensors += (read.sensor * weight).powi(2);
            let pairs = by_slope.iter_mut().zip(&read.by_slope);
            pairs.for_each(|(sum, by)| *sum += by * weight);
        }
        let of_parameters = combination_sigma(&machine, &state, &workspace, factors.as_slice());
        let of_slope: f64 = by_slope.iter().map(|by| by * by).sum();
        let per_share = factors.norm_squared() * (normal_force / count as f64).powi(2);
        let of_split: f64 = moved.iter().map(|moved| moved.dot(weights).powi(2)).sum();
        let variance = of_parameters.powi(2) + of_sensors + of_slope + of_split;
        Residual {
            residual,
            variance,
            per_share,
            of_split,
        }
    };
    let judged = (0..read.len()).map(|place| {
        let mut alone = DVector::zeros(read.len());
        alone[place] = 1.0;
        let weights = beside.column(place).into_owned();
        let beside_split = Some(sum(&weights, &moved)).filter(Residual::is_known);
        Judged {
            reading: sum(&alone, &[]),
            beside_split: beside_split.filter(|of| !of.shows_only_split()),
        }
    });
    judged.filter(|of| of.reading.is_known()).collect()
}

/// A load that was read.
struct Read {
    residual: f64,
    /// Factor of each wheel: 1 if the wheel is part of the load.
    factors: DVector<f64>,
    /// Standard deviation of the sensor (N).
    sensor: f64,
    /// Change of the load by one standard deviation of each slope (N).
    by_slope: Vec<f64>,
}

/// Removes the sums of readings that the split moves from the readings of an instant. Returns the weights of all readings in what
/// remains of each one, and the changes of the readings by the largest split in each direction (N). With h one of these changes
/// and s the standard deviation of a sensor, the weights are multiplied by
/// ```text
///     1 - h h' / (s^2 + h' h)
/// ```
/// so that a split that moves the readings by less than their sensors know hides nothing, and one that moves them far hides its
/// direction. The weights are symmetric, with one reading in each column.
fn without_split(
    read: &[Read],
    split: Vec<Vec<f64>>,
    normal_force: f64,
) -> (DMatrix<f64>, Vec<DVector<f64>>) {
    let mut left = DMatrix::identity(read.len(), read.len());
    let mut moved = Vec::new();
    let sensor = read.iter().map(|read| read.sensor.powi(2)).sum::<f64>() / read.len() as f64;
    for direction in split {
        // a direction of length one moves every support by its mean load
        let most = normal_force / (direction.len() as f64).sqrt();
        let direction = DVector::from_vec(direction);
        let shown = read.iter().map(|read| most * read.factors.dot(&direction));
        // beside those before
        let shown: DVector<f64> = &left * DVector::from_iterator(read.len(), shown);
        let (length, known) = (shown.norm_squared(), sensor.max(f64::MIN_POSITIVE));
        left -= &shown * shown.transpose() / (known + length);
        moved.push(shown);
    }
    (left, moved)
}

/// The machine as it stood at an instant and its state, with the errors of the signals corrected.
fn placed(changed: &Changed, known: &Machine, instant: &Instant) -> (Machine, State<f64>) {
    match &instant.situation {
        Situation::Logged(state) => (known.clone(), changed.corrected(state)),
        Situation::AtRest {
            positions, slope, ..
        } => {
            let shown = changed.corrected(&resting_state(known, positions));
            let positions: Vec<f64> = shown.joints.iter().map(|joint| joint.position).collect();
            resting_on_slope(known, &positions, *slope)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Front and rear axle of a machine whose one wheel is some millimetres out of square.
    #[test]
    fn a_split_that_moves_a_reading_by_little_hides_little() {
        let axle = |wheels: [f64; 4]| Read {
            residual: 0.0,
            factors: DVector::from_column_slice(&wheels),
            sensor: 50.0,
            by_slope: Vec::new(),
        };
        let read = [axle([1.0, 1.0, 0.0, 0.0]), axle([0.0, 0.0, 1.0, 1.0])];
        let split = |off: f64| vec![vec![0.5 + off, -0.5, -0.5 - off, 0.5]];
        // by 10 N, beside 50 N of the sensor
        let (left, _) = without_split(&read, split(4e-4), 50_000.0);
        let apart = DVector::from_column_slice(&[1.0, -1.0]);
        assert!((&left * &apart).norm() > 0.9 * apart.norm(), "{left}");
        // by 5 kN: what stands apart is the split, and its variance says so
        let (left, moved) = without_split(&read, split(0.2), 50_000.0);
        let left = &left * &apart;
        assert!(left.norm() < 1e-3, "{left}");
        let of_split: f64 = moved.iter().map(|moved| moved.dot(&left).powi(2)).sum();
        let of_sensors = (50.0 * left.norm()).powi(2);
        assert!(of_split > 0.99 * (of_split + of_sensors));
        // what both axles show together is never the split
        let together = DVector::from_column_slice(&[1.0, 1.0]);
        let (left, _) = without_split(&read, split(0.2), 50_000.0);
        assert!((&left * &together - together).norm() < 1e-9);
    }

    #[test]
    fn the_quantile_leaves_one_in_twenty_out() {
        let values: Vec<f64> = (0..100).rev().map(f64::from).collect();
        assert_eq!(at_share(values), 95.0);
        assert_eq!(at_share(vec![3.0]), 3.0);
    }
}

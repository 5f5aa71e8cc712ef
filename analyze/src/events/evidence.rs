//! The confidence of an event: under the stated split of the load, and under any split.
//!
//! The largest load that equilibrium allows a wheel is set by an edge that does not carry it: with every other
//! wheel off that edge unloaded, the wheel alone balances the moment about it,
//! ```text
//!     largest load of w = min over edges of sum over wheels (d_i / d_w) OTF_i,   d_i distance from the edge
//! ```
//! a sum of overturning forces that no split changes, with the standard deviation of that sum.

use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::normal_distribution;
use tipwatch_mechanics::{Placement, Quantity, Scope, State};

use super::episodes::Episode;
use super::onset::STATED_SIGMAS;
use super::pages::Pages;
use super::tipping::{Tipping, distances};

/// Time within which the error of a computed load counts as constant (ns).
pub(super) const CONSTANT_ERROR_NS: u64 = 30_000_000_000;
/// Standard deviation of the computed load off an edge while the platform rotates about it, beside the effect of the machine's
/// parameters: that of its motion, as a share of the weight.
const ROTATING_SHARE: f64 = 0.005;
/// Largest difference between a sum of OTF and the end of the envelope for both to count as equal, as a share of the weight.
const SAME_SHARE: f64 = 1e-3;

/// Finds the confidence of the events of a log.
pub(super) struct Evidence<'a> {
    machine: &'a Machine,
    rows: &'a Pages<'a>,
    scope: Scope,
    tippings: &'a [Tipping],
}

/// The error of a wheel's computed OTF, as far as a later rotation about an edge shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KnownError {
    /// The expected error (N).
    pub(super) mean_n: f64,
    /// The share of the variance of the OTF that remains.
    pub(super) variance_share: f64,
}

impl KnownError {
    const NONE: Self = Self {
        mean_n: 0.0,
        variance_share: 1.0,
    };
}

/// Probability that a load was below a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Confidence {
    /// Probability under the stated split.
    pub(super) stated: Option<f64>,
    /// Probability under any split.
    pub(super) any_split: Option<f64>,
    /// The row.
    pub(super) row: usize,
}

impl<'a> Evidence<'a> {
    pub(super) fn new(
        machine: &'a Machine,
        rows: &'a Pages<'a>,
        scope: Scope,
        tippings: &'a [Tipping],
    ) -> Self {
        Self {
            machine,
            rows,
            scope,
            tippings,
        }
    }

    fn at(&self, quantity: Quantity, row: usize) -> f64 {
        self.rows.value(quantity, row)
    }

    /// The load of a wheel as if it alone were held to the ground: its load, or its OTF where that is negative.
    /// Unknown where other wheels are off the ground too, for then the OTF is not what holding it takes.
    pub(super) fn held_load(&self, wheel: usize, row: usize) -> f64 {
        let load = self.at(Quantity::Load(wheel), row);
        if load > 0.0 || load.is_nan() {
            return load;
        }
        let mut others = (0..self.machine.wheels().len()).filter(|&other| other != wheel);
        match others.all(|other| self.at(Quantity::Load(other), row) > 0.0) {
            true => self.at(Quantity::Otf(wheel), row),
            false => f64::NAN,
        }
    }

    /// The error of the OTF of a wheel around `row` from the level that the load off an edge kept while the
    /// machine rotated about it, when it was zero in truth:
    /// ```text
    ///     E[error of w | level] = cov(w, edge) / (var(edge) + m^2) level,
    ///     var(w | level) = var(w) - cov(w, edge)^2 / (var(edge) + m^2)
    /// ```
    /// with m the error of the level that comes of the motion. A level that the parameters do not explain says nothing of them.
    pub(super) fn known_error(&self, wheel: usize, row: usize) -> KnownError {
        if !self.scope.sensitivities {
            return KnownError::NONE;
        }
        let time_ns = self.rows.times_ns[row];
        let distance =
            |tipping: &&Tipping| self.rows.times_ns[tipping.episode.first].abs_diff(time_ns);
        let shown = self
            .tippings
            .iter()
            .filter(|t| t.rotates && t.is_by_loads && t.factors[wheel] > 0.0);
        let nearest = shown
            .filter(|t| distance(t) <= CONSTANT_ERROR_NS)
            .min_by_key(distance);
        let found = nearest.and_then(|tipping| {
            let level_n = tipping.onset?.level_n?;
            let sigma = |own: f64, edge: f64| {
                let factors = tipping.factors.iter().enumerate();
                let factors: Vec<f64> = factors
                    .map(|(w, f)| edge * f + if w == wheel { own } else { 0.0 })
                    .collect();
                self.rows.sigma_near(row, &factors, 0)
            };
            let (plus, minus) = (sigma(1.0, 1.0)?, sigma(1.0, -1.0)?);
            let (own, edge) = (sigma(1.0, 0.0)?, sigma(0.0, 1.0)?);
            let covariance = 0.25 * (plus * plus - minus * minus);
            let motion = ROTATING_SHARE * self.at(Quantity::NormalForce, tipping.episode.first);
            let level = edge.hypot(motion);
            (level_n.abs() <= STATED_SIGMAS * level).then_some(KnownError {
                mean_n: covariance / (level * level) * level_n,
                variance_share: (1.0 - (covariance / (own * level)).powi(2)).max(0.0),
            })
        });
        found.unwrap_or(KnownError::NONE)
    }

    /// Standard deviation of the OTF of a wheel at a row, or shortly before it (N).
    pub(super) fn sigma_of(&self, wheel: usize, row: usize) -> f64 {
        let wheels = 0..self.machine.wheels().len();
        let factors: Vec<f64> = wheels.map(|w| f64::from(u8::from(w == wheel))).collect();
        let known = self.scope.sensitivities;
        let sigma = known.then(|| self.rows.sigma_near(row, &factors, 0));
        sigma.flatten().unwrap_or(f64::NAN)
    }

    /// Returns the probability that the load of a wheel was below `limit_n` in an episode, from the row that shows it best. Rows
    /// in which the machine rotates about an edge count through the certainty of the rotation. Tipping about an edge, by loads or
    /// by a rotation, needs every wheel off it unloaded, under any split: no wheel off it was less certainly below.
    pub(super) fn below(&self, wheel: usize, limit_n: f64, episode: Episode) -> Confidence {
        let unloading: Vec<&Tipping> = (self.tippings.iter())
            .filter(|tipping| tipping.factors[wheel] > 0.0)
            .collect();
        let falls = |row: usize| {
            let rotating = unloading.iter().filter(|tipping| tipping.rotates);
            let mut covers = rotating.map(|t| t.episode.first..=t.episode.last);
            covers.any(|rows| rows.contains(&row))
        };
        let rows = || (episode.first..=episode.last).filter(|&row| !falls(row));
        let lowest = |of: &dyn Fn(usize) -> f64| {
            let known = rows()
                .map(|row| (row, of(row)))
                .filter(|(_, n)| n.is_finite());
            known.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let stated = lowest(&|row| self.held_load(wheel, row))
            .or_else(|| lowest(&|row| self.at(Quantity::Otf(wheel), row)));
        let largest = lowest(&|row| self.at(Quantity::LoadLargest(wheel), row));
        let touching = unloading
            .iter()
            .filter(|tipping| tipping.episode.overlaps(episode));
        let by_tipping = touching.filter_map(|t| t.certainty).reduce(f64::max);
        let by_load = stated.and_then(|(row, load_n)| {
            let error = self.known_error(wheel, row);
            let sigma_n = self.load_sigma(wheel, row) * error.variance_share.sqrt();
            probability((limit_n - (load_n - error.mean_n)) / sigma_n)
        });
        let any_split = largest.and_then(|(row, load_n)| {
            probability((limit_n - load_n) / self.largest_sigma(wheel, row, load_n))
        });
        let best = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
        let stated_certainty = best(by_load, by_tipping);
        // What holds under any split holds under the stated one.
        let any_split = best(any_split, by_tipping)
            .map(|any| stated_certainty.map_or(any, |stated| any.min(stated)));
        Confidence {
            stated: stated_certainty,
            any_split,
            row: stated.map_or(episode.first, |(row, _)| row),
        }
    }

    /// Standard deviation of a wheel's load at a row, or of its OTF shortly before.
    pub(super) fn load_sigma(&self, wheel: usize, row: usize) -> f64 {
        if !self.scope.sensitivities {
            return f64::NAN;
        }
        let sigma = self.at(Quantity::LoadSigma(wheel), row);
        if sigma.is_finite() {
            sigma
        } else {
            self.sigma_of(wheel, row)
        }
    }

    /// Standard deviation of the largest load that equilibrium allows a wheel. Where equations of bogies make it
    /// smaller than the edges do, that of the wheel's own load stands in.
    fn largest_sigma(&self, wheel: usize, row: usize, largest_n: f64) -> f64 {
        if !self.scope.sensitivities {
            return f64::NAN;
        }
        let mut placement = Placement::new(self.machine);
        let mut state = State::zero(self.machine);
        self.rows.state(row, &mut state);
        placement.place(&state);
        let tolerance_n = SAME_SHARE * self.at(Quantity::NormalForce, row);
        let edges = 0..self.machine.polygon().edges().len();
        let factors = edges.filter_map(|edge| {
            let distances = distances(self.machine, &placement, edge);
            let own = distances[wheel];
            let sum_n = -self.at(Quantity::ItomFull(edge), row) / own;
            let is_end = own > 0.0 && (sum_n - largest_n).abs() <= tolerance_n;
            is_end.then(|| distances.iter().map(|d| d / own).collect::<Vec<f64>>())
        });
        let sigma = factors
            .filter_map(|factors| self.rows.sigma_near(row, &factors, 0))
            .reduce(f64::max);
        sigma.unwrap_or_else(|| self.load_sigma(wheel, row))
    }
}

fn probability(sigmas: f64) -> Option<f64> {
    Some(normal_distribution(sigmas)).filter(|p| p.is_finite())
}

//! Time at which a load reached zero, and its uncertainty.
//!
//! Two shapes occur. While other wheels hold the machine, the overturning force of a lifting wheel passes through
//! zero. Once the machine rotates about an edge, nothing is left to fall: the true load stays at zero, and the
//! computed one stays at its own error. The second shape has a corner, which is found without trusting the zero.

use nalgebra::{SMatrix, SVector};

/// Times on either side of a passage through zero that it is fitted to, the shortest that shows the fall
/// clearly (s).
pub(super) const PASSAGES_S: [f64; 4] = [0.12, 0.25, 0.5, 1.0];
/// Times before the corner that the fall is fitted to, the shortest that shows the fall clearly (s).
const FALLS_S: [f64; 4] = [0.3, 0.45, 0.7, 1.0];
/// A fall is clear if it is this many times the noise.
const CLEAR_FALL: f64 = 15.0;
/// Time after the corner that its level is fitted to (s).
const LEVEL_S: f64 = 0.35;
/// Distance of the candidates of the coarse and of the fine search (s).
const STEPS_S: [f64; 2] = [0.02, 0.004];
/// Range of the fine search on either side of the coarse result (s).
const FINE_S: f64 = 0.2;
/// The smoother rounds a corner, and a tyre springs back before it leaves the ground: their effect on the onset (s),
/// one standard deviation.
const ROUNDING_S: f64 = 0.03;
/// Effect of rounding on the onset in a passage through zero (s), one standard deviation.
const PASSAGE_S: f64 = 0.02;
/// Of the errors with which a load still falls below zero, about equally likely up to the depth of its fall, as many as are within one
/// standard deviation are below this share of that depth.
const WITHIN_SHARE: f64 = 0.68;
/// Effect of rounding on the onset of a rotation alone (s), one standard deviation: the last tyre on the other side springs back
/// before it leaves the ground.
const ROTATION_S: f64 = 0.08;
/// Rates of rotation are averaged over this time, and candidates of the onset are so far apart (s); over more where there would be more
/// than so many of them.
const RATE_BIN_S: f64 = 0.02;
const MOST_BINS: f64 = 300.0;
/// Rocking of a platform on its wheels: standard deviations of its rate (rad/s), and times for which it goes one way (s).
const ROCKING_RATES: [f64; 6] = [0.001, 0.003, 0.008, 0.02, 0.05, 0.12];
const ROCKING_S: [f64; 2] = [0.1, 0.3];
/// A rotation is no rocking from so many standard deviations of its rate on.
const CLEAR_ROCKING: f64 = 3.0;
/// Growth rates of a fall (1/s): the square root of weight times height over inertia about the edge.
const FALL_GROWTHS: [f64; 4] = [0.5, 1.5, 2.5, 4.0];
/// Least variance of the white noise of an averaged rate (rad^2/s^2).
const LEAST_WHITE: f64 = 1e-9;
/// Prior standard deviations of w, u, v (rad/s, rad/s^3, rad/s^4).
const RATE_PRIORS: [f64; 3] = [0.03, 2.0, 4.0];
/// Time before its rates in which a rotation may have begun that is under way in the first of them (s).
const BEGUN_S: f64 = 1.0;
/// Rotation since the first rate in which the rates tell whether it had begun (rad): farther on, a fall grows otherwise than at first.
const BEGINNING_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Distance from the onset of a rotation within which the corner is looked for (standard deviations).
pub(super) const NEAR_SIGMAS: f64 = 3.0;
/// Standard deviations up to which a level is that of the stated machine.
pub(super) const STATED_SIGMAS: f64 = 3.0;
/// Distance of two values from which the curve between them is unknown (s).
pub(super) const GAP_S: f64 = 0.25;
/// Fewest values of a fit.
const FEWEST: usize = 8;

/// Time at which a load reached zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Onset {
    /// The time (s), on the clock of the values.
    pub(super) at_s: f64,
    /// Its standard deviation (s).
    pub(super) sigma_s: f64,
    /// The level that the computed load keeps afterwards (N): its error, where a corner was found.
    pub(super) level_n: Option<f64>,
}

/// A load over time.
#[derive(Debug, Clone, Default)]
pub(super) struct Curve {
    /// Times (s), increasing.
    pub(super) times_s: Vec<f64>,
    /// The load (N).
    pub(super) loads_n: Vec<f64>,
    /// Time from which on the load is known to be zero, if it fell to zero at all (s).
    pub(super) zero_from_s: Option<f64>,
}

impl Curve {
    /// Adds a value; ignored if it is not finite.
    pub(super) fn push(&mut self, time_s: f64, load_n: f64) {
        if load_n.is_finite() {
            self.times_s.push(time_s);
            self.loads_n.push(load_n);
        }
    }

    /// Averages the values over bins of `bin_s`.
    fn binned(&self, bin_s: f64) -> Self {
        let mut binned = Self::default();
        let mut first = 0;
        for next in 1..=self.times_s.len() {
            let is_over = self
                .times_s
                .get(next)
                .is_none_or(|t| t - self.times_s[first] >= bin_s);
            if is_over {
                let count = (next - first) as f64;
                let mean = |values: &[f64]| values[first..next].iter().sum::<f64>() / count;
                binned.push(mean(&self.times_s), mean(&self.loads_n));
                first = next;
            }
        }
        binned
    }

    /// The times at which the load falls through a level (s).
    fn falls_through(&self, level_n: f64) -> impl DoubleEndedIterator<Item = f64> {
        let pairs = self.loads_n.windows(2).zip(self.times_s.windows(2));
        let falls = pairs.filter(move |(loads, _)| loads[0] > level_n && loads[1] <= level_n);
        falls.map(move |(loads, times)| {
            times[0] + (times[1] - times[0]) * (loads[0] - level_n) / (loads[0] - loads[1])
        })
    }

    /// The time nearest to `near_s` at which the load falls to zero (s).
    fn falls_to_zero(&self, near_s: f64) -> Option<f64> {
        self.falls_through(0.0)
            .min_by(|a, b| (a - near_s).abs().total_cmp(&(b - near_s).abs()))
    }

    /// Returns the larger of two times (s): that since the load was last above `level_n` before `at_s`, and that until the load
    /// is first below `-level_n`, or, where it rises to zero again or is known to be zero before, most of the way down to its lowest.
    /// Where it is known to be zero already before `at_s`, that since then.
    fn within_s(&self, at_s: f64, level_n: f64) -> f64 {
        let first_s = self.falls_through(level_n).rfind(|t| *t < at_s);
        let first_s = first_s.or(self.times_s.first().copied()).unwrap_or(at_s);
        let after = self.times_s.partition_point(|t| *t <= at_s);
        let falls = self.times_s.iter().zip(&self.loads_n).skip(after);
        let zero_from_s = self.zero_from_s.unwrap_or(f64::INFINITY);
        let lowest_n = falls
            .take_while(|(t, load)| **load <= 0.0 && **t <= zero_from_s)
            .map(|(_, load)| *load)
            .fold(0.0, f64::min);
        // a larger error would have hidden the fall
        let level_n = level_n.min(-WITHIN_SHARE * lowest_n);
        let last_s = match lowest_n < 0.0 {
            true => self.falls_through(-level_n).find(|t| *t > at_s),
            // it does not fall below zero, or was known to be zero before
            false => None,
        };
        let last_s = last_s.unwrap_or(at_s).min(zero_from_s);
        (at_s - first_s).max((last_s - at_s).abs())
    }

    /// Whether values are missing somewhere between two times. Before the first of all, none is missing.
    pub(super) fn has_gap(&self, from_s: f64, to_s: f64) -> bool {
        let inside = self.between(from_s, to_s).map(|(t, _)| t);
        let mut before = (self.times_s.first()).map_or(from_s, |first_s| from_s.max(*first_s));
        let times = inside.chain(std::iter::once(to_s));
        times
            .into_iter()
            .any(|t| t - std::mem::replace(&mut before, t) > GAP_S)
    }

    fn between(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (f64, f64)> + Clone {
        let from = self.times_s.partition_point(|&t| t < from_s);
        let to = self.times_s.partition_point(|&t| t <= to_s).max(from);
        let times = self.times_s[from..to].iter().copied();
        times.zip(self.loads_n[from..to].iter().copied())
    }
}

/// Finds the passage of a falling load through zero near `near_s`, if it has one.
///
/// ```text
///     load = c0 + c1 t + c2 t^2 near it,    var t = var c0 / (d load / dt)^2 + d^2
/// ```
/// with d the time in which the load is within `sigma_n`, the standard deviation of its error, of zero: the longer one of
/// that before and that after, which ends at 0.68 of the depth of its fall, for a larger error would have hidden it. Once a wheel
/// has lifted, its overturning force falls at another rate than its load did, and one that is too large by its error passes
/// through zero long after the load. The parabola is fitted around the sample at which the load falls to zero: farther away it
/// has roots at which the load is large.
///
/// Of samples too far apart for a parabola those on either side of zero tell that the load passed between them:
/// ```text
///     var t = h^2 / 12 + d^2,      h: the time between these two samples
/// ```
pub(super) fn passage(curve: &Curve, near_s: f64, sigma_n: f64) -> Option<Onset> {
    let around_s = curve.falls_to_zero(near_s)?;
    let shape = |t: f64| SVector::from([1.0, t, t * t]);
    let passes = |half_s: f64| {
        let near = curve.between(around_s - half_s, around_s + half_s);
        let fit = Fit::<3>::of(near.map(|(t, load)| (shape(t - around_s), load)), 0.0)?;
        let [c0, c1, c2] = fit.coefficients.into();
        let root = (c1 * c1 - 4.0 * c0 * c2).sqrt();
        // the root at which the load falls, by the formula that does not cancel
        let t = match c1 < 0.0 {
            true => 2.0 * c0 / (root - c1),
            false => (-c1 - root) / (2.0 * c2),
        };
        let slope = -root;
        let variance_n2 = fit.noise_n2 / fit.count as f64;
        let at_s = around_s + t;
        let within_s = curve.within_s(at_s, sigma_n);
        let variance_s2 = variance_n2 / (slope * slope) + within_s * within_s;
        let onset = Onset {
            at_s,
            sigma_s: (variance_s2 + PASSAGE_S * PASSAGE_S).sqrt(),
            level_n: None,
        };
        let is_inside = t.abs() <= 0.5 * half_s && onset.sigma_s.is_finite();
        let is_clear = -slope * half_s > CLEAR_FALL * fit.residual_n2.sqrt();
        is_inside.then_some((onset, is_clear))
    };
    let found: Vec<(Onset, bool)> = PASSAGES_S.into_iter().filter_map(passes).collect();
    let clear = found.iter().find(|(_, is_clear)| *is_clear);
    let by_sigma = |a: &&(Onset, bool), b: &&(Onset, bool)| a.0.sigma_s.total_cmp(&b.0.sigma_s);
    let found = clear.or_else(|| found.iter().min_by(by_sigma));
    let onset = found.map_or_else(|| between(curve, around_s, sigma_n), |(onset, _)| *onset);
    // a load that is below zero from the first row on fell before the rows begin
    (onset.at_s > *curve.times_s.first()?).then_some(onset)
}

/// A passage of which nothing is known but the values on either side of it.
fn between(curve: &Curve, at_s: f64, sigma_n: f64) -> Onset {
    let after = curve.times_s.partition_point(|t| *t < at_s);
    let sides_s = [after.saturating_sub(1), after].map(|side| curve.times_s.get(side));
    let apart_s = sides_s[0].zip(sides_s[1]).map_or(0.0, |(a, b)| b - a);
    let within_s = curve.within_s(at_s, sigma_n);
    Onset {
        at_s,
        sigma_s: (apart_s * apart_s / 12.0 + within_s * within_s + PASSAGE_S * PASSAGE_S).sqrt(),
        level_n: None,
    }
}

/// Finds the corner at which a load stops falling, between the ends of the curve.
///
/// For each candidate t0 the load is fitted by
/// ```text
///     load = b + a (t0 - t) + c (t0 - t)^2   before t0, a >= 0,        load = b   from t0 on
/// ```
/// with b, the error of a load that is zero in truth, normally distributed with `sigma_n`, and the rate of
/// rotation about the edge by
/// ```text
///     rate = w + v t before t0,        rate = w + v t + u (t - t0)^2 from t0 on
/// ```
/// for the moment that turns the machine grows from zero. The residuals give noise and its correlation, and with
/// them the probability of each candidate: the onset is their mean. `near` is when and how certainly gyro and attitude saw
/// it begin. Where the level is not that of a load that is zero within its error, the machine is not as stated: then it
/// may be any, and the corner shows all the same.
pub(super) fn corner(
    curve: &Curve,
    rates: &Curve,
    sigma_n: f64,
    near: Option<Onset>,
) -> Option<Onset> {
    let (first, last) = (*curve.times_s.first()?, *curve.times_s.last()?);
    let all = curve.between(first, last);
    let (from_s, to_s) = near.map_or((first, last), |near| {
        let reach_s = NEAR_SIGMAS * near.sigma_s;
        (
            first.max(near.at_s - reach_s),
            last.min(near.at_s + reach_s),
        )
    });
    let coarse = candidates(from_s, to_s, STEPS_S[0]).filter_map(|t0| {
        let shape = |t: f64| {
            let s = (t0 - t).max(0.0);
            SVector::from([1.0, s, s * s, s * s * s])
        };
        let rows = all.clone().map(|(t, load)| (shape(t), load));
        let fit = Fit::of(rows, 0.0)?;
        (fit.coefficients[1] > 0.0).then_some((t0, fit))
    });
    let (coarse_s, coarse) = coarse.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))?;
    let fall_s = FALLS_S
        .into_iter()
        .find(|fall_s| coarse.coefficients[1] * fall_s > CLEAR_FALL * coarse.residual_n2.sqrt());
    let from_s = coarse_s - fall_s.unwrap_or(FALLS_S[FALLS_S.len() - 1]);
    let window = curve.between(from_s, coarse_s + LEVEL_S);
    let is_stated = coarse.coefficients[0].abs() <= STATED_SIGMAS * sigma_n;
    let prior = coarse.noise_n2 / (sigma_n * sigma_n);
    let prior = if prior.is_finite() && is_stated {
        prior
    } else {
        0.0
    };
    let range = (coarse_s - FINE_S).max(from_s)..(coarse_s + FINE_S).min(last);
    let turning = rates.between(from_s, coarse_s + LEVEL_S);
    let fine: Vec<Candidate> = candidates(range.start, range.end, STEPS_S[1])
        .filter_map(|t0| {
            let shape = |t: f64| {
                let s = (t0 - t).max(0.0);
                SVector::from([1.0, s, s * s])
            };
            let load = Fit::of(window.clone().map(|(t, load)| (shape(t), load)), prior)?;
            let shape = |t: f64| SVector::from([1.0, t - coarse_s, (t - t0).max(0.0).powi(2)]);
            let rate = Fit::of(turning.clone().map(|(t, rate)| (shape(t), rate)), 0.0);
            (load.coefficients[1] > 0.0).then_some(Candidate { t0, load, rate })
        })
        .collect();
    let best_load = fine
        .iter()
        .map(|c| &c.load)
        .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let rates = fine.iter().filter_map(|c| c.rate.as_ref());
    let best_rate = rates.min_by(|a, b| a.cost.total_cmp(&b.cost));
    let exponent = |c: &Candidate| {
        let of_load = (c.load.cost - best_load.cost) / best_load.noise_n2;
        let of_rate = match (&c.rate, best_rate) {
            (Some(rate), Some(best)) => (rate.cost - best.cost) / best.noise_n2,
            _ => 0.0,
        };
        let of_near = near.map_or(0.0, |near| ((c.t0 - near.at_s) / near.sigma_s).powi(2));
        -0.5 * (of_load + of_rate + of_near)
    };
    let largest = fine.iter().map(exponent).fold(f64::NEG_INFINITY, f64::max);
    let sum = |of: &dyn Fn(f64, &Fit<3>) -> f64| -> f64 {
        let weighed = fine
            .iter()
            .map(|c| (exponent(c) - largest).exp() * of(c.t0, &c.load));
        weighed.sum()
    };
    let total = sum(&|_, _| 1.0);
    let at_s = sum(&|t0, _| t0) / total;
    let variance = sum(&|t0, _| (t0 - at_s).powi(2)) / total;
    Some(Onset {
        at_s,
        sigma_s: (variance + ROUNDING_S * ROUNDING_S).sqrt(),
        level_n: Some(sum(&|_, fit| fit.coefficients[0]) / total),
    })
    // what may have begun before the values do shows no corner
    .filter(|onset| onset.sigma_s.is_finite() && onset.at_s - first >= FALLS_S[0])
}

/// An onset that may be later: of a platform that rocks from one diagonal to another, the last wheel off the edge carries load
/// until long after the first has lifted. Where the load off the edge stays above the level that it has in the fall, from
/// `falls_s` on, by more than `sigma_n` after the onset for certain, the onset lies between both times:
/// ```text
///     t = (t0 + t1) / 2,      var t = var t0 + (t1 - t0)^2 / 4,      t1: the last fall through level + sigma_n
/// ```
pub(super) fn until_level(curve: &Curve, onset: Onset, falls_s: f64, sigma_n: f64) -> Onset {
    let last_s = curve.times_s.last().copied().unwrap_or(falls_s);
    let (sum_n, count) = (curve.between(falls_s, last_s))
        .fold((0.0, 0.0), |(sum, count), (_, load)| {
            (sum + load, count + 1.0)
        });
    let level_n = sum_n / count;
    let last_s = curve
        .falls_through(level_n + sigma_n)
        .rfind(|t| *t < falls_s);
    match last_s.filter(|t| *t > onset.at_s + NEAR_SIGMAS * onset.sigma_s) {
        Some(last_s) => {
            let half_s = 0.5 * (last_s - onset.at_s);
            Onset {
                at_s: onset.at_s + half_s,
                sigma_s: onset.sigma_s.hypot(half_s),
                level_n: Some(level_n),
            }
        }
        None => onset,
    }
}

/// Finds the onset of a rotation by its rate alone, between the ends of the curve.
///
/// ```text
///     rate = w + g + e before t0
///     rate = w + g + e + u 2 (cosh(l (t - t0)) - 1) / l^2 + v (t - t0)^3 from t0 on, u >= 0
///     g' = -g / T + white noise,       variance of g: s^2
/// ```
/// for the moment that turns the machine grows from zero in proportion to time, and with the rotation: a pendulum that
/// stands on its head. g is what a platform on its wheels does: it leans on its tyres under a moving arm and rocks from one
/// diagonal to the other. How much, s and T, and how fast the fall grows, l, follow from the rates themselves: each
/// candidate is weighed by its marginal likelihood, summed over them. The time in which the fall is not faster than the
/// platform rocks adds to the standard deviation. `angle` is the rotation at a time since the platform stood on all wheels,
/// of standard deviation `lean_rad` at the onset; infinite where unknown.
pub(super) fn of_rates(rates: &Curve, angle: impl Fn(f64) -> f64, lean_rad: f64) -> Option<Onset> {
    let onsets = WeighedOnsets::of(rates, angle, lean_rad, 0.0)?;
    let last = *onsets.binned.times_s.last()?;
    let at_s = onsets.mean(|t0, _| t0);
    let variance = onsets.mean(|t0, _| (t0 - at_s).powi(2));
    // as long as it is not faster than the platform rocks, a fall cannot be told from it
    let outgrows = CLEAR_ROCKING * onsets.mean(|_, sigma| sigma);
    let grown_s = onsets
        .binned
        .between(at_s, last)
        .find(|(_, rate)| *rate > outgrows);
    let hidden_s = grown_s.map_or(last, |(t, _)| t) - at_s;
    Some(Onset {
        at_s,
        sigma_s: (variance + ROTATION_S * ROTATION_S + hidden_s * hidden_s).sqrt(),
        level_n: None,
    })
    .filter(|onset| onset.sigma_s.is_finite())
}

/// Probability that a rotation had begun when its rates do: of a platform that turns already in the first of them, [`of_rates`] takes
/// that rate for a constant error of the gyro, and a fall that grows faster and faster for one that begins later. Onsets before the
/// rates, in which the same fall is slower at first, are candidates beside those in them.
pub(super) fn had_begun(rates: &Curve) -> f64 {
    let mut rotation_rad = 0.0;
    let mut beginning = Curve::default();
    let mut last_s = rates.times_s.first().copied().unwrap_or(0.0);
    for (&t, &rate) in rates.times_s.iter().zip(&rates.loads_n) {
        rotation_rad += rate * (t - std::mem::replace(&mut last_s, t));
        if rotation_rad > BEGINNING_RAD {
            break;
        }
        beginning.push(t, rate);
    }
    let onsets = WeighedOnsets::of(&beginning, |_| 0.0, f64::INFINITY, BEGUN_S);
    onsets.map_or(0.0, |onsets| {
        let first_s = onsets.binned.times_s[0];
        onsets.mean(|t0, _| f64::from(u8::from(t0 <= first_s)))
    })
}

/// Candidates of the onset of a rotation by its rates, weighed by how likely each of them is.
struct WeighedOnsets {
    /// The rates, averaged.
    binned: Curve,
    /// Onset (s), rate at which the platform rocks (rad/s), and the logarithm of their likelihood.
    candidates: Vec<(f64, f64, f64)>,
    largest_log: f64,
}

impl WeighedOnsets {
    /// Weighs onsets from `before_s` before the first rate on; see [`of_rates`]. `None` if no candidate fits.
    fn of(rates: &Curve, angle: impl Fn(f64) -> f64, lean_rad: f64, before_s: f64) -> Option<Self> {
        let span_s = *rates.times_s.last()? - *rates.times_s.first()?;
        let bin_s = RATE_BIN_S.max(span_s / MOST_BINS);
        let binned = rates.binned(bin_s);
        let (first, last) = (*binned.times_s.first()?, *binned.times_s.last()?);
        let white =
            white_noise(rates) * (rates.times_s.len() as f64 / binned.times_s.len() as f64).recip();
        let kinds = ROCKING_S.into_iter().flat_map(|time_s| {
            let whitener = move |sigma| (sigma, time_s);
            ROCKING_RATES.into_iter().map(whitener)
        });
        let rocking: Vec<(f64, Whitener, Vec<f64>, Vec<f64>)> = kinds
            .map(|(sigma, time_s)| {
                let whitener =
                    Whitener::new(&binned.times_s, sigma, time_s, white.max(LEAST_WHITE));
                let rates = whitener.apply(&binned.loads_n);
                let constant = whitener.apply(&vec![1.0; binned.times_s.len()]);
                (sigma, whitener, rates, constant)
            })
            .collect();
        let mut weighed: Vec<(f64, f64, f64)> = Vec::new();
        for t0 in candidates(first - before_s, last, bin_s) {
            let since = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
                let times = binned.times_s.iter();
                times.map(|t| of((t - t0).max(0.0))).collect()
            };
            let cube = since(&|t| t.powi(3));
            let falls = FALL_GROWTHS
                .map(|growth| since(&|t| 2.0 * ((growth * t).cosh() - 1.0) / (growth * growth)));
            let leant = angle(t0) / lean_rad;
            for (sigma, whitener, y, constant) in &rocking {
                let cube = whitener.apply(&cube);
                for fall in &falls {
                    let fall = whitener.apply(fall);
                    let Some((coefficients, log_evidence)) = evidence(y, [constant, &fall, &cube])
                    else {
                        continue;
                    };
                    let [_, u, v] = coefficients;
                    if u >= 0.0 && u + v * (last - t0) > 0.0 {
                        let log = log_evidence + whitener.log_density - 0.5 * leant * leant;
                        weighed.push((t0, *sigma, log));
                    }
                }
            }
        }
        let largest_log = weighed.iter().map(|(_, _, log)| *log).reduce(f64::max)?;
        Some(Self {
            binned,
            candidates: weighed,
            largest_log,
        })
    }

    /// The mean of what depends on the onset (s) and on the rate at which the platform rocks (rad/s).
    fn mean(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        let weights = self.candidates.iter().map(|(t0, sigma, log)| {
            let weight = (log - self.largest_log).exp();
            (weight, weight * of(*t0, *sigma))
        });
        let (total, sum) = weights.fold((0.0, 0.0), |sums, it| (sums.0 + it.0, sums.1 + it.1));
        sum / total
    }
}

/// Variance of the white noise of a curve, by the differences of its neighbours: their median is that of noise also where
/// the curve is steep in a part of it.
fn white_noise(curve: &Curve) -> f64 {
    let second = curve.loads_n.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
    let mut squares: Vec<f64> = second.map(|d| d * d / 6.0).collect();
    if squares.is_empty() {
        return 0.0;
    }
    let middle = squares.len() / 2;
    let (_, median, _) = squares.select_nth_unstable_by(middle, f64::total_cmp);
    // the median of the square of a normal number of variance 1 is 0.455
    *median / 0.455
}

/// Turns a curve with exponentially forgotten and white noise into one with unit white noise: the innovations of a Kalman
/// filter of one state.
struct Whitener {
    /// By sample: remaining share of the state, gain, standard deviation of the innovation.
    steps: Vec<(f64, f64, f64)>,
    /// Logarithm of the density of the noise, without the term of the squares.
    log_density: f64,
}

impl Whitener {
    fn new(times_s: &[f64], sigma: f64, time_s: f64, white: f64) -> Self {
        let stationary = sigma * sigma;
        let (mut variance, mut last) = (stationary, None);
        let (mut steps, mut log_density) = (Vec::with_capacity(times_s.len()), 0.0);
        for &t in times_s {
            let left = last
                .replace(t)
                .map_or(0.0, |last: f64| ((last - t) / time_s).exp());
            variance = left * left * variance + (1.0 - left * left) * stationary;
            let innovation = variance + white;
            let gain = variance / innovation;
            variance *= 1.0 - gain;
            steps.push((left, gain, innovation.sqrt()));
            log_density -= 0.5 * innovation.ln();
        }
        Self { steps, log_density }
    }

    fn apply(&self, values: &[f64]) -> Vec<f64> {
        let mut state = 0.0;
        let pairs = values.iter().zip(&self.steps);
        let innovations = pairs.map(|(value, (left, gain, sigma))| {
            state *= left;
            let innovation = value - state;
            state += gain * innovation;
            innovation / sigma
        });
        innovations.collect()
    }
}

/// Coefficients and logarithm of the marginal likelihood of a fit with unit noise, coefficients as uncertain beforehand as
/// [`RATE_PRIORS`].
fn evidence(y: &[f64], columns: [&Vec<f64>; 3]) -> Option<([f64; 3], f64)> {
    let mut normal = SMatrix::<f64, 3, 3>::zeros();
    let mut right = SVector::<f64, 3>::zeros();
    let mut squares = 0.0;
    let [constant, square, cube] = columns.map(|column| column.iter());
    for (y, ((a, b), c)) in y.iter().zip(constant.zip(square).zip(cube)) {
        let row = SVector::from([*a, *b, *c]);
        normal += row * row.transpose();
        right += row * *y;
        squares += y * y;
    }
    for (place, sigma) in RATE_PRIORS.into_iter().enumerate() {
        normal[(place, place)] += 1.0 / (sigma * sigma);
    }
    let factor = normal.cholesky()?;
    let coefficients = factor.solve(&right);
    let log_determinant: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
    let log_evidence = -0.5 * (squares - coefficients.dot(&right)) - log_determinant;
    Some((coefficients.into(), log_evidence))
}

/// A candidate of the fine search.
struct Candidate {
    t0: f64,
    load: Fit<3>,
    rate: Option<Fit<3>>,
}

/// Candidates between two times, ends excluded.
fn candidates(from_s: f64, to_s: f64, step_s: f64) -> impl Iterator<Item = f64> {
    let count = ((to_s - from_s) / step_s).clamp(0.0, 1e5) as usize;
    (1..count).map(move |k| from_s + k as f64 * step_s)
}

/// A least-squares fit.
struct Fit<const N: usize> {
    coefficients: SVector<f64, N>,
    /// Sum of squares, that of the prior included (N^2).
    cost: f64,
    /// Variance of a residual (N^2).
    residual_n2: f64,
    /// Variance of a residual enlarged by the correlation of neighbours, so that all residuals count as independent (N^2).
    noise_n2: f64,
    count: usize,
}

impl<const N: usize> Fit<N> {
    /// Fits `load = coefficients . shape`; `prior` is the weight of the first coefficient's square.
    fn of(rows: impl Iterator<Item = (SVector<f64, N>, f64)> + Clone, prior: f64) -> Option<Self> {
        let mut normal = SMatrix::<f64, N, N>::zeros();
        let mut right = SVector::<f64, N>::zeros();
        let mut count = 0;
        for (shape, load) in rows.clone() {
            normal += shape * shape.transpose();
            right += shape * load;
            count += 1;
        }
        if count < FEWEST {
            return None;
        }
        normal[(0, 0)] += prior;
        let coefficients = normal.try_inverse()? * right;
        let residuals = rows.map(|(shape, load)| load - shape.dot(&coefficients));
        let (mut squares, mut products, mut before) = (0.0, 0.0, 0.0);
        for residual in residuals {
            squares += residual * residual;
            products += residual * before;
            before = residual;
        }
        // A first-order autoregressive process with this correlation has (1 + r) / (1 - r) times the spectral
        // density of white noise at low frequencies.
        let r: f64 = if squares > 0.0 {
            products / squares
        } else {
            0.0
        };
        // not fewer than one of them is independent
        let most = (count as f64 - 1.0) / (count as f64 + 1.0);
        let r = r.clamp(0.0, most);
        let residual_n2 = squares / (count - N) as f64;
        Some(Self {
            cost: squares + prior * coefficients[0] * coefficients[0],
            noise_n2: residual_n2.max(f64::MIN_POSITIVE) * (1.0 + r) / (1.0 - r),
            residual_n2,
            coefficients,
            count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load that falls to zero at 2 s and stays there, with an error of +90 N and a wave of 20 N.
    fn falling(rate_n_per_s: f64) -> Curve {
        let mut curve = Curve::default();
        for k in 0..300 {
            let t = f64::from(k) * 0.01;
            let load = rate_n_per_s * (2.0 - t).max(0.0);
            curve.push(t, load + 90.0 + 20.0 * (37.0 * t).sin());
        }
        curve
    }

    #[test]
    fn a_corner_is_found_whatever_the_zero() {
        for rate in [600.0, 1500.0, 8000.0] {
            let onset = corner(&falling(rate), &Curve::default(), 150.0, None).unwrap();
            let error_s = (onset.at_s - 2.0).abs();
            assert!(error_s < 2.0 * onset.sigma_s, "{rate}: {onset:?}");
            assert!(onset.sigma_s < 0.1, "{rate}: {onset:?}");
            assert!((onset.level_n.unwrap() - 90.0).abs() < 20.0, "{onset:?}");
        }
    }

    /// The first rows of a causal estimator settle: they have no loads.
    #[test]
    fn rows_before_the_first_load_are_no_gap() {
        let mut curve = falling(1500.0);
        let kept = curve.times_s.partition_point(|t| *t < 0.39);
        curve.times_s.drain(..kept);
        curve.loads_n.drain(..kept);
        assert!(!curve.has_gap(0.0, 2.9));
        let hole = 100..140;
        curve.times_s.drain(hole.clone());
        curve.loads_n.drain(hole);
        assert!(curve.has_gap(0.0, 2.9));
        assert!(!curve.has_gap(2.0, 2.9));
        assert!(curve.has_gap(2.0, 4.0));
        assert!(Curve::default().has_gap(0.0, 2.9));
    }

    #[test]
    fn the_rotation_sharpens_a_slow_corner() {
        let mut rates = Curve::default();
        for k in 0..300 {
            let t = f64::from(k) * 0.01;
            rates.push(
                t,
                0.1 * (t - 2.0).max(0.0).powi(2) + 2e-5 * (91.0 * t).sin(),
            );
        }
        let by_load = corner(&falling(250.0), &Curve::default(), 150.0, None).unwrap();
        let both = corner(&falling(250.0), &rates, 150.0, None).unwrap();
        assert!(both.sigma_s < by_load.sigma_s, "{both:?} {by_load:?}");
        assert!((both.at_s - 2.0).abs() < 0.03, "{both:?}");
    }

    /// Rates of a platform that falls from a time on (s), in steps of 10 ms from 0 s on, with noise and a constant error of the gyro.
    fn falling_rates(from_s: f64, steps: u32) -> Curve {
        let mut rates = Curve::default();
        for k in 0..steps {
            let t = f64::from(k) * 0.01;
            let since_s = (t - from_s).max(0.0);
            let fall = 0.3 * ((2.5 * since_s).cosh() - 1.0);
            rates.push(t, 0.009 + fall + 1e-3 * (91.0 * t).sin());
        }
        rates
    }

    #[test]
    fn a_fall_that_is_under_way_in_the_first_rates_had_begun() {
        for from_s in [-0.6, -0.3, -0.1] {
            let probability = had_begun(&falling_rates(from_s, 80));
            assert!(probability > 0.97, "{from_s} s: {probability}");
        }
        for (from_s, steps) in [(0.3, 110), (0.6, 140), (1.0, 180)] {
            let probability = had_begun(&falling_rates(from_s, steps));
            assert!(
                probability < tipwatch_mechanics::number::BEYOND_SURE,
                "{from_s} s: {probability}"
            );
        }
        assert_eq!(had_begun(&Curve::default()), 0.0);
    }

    /// In the quick motion of a fall, a smoothed load is wrong for some tenths of a second one way.
    #[test]
    fn an_error_that_lasts_makes_the_corner_less_certain() {
        let corner_with = |period_s: f64| {
            let mut curve = Curve::default();
            for k in 0..240 {
                let t = f64::from(k) * 0.01;
                let wave = (std::f64::consts::TAU * t / period_s).sin();
                curve.push(t, 1000.0 * (2.0 - t).max(0.0) + 100.0 * wave);
            }
            corner(&curve, &Curve::default(), 150.0, None).unwrap()
        };
        let (quick, slow) = (corner_with(0.05), corner_with(0.8));
        assert!(slow.sigma_s > 2.0 * quick.sigma_s, "{slow:?} {quick:?}");
        for onset in [quick, slow] {
            assert!((onset.at_s - 2.0).abs() < 2.0 * onset.sigma_s, "{onset:?}");
        }
    }

    /// The machine file does not know a load: the computed load stops falling 4600 N above zero.
    #[test]
    fn a_corner_is_found_at_any_level() {
        let mut curve = falling(1500.0);
        curve.loads_n.iter_mut().for_each(|load| *load += 4600.0);
        let near = Onset {
            at_s: 2.2,
            sigma_s: 0.2,
            level_n: None,
        };
        let onset = corner(&curve, &Curve::default(), 150.0, Some(near)).unwrap();
        assert!((onset.at_s - 2.0).abs() < 2.0 * onset.sigma_s, "{onset:?}");
        assert!((onset.level_n.unwrap() - 4690.0).abs() < 20.0, "{onset:?}");
    }

    /// A fall from 2 s on, before which the platform swings with `rocking` rad/s.
    fn rocking_fall(rocking: f64) -> Curve {
        let mut rates = Curve::default();
        for k in 0..1000 {
            let t = f64::from(k) * 0.003;
            let after = (t - 2.0).max(0.0);
            let swing = rocking * (5.0 * t).sin() + 1e-4 * (91.0 * t).sin();
            rates.push(t, swing + 0.6 * after.powi(2));
        }
        rates
    }

    #[test]
    fn a_platform_that_rocks_makes_the_onset_less_certain_not_early() {
        let at = |rocking: f64| of_rates(&rocking_fall(rocking), |_| 0.0, f64::INFINITY).unwrap();
        let (steady, rocks) = (at(0.0), at(0.05));
        for onset in [steady, rocks] {
            assert!((onset.at_s - 2.0).abs() < 2.0 * onset.sigma_s, "{onset:?}");
        }
        assert!(steady.sigma_s < 0.2, "{steady:?}");
        assert!(rocks.sigma_s > 1.2 * steady.sigma_s, "{rocks:?} {steady:?}");
    }

    /// A fall whose moment grows with its rotation is faster than any power of time.
    #[test]
    fn a_slow_fall_is_not_dated_early() {
        let mut rates = Curve::default();
        for k in 0..1200 {
            let t = f64::from(k) * 0.005;
            let fall = 0.018 * ((1.5 * (t - 2.0).max(0.0)).cosh() - 1.0);
            rates.push(t, fall + 1e-3 * (91.0 * t).sin());
        }
        let onset = of_rates(&rates, |_| 0.0, f64::INFINITY).unwrap();
        assert!((onset.at_s - 2.0).abs() < 0.15, "{onset:?}");
        assert!((onset.at_s - 2.0).abs() < 2.0 * onset.sigma_s, "{onset:?}");
    }

    /// Off the ground the OTF falls ten times as fast as the load did: one that is 100 N too large passes zero 0.1 s late.
    #[test]
    fn a_passage_is_as_uncertain_as_the_load_before_it() {
        let mut curve = Curve::default();
        (0..300).for_each(|k| {
            let t = f64::from(k) * 0.01;
            let before = 1000.0 * (1.0 - t).max(0.0);
            curve.push(t, 100.0 + before - 1e4 * (t - 1.1).max(0.0));
        });
        let onset = passage(&curve, 1.1, 100.0).unwrap();
        assert!((onset.at_s - 1.0).abs() < 2.0 * onset.sigma_s, "{onset:?}");
    }

    /// An error that is larger than the load falls below zero would have left no passage.
    #[test]
    fn what_follows_a_passage_is_as_uncertain_as_its_depth() {
        let mut curve = Curve::default();
        (0..300).for_each(|k| {
            let t = f64::from(k) * 0.01;
            let load = match t < 1.0 {
                true => 1000.0 * (1.0 - t),
                false => -60.0 * (t - 1.0).min(1.0),
            };
            curve.push(t, load);
        });
        let within_s = curve.within_s(1.0, 100.0);
        assert!((within_s - 0.68).abs() < 0.02, "{within_s}");
        // from the onset of a tipping on the load is zero, whatever is computed
        curve.zero_from_s = Some(1.2);
        let within_s = curve.within_s(1.0, 100.0);
        assert!((within_s - 0.136).abs() < 0.02, "{within_s}");
        // one that is computed to be carried on after it is known to be zero is wrong by that time
        curve.zero_from_s = Some(0.5);
        let within_s = curve.within_s(1.0, 100.0);
        assert!((within_s - 0.5).abs() < 1e-6, "{within_s}");
        // a load that falls on as before is as uncertain on either side
        let mut straight = Curve::default();
        (0..300).for_each(|k| straight.push(f64::from(k) * 0.01, 1000.0 - 10.0 * f64::from(k)));
        let within_s = straight.within_s(1.0, 100.0);
        assert!((within_s - 0.1).abs() < 1e-6, "{within_s}");
    }

    #[test]
    fn a_passage_is_where_the_load_is_zero() {
        // it falls below zero, comes back at once, and a parabola through all of it has other roots
        let mut curve = Curve::default();
        (0..300).for_each(|k| {
            let t = f64::from(k) * 0.01;
            curve.push(t, 2000.0 * (t - 1.0).abs().min(0.4) - 400.0);
        });
        let onset = passage(&curve, 1.0, 20.0).unwrap();
        assert!((onset.at_s - 0.8).abs() < 0.02, "{onset:?}");
    }

    #[test]
    fn a_lift_older_than_the_rows_has_no_onset() {
        let mut lifted = Curve::default();
        (0..200)
            .for_each(|k| lifted.push(f64::from(k) * 0.01, -100.0 - 500.0 * f64::from(k) * 0.01));
        assert_eq!(passage(&lifted, 0.0, 10.0), None);
    }

    #[test]
    fn a_load_that_goes_on_after_the_first_wheel_has_lifted_leaves_the_onset_open() {
        let onset = Onset {
            at_s: 1.0,
            sigma_s: 0.05,
            level_n: Some(600.0),
        };
        let curve = |rocks: f64| {
            let mut curve = Curve::default();
            for k in 0..400 {
                let t = f64::from(k) * 0.01;
                let load = match t {
                    t if t < 1.0 => 600.0 + 3000.0 * (1.0 - t),
                    t if t < 2.3 => rocks,
                    _ => 0.0,
                };
                curve.push(t, load);
            }
            curve
        };
        let open = until_level(&curve(600.0), onset, 3.0, 300.0);
        assert!((open.at_s - 1.65).abs() < 0.01, "{open:?}");
        assert!(open.sigma_s >= 0.64, "{open:?}");
        let same = until_level(&curve(200.0), onset, 3.0, 300.0);
        assert_eq!(same.at_s, onset.at_s);
        assert_eq!(same.sigma_s, onset.sigma_s);
    }

    #[test]
    fn a_passage_has_the_uncertainty_of_its_zero() {
        let mut curve = Curve::default();
        (0..200)
            .for_each(|k| curve.push(f64::from(k) * 0.01, 800.0 - 1000.0 * f64::from(k) * 0.01));
        let onset = passage(&curve, 0.85, 100.0).unwrap();
        assert!((onset.at_s - 0.8).abs() < 1e-6, "{onset:?}");
        assert!(
            (onset.sigma_s - 0.1_f64.hypot(PASSAGE_S)).abs() < 1e-6,
            "{onset:?}"
        );
    }

    #[test]
    fn without_a_fall_there_is_no_onset() {
        let mut rising = Curve::default();
        (0..200).for_each(|k| rising.push(f64::from(k) * 0.01, f64::from(k)));
        assert_eq!(passage(&rising, 1.0, 10.0), None);
        assert_eq!(
            corner(&Curve::default(), &Curve::default(), 10.0, None),
            None
        );
    }
}

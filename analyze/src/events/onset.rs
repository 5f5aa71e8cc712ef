//! When a load reached zero, and how uncertain that time is.
//!
//! Two shapes occur. While other wheels hold the machine, the overturning force of a lifting wheel passes through
//! zero. Once the machine rotates about an edge, nothing is left to fall: the true load stays at zero, and the
//! computed one stays at its own error. The second shape has a corner, which is found without trusting the zero.

use nalgebra::{SMatrix, SVector};

/// Times on either side of a passage through zero that it is fitted to, the shortest that shows the fall
/// clearly (s).
pub(super) const PASSAGES_S: [f64; 3] = [0.25, 0.5, 1.0];
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
/// The same of a rotation alone: the last tyre on the other side springs back before it leaves the ground (s).
const ROTATION_S: f64 = 0.08;
/// Fewest values of a fit.
const FEWEST: usize = 8;

/// When a load reached zero.
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
}

impl Curve {
    /// Adds a value; ignored if it is not finite.
    pub(super) fn push(&mut self, time_s: f64, load_n: f64) {
        if load_n.is_finite() {
            self.times_s.push(time_s);
            self.loads_n.push(load_n);
        }
    }

    fn between(&self, from_s: f64, to_s: f64) -> impl Iterator<Item = (f64, f64)> + Clone {
        let from = self.times_s.partition_point(|&t| t < from_s);
        let to = self.times_s.partition_point(|&t| t <= to_s).max(from);
        let times = self.times_s[from..to].iter().copied();
        times.zip(self.loads_n[from..to].iter().copied())
    }
}

/// The passage of a falling load through zero near `near_s`, if it has one.
///
/// ```text
///     load = c0 + c1 t + c2 t^2 near it,    var t = (var c0 + sigma^2) / (d load / dt)^2
/// ```
/// with `sigma_n` the standard deviation of the load's error, which is constant over the fit.
pub(super) fn passage(curve: &Curve, near_s: f64, sigma_n: f64) -> Option<Onset> {
    let shape = |t: f64| SVector::from([1.0, t, t * t]);
    let fitted = |half_s: f64| {
        let near = curve.between(near_s - half_s, near_s + half_s);
        Fit::<3>::of(near.map(|(t, load)| (shape(t - near_s), load)), 0.0)
    };
    let is_clear = |half_s: f64, fit: &Fit<3>| {
        -fit.coefficients[1] * half_s > CLEAR_FALL * fit.residual_n2.sqrt()
    };
    let fits = PASSAGES_S
        .into_iter()
        .filter_map(|half_s| Some((half_s, fitted(half_s)?)));
    let fits: Vec<(f64, Fit<3>)> = fits.collect();
    let clear = fits.iter().find(|(half_s, fit)| is_clear(*half_s, fit));
    let (half_s, fit) = clear.or(fits.last())?;
    let [c0, c1, c2] = fit.coefficients.into();
    let slope = |t: f64| c1 + 2.0 * c2 * t;
    let mut t = 0.0;
    for _ in 0..20 {
        t -= (c0 + t * (c1 + t * c2)) / slope(t);
    }
    // A load that is below zero from the first row on fell before the rows begin.
    let is_inside = t.abs() <= *half_s && near_s + t > *curve.times_s.first()?;
    if !(is_inside && slope(t) < 0.0) {
        return None;
    }
    let variance_n2 = fit.noise_n2 / fit.count as f64 + sigma_n.powi(2);
    Some(Onset {
        at_s: near_s + t,
        sigma_s: variance_n2.sqrt() / -slope(t),
        level_n: None,
    })
    .filter(|onset| onset.sigma_s.is_finite())
}

/// The corner at which a load stops falling, between the ends of the curve.
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
/// them the probability of each candidate: the onset is their mean.
pub(super) fn corner(curve: &Curve, rates: &Curve, sigma_n: f64) -> Option<Onset> {
    let (first, last) = (*curve.times_s.first()?, *curve.times_s.last()?);
    let all = curve.between(first, last);
    let coarse = candidates(first, last, STEPS_S[0]).filter_map(|t0| {
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
    let prior = coarse.noise_n2 / (sigma_n * sigma_n);
    let prior = if prior.is_finite() { prior } else { 0.0 };
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
        -0.5 * (of_load + of_rate)
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
    .filter(|onset| onset.sigma_s.is_finite())
}

/// When a rotation began, by its rate alone, between the ends of the curve:
/// ```text
///     rate = w before t0,      rate = w + u (t - t0)^2 + v (t - t0)^3 from t0 on, u >= 0
/// ```
/// for the moment that turns the machine grows from zero, and grows with the rotation.
pub(super) fn of_rates(rates: &Curve) -> Option<Onset> {
    let (first, last) = (*rates.times_s.first()?, *rates.times_s.last()?);
    let all = rates.between(first, last);
    let fits: Vec<(f64, Fit<3>)> = candidates(first, last, STEPS_S[1].max((last - first) / 1000.0))
        .filter_map(|t0| {
            let shape = |t: f64| {
                let s = (t - t0).max(0.0);
                SVector::from([1.0, s * s, s * s * s])
            };
            let fit = Fit::of(all.clone().map(|(t, rate)| (shape(t), rate)), 0.0)?;
            let grown =
                (last - t0).powi(2) * (fit.coefficients[1] + fit.coefficients[2] * (last - t0));
            (fit.coefficients[1] >= 0.0 && grown > 0.0).then_some((t0, fit))
        })
        .collect();
    let (_, best) = (fits.iter()).min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))?;
    let weight = |fit: &Fit<3>| (-0.5 * (fit.cost - best.cost) / best.noise_n2).exp();
    let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
        fits.iter().map(|(t0, fit)| weight(fit) * of(*t0)).sum()
    };
    let total = sum(&|_| 1.0);
    let at_s = sum(&|t0| t0) / total;
    let variance = sum(&|t0| (t0 - at_s).powi(2)) / total;
    Some(Onset {
        at_s,
        sigma_s: (variance + ROTATION_S * ROTATION_S).sqrt(),
        level_n: None,
    })
    .filter(|onset| onset.sigma_s.is_finite())
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
    /// The same, enlarged by the correlation of neighbours, so that all residuals count as independent (N^2).
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
        let r = r.clamp(0.0, 0.95);
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
            let onset = corner(&falling(rate), &Curve::default(), 150.0).unwrap();
            let error_s = (onset.at_s - 2.0).abs();
            assert!(error_s < 2.0 * onset.sigma_s, "{rate}: {onset:?}");
            assert!(onset.sigma_s < 0.1, "{rate}: {onset:?}");
            assert!((onset.level_n.unwrap() - 90.0).abs() < 20.0, "{onset:?}");
        }
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
        let by_load = corner(&falling(250.0), &Curve::default(), 150.0).unwrap();
        let both = corner(&falling(250.0), &rates, 150.0).unwrap();
        assert!(both.sigma_s < by_load.sigma_s, "{both:?} {by_load:?}");
        assert!((both.at_s - 2.0).abs() < 0.03, "{both:?}");
    }

    #[test]
    fn a_lift_older_than_the_rows_has_no_onset() {
        let mut lifted = Curve::default();
        (0..200)
            .for_each(|k| lifted.push(f64::from(k) * 0.01, -100.0 - 500.0 * f64::from(k) * 0.01));
        assert_eq!(passage(&lifted, 0.0, 10.0), None);
    }

    #[test]
    fn a_passage_has_the_uncertainty_of_its_zero() {
        let mut curve = Curve::default();
        (0..200)
            .for_each(|k| curve.push(f64::from(k) * 0.01, 800.0 - 1000.0 * f64::from(k) * 0.01));
        let onset = passage(&curve, 0.85, 100.0).unwrap();
        assert!((onset.at_s - 0.8).abs() < 1e-6, "{onset:?}");
        assert!((onset.sigma_s - 0.1).abs() < 1e-6, "{onset:?}");
    }

    #[test]
    fn without_a_fall_there_is_no_onset() {
        let mut rising = Curve::default();
        (0..200).for_each(|k| rising.push(f64::from(k) * 0.01, f64::from(k)));
        assert_eq!(passage(&rising, 1.0, 10.0), None);
        assert_eq!(corner(&Curve::default(), &Curve::default(), 10.0), None);
    }
}

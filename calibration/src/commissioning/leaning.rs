//! The joints compared with how the platform leans when one of them moves alone while the machine stands.
//!
//! The arm's weight and the reaction to its motion deflect the tyres, and actuated wheels turn the platform. The
//! evaluation gives the normal n of the ground in base axes for every posture; where the ground stands still, the
//! gyroscope measures its change,
//! ```text
//!     dn_x/dt = -w_y,    dn_y/dt = w_x
//! ```
//! For each joint the measured change is fitted with `b dn/dt + constant`. The tyres' stiffness is known roughly only, so b
//! is compared with that of the other joints, and with 1 as far as the stiffness is known.

use nalgebra::Vector2;

use super::estimate::{Estimate, Relation};
use super::grid::derivative;
use super::least_squares::alike;
use super::moved::{FEWEST, MovedAlone};
use super::platform::{Platform, Predicted, widened};
use super::signals::{Signals, View};

/// Relative error of a predicted lean due to masses.
const MODEL: f64 = 0.06;

/// Fit of the predicted lean to the one that the gyroscope measures while a joint moves.
#[derive(Debug, Clone, Copy)]
struct Fit {
    joint: usize,
    /// Measured per predicted lean, and its standard deviation.
    gain: f64,
    sigma: f64,
    /// Share of what was measured beyond noise that is not predicted, and its standard deviation.
    unexplained: f64,
    unexplained_sigma: f64,
    /// Share of the bins with a posture in which the linkages cannot close.
    impossible: f64,
}

/// Change of the normal by the gyroscope.
pub(super) fn measured(view: &View, bin: usize) -> Vector2<f64> {
    Vector2::new(-view.turning[bin].y, view.turning[bin].x)
}

/// Fits the motion of a joint; `None` where its signals have gaps.
fn fit(
    signals: &Signals,
    view: &View,
    moved: &MovedAlone,
    predicted_runs: &[([Vec<f64>; 2], f64)],
) -> Option<Fit> {
    let variance = signals.gyro_variance();
    let (mut predicted, mut found, mut impossible) = (Vec::new(), Vec::new(), 0.0);
    for (run, (normals, share)) in moved.runs.iter().zip(predicted_runs) {
        let wide = widened(run, view.bins);
        let inside = run.start - wide.start..run.end - wide.start;
        impossible += share / moved.runs.len() as f64;
        for axis in 0..2 {
            let change = derivative(&normals[axis])[inside.clone()].to_vec();
            let seen: Vec<f64> = run.clone().map(|bin| measured(view, bin)[axis]).collect();
            let pairs: Vec<(f64, f64)> = (change.into_iter().zip(seen))
                .filter(|(p, y)| p.is_finite() && y.is_finite())
                .collect();
            let count = pairs.len() as f64;
            let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
            let (p0, y0) = (mean(|pair| pair.0), mean(|pair| pair.1));
            predicted.extend(pairs.iter().map(|pair| pair.0 - p0));
            found.extend(pairs.iter().map(|pair| pair.1 - y0));
        }
    }
    if impossible > 0.5 {
        return Some(Fit {
            joint: moved.joint,
            gain: f64::NAN,
            sigma: f64::NAN,
            unexplained: f64::NAN,
            unexplained_sigma: f64::NAN,
            impossible,
        });
    }
    if found.len() < 2 * FEWEST {
        return None;
    }
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = product(&predicted, &predicted);
    // A posture that leans the platform by nothing explains nothing.
    let gain = if size > 0.0 {
        product(&predicted, &found) / size
    } else {
        0.0
    };
    let residual: Vec<f64> = (found.iter().zip(&predicted))
        .map(|(y, p)| y - gain * p)
        .collect();
    let count = found.len() as f64;
    let left = product(&residual, &residual);
    let scatter = (left / count).max(variance);
    let beyond_noise = product(&found, &found) - count * variance;
    Some(Fit {
        joint: moved.joint,
        gain,
        sigma: if size > 0.0 {
            (scatter * alike(&residual) / size).sqrt()
        } else {
            f64::NAN
        },
        unexplained: (left - count * variance) / beyond_noise,
        unexplained_sigma: if beyond_noise > 0.0 {
            (2.0 * count * 3.0).sqrt() * variance / beyond_noise
        } else {
            f64::NAN
        },
        impossible,
    })
}

/// The joints that moved alone.
pub(super) fn leaning(
    platform: &Platform,
    signals: &Signals,
    view: &View,
    moved: &[MovedAlone],
    predicted: &Predicted,
) -> Vec<Estimate> {
    let pairs = moved.iter().zip(&predicted.0);
    let fits: Vec<Fit> = pairs
        .filter_map(|(moved, runs)| fit(signals, view, moved, runs))
        .collect();
    let mut found = Vec::new();
    for fit in &fits {
        found.extend(of_fit(fit, &fits, platform.stiffness_sigma));
    }
    found
}

fn of_fit(fit: &Fit, all: &[Fit], stiffness_sigma: f64) -> [Estimate; 2] {
    let gain = |value: f64, sigma: f64| Estimate::of(Relation::Lean(fit.joint), [value, sigma]);
    let unexplained = [fit.unexplained, fit.unexplained_sigma];
    let relation = Relation::LeanUnexplained(fit.joint);
    let unexplained = Estimate::of(relation, unexplained);
    if fit.impossible > 0.5 {
        return [gain(f64::from(f32::MAX).ln(), 0.01), unexplained];
    }
    // Logarithm of the lean per predicted lean of the others, with 1 as far as the stiffness is known.
    let (mut weight, mut mean) = (stiffness_sigma.powi(-2), 0.0);
    for other in all
        .iter()
        .filter(|other| other.joint != fit.joint && other.gain > 0.0)
    {
        let sigma = (other.sigma / other.gain).hypot(MODEL);
        if sigma < 0.5 {
            weight += sigma.powi(-2);
            mean += other.gain.ln() * sigma.powi(-2);
        }
    }
    mean /= weight;
    let common = mean.exp();
    if fit.gain > 0.3 * common {
        let sigma = (fit.sigma / fit.gain).hypot(weight.powf(-0.5));
        return [gain(fit.gain.ln() - mean, sigma), unexplained];
    }
    // Against the prediction, or far too small: certain only if noise cannot make it so.
    let is_certain = fit.gain + 5.0 * fit.sigma < 0.3 * common;
    let sigma = if is_certain { 0.01 } else { f64::NAN };
    [gain((fit.gain / common).max(0.01).ln(), sigma), unexplained]
}

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

use nalgebra::{Vector2, Vector3};

use super::estimate::{Estimate, Relation};
use super::grid::{derivative, noise, smooth};
use super::least_squares::{Equations, alike};
use super::roles::{Role, Roles};
use super::signals::{Signals, View};
use super::travel::Travel;
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::scope::Scope;
use crate::evaluate::workspace::Workspace;
use crate::machine::Machine;
use crate::state::State;

/// Least velocity of a joint that moves (rad/s or m/s).
const MOVING: f64 = 0.004;
/// The same as a share of a joint's own fast motion.
const SHARE: f64 = 0.08;
/// Bins that belong to a motion before and after it.
const AROUND: usize = 5;
/// Lean beyond what tyres give way (rad): the machine tips over, or its ground moves.
const FALLS: f64 = 0.03;
/// Fewest bins of a motion.
const FEWEST: usize = 12;
/// Most bins of one joint that are used: a minute.
const MOST: usize = 600;
/// Standard deviation of the logarithm of the tyres' stiffness where the machine file states it, and where it does not.
const STATED: f64 = 0.35;
const UNSTATED: f64 = 1.2;
/// Deflection of the mean tyre where its stiffness is not stated (m).
const DEFLECTION: f64 = 0.015;
/// Relative error of a predicted lean due to masses.
const MODEL: f64 = 0.06;

/// A joint that moves alone: its bins, in runs.
#[derive(Debug, Clone)]
pub(super) struct MovedAlone {
    pub(super) joint: usize,
    pub(super) runs: Vec<std::ops::Range<usize>>,
}

/// The platform on its tyres.
#[derive(Debug)]
pub(super) struct Platform {
    machine: Machine,
    stiffness_sigma: f64,
}

impl Platform {
    pub(super) fn new(machine: &Machine) -> Self {
        let mut resting = machine.with_imu_at_base();
        let is_stated = resting.wheels.iter().all(|wheel| wheel.stiffness.is_some());
        if !is_stated {
            let load = machine.mass() * machine.gravity / machine.wheels.len() as f64;
            for wheel in &mut resting.wheels {
                wheel.stiffness = Some(load / DEFLECTION);
            }
            resting.contact.tyres_deflect = true;
        }
        resting.leave_out_actuator_forces();
        Self {
            machine: resting,
            stiffness_sigma: if is_stated { STATED } else { UNSTATED },
        }
    }

    /// Normal of the ground in base axes on level ground, with the joints at the medians of their positions.
    pub(super) fn level_normal(&self, view: &View) -> Vector3<f64> {
        let mut state = State::<f64>::zero(&self.machine);
        for (columns, motion) in view.joints.iter().zip(&mut state.joints) {
            let mut known: Vec<f64> = columns
                .position
                .iter()
                .copied()
                .filter(|p| p.is_finite())
                .collect();
            known.sort_by(f64::total_cmp);
            if let Some(&median) = known.get(known.len() / 2) {
                motion.position = median;
            }
        }
        state.imu.specific_force = Vector3::z() * self.machine.gravity;
        let mut workspace = Workspace::with_scope(&self.machine, Scope::LOADS);
        let normal = evaluate(&self.machine, &state, &mut workspace).contact_normal;
        let is_known = normal.iter().all(|x| x.is_finite());
        if is_known { normal } else { Vector3::z() }
    }

    /// The normals that the joints' motions predict.
    pub(super) fn predict(&self, view: &View, moved: &[MovedAlone]) -> Predicted {
        let of_run = |run: &std::ops::Range<usize>| self.normals(view, widened(run, view.bins));
        let of_joint = |moved: &MovedAlone| moved.runs.iter().map(of_run).collect();
        Predicted(moved.iter().map(of_joint).collect())
    }

    /// The normal in these bins, x and y, and the share of the bins in which the linkages cannot close.
    fn normals(&self, view: &View, bins: std::ops::Range<usize>) -> ([Vec<f64>; 2], f64) {
        let mut state = State::<f64>::zero(&self.machine);
        let mut workspace = Workspace::with_scope(&self.machine, Scope::LOADS);
        let mut normals = [Vec::new(), Vec::new()];
        let mut impossible = 0;
        let count = bins.len();
        for bin in bins {
            view.set_joints(bin, &mut state);
            state.imu.specific_force = view.force[bin];
            let outcome = evaluate(&self.machine, &state, &mut workspace);
            impossible += usize::from(outcome.linkage_closure < 0.0);
            normals[0].push(outcome.contact_normal.x);
            normals[1].push(outcome.contact_normal.y);
        }
        (normals, impossible as f64 / count.max(1) as f64)
    }
}

/// Predicted normals: by joint that moved alone and by run, x and y in each bin, and the share of bins with a posture in
/// which the linkages cannot close.
#[derive(Debug, Clone)]
pub(super) struct Predicted(Vec<Vec<([Vec<f64>; 2], f64)>>);

/// A run with the bins around it that filters need.
fn widened(run: &std::ops::Range<usize>, bins: usize) -> std::ops::Range<usize> {
    run.start.saturating_sub(2)..(run.end + 2).min(bins)
}

/// Whether each joint that moves masses moves, by bin.
fn moving(roles: &Roles, view: &View) -> Vec<(usize, Vec<bool>)> {
    let joints = roles.joints(|role| matches!(role, Role::Mass)).into_iter();
    let moves = |joint: usize| {
        let columns = &view.joints[joint];
        let mut rates: Vec<f64> = columns
            .rate
            .iter()
            .map(|r| r.abs())
            .filter(|r| r.is_finite())
            .collect();
        rates.sort_by(f64::total_cmp);
        let fast = rates.get(rates.len() * 99 / 100).copied().unwrap_or(0.0);
        // A drive gives way a little while another joint moves: that is predicted, and no motion of its own.
        let least = MOVING
            .max(6.0 * 3.2 * noise(&columns.position))
            .max(SHARE * fast);
        (
            joint,
            columns.rate.iter().map(|rate| rate.abs() > least).collect(),
        )
    };
    joints.map(moves).collect()
}

/// The bins in which each joint moves alone while the machine stands.
pub(super) fn moved_alone(roles: &Roles, view: &View, travel: &Travel) -> Vec<MovedAlone> {
    let moving = moving(roles, view);
    let alone = |joint: usize| {
        let others = |bin: usize| {
            moving
                .iter()
                .any(|(other, moves)| *other != joint && moves[bin])
        };
        let own = moving.iter().find(|(other, _)| *other == joint);
        let own = |bin: usize| own.is_some_and(|(_, moves)| moves[bin]);
        let near = |bin: usize| {
            let around = bin.saturating_sub(AROUND)..(bin + AROUND + 1).min(view.bins);
            around.into_iter().any(own)
        };
        let belongs =
            |bin: usize| travel.stands[bin] && view.is_upright[bin] && !others(bin) && near(bin);
        let mut runs = runs(view.bins, belongs);
        // A run at the edge of another joint's motion holds none of its own.
        runs.retain(|run| {
            run.len() >= FEWEST && run.clone().filter(|&bin| own(bin)).count() * 3 >= run.len()
        });
        let mut left = MOST;
        runs.retain(|run| {
            let fits = run.len() <= left;
            left -= if fits { run.len() } else { 0 };
            fits
        });
        MovedAlone { joint, runs }
    };
    let all = moving.iter().map(|(joint, _)| alone(*joint));
    all.filter(|moved| !moved.runs.is_empty()).collect()
}

/// Runs of neighbouring bins for which this holds.
fn runs(bins: usize, holds: impl Fn(usize) -> bool) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for bin in (0..bins).filter(|&bin| holds(bin)) {
        match runs.last_mut() {
            Some(run) if run.end == bin => run.end += 1,
            _ => runs.push(bin..bin + 1),
        }
    }
    runs
}

/// What the gyroscope measures of a joint's motion.
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
fn measured(view: &View, bin: usize) -> Vector2<f64> {
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
    let gain = |value: f64, sigma: f64| Estimate {
        relation: Relation::Lean(fit.joint),
        value,
        sigma,
        expected: 0.0,
        tolerance: 0.25,
        wrong: 0.6,
    };
    let unexplained = Estimate {
        relation: Relation::LeanUnexplained(fit.joint),
        value: fit.unexplained,
        sigma: fit.unexplained_sigma,
        expected: 0.0,
        tolerance: 0.35,
        // Other things move a platform, too: by itself that is no fault of a sensor.
        wrong: f64::INFINITY,
    };
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

/// Joints that never move by their readings, while the platform leans as if they did and no other joint moves.
pub(super) fn still(
    platform: &Platform,
    roles: &Roles,
    signals: &Signals,
    view: &View,
    travel: &Travel,
) -> Vec<Estimate> {
    let moving = moving(roles, view);
    let candidates: Vec<usize> = (moving.iter())
        .filter(|(joint, moves)| {
            let is_there = view.joints[*joint].position.iter().any(|p| p.is_finite());
            is_there && !moves.iter().any(|moves| *moves)
        })
        .map(|(joint, _)| *joint)
        .collect();
    if candidates.is_empty() {
        return Vec::new();
    }
    let is_quiet = |bin: usize| {
        let around = bin.saturating_sub(2 * AROUND)..(bin + 2 * AROUND + 1).min(view.bins);
        around
            .into_iter()
            .all(|bin| travel.stands[bin] && !moving.iter().any(|(_, moves)| moves[bin]))
    };
    let runs: Vec<_> = (runs(view.bins, is_quiet).into_iter())
        .filter(|run| run.len() >= FEWEST)
        .collect();
    let variance = signals.gyro_variance();
    candidates
        .iter()
        .filter_map(|&joint| {
            let all = runs
                .iter()
                .filter_map(|run| leans_along(platform, view, joint, run, variance));
            let (value, sigma) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
            Some(Estimate {
                relation: Relation::Still(joint),
                value,
                sigma,
                expected: 0.0,
                tolerance: 3e-4,
                wrong: 1e-3,
            })
        })
        .collect()
}

/// Lean in a run along the direction in which a joint leans the platform (rad), if most of the lean is along it.
fn leans_along(
    platform: &Platform,
    view: &View,
    joint: usize,
    run: &std::ops::Range<usize>,
    variance: f64,
) -> Option<(f64, f64)> {
    let at = |offset: f64| {
        let mut state = State::<f64>::zero(&platform.machine);
        view.set_joints(run.start, &mut state);
        state.joints[joint].position += offset;
        state.imu.specific_force = view.force[run.start];
        let mut workspace = Workspace::with_scope(&platform.machine, Scope::LOADS);
        evaluate(&platform.machine, &state, &mut workspace).contact_normal
    };
    let step = 0.02;
    let along = (at(step) - at(-step)).xy().try_normalize(1e-9)?;
    let rates: Vec<Vector2<f64>> = run.clone().map(|bin| measured(view, bin)).collect();
    let rates: Vec<Vector2<f64>> = rates
        .into_iter()
        .filter(|r| r.x.is_finite() && r.y.is_finite())
        .collect();
    let mean = rates.iter().sum::<Vector2<f64>>() / rates.len() as f64;
    let (mut lean, mut least, mut largest) = (0.0, 0.0_f64, 0.0_f64);
    let (mut with, mut all) = (0.0, 0.0);
    for rate in &rates {
        let rate = rate - mean;
        let part = rate.dot(&along);
        with += part * part;
        all += rate.norm_squared();
        lean += part * super::grid::STEP_S;
        least = least.min(lean);
        largest = largest.max(lean);
    }
    let sigma = (variance * rates.len() as f64 * 4.0).sqrt() * super::grid::STEP_S;
    let turned = largest - least;
    (with > 0.8 * all && turned < FALLS).then_some((turned, sigma))
}

/// Positions and velocities of the joints against each other, and positions against limits.
pub(super) fn readings(machine: &Machine, roles: &Roles, view: &View) -> Vec<Estimate> {
    let mut found = Vec::new();
    for (joint, columns) in view.joints.iter().enumerate() {
        if matches!(roles.of(joint), Role::Constant) {
            continue;
        }
        let least = MOVING.max(10.0 * 3.2 * noise(&columns.position));
        let mut equations = Equations::new(2).excited(0, least);
        for (rate, measured) in columns.rate.iter().zip(&columns.measured_rate) {
            equations.add(&[*rate, 1.0], *measured);
        }
        if let Some(solution) = equations.solve() {
            found.push(Estimate {
                relation: Relation::Rate(joint),
                value: solution.values[0],
                sigma: solution.sigmas[0],
                expected: 1.0,
                tolerance: 0.1,
                wrong: 0.3,
            });
        }
        let Some([least, largest]) = machine.joints[joint].limits else {
            continue;
        };
        let known = smooth(&columns.position)
            .into_iter()
            .filter(|p| p.is_finite());
        let beyond = known
            .map(|p| (least - p).max(p - largest).max(0.0))
            .fold(0.0, f64::max);
        let span = largest - least;
        if span.is_finite() && span > 0.0 {
            found.push(Estimate {
                relation: Relation::Range(joint),
                value: beyond / span,
                sigma: 0.001,
                expected: 0.0,
                tolerance: 0.05,
                wrong: 0.15,
            });
        }
    }
    found
}

//! Encoders that stand still: the platform leans as if a joint moved, and no reading changes.

use nalgebra::Vector2;

use super::estimate::{Estimate, Relation};
use super::grid::STEP_S;
use super::leaning::measured;
use super::moved::{AROUND, FEWEST, moving, runs};
use super::platform::Platform;
use super::roles::Roles;
use super::signals::{Signals, View};
use super::travel::Travel;
use tipwatch_mechanics::Scope;
use tipwatch_mechanics::Workspace;
use tipwatch_mechanics::evaluate;
use tipwatch_mechanics::state::State;

/// Lean beyond what tyres give way (rad): the machine tips over, or its ground moves.
const FALLS: f64 = 0.03;

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
    let runs: Vec<_> = (runs(view.bins, 0, is_quiet).into_iter())
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
            Some(Estimate::of(Relation::Still(joint), [value, sigma]))
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
        lean += part * STEP_S;
        least = least.min(lean);
        largest = largest.max(lean);
    }
    let sigma = (variance * rates.len() as f64 * 4.0).sqrt() * STEP_S;
    let turned = largest - least;
    (with > 0.8 * all && turned < FALLS).then_some((turned, sigma))
}

//! Bins in which each joint moves, and in which it moves alone while the machine stands.

use super::grid::noise;
use super::roles::{Role, Roles};
use super::signals::View;
use super::travel::Travel;

/// Least velocity of a joint that moves (rad/s or m/s).
pub(super) const MOVING: f64 = 0.004;
/// Least velocity of a joint that moves, as a share of the joint's own fast motion.
const SHARE: f64 = 0.08;
/// Bins that belong to a motion before and after it.
pub(super) const AROUND: usize = 5;
/// Fewest bins of a motion.
pub(super) const FEWEST: usize = 12;
/// Most bins of one joint that are used: a minute.
const MOST: usize = 600;

/// A joint that moves alone: its bins, in runs.
#[derive(Debug, Clone)]
pub(super) struct MovedAlone {
    pub(super) joint: usize,
    pub(super) runs: Vec<std::ops::Range<usize>>,
}

/// Returns the index of each joint that moves masses, with whether it moves in each bin.
pub(super) fn moving(roles: &Roles, view: &View) -> Vec<(usize, Vec<bool>)> {
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
        let mut runs = runs(view.bins, 0, belongs);
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

/// Runs of bins for which this holds, but for at most so many at a time.
pub(super) fn runs(
    bins: usize,
    but_for: usize,
    holds: impl Fn(usize) -> bool,
) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for bin in (0..bins).filter(|&bin| holds(bin)) {
        match runs.last_mut() {
            Some(run) if bin - run.end <= but_for => run.end = bin + 1,
            _ => runs.push(bin..bin + 1),
        }
    }
    runs
}

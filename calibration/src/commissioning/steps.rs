//! Recognises what was done in a commissioning drive.

use super::assessment::Step;
use super::evidence::Comparison;
use super::grid::{Grid, STEP_S};
use super::moved::runs;

/// Least forward acceleration of driving off and braking (m/s^2), speed (m/s) and yaw rate (rad/s).
const ACCELERATES: f64 = 0.2;
const DRIVES: f64 = 0.1;
const TURNS: f64 = 0.08;
/// Shortest step (s).
const SHORTEST: usize = 5;

/// The steps, in order of their beginnings.
pub(super) fn steps(comparison: &Comparison<'_>) -> Vec<Step> {
    let (view, travel) = (&comparison.view, &comparison.travel);
    let speed = |k: usize| travel.velocity[k].x;
    let change = |k: usize| travel.acceleration[k].x * speed(k).signum();
    let yaw = |k: usize| view.turning[k].z;
    let drives = |k: usize| speed(k).abs() > DRIVES;
    type Holds<'a> = Box<dyn Fn(usize) -> bool + 'a>;
    // what it is called, also if the machine turned all round meanwhile, and when it is done
    let kinds: [(&str, Option<&str>, Holds<'_>); 6] = [
        ("stand", None, Box::new(|k| travel.stands[k])),
        ("drive forward", None, Box::new(move |k| speed(k) > DRIVES)),
        (
            "drive backward",
            None,
            Box::new(move |k| speed(k) < -DRIVES),
        ),
        (
            "brake",
            None,
            Box::new(move |k| drives(k) && change(k) < -ACCELERATES),
        ),
        (
            "turn left",
            Some("circle left"),
            Box::new(move |k| drives(k) && yaw(k) > TURNS),
        ),
        (
            "turn right",
            Some("circle right"),
            Box::new(move |k| drives(k) && yaw(k) < -TURNS),
        ),
    ];
    let mut steps = Vec::new();
    for (what, all_round, holds) in &kinds {
        let runs = runs(view.bins, 1, holds).into_iter();
        for run in runs.filter(|run| run.len() >= SHORTEST) {
            let turned: f64 = run
                .clone()
                .map(|k| yaw(k) * STEP_S)
                .filter(|t| t.is_finite())
                .sum();
            let what = match turned.abs() > 0.9 * std::f64::consts::TAU {
                true => all_round.unwrap_or(what),
                false => what,
            };
            steps.push(step(what.to_string(), &run));
        }
    }
    for moved in &comparison.moved {
        let name = &comparison.machine.joints()[moved.joint].name;
        steps.extend(
            moved
                .runs
                .iter()
                .map(|run| step(format!("move {name} alone"), run)),
        );
    }
    steps.sort_by(|a, b| a.span_s[0].total_cmp(&b.span_s[0]));
    steps
}

fn step(what: String, run: &std::ops::Range<usize>) -> Step {
    Step {
        what,
        span_s: [Grid::seconds(run.start), Grid::seconds(run.end)],
    }
}

//! A controlled suspension is never worse than a locked one: over random manoeuvres, in every mode, with rods that
//! follow at once and through valves, oil and cylinders.

#![allow(clippy::print_stdout, reason = "the figures are printed")]

use std::collections::BTreeMap;

use crate::manoeuvres::{Manoeuvre, least_load};
use crate::problems::{Draws, control, machine};
use tipwatch_mechanics::machine::{ControlMode, SuspensionControl};
use tipwatch_suspension::Status;
use tipwatch_suspension::replay::SuspensionMotion;

/// Every mode, with common and individual rods.
const MODES: [(ControlMode, bool); 4] = [
    (ControlMode::LookAhead, false),
    (ControlMode::LookAhead, true),
    (ControlMode::OneStep, false),
    (ControlMode::OneStep, true),
];
/// `limits.min_load` of the machine (N).
const LIMIT: f64 = 500.0;
/// What the load may be below the smaller of the limit and that of locked rods, as a share of the mean load: the
/// manoeuvres are faster than the guard's reserves.
const TOLERANCE: f64 = 0.015;
/// ... and the oil adds a little.
const HYDRAULIC_TOLERANCE: f64 = 0.025;
/// What the largest spread of a manoeuvre may be, relative to that of locked rods.
const MOST_SPREAD: f64 = 1.03;

/// Above this stability angle the loads come first (rad).
const AMPLE_ANGLE: f64 = 0.25;
/// (rad)
const ANGLE_TOLERANCE: f64 = 2e-3;

/// One-step mode takes a step that is long enough for every posture here.
fn settings(mode: ControlMode, independent: bool) -> SuspensionControl {
    let mut control = control(mode, independent);
    if mode == ControlMode::OneStep {
        control.rate = 0.4;
    }
    control
}

fn manoeuvres(variable: &str, default: u32) -> u32 {
    std::env::var(variable).map_or(default, |n| n.parse().unwrap())
}

#[test]
fn rods_that_follow_at_once_never_cost_a_wheel_its_load() {
    let machine = machine();
    let mean = machine.mass() * machine.gravity() / 4.0;
    let (mut worst, mut statuses, mut gains) =
        (f64::INFINITY, BTreeMap::<Status, usize>::new(), Vec::new());
    for (mode, independent) in MODES {
        let mut draws = Draws(u64::from(manoeuvres("TIPWATCH_SEED", 5)));
        for k in 0..manoeuvres("TIPWATCH_IDEAL", 16) {
            let manoeuvre = Manoeuvre::draw(&mut draws, &machine);
            let found = manoeuvre.ideal(&machine, &settings(mode, independent));
            for (row, &[locked, moved]) in found.least.iter().enumerate() {
                worst = worst.min(moved - LIMIT.min(locked));
                let floor = LIMIT.min(locked) - TOLERANCE * mean;
                assert!(
                    moved >= floor,
                    "{mode:?} {independent} manoeuvre {k} row {row}: {moved:.0} N, locked {locked:.0} N"
                );
                assert!(
                    locked <= TOLERANCE * mean || moved > 0.0,
                    "{mode:?} manoeuvre {k} row {row}"
                );
            }
            for status in found.status {
                *statuses.entry(status).or_default() += 1;
            }
            let most = |i: usize| {
                found
                    .spread
                    .iter()
                    .map(|spread| spread[i])
                    .fold(0.0, f64::max)
            };
            assert!(
                most(1) <= MOST_SPREAD * most(0),
                "{mode:?} {independent} manoeuvre {k}: {:.0} N, locked {:.0} N",
                most(1),
                most(0)
            );
            for (row, &[locked, moved]) in found.angle.iter().enumerate() {
                assert!(
                    moved >= locked.min(AMPLE_ANGLE) - ANGLE_TOLERANCE,
                    "{mode:?} {independent} manoeuvre {k} row {row}: {moved:.3} rad, locked {locked:.3} rad"
                );
            }
            let sum = |i: usize| found.spread.iter().map(|spread| spread[i]).sum::<f64>();
            gains.push(1.0 - sum(1) / sum(0));
        }
    }
    let gain = gains.iter().sum::<f64>() / gains.len() as f64;
    println!(
        "worst {worst:.0} N, mean gain {:.1} %, {statuses:?}",
        100.0 * gain
    );
    // a guard that always holds would pass otherwise
    assert!(gain > 0.02, "{gain}");
    assert!(statuses.contains_key(&Status::Restrained));
}

#[test]
fn hydraulic_rods_never_cost_a_wheel_its_load() {
    let machine = machine();
    let mean = machine.mass() * machine.gravity() / 4.0;
    for (mode, independent) in MODES {
        let mut draws = Draws(u64::from(manoeuvres("TIPWATCH_SEED", 5)));
        let motion = SuspensionMotion::Controlled(settings(mode, independent));
        for k in 0..manoeuvres("TIPWATCH_HYDRAULIC", 5) {
            let manoeuvre = Manoeuvre::draw(&mut draws, &machine);
            let found = manoeuvre.compared(&machine, &motion);
            let largest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
            let mut worst = f64::INFINITY;
            for row in 0..found.fixed.spread.len() {
                let [locked, moved] = [&found.fixed, &found.moved].map(|of| least_load(of, row));
                worst = worst.min(moved - LIMIT.min(locked));
                assert!(
                    moved >= LIMIT.min(locked) - HYDRAULIC_TOLERANCE * mean,
                    "{mode:?} {independent} manoeuvre {k} row {row}: {moved:.0} N, locked {locked:.0} N"
                );
            }
            let [spread, angle] = [
                [&found.fixed, &found.moved].map(|of| largest(&of.spread)),
                [&found.fixed, &found.moved].map(|of| least(&of.stability_angle)),
            ];
            let rods = found.moved.rods.iter();
            let fastest = rods
                .map(|rod| largest(&rod.acceleration))
                .fold(0.0, f64::max);
            println!(
                "{mode:?} {independent} {k}: worst {worst:.0} N, largest spread {spread:.0?}, smallest angle {angle:.3?}, {fastest:.2} m/s2"
            );
            assert!(spread[1] <= MOST_SPREAD * spread[0], "{spread:?}");
            assert!(
                angle[1] >= angle[0].min(AMPLE_ANGLE) - ANGLE_TOLERANCE,
                "{angle:?}"
            );
        }
    }
}

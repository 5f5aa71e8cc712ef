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
/// What the load may be below the smaller of the limit and that of locked rods, as a share of the mean load: some of the
/// manoeuvres are faster than the guard's reserves.
const TOLERANCE: f64 = 0.005;
/// The same through valves, oil and cylinders, against the smaller load of rigid rods and of rods that closed valves hold
/// on the same oil.
const HYDRAULIC_TOLERANCE: f64 = 0.002;
/// Rods on oil swing: control and closed valves do not swing in step. So many rows to each side are compared.
const SWING_ROWS: usize = 8;
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
    assert!(gain > 0.015, "{gain}");
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
            let held = manoeuvre.compared(&machine, &SuspensionMotion::Held).moved;
            let largest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
            let mut worst = f64::INFINITY;
            let rows = found.fixed.spread.len();
            for row in 0..rows {
                let [rigid, moved] = [&found.fixed, &found.moved].map(|of| least_load(of, row));
                let around = row.saturating_sub(SWING_ROWS)..(row + SWING_ROWS + 1).min(rows);
                let locked = around.fold(rigid, |least, row| least.min(least_load(&held, row)));
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

/// Where a wheel would lose its load if all that is reserved for came true, the rods still move: slowly, at no more than a
/// start's cost, and to the benefit of the lightest wheel.
#[test]
fn reserves_beyond_a_wheels_load_do_not_freeze_the_rods() {
    let machine = machine();
    let mean = machine.mass() * machine.gravity() / 4.0;
    let manoeuvre = Manoeuvre::standing(&machine, 6, -0.18, 1.0);
    let found = manoeuvre.ideal(&machine, &settings(ControlMode::LookAhead, false));
    let travel = (found.rod.last().unwrap() - found.rod[0]).abs();
    let losses = found.least.iter().map(|&[locked, moved]| locked - moved);
    let most = losses.fold(f64::NEG_INFINITY, f64::max);
    let [locked, moved] = *found.least.last().unwrap();
    println!(
        "{travel:.3} m; the lightest wheel {locked:.0} -> {moved:.0} N, at most {most:.1} N less"
    );
    assert!(travel > 0.03, "{travel}");
    assert!(moved > locked + 0.02 * mean, "{locked} {moved}");
    assert!(most <= 0.0035 * mean, "{most}");
}

/// Closed valves hold the rods where they are, but for what the oil yields: the measure of a control on the same oil.
#[test]
fn closed_valves_hold_the_rods() {
    let machine = machine();
    let mut draws = Draws(5);
    let manoeuvre = Manoeuvre::draw(&mut draws, &machine);
    let found = manoeuvre.compared(&machine, &SuspensionMotion::Held);
    let mut farthest = 0.0_f64;
    for rod in &found.moved.rods {
        assert!(rod.opening.iter().all(|&opening| opening == 0.0));
        let home = rod.position[0];
        farthest = rod
            .position
            .iter()
            .fold(farthest, |most, x| most.max((x - home).abs()));
    }
    println!("the oil yields {:.1} mm", 1e3 * farthest);
    assert!(farthest > 1e-5 && farthest < 8e-3, "{farthest}");
}

/// Where no wheel is light the guard costs nothing: most of what the best posture can do, within the first 4 s.
#[test]
fn val_guard_keeps_the_gain_of_a_folded_arm() {
    let machine = machine();
    let manoeuvre = Manoeuvre::folded(&machine, 4);
    let motion = SuspensionMotion::Controlled(control(ControlMode::LookAhead, false));
    let found = manoeuvre.compared(&machine, &motion);
    let share = found.gain_share().unwrap();
    let least = (0..found.moved.spread.len())
        .map(|row| least_load(&found.moved, row))
        .fold(f64::INFINITY, f64::min);
    println!(
        "{:.0} % of the best posture's gain, least load {least:.0} N",
        100.0 * share
    );
    assert!(share > 0.7, "{share}");
}

//! A controlled suspension is never worse than a locked one: over random manoeuvres, in every mode, with rods that
//! follow at once and through valves, oil and cylinders.
//!
//! `TIPWATCH_IDEAL=40 TIPWATCH_HYDRAULIC=40 cargo test --release -p tipwatch-suspension --test tests never_worse` draws
//! more manoeuvres (40 of each take a minute), `TIPWATCH_SEED` others.

#![allow(clippy::print_stdout, reason = "the figures are printed")]

use std::collections::BTreeMap;

use crate::manoeuvres::{Manoeuvre, RATE, least_load};
use crate::problems::{Draws, control, machine};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{ControlMode, SuspensionControl};
use tipwatch_suspension::Status;
use tipwatch_suspension::replay::SuspensionMotion;

/// `limits.min_load` of the machine (N).
const LIMIT: f64 = 500.0;
/// What the load may be below the smaller of the limit and that of locked rods, as a share of the mean load, with common
/// and with individual rods: half of it is what the guard allows for the moment of a start, the rest that some manoeuvres
/// are faster than its reserves.
const TOLERANCE: [f64; 2] = [0.002, 0.005];
/// The same through valves, oil and cylinders, against the smaller load of rigid rods and of rods that closed valves hold
/// on the same oil.
const HELD_TOLERANCE: [f64; 2] = [0.002, 0.004];
/// ... and against rigid rods alone, which do not swing on oil.
const RIGID_TOLERANCE: f64 = 0.021;
/// Rods on oil swing, and control and closed valves do not swing in step: so many rows, half a swing, to each side are
/// compared.
const SWING_ROWS: usize = 4;
/// What the largest spread of a manoeuvre may be, relative to that of locked rods.
const MOST_SPREAD: f64 = 1.02;

/// Above this stability angle the loads come first (rad).
const AMPLE_ANGLE: f64 = 0.25;
/// (rad)
const ANGLE_TOLERANCE: f64 = 1e-3;

/// One-step mode takes a step that is long enough for every posture here.
fn settings(mode: ControlMode, independent: bool) -> SuspensionControl {
    let mut control = control(mode, independent);
    if mode == ControlMode::OneStep {
        control.rate = 0.4;
    }
    control
}

fn draws(variable: &str, default: u32, machine: &Machine) -> impl Iterator<Item = Manoeuvre> {
    let number = |variable: &str, default: u32| {
        std::env::var(variable).map_or(default, |n| n.parse().unwrap())
    };
    let mut draws = Draws(u64::from(number("TIPWATCH_SEED", 5)));
    (0..number(variable, default)).map(move |_| Manoeuvre::draw(&mut draws, machine))
}

/// The largest of the first and of the second numbers.
fn largest(pairs: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|i| {
        pairs
            .iter()
            .map(|pair| pair[i])
            .fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Rods that follow at once cost no wheel its load; `gain` is the least mean reduction of the spread, since a guard that
/// always holds would pass otherwise.
fn ideal(mode: ControlMode, independent: bool, gain: f64) {
    let machine = machine();
    let mean = machine.mass() * machine.gravity() / 4.0;
    let tolerance = TOLERANCE[usize::from(independent)];
    let (mut worst, mut statuses, mut gains) =
        (f64::INFINITY, BTreeMap::<Status, usize>::new(), Vec::new());
    for (k, manoeuvre) in draws("TIPWATCH_IDEAL", 16, &machine).enumerate() {
        let found = manoeuvre.ideal(&machine, &settings(mode, independent));
        for (row, &[locked, moved]) in found.least.iter().enumerate() {
            let added = moved - LIMIT.min(locked);
            worst = worst.min(added);
            assert!(
                added >= -tolerance * mean,
                "manoeuvre {k} row {row}: {moved:.0} N, locked {locked:.0} N"
            );
            assert!(
                locked <= tolerance * mean || moved > 0.0,
                "manoeuvre {k} row {row}: {moved:.0} N, locked {locked:.0} N"
            );
        }
        for status in found.status {
            *statuses.entry(status).or_default() += 1;
        }
        let spread = largest(&found.spread);
        assert!(
            spread[1] <= MOST_SPREAD * spread[0],
            "manoeuvre {k}: {spread:.0?}"
        );
        for (row, &[locked, moved]) in found.angle.iter().enumerate() {
            assert!(
                moved >= locked.min(AMPLE_ANGLE) - ANGLE_TOLERANCE,
                "manoeuvre {k} row {row}: {moved:.4} rad, locked {locked:.4} rad"
            );
        }
        let sum = |i: usize| found.spread.iter().map(|spread| spread[i]).sum::<f64>();
        gains.push(1.0 - sum(1) / sum(0));
    }
    let found = gains.iter().sum::<f64>() / gains.len() as f64;
    println!(
        "worst {:.2} % of the mean load, mean gain {:.1} %, {statuses:?}",
        100.0 * worst / mean,
        100.0 * found
    );
    assert!(found > gain, "{found}");
    assert!(statuses.contains_key(&Status::Restrained));
}

#[test]
fn ideal_rods_look_ahead() {
    ideal(ControlMode::LookAhead, false, 0.025);
}

#[test]
fn ideal_rods_look_ahead_each_rod() {
    ideal(ControlMode::LookAhead, true, 0.025);
}

#[test]
fn ideal_rods_one_step() {
    ideal(ControlMode::OneStep, false, 0.015);
}

#[test]
fn ideal_rods_one_step_each_rod() {
    ideal(ControlMode::OneStep, true, 0.015);
}

/// Rods on valves, oil and cylinders cost no wheel its load either.
fn hydraulic(mode: ControlMode, independent: bool) {
    let machine = machine();
    let mean = machine.mass() * machine.gravity() / 4.0;
    let tolerance = HELD_TOLERANCE[usize::from(independent)];
    let motion = SuspensionMotion::Controlled(settings(mode, independent));
    for (k, manoeuvre) in draws("TIPWATCH_HYDRAULIC", 3, &machine).enumerate() {
        let found = manoeuvre.compared(&machine, &motion);
        let held = manoeuvre.compared(&machine, &SuspensionMotion::Held).moved;
        let rows = found.fixed.spread.len();
        let (mut worst, mut pairs) = ([f64::INFINITY; 2], Vec::new());
        for row in 0..rows {
            let [rigid, moved] = [&found.fixed, &found.moved].map(|of| least_load(of, row));
            let around = row.saturating_sub(SWING_ROWS)..(row + SWING_ROWS + 1).min(rows);
            let locked = around.fold(rigid, |least, row| least.min(least_load(&held, row)));
            worst[0] = worst[0].min(moved - LIMIT.min(locked));
            worst[1] = worst[1].min(moved - LIMIT.min(rigid));
            pairs.push([found.fixed.spread[row], found.moved.spread[row]]);
        }
        let spread = largest(&pairs);
        let angle = [&found.fixed, &found.moved].map(|of| {
            let angles = of.stability_angle.iter();
            angles.copied().fold(f64::INFINITY, f64::min)
        });
        println!(
            "{k}: worst {worst:.0?} N, largest spread {spread:.0?}, smallest angle {angle:.3?}"
        );
        assert!(worst[0] >= -tolerance * mean, "manoeuvre {k}: {worst:?}");
        assert!(
            worst[1] >= -RIGID_TOLERANCE * mean,
            "manoeuvre {k}: {worst:?}"
        );
        assert!(spread[1] <= MOST_SPREAD * spread[0], "{spread:?}");
        assert!(
            angle[1] >= angle[0].min(AMPLE_ANGLE) - ANGLE_TOLERANCE,
            "{angle:?}"
        );
    }
}

#[test]
fn hydraulic_rods_look_ahead() {
    hydraulic(ControlMode::LookAhead, false);
}

#[test]
fn hydraulic_rods_look_ahead_each_rod() {
    hydraulic(ControlMode::LookAhead, true);
}

#[test]
fn hydraulic_rods_one_step() {
    hydraulic(ControlMode::OneStep, false);
}

#[test]
fn hydraulic_rods_one_step_each_rod() {
    hydraulic(ControlMode::OneStep, true);
}

/// A platform that rocks on tyres and oil does not move the rods in step with it, which would feed the swing: they go the
/// way that they go on one that stands still.
#[test]
fn a_swing_of_the_platform_is_not_fed() {
    let machine = machine();
    for rods in [-0.18, -0.1, -0.03] {
        let paths = [0.0, 0.5, 1.0].map(|swing| {
            Manoeuvre::standing(&machine, rods, [2.0, swing])
                .ideal(&machine, &settings(ControlMode::LookAhead, false))
                .rod
        });
        let travel = paths[0].last().unwrap()[0] - rods;
        let differs = |path: &[[f64; 2]]| {
            let pairs = path.iter().zip(&paths[0]);
            pairs.map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max)
        };
        let found = [differs(&paths[1]), differs(&paths[2])];
        println!("rods at {rods} m go {travel:.3} m, velocities differ by {found:.5?} m/s");
        assert!(travel > 0.02, "{travel}");
        assert!(found[0] < 1e-3, "{found:?}");
    }
}

/// Closed valves hold the rods where they are, but for what the oil yields: the measure of a control on the same oil.
#[test]
fn closed_valves_hold_the_rods() {
    let machine = machine();
    let manoeuvre = Manoeuvre::draw(&mut Draws(5), &machine);
    let found = manoeuvre.compared(&machine, &SuspensionMotion::Held);
    let mut farthest = 0.0_f64;
    for rod in &found.moved.rods {
        assert!(rod.opening.iter().all(|&opening| opening == 0.0));
        let home = rod.position[0];
        let away = rod.position.iter().map(|x| (x - home).abs());
        farthest = away.fold(farthest, f64::max);
    }
    println!("the oil yields {:.1} mm", 1e3 * farthest);
    assert!(farthest > 1e-5 && farthest < 8e-3, "{farthest}");
}

/// Where no wheel is light the guard costs little: most of what the best posture can do, within the first 4 s.
#[test]
fn val_guard_keeps_the_gain_of_a_folded_arm() {
    let machine = machine();
    let motion = SuspensionMotion::Controlled(control(ControlMode::LookAhead, false));
    let found = Manoeuvre::folded(&machine, 4 * RATE).compared(&machine, &motion);
    let share = found.gain_share().unwrap();
    println!("{:.0} % of the best posture's gain", 100.0 * share);
    assert!(share > 0.7, "{share}");
}

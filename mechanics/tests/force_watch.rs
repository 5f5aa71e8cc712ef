//! Measured forces of the arm, by which nothing is computed, against those that masses and motion require.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::studies::measured_forces::ForceWatch;

use crate::support::swinging_boom::{FRICTION_SHARE, swinging, with_linkage, with_load};

/// More than five standard deviations of friction (5 %), samples and masses.
const WRONG_BY_N: f64 = 60e3;

/// Returns a machine whose lift cylinder has a measured force and carries a load of this mass (kg); `at_stop`: the boom in its reference
/// posture is at a limit of the URDF.
fn machine(mass: &str, at_stop: bool) -> Machine {
    with_load(mass, |line| match line.contains("<joint name='lift' ") {
        true if at_stop => line.replace("lower='-10'", "lower='-1.488'"),
        _ => line.to_owned(),
    })
}

/// What the watch says of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Told {
    time_s: f64,
    is_contradicted: bool,
    is_frozen: bool,
}

/// Watches the lift cylinder while the boom swings (rad); `measured` is the force that its sensor shows, by time (s) and by what the
/// right one would show (N).
fn watched(
    machine: &Machine,
    swing: f64,
    seconds: f64,
    mut measured: impl FnMut(f64, f64) -> f64,
) -> Vec<Told> {
    let mut watch = ForceWatch::new(machine).unwrap();
    let friction = |rate: f64| FRICTION_SHARE * rate.signum();
    let rows = swinging(machine, swing, seconds, |_| 1.0, friction);
    let rows = rows.map(|(time_s, mut estimate, force)| {
        estimate.arm_forces = vec![measured(time_s, force)];
        watch.row(machine, &mut estimate);
        let doubt = watch.doubt();
        assert_eq!(
            estimate.reasons.has(Reason::Contradiction),
            doubt.contradicted != 0
        );
        Told {
            time_s,
            is_contradicted: doubt.contradicted == 1,
            is_frozen: doubt.frozen == 1,
        }
    });
    rows.collect()
}

/// The times of the first and the last row that are told (s).
fn span(rows: &[Told], is_told: impl Fn(&Told) -> bool) -> Option<[f64; 2]> {
    let mut told = rows.iter().filter(|row| is_told(row)).map(|row| row.time_s);
    let first = told.next()?;
    Some([first, told.last().unwrap_or(first)])
}

#[test]
fn a_right_force_contradicts_nothing() {
    let rows = watched(&machine("320.0", false), 0.3, 20.0, |_, force| force);
    assert_eq!(
        span(&rows, |row| row.is_contradicted || row.is_frozen),
        None
    );
}

#[test]
fn a_wrong_force_is_doubted_after_two_seconds_until_it_is_right() {
    let rows = watched(&machine("320.0", false), 0.3, 12.0, |time_s, force| {
        let is_wrong = (4.0..8.0).contains(&time_s);
        force + if is_wrong { WRONG_BY_N } else { 0.0 }
    });
    let [from_s, to_s] = span(&rows, |row| row.is_contradicted).unwrap();
    assert!((6.0..6.5).contains(&from_s), "{from_s}");
    assert!((7.7..8.3).contains(&to_s), "{to_s}");
    assert_eq!(span(&rows, |row| row.is_frozen), None);
}

/// What was contradicted stays so while nothing measures it.
#[test]
fn a_missing_force_ends_no_doubt() {
    let rows = watched(
        &machine("320.0", false),
        0.3,
        12.0,
        |time_s, force| match time_s < 8.0 {
            true => force + WRONG_BY_N,
            false => f64::NAN,
        },
    );
    let [from_s, to_s] = span(&rows, |row| row.is_contradicted).unwrap();
    assert!(from_s < 4.0 && to_s > 11.9, "{from_s} {to_s}");
}

/// A sensor that has stopped is told, and doubts no load.
#[test]
fn a_force_that_stands_still_is_told() {
    let mut kept = None;
    let rows = watched(
        &machine("320.0", false),
        0.6,
        12.0,
        |time_s, force| match (4.0..9.0).contains(&time_s) {
            true => *kept.get_or_insert(force),
            false => force,
        },
    );
    let [from_s, to_s] = span(&rows, |row| row.is_frozen).unwrap();
    assert!((6.0..7.0).contains(&from_s), "{from_s}");
    assert!((8.7..9.3).contains(&to_s), "{to_s}");
    assert_eq!(span(&rows, |row| row.is_contradicted), None);
}

/// A cylinder at its stop carries any force.
#[test]
fn a_cylinder_at_its_stop_contradicts_nothing() {
    let wrong = |_: f64, force: f64| force + WRONG_BY_N;
    let rows = watched(&machine("320.0", true), 0.0, 8.0, wrong);
    assert_eq!(span(&rows, |row| row.is_contradicted), None);
    let rows = watched(&machine("320.0", false), 0.0, 8.0, wrong);
    assert!(span(&rows, |row| row.is_contradicted).is_some());
}

/// Where the machine file says so, an arm may lie on its rest: its cylinder then carries less than without it, or presses it down.
#[test]
fn a_cylinder_whose_arm_may_lie_on_its_rest_contradicts_nothing_by_carrying_less() {
    let is_contradicted = |range: &str, factor: f64| {
        let rests = format!("rests_within = {range}\n");
        let machine = with_linkage(&rests, "320.0", str::to_owned);
        let rows = watched(&machine, 0.0, 8.0, |_, force| factor * force);
        span(&rows, |row| row.is_contradicted).is_some()
    };
    // the boom is at -1.488 rad
    let there = "[-1.6, -1.4]";
    assert!(!is_contradicted(there, 0.0));
    assert!(!is_contradicted(there, -10.0));
    assert!(is_contradicted("[-1.4, -1.2]", -10.0));
    assert!(is_contradicted(there, 10.0));
}

/// A force that tells the mass of a payload cannot be checked against it.
#[test]
fn a_force_that_weighs_is_not_watched() {
    assert!(ForceWatch::new(&machine("\"estimate\"", false)).is_none());
}

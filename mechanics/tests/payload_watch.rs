//! Payloads that are weighed row by row, by the forces of a machine whose payload is known.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::studies::payload_watch::PayloadWatch;

use crate::support::swinging_boom::{FRICTION_SHARE, swinging, with_load};

/// Returns a machine that weighs the load of its lift cylinder.
fn scale() -> Machine {
    let mut machine = with_load("\"estimate\"", str::to_owned);
    machine.weigh_payloads_by_row();
    machine
}

/// Result of the watch for a row.
struct Known {
    time_s: f64,
    /// Mass and standard deviation (kg).
    mass: Option<[f64; 2]>,
}

/// Weighs a mass over time (kg by s) while the boom swings; `friction` is the friction of the cylinder over time, by the
/// direction of its rod, as a share of the force. A mass of `None` is a missing force.
fn weigh(
    swing: f64,
    seconds: f64,
    mass: impl Fn(f64) -> Option<f64>,
    friction: impl Fn(f64) -> f64,
) -> Vec<Known> {
    let machine = scale();
    let mut watch = PayloadWatch::new(&machine);
    let share = |time_s: f64| mass(time_s).unwrap_or(0.0);
    let rows = swinging(&machine, swing, seconds, share, friction);
    let rows = rows.map(|(time_s, mut estimate, force)| {
        estimate.state.payload_share[0] = f64::NAN;
        estimate.lift_forces = vec![mass(time_s).map_or(f64::NAN, |_| force)];
        watch.row(&machine, &mut estimate);
        let mass = estimate.state.payload_share[0];
        assert_eq!(
            mass.is_nan(),
            estimate.reasons.has(Reason::ToolWrenchGap),
            "{time_s}"
        );
        let sigma = estimate.state.noise.payload_mass.sqrt();
        let mass = mass.is_finite().then_some([mass, sigma]);
        Known { time_s, mass }
    });
    rows.collect()
}

fn no_friction(_: f64) -> f64 {
    0.0
}

/// Asserts that the mass is unknown throughout between these times (s).
fn assert_unknown(rows: &[Known], from_s: f64, to_s: f64) {
    let rows = rows
        .iter()
        .filter(|row| (from_s..to_s).contains(&row.time_s));
    assert!(
        rows.fold(0, |rows, row| {
            assert!(row.mass.is_none(), "{} {:?}", row.time_s, row.mass);
            rows + 1
        }) > 0
    );
}

/// Asserts that the mass is known between these times (s), within two and a half standard deviations, of at most 80 kg.
fn assert_known(rows: &[Known], from_s: f64, to_s: f64, truth: f64) {
    let rows = rows
        .iter()
        .filter(|row| (from_s..to_s).contains(&row.time_s));
    assert!(
        rows.fold(0, |rows, row| {
            let [mass, sigma] = row
                .mass
                .unwrap_or_else(|| panic!("unknown at {}", row.time_s));
            assert!(
                (mass - truth).abs() < 2.5 * sigma && sigma < 80.0,
                "{} {mass} {sigma}",
                row.time_s
            );
            rows + 1
        }) > 0
    );
}

#[test]
fn a_load_that_is_picked_up_or_dropped_is_unknown_until_it_is_weighed_anew() {
    let mass = |time_s: f64| {
        Some(if (4.0..10.0).contains(&time_s) {
            600.0
        } else {
            0.0
        })
    };
    let rows = weigh(0.1, 16.0, mass, |rate| 0.5 * FRICTION_SHARE * rate.signum());
    assert_unknown(&rows, 0.0, 0.75);
    assert_known(&rows, 1.5, 3.9, 0.0);
    // five samples, a fifth of a second apart, the first of them at most that late
    assert_unknown(&rows, 4.2, 4.75);
    assert_known(&rows, 5.2, 9.9, 600.0);
    assert_unknown(&rows, 10.2, 10.75);
    assert_known(&rows, 11.2, 16.0, 0.0);
}

#[test]
fn a_load_that_grows_slowly_is_followed() {
    let mass = |time_s: f64| Some(60.0 * (time_s - 4.0).clamp(0.0, 5.0));
    let rows = weigh(0.1, 24.0, mass, no_friction);
    assert_known(&rows, 1.5, 4.0, 0.0);
    assert_known(&rows, 12.0, 24.0, 300.0);
}

#[test]
fn friction_of_a_rod_at_rest_is_in_the_band_of_the_mass() {
    for sign in [-1.0, 1.0] {
        let rows = weigh(0.0, 12.0, |_| Some(320.0), |_| sign * FRICTION_SHARE);
        let [mass, sigma] = rows[rows.len() - 1].mass.unwrap();
        let off = (mass - 320.0).abs();
        // as much as its stated standard deviation, however long it is averaged
        assert!((0.5 * sigma..1.1 * sigma).contains(&off), "{mass} {sigma}");
    }
}

#[test]
fn without_its_force_the_mass_is_unknown_at_once() {
    let mass = |time_s: f64| (!(5.0..5.5).contains(&time_s)).then_some(320.0);
    let rows = weigh(0.1, 10.0, mass, no_friction);
    assert_known(&rows, 1.5, 5.0, 320.0);
    assert_unknown(&rows, 5.0, 6.25);
    assert_known(&rows, 7.0, 10.0, 320.0);
}

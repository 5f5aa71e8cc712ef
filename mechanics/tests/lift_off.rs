//! The forecast of lift-off: which wheel, when, and when it says nothing.

use nalgebra::{Matrix3, Vector3};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::verdict::{LiftOff, LiftOffForecast};

use crate::support::edited;

const STEP_NS: i64 = 10_000_000;
const STEP_S: f64 = 0.01;

/// A forecast that is fed shares of the static loads.
struct Fed {
    machine: Machine,
    forecast: LiftOffForecast,
}

impl Fed {
    fn new() -> Self {
        let mut machine = edited("rigid", |file| file).unwrap();
        machine.set_reference_loads().unwrap();
        let forecast = LiftOffForecast::new(&machine);
        Self { machine, forecast }
    }

    fn row(&mut self, time_ns: i64, shares: [f64; 4]) -> Option<LiftOff> {
        let loads = shares.iter().zip(&self.machine.reference().static_load);
        let otf: Vec<f64> = loads.map(|(share, load)| share * load).collect();
        self.forecast.row(&self.machine, time_ns, &otf)
    }

    /// The last of `rows` rows, with the shares of each at its time (s).
    fn rows(&mut self, rows: i64, shares: impl Fn(f64) -> [f64; 4]) -> Option<LiftOff> {
        let mut last = None;
        for row in 0..rows {
            last = self.row(row * STEP_NS, shares(row as f64 * STEP_S));
        }
        last
    }
}

/// Wheel 0 falls from a share at a rate (1/s); the others stand.
fn falls(from: f64, rate: f64) -> impl Fn(f64) -> [f64; 4] {
    move |t| [from - rate * t, 1.0, 1.0, 1.0]
}

#[test]
fn a_steady_fall_is_told_within_five_seconds() {
    // after 2 s at 0.4/s
    let in_s = |from: f64| Fed::new().rows(201, falls(from, 0.4));
    let found = in_s(2.6).unwrap();
    assert_eq!(found.wheel, 0);
    assert!((found.in_s - 4.5).abs() < 0.05, "{found:?}");
    assert!(in_s(2.72).is_some());
    assert_eq!(in_s(2.88), None);
}

#[test]
fn loads_that_stand_or_rise_are_no_forecast() {
    assert_eq!(Fed::new().rows(300, |_| [0.3; 4]), None);
    assert_eq!(Fed::new().rows(300, falls(0.1, -0.4)), None);
}

#[test]
fn a_wheel_that_has_lifted_lifts_now() {
    for share in [0.0, -0.2] {
        let now = Some(LiftOff {
            wheel: 2,
            in_s: 0.0,
        });
        assert_eq!(Fed::new().row(0, [1.0, 1.0, share, 1.0]), now);
        // also while its load comes back
        let comes_back = |t: f64| [1.0, 1.0, share - 0.5 + 0.1 * t, 1.0];
        assert_eq!(Fed::new().rows(200, comes_back), now);
    }
}

#[test]
fn of_several_wheels_the_first_to_lift_is_told() {
    let two = |first: f64, second: f64| {
        let shares = move |t: f64| [first - 0.4 * t, 1.0, second - 0.4 * t, 1.0];
        Fed::new().rows(101, shares).unwrap()
    };
    assert_eq!(two(1.4, 1.2).wheel, 2);
    assert_eq!(two(1.2, 1.4).wheel, 0);
    let both = [-0.1, 1.0, -0.2, 1.0];
    let found = Fed::new().row(0, both);
    assert_eq!(found.map(|found| found.wheel), Some(0));
}

#[test]
fn a_gap_longer_than_that_of_the_estimator_begins_anew() {
    // so fast that the doubt that grows in a gap hides nothing
    let after = |gap_s: f64| {
        let mut fed = Fed::new();
        fed.rows(101, falls(30.0, 10.0)).unwrap();
        let last = 100 * STEP_NS;
        let time_ns = last + (gap_s * 1e9) as i64;
        fed.row(time_ns, falls(30.0, 10.0)(time_ns as f64 * 1e-9))
    };
    let longest = edited("rigid", |file| file).unwrap().estimator().max_gap;
    assert!(after(0.9 * longest).is_some());
    assert_eq!(after(1.1 * longest), None);
}

#[test]
fn a_row_that_is_not_later_says_nothing() {
    let mut fed = Fed::new();
    fed.rows(101, falls(1.2, 0.4)).unwrap();
    let last = 100 * STEP_NS;
    assert_eq!(fed.row(last, falls(1.2, 0.4)(1.0)), None);
    assert!(fed.row(last + STEP_NS, falls(1.2, 0.4)(1.01)).is_some());
}

/// Standard deviation of the rate in the steady state (1/s): the Riccati equation of a value, its rate and its second
/// derivative, of which only the value is measured, iterated.
fn steady_rate_sigma(noise: f64, process: f64) -> f64 {
    let t = STEP_S;
    let step = Matrix3::new(1.0, t, 0.5 * t * t, 0.0, 1.0, t, 0.0, 0.0, 1.0);
    let (t3, t4, t5) = (t.powi(3), t.powi(4), t.powi(5));
    let grown = Matrix3::new(
        t5 / 20.0,
        t4 / 8.0,
        t3 / 6.0,
        t4 / 8.0,
        t3 / 3.0,
        t * t / 2.0,
        t3 / 6.0,
        t * t / 2.0,
        t,
    ) * (process * process);
    let mut covariance = Matrix3::identity();
    for _ in 0..2000 {
        let before = step * covariance * step.transpose() + grown;
        let gain: Vector3<f64> = before.column(0) / (before[(0, 0)] + noise * noise);
        covariance = before - gain * before.row(0);
    }
    covariance[(1, 1)].sqrt()
}

#[test]
fn val_rates_within_three_standard_deviations_are_noise() {
    let sure = 3.0 * steady_rate_sigma(0.003, 10.0);
    // in 4 s they end at a share from which even the slower fall reaches zero within five seconds
    let told = |rate: f64| Fed::new().rows(401, falls(3.0 * rate + 4.0 * rate, rate));
    assert_eq!(told(0.98 * sure), None, "{sure}");
    let found = told(1.02 * sure).unwrap();
    assert!((found.in_s - 3.0).abs() < 0.05, "{found:?}");
}

/// Returns the time at which a fall is reported (s), in loads with noise that ends after 3 s; rows of this length (s).
fn told_from(noise: f64, step_s: f64, fall: impl Fn(f64) -> [f64; 4]) -> f64 {
    let mut fed = Fed::new();
    let mut told_from = f64::NAN;
    for row in 0..(10.0 / step_s) as i64 {
        let t = row as f64 * step_s;
        let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
        let mut shares = fall(t);
        shares[0] += if t < 3.0 { sign * noise } else { 0.0 };
        match fed.row((t * 1e9).round() as i64, shares) {
            Some(_) => told_from = told_from.min(t),
            // nothing is told of more than five seconds ahead
            None if t > 3.3 => told_from = f64::NAN,
            None => {}
        }
    }
    told_from
}

#[test]
fn noise_beyond_what_is_stated_takes_as_much_more_of_a_rate() {
    // the mean square of the deviations falls by 1 / (1 + step / 1 s) in each step, however often rows come
    let later_s = |step_s: f64, more: f64| 2.0 * more.ln() * step_s / (1.0 + step_s).ln();
    for step_s in [0.01, 0.02] {
        let fall = || falls(3.9, 0.48);
        assert!(told_from(0.006, step_s, fall()) < 3.4);
        let found_s = told_from(0.03, step_s, fall()) - told_from(0.02, step_s, fall());
        assert!((found_s - later_s(step_s, 1.5)).abs() < 0.04, "{found_s}");
    }
    // a fast fall, since seldom rows leave much doubt in a rate
    let fall = || falls(21.0, 2.0);
    let found_s = told_from(2.0, 0.05, fall()) - told_from(0.3, 0.05, fall());
    assert!(
        (found_s - later_s(0.05, 2.0 / 0.3)).abs() < 0.09,
        "{found_s}"
    );
}

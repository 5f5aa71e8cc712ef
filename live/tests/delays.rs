//! Data are late whatever their stamps say, from the first sample on; and a session without real time is not safe once its
//! samples stop. The monitor is the program's own loop in simulated time.

use std::time::Duration;

use tipwatch_live::wire::topics::{Kind, Wire, WireSample, WireVerdict};
use tipwatch_mechanics::verdict::{InputFault, Level};

use crate::support::World;
use crate::support::feed::{Feed, Time};
use crate::support::steered::Steered;

const MACHINE: &str = "forwarder6";
const MS: i64 = 1_000_000;

fn feed(world: &World) -> Feed<Steered> {
    let mut feed = Feed::new(&world.join(), MACHINE, Steered::monitor(world, MACHINE));
    feed.wait_for_monitor();
    feed
}

/// Sends samples whose stamps are changed, for so many seconds; the verdicts published meanwhile.
fn sent(
    feed: &mut Feed<Steered>,
    seconds: f64,
    change: impl Fn(&mut WireSample, i64),
) -> Vec<WireVerdict> {
    let from_ns = feed.time.now_ns();
    let mut verdicts = Vec::new();
    while feed.time.now_ns() - from_ns < (seconds * 1e9) as i64 {
        feed.wait();
        let since_ns = feed.time.now_ns() - from_ns;
        feed.inject_sealed(|sample| change(sample, since_ns));
        while let Some(verdict) = feed.verdicts.receive(|v| *v).unwrap() {
            verdicts.push(verdict);
        }
    }
    verdicts
}

fn shift(sample: &mut WireSample, by_ns: i64) {
    sample.time_ns += by_ns;
    sample.seal(sample.head());
}

/// Returns the time of the first level that is not safe (s after `from_ns`), and asserts that no later level is safe.
fn left_safe_after_s(verdicts: &[WireVerdict], from_ns: i64) -> f64 {
    let is_bad = |verdict: &&WireVerdict| verdict.verdict().level >= Level::Warning;
    let first = verdicts.iter().find(is_bad).expect("not safe");
    let after = verdicts.iter().filter(|v| v.sequence > first.sequence);
    assert!(after.clone().count() > 0);
    assert!(after.clone().all(|v| is_bad(&v)), "safe again");
    (first.published_ns - from_ns) as f64 * 1e-9
}

// requirement: TW-FAULT-02
#[test]
fn data_that_are_late_from_the_start_are_never_safe() {
    for late_ns in [300 * MS, 5000 * MS] {
        let world = World::new("delayed");
        let mut feed = feed(&world);
        let verdicts = sent(&mut feed, 3.0, |sample, _| shift(sample, -late_ns));
        let is_safe = |v: &WireVerdict| (1..=2).contains(&v.level);
        assert!(!verdicts.iter().any(is_safe));
        let is_told = |v: &WireVerdict| {
            v.conditions().faults.has(InputFault::Stale) && v.level == Level::Fault as u32
        };
        assert!(verdicts.iter().any(is_told));
    }
}

// requirement: TW-FAULT-02
#[test]
fn one_late_sensor_is_never_safe() {
    let world = World::new("onelate");
    let mut feed = feed(&world);
    let verdicts = sent(&mut feed, 3.0, |sample, _| {
        if sample.kind == Kind::Odometry as u32 {
            shift(sample, -400 * MS);
        }
    });
    let from_ns = verdicts[0].published_ns;
    let rest = verdicts
        .iter()
        .filter(|v| v.published_ns > from_ns + 200 * MS);
    assert!(rest.clone().count() > 100);
    assert!(rest.into_iter().all(|v| !(1..=2).contains(&v.level)));
}

// requirement: TW-FAULT-06
#[test]
fn stamps_at_another_speed_are_found() {
    // half speed is 100 ms late after 0.2 s, one per cent drifts by 50 ms in 5 s
    for (speed, within_s) in [
        (0.5, 0.25),
        (1.5, 0.25),
        (0.9, 1.1),
        (0.99, 7.1),
        (1.01, 7.1),
    ] {
        let world = World::new("speed");
        let mut feed = feed(&world);
        feed.run_in();
        let from_ns = feed.time.now_ns();
        let verdicts = sent(&mut feed, 9.0, |sample, since_ns| {
            shift(sample, (since_ns as f64 * (speed - 1.0)) as i64);
        });
        let found_s = left_safe_after_s(&verdicts, from_ns);
        println!("stamps at {speed} of their speed: found after {found_s:.3} s");
        assert!(found_s <= within_s, "{speed}: {found_s}");
    }
}

/// Two sound clocks drift apart: stamps that lead by less than is borne, and run fast as crystals do.
// requirement: TW-FAULT-05
#[test]
fn stamps_of_a_clock_that_drifts_as_crystals_do_are_no_fault() {
    let world = World::new("drift");
    let mut feed = Feed::with(
        &world.join(),
        MACHINE,
        Steered::monitor(&world, MACHINE),
        |session| session.clock.stamp_ns -= 48 * MS,
    );
    feed.wait_for_monitor();
    feed.run_in();
    let verdicts = sent(&mut feed, 40.0, |sample, since_ns| {
        shift(sample, since_ns / 10_000);
    });
    // 48 ms, and 4 ms more
    let fault = verdicts.iter().find(|v| {
        let conditions = v.conditions();
        conditions.faults.has(InputFault::ClockJump)
            || conditions.cautions.has(InputFault::ClockJump)
    });
    assert!(fault.is_none(), "{:?}", fault.map(WireVerdict::conditions));
}

#[test]
fn delays_that_vary_stay_safe() {
    let world = World::new("jitter");
    let mut feed = feed(&world);
    feed.run_in();
    let verdicts = sent(&mut feed, 3.0, |sample, _| {
        // one delay for all, in steps that keep each sensor's stamps in order
        shift(sample, -60 * MS);
    });
    let settled = verdicts.iter().skip(verdicts.len() / 2);
    assert!(
        settled
            .into_iter()
            .all(|v| !v.conditions().faults.has(InputFault::Stale))
    );
}

// requirement: TW-FAULT-02
#[test]
fn odometry_that_falls_silent_is_a_fault() {
    let world = World::new("odometry");
    let mut feed = feed(&world);
    feed.run_in();
    let from_ns = feed.time.now_ns();
    let mut told = None;
    while told.is_none() {
        assert!(feed.time.now_ns() - from_ns < 6_000 * MS, "not told");
        if feed.peek().kind == Kind::Odometry as u32 {
            feed.leave_out();
        } else {
            feed.send(1);
        }
        told = feed.find(|v| v.conditions().faults.has(InputFault::Stale));
    }
}

// requirement: TW-FAULT-02
#[test]
fn untimed_session_is_not_safe_once_its_samples_stop() {
    let world = World::new("untimed");
    let mut time = Steered::monitor(&world, MACHINE);
    time.stop_monitor();
    time.untimed = tipwatch_live::wire::opening::Untimed::Allowed;
    time.start_monitor();
    let mut feed = Feed::with(&world.join(), MACHINE, time, |session| session.pace = 0.0);
    feed.wait_for_monitor();
    feed.run_in();
    let from_ns = feed.time.now_ns();
    feed.time.pass(Duration::from_secs(3));
    let mut late = Vec::new();
    while let Some(verdict) = feed.verdicts.receive(|v| *v).unwrap() {
        if verdict.published_ns - from_ns > 1_030 * MS {
            late.push(verdict);
        }
    }
    assert!(!late.is_empty());
    assert!(late.iter().all(|v| v.level == Level::Fault as u32));
}

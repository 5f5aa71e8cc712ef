//! Every fault of the input that can occur here, injected at the boundary of the shared memory, with the
//! time until the monitor's verdict reports of it.
//!
//! The monitor is the program's own loop in simulated time: times of detection do
//! not depend on how busy the computer is. Times are printed (`cargo test -- --nocapture`).

use std::time::Duration;

use tipwatch_live::safety_limits::HEARTBEAT_NS;
use tipwatch_live::wire::topics::{Kind, Wire, WireSample, WireVerdict};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Conditions, InputFault, Level};

use crate::support::World;
use crate::support::feed::{Feed, RealTime, Time, reports};
use crate::support::steered::Steered;

/// A fault between rows is reported at the latest with the next periodic verdict.
const HEARTBEAT: Duration = Duration::from_nanos(HEARTBEAT_NS as u64);

struct Bench {
    feed: Feed<Steered>,
    world: World,
}

impl Bench {
    /// A monitor that has been following a faultless session, and calls the machine safe.
    fn new(test: &str) -> Self {
        let mut bench = Self::waiting(test);
        bench.feed.run_in();
        bench
    }

    /// A monitor that has the session, and no sample.
    fn waiting(test: &str) -> Self {
        Self::of(test, "forwarder6")
    }

    fn of(test: &str, name: &str) -> Self {
        let world = World::new(test);
        let time = Steered::monitor(&world, name);
        let mut feed = Feed::new(&world.join(), name, time);
        feed.wait_for_monitor();
        Self { feed, world }
    }

    fn now_ns(&self) -> i64 {
        self.feed.time.now_ns()
    }

    /// Asserts that the fault is reported within this time.
    fn reported_within(&mut self, fault: InputFault, limit: Duration, from_ns: i64) {
        let verdict = self
            .feed
            .wait_for(limit, reports(fault))
            .unwrap_or_else(|| panic!("{} was not reported", fault.name()));
        assert_reported(fault, limit, verdict.published_ns - from_ns);
    }

    /// Asserts that this fault was not reported so far.
    fn is_quiet_about(&self, fault: InputFault) {
        assert!(self.feed.find(reports(fault)).is_none(), "{}", fault.name());
    }

    /// After the fault everything is well again, after a second and ten good rows.
    fn recovers(&mut self) {
        self.feed.find(|_| false);
        self.feed.run_in();
    }
}

fn assert_reported(fault: InputFault, limit: Duration, took_ns: i64) {
    println!(
        "{:16} reported after {:8.2} ms",
        fault.name(),
        took_ns as f64 * 1e-6
    );
    assert!(took_ns <= limit.as_nanos() as i64, "{}", fault.name());
}

// requirement: TW-FAULT-01
#[test]
fn missing_sensor_is_a_fault_after_start_up() {
    let mut bench = Bench::waiting("never");
    let from_ns = bench.now_ns();
    // 2 s after the session has begun, by the next look
    let limit = Duration::from_millis(2001);
    bench.reported_within(InputFault::NeverReceived, limit, from_ns);
}

// requirement: TW-FAULT-02
#[test]
fn silence_of_all_sensors_is_stale() {
    let mut bench = Bench::new("stale");
    let from_ns = bench.now_ns();
    // ten periods of the sensor, here 80 to 100 ms
    bench.reported_within(InputFault::Stale, Duration::from_millis(100), from_ns);
    bench.recovers();
}

// requirement: TW-FAULT-02
#[test]
fn silence_of_one_sensor_is_stale() {
    let mut bench = Bench::new("imu");
    let from_ns = bench.now_ns();
    for _ in 0..60 {
        let is_imu = bench.feed.peek().kind == Kind::Imu as u32;
        if is_imu {
            bench.feed.leave_out();
        } else {
            bench.feed.send(1);
        }
    }
    bench.reported_within(InputFault::Stale, Duration::from_millis(100), from_ns);
}

// requirement: TW-VERDICT-27, TW-FAULT-02
#[test]
fn a_fall_that_is_no_longer_measured_is_a_fault() {
    for is_imu_alone in [true, false] {
        let mut bench = Bench::of(&format!("fall_{is_imu_alone}"), "tip_over");
        let tips = |v: &WireVerdict| v.row_reasons().has(Reason::Tipping);
        while bench.feed.find(tips).is_none() {
            bench.feed.send(1);
        }
        // by the loads; 1.3 s later it rotates for certain
        bench.feed.send(260);
        let is_danger = |v: &WireVerdict| v.verdict().level == Level::Danger;
        assert!(bench.feed.find(is_danger).is_some());
        while bench.feed.find(|_| true).is_some() {}
        let from_ns = bench.now_ns();
        let is_fault = |v: &WireVerdict| v.verdict().level == Level::Fault;
        for _ in 0..40 {
            if is_imu_alone && bench.feed.peek().kind != Kind::Imu as u32 {
                bench.feed.send(1);
            } else {
                bench.feed.leave_out();
            }
        }
        let fault = bench.feed.wait_for(Duration::from_millis(600), is_fault);
        let verdict = fault.expect("a fault");
        assert!(verdict.published_ns - from_ns < 300_000_000);
        assert!(reports(InputFault::Stale)(&verdict));
    }
}

// requirement: TW-FAULT-03
#[test]
fn lost_samples_are_a_fault() {
    let mut bench = Bench::new("lost");
    // a few are not a fault: the estimate's own uncertainty grows
    bench.feed.next += 3;
    bench.feed.send(10);
    bench.is_quiet_about(InputFault::Lost);
    bench.feed.next += 11;
    bench.feed.wait();
    let from_ns = bench.now_ns();
    bench.feed.send(3);
    bench.reported_within(InputFault::Lost, Duration::from_millis(20), from_ns);
    bench.recovers();
}

// requirement: TW-FAULT-04
#[test]
fn repeated_samples_are_a_fault() {
    let mut bench = Bench::new("again");
    let from_ns = bench.now_ns();
    let last = bench.feed.next - 1;
    for _ in 0..3 {
        let mut sample = bench.feed.peek();
        sample.sequence = last as u64;
        sample.seal(sample.head());
        bench.feed.raw(&sample);
    }
    bench.reported_within(InputFault::Disordered, Duration::from_millis(20), from_ns);
}

// requirement: TW-FAULT-04
#[test]
fn clock_set_back_is_a_fault() {
    let mut bench = Bench::new("back");
    let from_ns = bench.now_ns();
    for _ in 0..12 {
        bench
            .feed
            .inject_sealed(|sample| sample.time_ns -= 200_000_000);
    }
    // the third sample of a sensor
    bench.reported_within(InputFault::Disordered, Duration::from_millis(40), from_ns);
}

// requirement: TW-FAULT-05
#[test]
fn clock_jump_is_a_fault() {
    let mut bench = Bench::new("jump");
    let from_ns = bench.now_ns();
    for _ in 0..12 {
        bench
            .feed
            .inject_sealed(|sample| sample.time_ns += 3_600_000_000_000);
    }
    bench.reported_within(InputFault::ClockJump, Duration::from_millis(40), from_ns);
}

// requirement: TW-FAULT-05
#[test]
fn message_from_the_future_is_a_fault() {
    let mut bench = Bench::new("future");
    let from_ns = bench.now_ns();
    for _ in 0..12 {
        bench
            .feed
            .inject_sealed(|sample| sample.published_ns += 1_000_000_000);
    }
    bench.reported_within(InputFault::ClockJump, Duration::from_millis(40), from_ns);
}

// requirement: TW-FAULT-07
#[test]
fn non_finite_values_are_a_fault() {
    for (test, value) in [("nan", f64::NAN), ("inf", f64::INFINITY)] {
        let mut bench = Bench::new(test);
        // one is left out
        bench.feed.inject_sealed(|sample| sample.values[0] = value);
        bench.feed.send(6);
        bench.is_quiet_about(InputFault::NotFinite);
        let from_ns = bench.now_ns();
        for _ in 0..12 {
            bench.feed.inject_sealed(|sample| sample.values[0] = value);
        }
        bench.reported_within(InputFault::NotFinite, Duration::from_millis(40), from_ns);
        bench.recovers();
    }
}

/// Changes a sample of a kind: the sample, which of them it is, and the place of the slewing joint.
type Change = fn(&mut WireSample, usize, usize);

/// Changes every sample of a kind until this fault is reported.
fn implausible(kind: Kind, fault: InputFault, limit: Duration, change: Change) -> Bench {
    let mut bench = Bench::new(fault.name());
    let from_ns = bench.now_ns();
    let (mut count, slew) = (0, bench.feed.place_of("slew"));
    while bench.now_ns() - from_ns <= limit.as_nanos() as i64 {
        if bench.feed.peek().kind != kind as u32 {
            bench.feed.send(1);
            continue;
        }
        count += 1;
        bench
            .feed
            .inject_sealed(|sample| change(sample, count, slew));
        if let Some(verdict) = bench.feed.find(reports_or_cautions(fault)) {
            assert_reported(fault, limit, verdict.published_ns - from_ns);
            return bench;
        }
    }
    panic!("{} was not reported", fault.name());
}

/// Returns a predicate: whether a verdict reports this problem as a fault or as a caution.
fn reports_or_cautions(fault: InputFault) -> impl Fn(&WireVerdict) -> bool {
    move |verdict| {
        let conditions = verdict.conditions();
        let is_fault = conditions.faults.has(fault) && verdict.level == Level::Fault as u32;
        let is_caution =
            conditions.cautions.has(fault) && verdict.verdict().level >= Level::Warning;
        is_fault || is_caution
    }
}

// requirement: TW-FAULT-08
#[test]
fn impossible_specific_force_is_a_fault() {
    let within = Duration::from_millis(40);
    let mut bench = implausible(Kind::Imu, InputFault::OutOfRange, within, |imu, _, _| {
        imu.values[2] = 60.0;
    });
    bench.recovers();
}

// requirement: TW-VERDICT-10
#[test]
fn single_bad_sample_is_left_out() {
    let mut bench = Bench::new("spike");
    while bench.feed.peek().kind != Kind::Imu as u32 {
        bench.feed.send(1);
    }
    bench.feed.inject_sealed(|sample| sample.values[2] = 1e9);
    bench.feed.send(12);
    let is_quiet = |v: &WireVerdict| v.conditions() == Conditions::default();
    let is_fault = |v: &WireVerdict| v.verdict().level >= Level::Notice || !is_quiet(v);
    assert!(bench.feed.find(is_fault).is_none());
    bench.recovers();
}

// requirement: TW-FAULT-09
#[test]
fn jumping_joint_is_a_fault() {
    let within = Duration::from_millis(60);
    implausible(
        Kind::Joints,
        InputFault::ImpossibleRate,
        within,
        |joints, count, slew| {
            joints.values[slew] += 2.0 * count as f64;
        },
    );
}

// requirement: TW-FAULT-10
#[test]
fn frozen_imu_is_a_fault() {
    let within = Duration::from_millis(1500);
    implausible(Kind::Imu, InputFault::Frozen, within, |imu, _, _| {
        imu.values[..10].copy_from_slice(&[0.01, 0.02, 9.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    });
}

// requirement: TW-FAULT-12
#[test]
fn attitude_that_is_no_unit_quaternion_is_a_fault() {
    let within = Duration::from_millis(40);
    implausible(Kind::Imu, InputFault::NotUnit, within, |imu, _, _| {
        imu.values[6..10].fill(2.0);
    });
}

// requirement: TW-FAULT-11
#[test]
fn joint_beyond_its_limit_is_a_fault() {
    let within = Duration::from_secs(2);
    implausible(
        Kind::Joints,
        InputFault::JointLimit,
        within,
        |joints, count, slew| {
            let (time_s, acceleration) = (count as f64 * 0.01, 20.0);
            joints.values[slew] += 0.5 * acceleration * time_s * time_s;
            joints.values[joints.value_count as usize / 2 + slew] += acceleration * time_s;
        },
    );
}

// requirement: TW-FAULT-13
#[test]
fn velocity_must_be_the_derivative_of_position() {
    let within = Duration::from_secs(1);
    implausible(
        Kind::Joints,
        InputFault::Disagreement,
        within,
        |joints, _, slew| {
            joints.values[joints.value_count as usize / 2 + slew] += 1.0;
        },
    );
}

// requirement: TW-FAULT-13
#[test]
fn attitude_must_agree_with_specific_force() {
    let within = Duration::from_millis(10_500);
    implausible(Kind::Imu, InputFault::Disagreement, within, |imu, _, _| {
        // axes down: half a turn about the way ahead
        let [x, y, z, w] = [6, 7, 8, 9].map(|at| imu.values[at]);
        imu.values[6..10].copy_from_slice(&[w, z, -y, -x]);
    });
}

// requirement: TW-FAULT-15
#[test]
fn torn_and_empty_messages_are_a_fault() {
    for test in ["torn", "zero", "kind", "length"] {
        let mut bench = Bench::new(test);
        let from_ns = bench.now_ns();
        for _ in 0..3 {
            bench.feed.inject(|sample| match test {
                "torn" => sample.values[3] += 1e-9,
                "zero" => *sample = WireSample::blank(),
                "kind" => {
                    sample.kind = 99;
                    sample.seal(sample.head());
                }
                _ => {
                    sample.value_count = 4000;
                    sample.seal(sample.head());
                }
            });
        }
        bench.reported_within(InputFault::Torn, Duration::from_millis(20), from_ns);
        bench.recovers();
    }
}

// requirement: TW-FAULT-16, TW-FAULT-17
#[test]
fn foreign_source_or_machine_is_a_fault() {
    let mut bench = Bench::new("source");
    let from_ns = bench.now_ns();
    for _ in 0..3 {
        bench.feed.inject_sealed(|sample| sample.source ^= 1);
    }
    bench.reported_within(InputFault::WrongSource, Duration::from_millis(20), from_ns);
    bench.recovers();
    let from_ns = bench.now_ns();
    bench.feed.inject_sealed(|sample| sample.machine_hash ^= 1);
    bench.reported_within(InputFault::WrongMachine, Duration::from_millis(20), from_ns);
}

// requirement: TW-FAULT-16
#[test]
fn second_producer_is_rejected() {
    let world = World::new("second");
    let node = world.join();
    let _first = Feed::new(&node, "forwarder6", RealTime);
    let replay = world.replay("forwarder6", &["--speed", "max"]).end();
    assert_eq!(replay.status.code(), Some(1));
    assert!(replay.err.contains("cannot write"), "{}", replay.err);
}

// requirement: TW-FAULT-20
#[test]
fn missing_producer_is_a_fault() {
    let bench = Bench::new("gone");
    let from_ns = bench.now_ns();
    let Bench { feed, world } = bench;
    let Feed {
        mut time,
        verdicts,
        producer,
        ..
    } = feed;
    drop(producer);
    time.pass(HEARTBEAT);
    let told = std::iter::from_fn(|| verdicts.receive(|v| *v).unwrap())
        .find(reports(InputFault::ProducerGone))
        .expect("reported");
    assert_reported(
        InputFault::ProducerGone,
        HEARTBEAT,
        told.published_ns - from_ns,
    );
    // and the next one is followed
    Feed::new(&world.join(), "forwarder6", time).run_in();
}

// requirement: TW-FAULT-21
#[test]
fn late_verdicts_are_a_fault() {
    let mut bench = Bench::new("late");
    // a row is published two looks after its sample: the limit is 20 ms
    bench.feed.time.slow_down(Duration::from_millis(9));
    bench.feed.send(20);
    bench.is_quiet_about(InputFault::VerdictLate);
    bench.feed.time.slow_down(Duration::from_millis(11));
    let from_ns = bench.now_ns();
    bench.feed.send(20);
    bench.feed.time.slow_down(Duration::ZERO);
    // three rows, and what comes between them
    let limit = Duration::from_millis(500);
    bench.reported_within(InputFault::VerdictLate, limit, from_ns);
    bench.recovers();
}

// requirement: TW-FAULT-23
#[test]
fn verdict_expires_when_the_monitor_hangs() {
    let mut bench = Bench::new("until");
    bench.feed.send(5);
    let verdict = bench.feed.find(|_| true).unwrap();
    assert_eq!(verdict.valid_until_ns - verdict.published_ns, 100_000_000);
    // a monitor that hangs gives no verdict: what it gave runs out
    bench.feed.time.hang = true;
    bench.feed.send(60);
    assert!(verdict.valid_until_ns < bench.now_ns());
    let from_ns = bench.now_ns();
    bench.feed.time.hang = false;
    // what it gives now comes too late
    bench.reported_within(InputFault::Stale, HEARTBEAT, from_ns);
    bench.recovers();
}

// requirement: TW-VERDICT-18
#[test]
fn alarm_persists_until_acknowledged() {
    let mut bench = Bench::of("ack", "tiny_lift");
    let latched = |level: Level| move |v: &WireVerdict| v.latched_level == level as u32;
    // the wheel is in the air at 1 s
    bench.feed.send(200);
    assert!(bench.feed.find(latched(Level::Danger)).is_some());
    bench.feed.send(1000);
    let is_released = |v: &WireVerdict| v.verdict().latched_level < Level::Danger && v.rows > 10;
    assert!(bench.feed.find(is_released).is_none());
    // Where the log begins again its joints jump, which is latched, and then the wheel lifts: one acknowledgement after the
    // wheel has come down is enough.
    // An alarm that changes meanwhile is not acknowledged.
    let is_released = (0..20).any(|_| {
        let mut acknowledging = bench.world.start(&["acknowledge"]);
        while acknowledging.child.try_wait().unwrap().is_none() {
            bench.feed.send(1);
            // the program goes by real time
            std::thread::sleep(Duration::from_millis(1));
        }
        let is_acknowledged = acknowledging.end().status.success();
        let is_released_now = bench.feed.find(is_released).is_some();
        bench.feed.send(150);
        is_acknowledged && (is_released_now || bench.feed.find(is_released).is_some())
    });
    assert!(is_released, "still latched");
}

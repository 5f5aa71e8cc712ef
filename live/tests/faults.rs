//! Every fault of the input that can occur here, injected at the boundary of the shared memory, with the
//! time until the monitor's verdict tells of it.
//!
//! The monitor is the program, in a process of its own. Times are printed (`cargo test -- --nocapture`);
//! that they stay below the limits stated here is checked with room for a busy computer.

use std::time::Duration;

use tipwatch_live::clock::monotonic_ns;
use tipwatch_live::topics::{Head, Kind, Wire, WireSample, WireVerdict};
use tipwatch_mechanics::verdict::{Conditions, InputFault, Level};

use crate::support::favour::{Favoured, favour};
use crate::support::feed::{Feed, tells};
use crate::support::{Process, World, data};

/// How long anything may take on a busy computer beyond its own time.
const ROOM: Duration = Duration::from_secs(15);

struct Bench {
    feed: Feed,
    monitor: Process,
    _world: World,
    _favoured: Favoured,
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
        let favoured = favour();
        let world = World::new(test);
        let monitor = world.monitor(&data("forwarder6.toml"), &["--quiet", "--stay"]);
        let mut feed = Feed::new(&world.join(), "forwarder6");
        feed.wait_for_monitor();
        Self {
            feed,
            monitor,
            _world: world,
            _favoured: favoured,
        }
    }

    /// The time from now until the fault is told, which must be no longer than this.
    fn told_within(&self, fault: InputFault, limit: Duration, from_ns: i64) {
        let verdict = self
            .feed
            .wait_for(limit + ROOM, tells(fault))
            .unwrap_or_else(|| panic!("{} was not told", fault.name()));
        let took_ms = (verdict.published_ns - from_ns) as f64 * 1e-6;
        println!("{:16} told after {took_ms:8.2} ms", fault.name());
    }

    /// Sends one message in place of the next sample.
    fn inject(&mut self, change: impl FnOnce(&mut WireSample)) {
        self.feed.wait();
        let mut sample = self.feed.peek();
        change(&mut sample);
        self.feed.raw(&sample);
        self.feed.next += 1;
    }

    /// This was not told of so far.
    fn is_quiet_about(&self, fault: InputFault) {
        assert!(self.feed.find(tells(fault)).is_none(), "{}", fault.name());
    }

    /// After the fault everything is well again, after a second and ten good rows.
    fn recovers(&mut self) {
        self.feed.find(|_| false);
        for _ in 0..15_000 {
            self.feed.send(1);
            if self.feed.find(|v| v.level == Level::Safe as u32).is_some() {
                return;
            }
        }
        panic!("never safe again");
    }
}

#[test]
fn never_received() {
    let bench = Bench::waiting("never");
    let from_ns = monotonic_ns();
    // 2 s after the session has begun
    bench.told_within(InputFault::NeverReceived, Duration::from_secs(2), from_ns);
}

#[test]
fn nothing_comes_any_more() {
    let mut bench = Bench::new("stale");
    let from_ns = monotonic_ns();
    // ten periods of the sensor, here 80 to 100 ms
    bench.told_within(InputFault::Stale, Duration::from_millis(100), from_ns);
    bench.recovers();
}

#[test]
fn one_sensor_of_several_goes_silent() {
    let mut bench = Bench::new("imu");
    let from_ns = monotonic_ns();
    for _ in 0..60 {
        let is_imu = bench.feed.peek().kind == Kind::Imu as u32;
        if is_imu {
            bench.feed.leave_out();
        } else {
            bench.feed.send(1);
        }
    }
    bench.told_within(InputFault::Stale, Duration::from_millis(100), from_ns);
}

#[test]
fn samples_are_lost() {
    let mut bench = Bench::new("lost");
    // a few are not a fault: the estimate's own uncertainty grows
    bench.feed.next += 3;
    bench.feed.send(10);
    bench.is_quiet_about(InputFault::Lost);
    bench.feed.next += 11;
    bench.feed.wait();
    let from_ns = monotonic_ns();
    bench.feed.send(3);
    bench.told_within(InputFault::Lost, Duration::from_millis(20), from_ns);
    bench.recovers();
}

#[test]
fn samples_come_again() {
    let mut bench = Bench::new("again");
    let from_ns = monotonic_ns();
    let last = bench.feed.next - 1;
    for _ in 0..3 {
        let mut sample = bench.feed.peek();
        let head = Head {
            sequence: last as u64,
            ..sample.head()
        };
        sample.seal(head);
        bench.feed.raw(&sample);
    }
    bench.told_within(InputFault::Disordered, Duration::from_millis(20), from_ns);
}

#[test]
fn a_clock_goes_back() {
    let mut bench = Bench::new("back");
    let from_ns = monotonic_ns();
    for _ in 0..12 {
        bench.inject(|sample| {
            let head = sample.head();
            let time_ns = head.time_ns - 200_000_000;
            sample.seal(Head { time_ns, ..head });
        });
    }
    // the third sample of a sensor
    bench.told_within(InputFault::Disordered, Duration::from_millis(40), from_ns);
}

#[test]
fn a_clock_jumps() {
    let mut bench = Bench::new("jump");
    let from_ns = monotonic_ns();
    for _ in 0..12 {
        bench.inject(|sample| {
            let head = sample.head();
            let time_ns = head.time_ns + 3_600_000_000_000;
            sample.seal(Head { time_ns, ..head });
        });
    }
    bench.told_within(InputFault::ClockJump, Duration::from_millis(40), from_ns);
}

#[test]
fn a_message_from_the_future() {
    let mut bench = Bench::new("future");
    let from_ns = monotonic_ns();
    for _ in 0..12 {
        bench.inject(|sample| {
            let head = sample.head();
            let published_ns = head.published_ns + 1_000_000_000;
            sample.seal(Head {
                published_ns,
                ..head
            });
        });
    }
    bench.told_within(InputFault::ClockJump, Duration::from_millis(40), from_ns);
}

#[test]
fn numbers_that_are_none() {
    for (test, value) in [("nan", f64::NAN), ("inf", f64::INFINITY)] {
        let mut bench = Bench::new(test);
        // one is left out
        bench.inject(|sample| {
            sample.values[0] = value;
            sample.seal(sample.head());
        });
        bench.feed.send(6);
        bench.is_quiet_about(InputFault::NotFinite);
        let from_ns = monotonic_ns();
        for _ in 0..12 {
            bench.inject(|sample| {
                sample.values[0] = value;
                sample.seal(sample.head());
            });
        }
        bench.told_within(InputFault::NotFinite, Duration::from_millis(40), from_ns);
        bench.recovers();
    }
}

/// Changes a sample of a kind: the sample, which of them it is, and the place of the slewing joint.
type Change = fn(&mut WireSample, usize, usize);

/// Injects into every sample of a kind until this is told.
fn implausible(kind: Kind, fault: InputFault, limit: Duration, change: Change) -> Bench {
    let mut bench = Bench::new(fault.name());
    let from_ns = monotonic_ns();
    let (mut count, slew) = (0, bench.feed.place_of("slew"));
    let until_ns = from_ns + (limit + ROOM).as_nanos() as i64;
    while monotonic_ns() < until_ns {
        if bench.feed.peek().kind != kind as u32 {
            bench.feed.send(1);
            continue;
        }
        count += 1;
        bench.inject(|sample| {
            change(sample, count, slew);
            sample.seal(sample.head());
        });
        if let Some(verdict) = bench.feed.find(tells_of(fault)) {
            let took_ms = (verdict.published_ns - from_ns) as f64 * 1e-6;
            println!("{:16} told after {took_ms:8.2} ms", fault.name());
            return bench;
        }
    }
    panic!("{} was not told", fault.name());
}

/// Whether a verdict tells of a fault, or of the same as a caution.
fn tells_of(fault: InputFault) -> impl Fn(&WireVerdict) -> bool {
    move |verdict| {
        let conditions = verdict.conditions();
        let is_fault = conditions.faults.has(fault) && verdict.level == Level::Fault as u32;
        let is_caution = conditions.cautions.has(fault) && verdict.level >= Level::Warning as u32;
        is_fault || is_caution
    }
}

#[test]
fn a_force_that_no_machine_feels() {
    let within = Duration::from_millis(40);
    let mut bench = implausible(Kind::Imu, InputFault::OutOfRange, within, |imu, _, _| {
        imu.values[2] = 60.0;
    });
    bench.recovers();
}

#[test]
fn one_wrong_sample_is_left_out() {
    let mut bench = Bench::new("spike");
    while bench.feed.peek().kind != Kind::Imu as u32 {
        bench.feed.send(1);
    }
    bench.inject(|sample| {
        sample.values[2] = 1e9;
        sample.seal(sample.head());
    });
    bench.feed.send(12);
    let is_quiet = |v: &WireVerdict| v.conditions() == Conditions::default();
    let is_fault = |v: &WireVerdict| v.level >= Level::Notice as u32 || !is_quiet(v);
    assert!(bench.feed.find(is_fault).is_none());
    bench.recovers();
}

#[test]
fn a_joint_that_jumps() {
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

#[test]
fn an_imu_that_stands_still() {
    let within = Duration::from_millis(1500);
    implausible(Kind::Imu, InputFault::Frozen, within, |imu, _, _| {
        imu.values[..10].copy_from_slice(&[0.01, 0.02, 9.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    });
}

#[test]
fn an_attitude_that_is_none() {
    let within = Duration::from_millis(40);
    implausible(Kind::Imu, InputFault::NotUnit, within, |imu, _, _| {
        imu.values[6..10].fill(2.0);
    });
}

#[test]
fn a_joint_beyond_its_stop() {
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

#[test]
fn a_rate_that_is_not_that_of_the_position() {
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

#[test]
fn torn_and_empty_messages() {
    for test in ["torn", "zero", "kind", "length"] {
        let mut bench = Bench::new(test);
        let from_ns = monotonic_ns();
        for _ in 0..3 {
            bench.inject(|sample| match test {
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
        bench.told_within(InputFault::Torn, Duration::from_millis(20), from_ns);
        bench.recovers();
    }
}

#[test]
fn another_source_and_another_machine() {
    let mut bench = Bench::new("source");
    let from_ns = monotonic_ns();
    for _ in 0..3 {
        bench.inject(|sample| {
            let head = sample.head();
            let source = head.source ^ 1;
            sample.seal(Head { source, ..head });
        });
    }
    bench.told_within(InputFault::WrongSource, Duration::from_millis(20), from_ns);
    bench.recovers();
    let from_ns = monotonic_ns();
    bench.inject(|sample| {
        let head = sample.head();
        let machine_hash = head.machine_hash ^ 1;
        sample.seal(Head {
            machine_hash,
            ..head
        });
    });
    bench.told_within(InputFault::WrongMachine, Duration::from_millis(20), from_ns);
}

#[test]
fn two_producers_are_refused() {
    let world = World::new("two");
    let joined = world.join();
    let _first = Feed::new(&joined, "forwarder6");
    let replay = world.replay("forwarder6", &["--speed", "max"]).end();
    assert_eq!(replay.status.code(), Some(1));
    assert!(replay.err.contains("cannot be written"), "{}", replay.err);
}

#[test]
fn the_producer_dies() {
    let _favoured = favour();
    let world = World::new("dies");
    let monitor = world.monitor(&data("forwarder6.toml"), &["--quiet", "--stay"]);
    let verdicts = world.join().receiver::<WireVerdict>().unwrap();
    let told = |level: Level, within: Duration| {
        let start = std::time::Instant::now();
        while start.elapsed() < within {
            if let Some(Some(at)) = verdicts
                .receive(|v| (v.level == level as u32).then_some((v.published_ns, v.conditions())))
                .unwrap()
            {
                return Some(at);
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        None
    };
    // where the computer is so busy that samples come late, Safe is rightly not said: once more
    let until_safe = || {
        let safe = (0..8).find_map(|_| {
            let replay = world.replay("forwarder6", &["--wait", "60"]);
            told(Level::Unknown, 4 * ROOM).unwrap();
            match told(Level::Safe, ROOM) {
                Some(_) => Some(replay),
                None => {
                    replay.kill();
                    None
                }
            }
        });
        safe.expect("Safe in one of eight replays")
    };
    let replay = until_safe();
    let from_ns = monotonic_ns();
    replay.kill();
    let (told_ns, conditions) = told(Level::Fault, 4 * ROOM).unwrap();
    println!(
        "producer killed  told after {:8.2} ms: {:?}",
        (told_ns - from_ns) as f64 * 1e-6,
        conditions.faults.iter().collect::<Vec<_>>()
    );
    // and the next one is followed
    drop(until_safe());
    drop(monitor);
}

#[test]
fn a_verdict_says_until_when_it_holds() {
    let mut bench = Bench::new("until");
    bench.feed.send(5);
    let verdict = bench.feed.wait_for(ROOM, |_| true).unwrap();
    assert_eq!(verdict.valid_until_ns - verdict.published_ns, 100_000_000);
    // a monitor that hangs gives no verdict: what it gave runs out
    bench.monitor.signal("-STOP");
    std::thread::sleep(Duration::from_millis(300));
    bench.feed.send(5);
    let last = std::iter::from_fn(|| bench.feed.find(|_| true)).last();
    assert!(last.is_none_or(|last| last.valid_until_ns < monotonic_ns()));
    let from_ns = monotonic_ns();
    bench.monitor.signal("-CONT");
    // late verdicts are a fault
    bench.told_within(InputFault::Stale, Duration::from_millis(100), from_ns);
}

#[test]
fn an_alarm_stays_until_it_is_acknowledged() {
    let _favoured = favour();
    let world = World::new("ack");
    let monitor = world.monitor(&data("tiny_lift.toml"), &["--quiet", "--stay"]);
    let mut feed = Feed::new(&world.join(), "tiny_lift");
    feed.wait_for_monitor();
    let latched = |level: Level| move |v: &WireVerdict| v.latched_level == level as u32;
    // the wheel is in the air at 1 s
    feed.send(200);
    let danger = feed.wait_for(ROOM, latched(Level::Danger));
    assert!(danger.is_some());
    let acknowledged = world.start(&["acknowledge"]);
    while acknowledged_is_running(&acknowledged) {
        feed.send(1);
    }
    let acknowledged = acknowledged.end();
    assert!(acknowledged.status.success(), "{}", acknowledged.err);
    // and it comes down again: without the acknowledgement this would stay danger
    let mut seen = None;
    for _ in 0..6000 {
        feed.send(1);
        seen = feed.find(|v| v.latched_level < Level::Danger as u32 && v.rows > 10);
        if seen.is_some() {
            break;
        }
    }
    assert!(seen.is_some(), "still latched");
    drop(monitor);
}

fn acknowledged_is_running(process: &Process) -> bool {
    let status = std::path::PathBuf::from(format!("/proc/{}/status", process.child.id()));
    std::fs::read_to_string(status).is_ok_and(|text| !text.contains("State:\tZ"))
}

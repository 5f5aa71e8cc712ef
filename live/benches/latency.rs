//! Latency of the monitor: `cargo bench -p tipwatch-live --bench latency -- [ticks] [seconds]`.
//!
//! 1. A tick of the monitor by itself: back to back, and a thousand a second with cold caches.
//! 2. From publishing a sample to receiving its verdict, by a monitor in another process, beside a bare
//!    round trip through iceoryx2 with the same messages in the same run; both by polling and by events,
//!    with the share of a processor that the other process takes; by events also a hundred a second.
//!
//! 3. `-- --long SECONDS`: a thousand rows a second with a recorder and a neighbour that takes a whole
//!    processor; what was lost or late.
//!
//! The two processes sit on processors 0 and 1. What else runs there shows in the maxima.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "a program for people, on the helpers of the tests"
)]

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use processor::ProcessorTime;
use support::World;
use support::feed::{machine, samples};
use support::obeying::Obeying;
use tipwatch_live::control::Control;
use tipwatch_live::monitor::Monitor;
use tipwatch_live::node::Producer;
use tipwatch_live::node::{LiveNode, Receiver, Sender, ServiceAddress};
use tipwatch_live::node::{Waiter, Wake};
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::system::realtime::RealTime;
use tipwatch_live::wire::command::Mode;
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{
    EVENT_ROW, Head, Kind, Wire, WireCommand, WireSample, WireSession, WireVerdict,
};
use tipwatch_mechanics::verdict::Level;

/// The machine: four wheels and two closed chains, unless TIPWATCH_MACHINE names another of the test data.
fn machine_name() -> String {
    std::env::var("TIPWATCH_MACHINE").unwrap_or_else(|_| "tiny".into())
}

const PONG: &str = "--pong";
/// For so many seconds with a recorder and a busy neighbour.
const LONG: &str = "--long";

#[path = "latency/long.rs"]
mod long;
#[path = "latency/processor.rs"]
mod processor;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|argument| argument == PONG) {
        return pong(&arguments[at + 1], arguments[at + 2].parse().unwrap());
    }
    let mut numbers = arguments
        .iter()
        .filter_map(|argument| argument.parse::<u64>().ok());
    let ticks = numbers.next().unwrap_or(200_000);
    let seconds = numbers.next().unwrap_or(10);
    pin(0);
    if let Some(at) = arguments.iter().position(|argument| argument == LONG) {
        return long::run(arguments[at + 1].parse().unwrap());
    }
    tick(ticks);
    control_tick(ticks);
    for wake in ["poll", "event"] {
        bare(wake, 0, 20_000);
        bare(wake, 1_000_000, seconds * 1000);
        monitored(wake, 0, 20_000);
        monitored(wake, 1_000_000, seconds * 1000);
    }
    bare("event", 10_000_000, seconds * 100);
    monitored("event", 10_000_000, seconds * 100);
}

fn pin(core: usize) {
    let real_time = RealTime {
        core: Some(core),
        ..RealTime::default()
    };
    real_time.apply().unwrap();
}

fn report(what: &str, mut times_ns: Vec<i64>) {
    times_ns.sort_unstable();
    let at = |share: f64| {
        let last = times_ns.len() - 1;
        times_ns[(last as f64 * share).round() as usize] as f64 * 1e-3
    };
    println!(
        "{what:58} n {:8}  median {:8.2}  p99 {:8.2}  p99.9 {:8.2}  max {:9.2} us",
        times_ns.len(),
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}

/// A machine in the middle of its work, again and again: one sample of each sensor.
struct Steady {
    odometry: WireSample,
    imu: WireSample,
    imu_means: [f64; 6],
    joints: WireSample,
    session: Session,
    hash: u64,
    sequence: u64,
    time_ns: i64,
}

impl Steady {
    fn new(name: &str, source: u64) -> Self {
        let (file, urdf) = machine(name);
        let (recording, samples) = samples(name);
        let middle = &samples[samples.len() / 2..];
        let of = |kind: Kind| *middle.iter().find(|s| s.kind == kind as u32).unwrap();
        let (imu, mut joints) = (of(Kind::Imu), of(Kind::Joints));
        let mut odometry = of(Kind::Odometry);
        odometry.values[..6].fill(0.0);
        // it stands still: its joints do not move, and say so
        joints.values[joints.value_count as usize / 2..].fill(0.0);
        Self {
            imu_means: std::array::from_fn(|k| imu.values[k]),
            imu,
            odometry,
            joints,
            session: Session {
                id: source,
                wants_progress: false,
                ..recording.session
            },
            hash: machine_hash(&file, &urdf),
            sequence: 0,
            time_ns: 1_000_000_000,
        }
    }

    /// The next samples: measured when they are published, or without real time a millisecond later.
    fn next(&mut self, published_ns: i64) -> [WireSample; 3] {
        let clock = self.session.clock;
        self.time_ns = if self.session.pace == 1.0 && published_ns != 0 {
            clock.stamp_ns + published_ns - clock.host_ns
        } else {
            self.time_ns + 1_000_000
        };
        let imu = &mut self.imu;
        // noise: constant bits would count as frozen
        let noise =
            (self.sequence.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) as f64 / (1 << 24) as f64;
        for (value, mean) in imu.values[..6].iter_mut().zip(&self.imu_means) {
            *value = mean + 0.002 * (noise - 0.5);
        }
        [self.odometry, self.imu, self.joints].map(|mut sample| {
            sample.seal(Head {
                sequence: self.sequence,
                source: self.session.id,
                machine_hash: self.hash,
                time_ns: self.time_ns,
                published_ns,
            });
            self.sequence += 1;
            sample
        })
    }
}

fn tick(count: u64) {
    let mut steady = Steady::new(&machine_name(), 1);
    let (file, urdf) = machine(&machine_name());
    let (machine, sensors) = steady.session.machine(&file, &urdf).unwrap();
    let session = Session {
        pace: 0.0,
        ..steady.session.clone()
    };
    let mut monitor = Monitor::new(machine, &sensors, &session, 0);
    let mut run = |count: u64, cold: bool, what: &str| {
        let (mut row, mut other) = (Vec::new(), Vec::new());
        let mut cache = vec![0_u8; 16 << 20];
        for _ in 0..count {
            let [odometry, imu, joints] = steady.next(0);
            if cold {
                std::thread::sleep(Duration::from_micros(900));
                for byte in cache.iter_mut().step_by(64) {
                    *byte = byte.wrapping_add(1);
                }
                black_box(&cache);
            }
            let mut publish = |verdict: &mut WireVerdict| {
                verdict.seal(Head::default());
                black_box(&verdict);
                0
            };
            let start = monotonic_ns();
            monitor.take(&odometry, 0, &mut publish);
            monitor.take(&imu, 0, &mut publish);
            let between = monotonic_ns();
            monitor.take(&joints, 0, &mut publish);
            row.push(monotonic_ns() - between);
            other.push(between - start);
        }
        report(&format!("tick with a row, {what}"), row);
        report(&format!("tick without a row, {what}"), other);
    };
    run(1000, false, "warming up");
    run(count, false, "back to back");
    run(3000, true, "1 kHz, cold caches");
    println!("level {:?}", monitor.verdict().level);
}

/// The control with safe verdicts, and rods that obey it; its optimiser runs fifty times per second.
fn control_tick(count: u64) {
    const MACHINE: &str = "second_paper";
    let mut steady = Steady::new(MACHINE, 1);
    let (file, urdf) = machine(MACHINE);
    let (machine, sensors) = steady.session.machine(&file, &urdf).unwrap();
    let session = Session {
        pace: 0.0,
        ..steady.session.clone()
    };
    let mut rods = Obeying::new(&machine, &session.streams[0]);
    let mut control = Control::new(machine, &sensors, &session, 0).unwrap();
    let mut verdict = WireVerdict::unknown();
    verdict.session = session.id;
    verdict.level = Level::Safe as u32;
    verdict.valid_until_ns = i64::MAX;
    verdict.seal(Head {
        machine_hash: steady.hash,
        ..Head::default()
    });
    let (mut solved, mut other, mut following) = (Vec::new(), Vec::new(), 0);
    let mut last = WireCommand::closed();
    for _ in 0..count + 1000 {
        let [odometry, imu, mut joints] = steady.next(0);
        rods.obey(&last.opening, &mut joints);
        let mut send = |command: &mut WireCommand| {
            command.seal(Head::default());
            last = *command;
            0
        };
        control.acknowledge();
        control.take(&odometry, 0, &mut send).unwrap();
        control.take(&imu, 0, &mut send).unwrap();
        let start = monotonic_ns();
        control.verdict(&verdict);
        control.take(&joints, 0, &mut send).unwrap();
        let took_ns = monotonic_ns() - start;
        let is_following = last.mode() == Mode::Follow;
        following += u64::from(is_following);
        // the optimiser runs in every twentieth row
        if is_following && following % 20 == 1 {
            solved.push(took_ns);
        } else {
            other.push(took_ns);
        }
    }
    assert!(following >= count, "{following} rows followed");
    report("control: row with a step of the optimiser", solved);
    report("control: other rows", other);
}

/// The other end of a bare round trip.
fn pong(prefix: &str, wake: Wake) {
    pin(1);
    let node = LiveNode::new(&bare_place(prefix), "pong").unwrap();
    let samples: Receiver<WireSample> = node.receiver().unwrap();
    let verdicts: Sender<WireVerdict> = node.sender(0, 0).unwrap();
    let topic_notifier = node.event_notifier::<WireVerdict>().unwrap();
    let waiter = Waiter::new::<WireSample>(&node, wake).unwrap();
    let mut verdict = WireVerdict::unknown();
    let mut ends = false;
    while !ends {
        while let Some((sequence, kind)) = samples.receive(|s| (s.sequence, s.kind)).unwrap() {
            verdict.sample_sequence = sequence;
            verdict.event = EVENT_ROW;
            verdicts.send_raw(&verdict).unwrap();
            if wake == Wake::Event {
                topic_notifier.notify();
            }
            ends = kind == Kind::End as u32;
        }
        waiter.wait();
    }
    std::thread::sleep(Duration::from_millis(100));
}

fn bare_place(prefix: &str) -> ServiceAddress {
    ServiceAddress {
        service: "bare".into(),
        prefix: Some(prefix.into()),
    }
}

/// Ended when this is.
struct Other(Child);

impl Drop for Other {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits for the verdict on a sample; when it came (ns).
fn verdict_on(sequence: u64, verdicts: &Receiver<WireVerdict>, waiter: &Waiter) -> i64 {
    loop {
        let is_it = verdicts.receive(|v| v.event == EVENT_ROW && v.sample_sequence == sequence);
        match is_it.unwrap() {
            Some(true) => return monotonic_ns(),
            Some(false) => {}
            None => waiter.wait(),
        }
    }
}

/// Sleeps, then spins, until it is time.
fn wait_until(due_ns: i64) {
    let left_ns = due_ns - monotonic_ns() - 200_000;
    if left_ns > 0 {
        std::thread::sleep(Duration::from_nanos(left_ns.unsigned_abs()));
    }
    while monotonic_ns() < due_ns {
        std::hint::spin_loop();
    }
}

fn bare(wake: &str, period_ns: i64, count: u64) {
    let world = World::new("lb");
    let node = LiveNode::new(&bare_place(&world.prefix), "ping").unwrap();
    let wake: Wake = wake.parse().unwrap();
    let samples: Sender<WireSample> = node.sender(0, 0).unwrap();
    let topic_notifier = node.event_notifier::<WireSample>().unwrap();
    let verdicts: Receiver<WireVerdict> = node.receiver().unwrap();
    let waiter = Waiter::new::<WireVerdict>(&node, wake).unwrap();
    let name = if wake == Wake::Poll { "poll" } else { "event" };
    let pong = Other(
        Command::new(std::env::current_exe().unwrap())
            .args([PONG, &world.prefix, name])
            .stdout(Stdio::null())
            .spawn()
            .unwrap(),
    );
    while samples.readers() == 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(50));
    let mut sample = WireSample::end();
    sample.kind = Kind::Joints as u32;
    let mut times = Vec::new();
    let mut due_ns = monotonic_ns();
    let processor = ProcessorTime::of(pong.0.id());
    for sequence in 0..count {
        due_ns = (due_ns + period_ns).max(monotonic_ns());
        wait_until(due_ns);
        sample.sequence = sequence;
        if sequence + 1 == count {
            sample.kind = Kind::End as u32;
        }
        let start_ns = monotonic_ns();
        samples.send_raw(&sample).unwrap();
        if wake == Wake::Event {
            topic_notifier.notify();
        }
        times.push(verdict_on(sequence, &verdicts, &waiter) - start_ns);
        if sequence + 2 == count {
            processor.print_share();
        }
    }
    report(
        &format!("bare round trip, {name}{}", pace(period_ns)),
        times,
    );
}

fn pace(period_ns: i64) -> &'static str {
    match period_ns {
        0 => ", back to back",
        1_000_000 => ", 1 kHz",
        _ => ", 100 Hz",
    }
}

fn monitored(wake: &str, period_ns: i64, count: u64) {
    let world = World::new("lm");
    let node = world.join();
    let verdicts: Receiver<WireVerdict> = node.receiver().unwrap();
    let waiter = Waiter::new::<WireVerdict>(&node, wake.parse().unwrap()).unwrap();
    let monitor = world.monitor(
        &support::data(&format!("{}.toml", machine_name())),
        &[
            "--quiet",
            "--stay",
            "--wake",
            wake,
            "--core",
            "1",
            "--lock-memory",
            "--allow-untimed",
        ],
    );
    let mut steady = Steady::new(&machine_name(), monotonic_ns().unsigned_abs());
    // real time is checked where there is any
    steady.session.pace = if period_ns == 0 { 0.0 } else { 1.0 };
    steady.session.clock = StampClock {
        stamp_ns: steady.time_ns,
        host_ns: monotonic_ns(),
    };
    let mut producer = Producer::new(&node, steady.session.id, steady.hash).unwrap();
    producer
        .announce(&mut WireSession::try_from(&steady.session).unwrap())
        .unwrap();
    while producer.readers() == 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    producer.update_connections().unwrap();
    let mut times = Vec::new();
    let mut due_ns = monotonic_ns();
    let mut processor = None;
    for row in 0..count + 500 {
        if row == 500 {
            processor = Some(ProcessorTime::of(monitor.child.id()));
        }
        due_ns = (due_ns + period_ns).max(monotonic_ns());
        wait_until(due_ns);
        let [mut odometry, mut imu, mut joints] = steady.next(monotonic_ns());
        producer.send(&mut odometry).unwrap();
        producer.send(&mut imu).unwrap();
        let start_ns = monotonic_ns();
        producer.send(&mut joints).unwrap();
        times.push(verdict_on(joints.sequence, &verdicts, &waiter) - start_ns);
    }
    processor.unwrap().print_share();
    // the first rows wait for the monitor's start
    let times = times.split_off(500);
    report(
        &format!("sample to verdict, {wake}{}", pace(period_ns)),
        times,
    );
}

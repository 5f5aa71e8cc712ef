//! The control of an active suspension: what it does while all is well, and every fault that must close
//! the valves, injected at the boundary of the shared memory.
//!
//! Monitor and control are the program's own loops, in time that the test steers.
//!
//! The rods of the log are replaced by simulated ones that obey the valves.

use std::time::Duration;

use tipwatch_ingest::{FieldRequest, Log, record_fields};
use tipwatch_live::node::Receiver;
use tipwatch_live::safety_limits::{CLOSING_RATE, TRIAL_OPENING};
use tipwatch_live::wire::command::{HoldReason, Mode};
use tipwatch_live::wire::topics::{EVENT_ROW, Kind, Wire, WireCommand, WireSample, WireVerdict};

use crate::support::feed::{Feed, Time};
use crate::support::killing::{files, wait_for_command};
use crate::support::producing::Producing;
use crate::support::standing::FASTEST;
use crate::support::steered::Steered;
use crate::support::{World, data};

/// The machine of `second_paper`, whose rods the test moves while the IMU stays as it was logged.
const MACHINE: &str = "free_rods";
/// Full openings a second of the machine file's valve.
const VALVE_RATE: f64 = 20.0;
/// Valves that are all the way open are closed after so long (ns).
const RAMP_NS: i64 = (1e9 / CLOSING_RATE) as i64;

struct Bench {
    feed: Feed<Steered>,
    commands: Receiver<WireCommand>,
    last: WireCommand,
    rods: [f64; 2],
    /// Velocity of the rods over what their valves ask for: 1 if they obey, 0 if they are stuck.
    obedience: f64,
    places: [usize; 2],
    before_ns: Option<i64>,
    world: World,
}

impl Bench {
    /// A machine at work, with rods far from where they do best.
    fn new(test: &str) -> Self {
        let world = World::new(test);
        let node = world.join();
        let commands = node.receiver().unwrap();
        let mut time = Steered::monitor(&world, MACHINE);
        time.start_control();
        let mut feed = Feed::new(&node, MACHINE, time);
        feed.wait_for_monitor();
        let places = ["suspension_right", "suspension_left"].map(|rod| feed.place_of(rod));
        let mut bench = Self {
            feed,
            commands,
            last: WireCommand::closed(),
            rods: [-0.18, -0.18],
            obedience: 1.0,
            places,
            before_ns: None,
            world,
        };
        bench.until("a command of the session", |command, bench| {
            command.session == bench.feed.source
        });
        bench
    }

    fn now_ns(&self) -> i64 {
        self.feed.time.now_ns()
    }

    /// The next sample, with the rods where they are now.
    fn send(&mut self, change: impl FnOnce(&mut WireSample)) {
        self.feed.wait();
        // new readers receive the session
        self.feed.producer.update_connections().unwrap();
        let mut sample = self.feed.peek();
        if sample.kind == Kind::Joints as u32 {
            let seconds = self
                .before_ns
                .map_or(0.0, |before| (sample.time_ns - before) as f64 * 1e-9);
            self.before_ns = Some(sample.time_ns);
            let joints = sample.value_count as usize / 2;
            for (k, place) in self.places.into_iter().enumerate() {
                let rate = FASTEST * self.obedience * self.last.opening[k];
                self.rods[k] += rate * seconds;
                sample.values[place] = self.rods[k];
                sample.values[joints + place] = rate;
            }
        }
        change(&mut sample);
        sample.seal(sample.head());
        self.feed.raw(&sample);
        self.feed.next += 1;
    }

    /// Takes the commands that wait; every one is whole, within limits, and no jump from the one before.
    fn take(&mut self, is_it: &mut dyn FnMut(&WireCommand, &Self) -> bool) -> bool {
        let mut found = false;
        while let Some(command) = self.commands.receive(|command| *command).unwrap() {
            assert!(command.is_whole());
            let before = std::mem::replace(&mut self.last, command);
            let is_same = before.source == command.source && before.session == command.session;
            let seconds = (command.published_ns - before.published_ns) as f64 * 1e-9;
            for (now, was) in command.opening.iter().zip(before.opening) {
                assert!(now.abs() <= 1.0);
                let reach = match command.mode() {
                    // the valve law goes by the time of rows, which may come in bursts
                    Mode::Follow => VALVE_RATE * (command.time_ns - before.time_ns) as f64 * 1e-9,
                    // what is between the control's look at the clock and its sending
                    _ => CLOSING_RATE * (seconds + 0.02),
                };
                let step = (now - was).abs();
                assert!(
                    !is_same || step <= reach + 1e-9,
                    "{step} {reach} {command:?}"
                );
                let closes = command.mode() == Mode::Follow || now.abs() <= was.abs();
                assert!(!is_same || closes, "{command:?}");
            }
            assert_eq!(command.valid_until_ns - command.published_ns, 100_000_000);
            found |= is_it(&command, self);
        }
        found
    }

    /// Sends samples until there is such a command.
    fn until(&mut self, what: &str, mut is_it: impl FnMut(&WireCommand, &Self) -> bool) {
        let start_ns = self.now_ns();
        while !self.take(&mut is_it) {
            assert!(
                self.now_ns() - start_ns < 10_000_000_000,
                "{what}: {:?}",
                self.last
            );
            self.send(|_| ());
        }
    }

    fn runs_in(&mut self) {
        self.until("follows, valves open", |command, _| {
            command.mode() == Mode::Follow && command.opening.iter().all(|u| u.abs() > 0.01)
        });
    }

    /// A machine at work whose valves are open so far that a rod which stands still is a fault.
    fn runs_well(&mut self) {
        self.runs_in();
        self.until("valves well open", |command, _| {
            command.mode() == Mode::Follow && command.opening.iter().all(|u| u.abs() > 0.05)
        });
    }

    /// Waits until the valves have closed for this reason, which must be reported within this time.
    fn closes(&mut self, reason: HoldReason, from_ns: i64, within_ms: f64, sends: bool) {
        let (mut reported_ns, mut closed_ns) = (None, None);
        while closed_ns.is_none() {
            assert!(
                self.now_ns() - from_ns < 10_000_000_000,
                "{}: {:?}",
                reason.name(),
                self.last
            );
            self.take(&mut |command, _| {
                let is_reported = command.reasons().has(reason) && command.mode() != Mode::Follow;
                if is_reported && reported_ns.is_none() {
                    reported_ns = Some(command.published_ns);
                }
                if reported_ns.is_some() && command.mode() == Mode::Hold && closed_ns.is_none() {
                    closed_ns = Some(command.published_ns);
                }
                false
            });
            if sends {
                self.send(|_| ());
            } else {
                self.feed.time.pass(Duration::from_millis(1));
            }
        }
        let ms = |at: Option<i64>| (at.unwrap() - from_ns) as f64 * 1e-6;
        println!(
            "{:14} reported after {:7.2} ms, valves closed after {:7.2} ms",
            reason.name(),
            ms(reported_ns),
            ms(closed_ns)
        );
        assert!(ms(reported_ns) <= within_ms, "{}", reason.name());
        assert!(
            closed_ns.unwrap() - reported_ns.unwrap() <= RAMP_NS,
            "{}",
            reason.name()
        );
    }
}

// requirement: TW-CONTROL-11
#[test]
fn rods_follow_their_references() {
    let mut bench = Bench::new("led");
    bench.runs_in();
    let mut largest = 0.0_f64;
    let (mut rows, mut solved) = (0, 0);
    for _ in 0..600 {
        bench.send(|_| ());
        bench.take(&mut |command, _| {
            if command.event == EVENT_ROW && command.mode() == Mode::Follow {
                rows += 1;
                // the optimum, or what of it every wheel can afford
                solved += u32::from([1, 8].contains(&command.status));
                for k in 0..2 {
                    largest = largest.max((command.reference[k] - command.measured[k]).abs());
                }
            }
            false
        });
    }
    println!(
        "{rows} rows, {solved} optimal; rods {:?}; largest error {largest:.3} m",
        bench.rods
    );
    assert!(rows > 100 && solved > rows / 2, "{:?}", bench.last);
    // a quarter of the stroke is where the control would give them up
    assert!(largest < 0.05, "{largest}");
    assert!(
        bench.rods.iter().all(|rod| *rod > -0.17),
        "{:?}",
        bench.rods
    );
}

// requirement: TW-CONTROL-04
#[test]
fn fault_of_the_monitor_closes_the_valves() {
    let mut bench = Bench::new("fault");
    bench.runs_in();
    let from_ns = bench.now_ns();
    for _ in 0..20 {
        bench.send(|sample| {
            if sample.kind == Kind::Imu as u32 {
                sample.values[0] = f64::NAN;
            }
        });
    }
    bench.closes(HoldReason::Verdict, from_ns, 60.0, true);
    // and they open again when all is well
    bench.runs_in();
}

// requirement: TW-CONTROL-01
#[test]
fn silent_producer_closes_the_valves() {
    let mut bench = Bench::new("silent");
    bench.runs_in();
    let from_ns = bench.now_ns();
    bench.closes(HoldReason::NoRow, from_ns, 60.0, false);
    bench.runs_in();
}

// requirement: TW-CONTROL-03
#[test]
fn missing_monitor_closes_the_valves() {
    let mut bench = Bench::new("gone");
    bench.runs_in();
    let from_ns = bench.now_ns();
    bench.feed.time.stop_monitor();
    bench.closes(HoldReason::NoVerdict, from_ns, 120.0, true);
    bench.feed.time.start_monitor();
    bench.runs_in();
}

// requirement: TW-CONTROL-03
#[test]
fn killed_or_stopped_monitor_closes_the_valves() {
    let world = World::new("real");
    let machine = data(&format!("{MACHINE}.toml"));
    let producing = Producing::start(&world.address(), MACHINE);
    let commands: Receiver<WireCommand> = world.join().receiver().unwrap();
    let control = world.control(&machine, &["--stay"]);
    let has_verdict = |command: &WireCommand| {
        command.event == EVENT_ROW && !command.reasons().has(HoldReason::NoVerdict)
    };
    let is_closed = |command: &WireCommand| {
        command.reasons().has(HoldReason::NoVerdict) && command.opening == [0.0; 2]
    };
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    wait_for_command(&commands, has_verdict);
    monitor.signal("-STOP");
    wait_for_command(&commands, is_closed);
    monitor.signal("-CONT");
    wait_for_command(&commands, has_verdict);
    monitor.kill();
    wait_for_command(&commands, is_closed);
    producing.end();
    drop(control);
}

// requirement: TW-CONTROL-02
#[test]
fn unknown_rod_position_closes_the_valves() {
    let mut bench = Bench::new("unknown");
    bench.runs_in();
    let from_ns = bench.now_ns();
    let place = bench.places[0];
    for _ in 0..20 {
        bench.send(|sample| {
            if sample.kind == Kind::Joints as u32 {
                sample.values[place] = f64::NAN;
            }
        });
    }
    bench.closes(HoldReason::RowInvalid, from_ns, 60.0, true);
    bench.runs_in();
}

// requirement: TW-CONTROL-07
#[test]
fn stuck_rod_closes_valves_until_acknowledged() {
    let mut bench = Bench::new("stuck");
    bench.runs_well();
    bench.obedience = 0.0;
    let from_ns = bench.now_ns();
    bench.closes(HoldReason::NotFollowing, from_ns, 3000.0, true);
    bench.obedience = 1.0;
    for _ in 0..300 {
        bench.send(|_| ());
    }
    bench.take(&mut |_, _| false);
    assert!(bench.last.reasons().has(HoldReason::NotFollowing));
    let mut acknowledging = bench.world.start(&["acknowledge"]);
    while acknowledging.child.try_wait().unwrap().is_none() {
        bench.send(|_| ());
        // the program goes by real time
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(acknowledging.end().status.success());
    bench.runs_in();
}

/// Valves that are connected the other way round are found at a small opening, before a rod has gone anywhere.
// requirement: TW-CONTROL-08
#[test]
fn reversed_valves_close_at_a_small_opening() {
    let mut bench = Bench::new("reversed");
    bench.obedience = -1.0;
    let mut largest = 0.0_f64;
    let start = bench.rods;
    bench.until("a rod that runs the wrong way", |command, _| {
        largest = command
            .opening
            .iter()
            .fold(largest, |most, u| most.max(u.abs()));
        command.reasons().has(HoldReason::WrongWay)
    });
    println!(
        "largest opening {largest:.3}, rods {start:?} -> {:?}",
        bench.rods
    );
    assert!(largest <= TRIAL_OPENING + 1e-9, "{largest}");
    for (rod, from) in bench.rods.iter().zip(start) {
        assert!((rod - from).abs() < 0.006, "{:?}", bench.rods);
    }
    bench.obedience = 1.0;
    for _ in 0..300 {
        bench.send(|_| ());
    }
    bench.take(&mut |_, _| false);
    assert!(bench.last.reasons().has(HoldReason::WrongWay));
    assert_eq!(bench.last.opening, [0.0; 2]);
}

// requirement: TW-CONTROL-09
#[test]
fn rod_outside_its_stroke_closes_the_valves() {
    let mut bench = Bench::new("outside");
    bench.runs_in();
    let place = bench.places[0];
    let (mut is_seen, mut follows) = (false, false);
    for _ in 0..200 {
        bench.send(|sample| {
            if sample.kind == Kind::Joints as u32 {
                sample.values[place] = 0.4;
            }
        });
        bench.take(&mut |command, _| {
            is_seen |= command.reasons().has(HoldReason::OutsideStroke);
            follows = command.mode() == Mode::Follow;
            false
        });
    }
    assert!(is_seen && !follows, "{:?}", bench.last);
    assert_eq!(bench.last.opening, [0.0; 2]);
}

/// A verdict counts only with the hash of the control's own machine, whatever session it names.
// requirement: TW-CONTROL-03
#[test]
fn verdicts_of_another_machine_are_refused() {
    let mut bench = Bench::new("other");
    let node = bench.world.join();
    let verdicts: Receiver<WireVerdict> = node.receiver().unwrap();
    bench.runs_in();
    let mut known = None;
    while let Some(verdict) = verdicts.receive(|verdict| *verdict).unwrap() {
        known = Some(verdict);
    }
    let mut forged = known.unwrap();
    bench.feed.time.stop_monitor();
    let own = forged.machine_hash;
    for (hash, follows) in [(own ^ 1, false), (own, true)] {
        let mut sender = node.sender::<WireVerdict>(11, hash).unwrap();
        let mut has_followed = false;
        for _ in 0..300 {
            let now_ns = bench.now_ns();
            forged.valid_until_ns = now_ns + 100_000_000;
            sender.send_at(&mut forged, now_ns).unwrap();
            bench.send(|_| ());
            bench.take(&mut |command, _| {
                has_followed = command.mode() == Mode::Follow;
                false
            });
        }
        assert_eq!(has_followed, follows, "{:?}", bench.last);
    }
}

// requirement: TW-CONTROL-11
#[test]
fn successor_of_a_dead_control_starts_closed() {
    let mut bench = Bench::new("next");
    bench.runs_in();
    bench.feed.time.stop_control();
    let source = bench.last.source;
    // what it said last runs out by itself
    bench.take(&mut |_, _| false);
    bench.feed.time.pass(Duration::from_millis(150));
    assert!(bench.last.valid_until_ns < bench.now_ns());
    let from_ns = bench.now_ns();
    bench.feed.time.start_control();
    let mut first = None;
    bench.until("a command of the next", |command, _| {
        if command.source != source {
            first.get_or_insert(*command);
        }
        first.is_some()
    });
    let first = first.unwrap();
    assert_eq!((first.mode(), first.opening), (Mode::Hold, [0.0; 2]));
    bench.runs_in();
    let took_ms = (bench.last.published_ns - from_ns) as f64 * 1e-6;
    println!("a new control follows {took_ms:.0} ms after its start");
}

// requirement: TW-CONTROL-05
#[test]
fn faulty_input_closes_the_valves() {
    let mut bench = Bench::new("input");
    bench.runs_in();
    let from_ns = bench.now_ns();
    for _ in 0..3 {
        bench.send(|sample| sample.source ^= 1);
    }
    bench.closes(HoldReason::Input, from_ns, 40.0, true);
    bench.runs_in();
}

// requirement: TW-CONTROL-10
#[test]
fn late_commands_close_the_valves() {
    let mut bench = Bench::new("late");
    bench.runs_in();
    let from_ns = bench.now_ns();
    // the loops look at the clock several times a row
    bench.feed.time.slow_down(Duration::from_millis(11));
    // a sample takes a tenth of a second then, and three rows seven samples
    bench.closes(HoldReason::Late, from_ns, 1500.0, true);
    bench.feed.time.slow_down(Duration::ZERO);
    bench.runs_in();
}

#[test]
fn machine_without_suspension_is_rejected() {
    let world = World::new("none");
    let machine = data("tiny.toml");
    let control = world.control(&machine, &[]);
    let replay = world.replay("tiny", &["--wait", "60"]);
    let ended = control.end();
    assert_eq!(ended.status.code(), Some(1));
    assert!(
        ended.err.contains("tiny.toml") && ended.err.contains("expected [suspension]"),
        "{}",
        ended.err
    );
    drop(replay);
}

#[test]
fn commands_are_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let mut bench = Bench::new("recorded");
    let machine = data(&format!("{MACHINE}.toml"));
    let recorder = bench.world.record(&machine, folder.path(), &[]);
    while files(folder.path()).is_empty() {
        bench.send(|_| ());
        bench.take(&mut |_, _| false);
        // the recorder goes by real time
        std::thread::sleep(Duration::from_millis(1));
    }
    bench.runs_well();
    bench.obedience = 0.0;
    let from_ns = bench.now_ns();
    bench.closes(HoldReason::NotFollowing, from_ns, 3000.0, true);
    bench.feed.end();
    let ended = recorder.end();
    assert!(ended.status.success(), "{}", ended.err);
    let file = &files(folder.path())[0];
    let log = Log::open(file).unwrap();
    let topic = log
        .topics()
        .iter()
        .find(|t| t.name == "/tipwatch/command")
        .unwrap();
    let read = |field: &str| {
        let request = FieldRequest::raw(&topic.name, field);
        record_fields(&log, &[request], None)
            .unwrap()
            .0
            .remove(0)
            .values
    };
    let (openings, costs) = (read("opening[0]"), read("cost"));
    assert_eq!(openings.len() as u64, topic.message_count.unwrap());
    let last = openings.last().unwrap();
    assert!(
        openings.iter().any(|u| u.abs() > 0.01) && *last == 0.0,
        "{last}"
    );
    assert!(costs.iter().any(|cost| cost.is_finite()));
    let text = String::from_utf8_lossy(&std::fs::read(file).unwrap()).into_owned();
    assert!(text.contains("not_following") && text.contains("optimal"));
}

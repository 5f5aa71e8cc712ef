//! Tests of how the control begins, waits, changes sessions and ends: its own loop over shared memory, in the process and the
//! time of the test.

use tipwatch_live::control::ControlProgram;
use tipwatch_live::node::{Housekeeping, LiveNode, LoopOptions, Receiver, Sender, Wake};
use tipwatch_live::safety_limits::CLOSING_RATE;
use tipwatch_live::wire::command::{HoldReason, Mode};
use tipwatch_live::wire::session::{Progress, Session};
use tipwatch_live::wire::topics::{
    Head, Kind, Wire, WireAcknowledge, WireCommand, WireSample, WireSession, WireVerdict,
};
use tipwatch_mechanics::verdict::Level;

use crate::support::World;
use crate::support::feed::machine;
use crate::support::seal;
use crate::support::standing::{
    SESSION, START, follows, move_rods, seal_sample, standing, verdict,
};
use crate::support::steered_clock::SteeredClock;

const MS: i64 = 1_000_000;
/// Time from row to row (ns).
const ROW_NS: i64 = 10 * MS;
/// The session after the first.
const NEXT: u64 = 8;

struct Bench {
    control: ControlProgram<'static>,
    clock: &'static SteeredClock,
    sessions: Sender<WireSession>,
    /// `None`: the producer is dead.
    samples: Option<Sender<WireSample>>,
    verdicts: Sender<WireVerdict>,
    commands: Receiver<WireCommand>,
    sequence: u64,
    rods: [f64; 2],
    /// Velocity of the rods over what their valves ask for.
    obedience: f64,
    imu: usize,
    last: WireCommand,
    // after everything that is in it
    node: LiveNode,
    world: World,
}

impl Bench {
    /// A control without a session.
    fn new(test: &str, stays: bool) -> Self {
        let world = World::new(test);
        let node = world.join();
        let (file, urdf) = machine("second_paper");
        let clock: &SteeredClock = Box::leak(Box::new(SteeredClock::at(START)));
        let options = LoopOptions {
            wake: Wake::Poll,
            stays,
        };
        let (file, urdf) = (Box::leak(Box::new(file)), Box::leak(Box::new(urdf)));
        let hash = standing().session.machine_hash;
        Self {
            commands: node.receiver().unwrap(),
            control: ControlProgram::new(&node, file, urdf, clock, options).unwrap(),
            clock,
            sessions: node.sender(SESSION, hash).unwrap(),
            samples: Some(node.sender(SESSION, hash).unwrap()),
            verdicts: node.sender(99, hash).unwrap(),
            sequence: 0,
            rods: [-0.18; 2],
            obedience: 1.0,
            imu: 0,
            last: WireCommand::closed(),
            node,
            world,
        }
    }

    /// A control whose valves follow, open at least that far.
    fn following(test: &str, stays: bool, opening: f64) -> Self {
        let mut bench = Self::new(test, stays);
        bench.sessions.send_raw(&announcement(SESSION)).unwrap();
        for _ in 0..400 {
            bench.row();
            if follows(&bench.last, opening) {
                return bench;
            }
        }
        panic!("{:?}", bench.last);
    }

    fn now_ns(&self) -> i64 {
        self.clock.now_ns.get()
    }

    fn pass(&self, time_ns: i64) {
        self.clock.now_ns.set(self.now_ns() + time_ns);
    }

    /// A cycle of the program; returns the number of its commands.
    fn cycle(&mut self, must_end: bool) -> (Progress, usize) {
        let progress = self.control.cycle(must_end).unwrap();
        (progress, self.receive())
    }

    fn receive(&mut self) -> usize {
        let mut count = 0;
        while let Some(command) = self.commands.receive(|command| *command).unwrap() {
            assert!(command.is_whole());
            self.last = command;
            count += 1;
        }
        count
    }

    /// A message of this session.
    fn send(&mut self, wire: &mut WireSample, session: u64) {
        seal_sample(wire, session, self.sequence, self.now_ns());
        self.sequence += 1;
        self.samples.as_ref().unwrap().send_raw(wire).unwrap();
    }

    /// The rod obeys no more, until that is a fault.
    fn disobey_until_it_is_found(&mut self) {
        self.obedience = 0.0;
        let mut rows = 0;
        while !self.last.has_rod_fault() {
            self.row();
            rows += 1;
            assert!(rows < 1000, "{:?}", self.last);
        }
    }

    /// A row of the session, with a verdict before it.
    fn row(&mut self) {
        self.pass(ROW_NS);
        move_rods(&mut self.rods, &self.last, self.obedience, ROW_NS);
        let now_ns = self.now_ns();
        let mut safe = verdict(Level::Safe, now_ns);
        self.verdicts.send_at(&mut safe, now_ns).unwrap();
        self.imu += 1;
        for kind in [Kind::Imu, Kind::Odometry, Kind::Joints] {
            let mut wire = standing().sample(kind, self.imu, self.rods);
            self.send(&mut wire, SESSION);
        }
        assert_eq!(self.cycle(false).0, Progress::Running);
    }

    /// Cycles of a millisecond until the program ends; returns their number.
    fn until_end(&mut self, must_end: bool) -> usize {
        for cycles in 1..200 {
            self.pass(MS);
            if self.cycle(must_end).0 == Progress::Ended {
                return cycles;
            }
        }
        panic!("never ends: {:?}", self.last);
    }
}

fn announcement(session: u64) -> WireSession {
    let session = Session {
        id: session,
        ..standing().session.clone()
    };
    let mut wire = WireSession::try_from(&session).unwrap();
    seal(&mut wire, &session, 0, START);
    wire
}

#[test]
fn valves_are_told_to_stay_closed_without_a_session() {
    let mut bench = Bench::new("idle", false);
    let mut count = 0;
    for _ in 0..100 {
        bench.pass(MS);
        let (progress, commands) = bench.cycle(false);
        assert_eq!(progress, Progress::Running);
        count += commands;
        assert_eq!((bench.last.session, bench.last.mode()), (0, Mode::Hold));
        assert!(bench.last.reasons().has(HoldReason::NoRow));
    }
    // every 20 ms
    assert_eq!(count, 5);
    assert_eq!(bench.cycle(true).0, Progress::Ended);
}

#[test]
fn commands_are_repeated_by_the_time_of_their_publication() {
    let mut bench = Bench::following("beat", true, 0.0);
    // no more rows: the valves close
    for _ in 0..200 {
        bench.pass(MS);
        bench.cycle(false);
    }
    assert_eq!(bench.last.mode(), Mode::Hold);
    let mut count = 0;
    for _ in 0..100 {
        bench.pass(MS);
        count += bench.cycle(false).1;
    }
    assert_eq!(count, 5);
}

#[test]
fn the_next_session_begins_with_its_first_sample() {
    let mut bench = Bench::following("succeed", false, 0.05);
    bench.sessions.send_raw(&announcement(NEXT)).unwrap();
    // the samples before belong to the session before
    for _ in 0..5 {
        bench.row();
        assert_eq!(
            (bench.last.session, bench.last.mode()),
            (SESSION, Mode::Follow)
        );
    }
    let before = bench.last;
    bench.pass(MS);
    let mut first = standing().sample(Kind::Imu, 0, bench.rods);
    bench.send(&mut first, NEXT);
    bench.cycle(false);
    assert_eq!((bench.last.session, bench.last.mode()), (NEXT, Mode::Ramp));
    for (now, was) in bench.last.opening.iter().zip(before.opening) {
        assert!(
            (now - was).abs() <= CLOSING_RATE * 1e-3 + 1e-12,
            "{now} {was}"
        );
    }
}

#[test]
fn the_session_after_a_dead_producer_begins_with_its_announcement() {
    let mut bench = Bench::following("dead", false, 0.0);
    bench.samples = None;
    bench.pass(MS);
    bench.cycle(false);
    assert_eq!(bench.last.session, SESSION);
    // one has announced a session, and was killed before its first sample
    bench.sessions.send_raw(&announcement(NEXT)).unwrap();
    for _ in 0..30 {
        bench.pass(MS);
        assert_eq!(bench.cycle(false).0, Progress::Running);
    }
    assert_eq!(bench.last.session, NEXT);
}

#[test]
fn a_session_of_another_machine_does_not_replace_one_that_runs() {
    let mut bench = Bench::following("foreign", false, 0.0);
    let mut foreign = announcement(NEXT);
    foreign.machine_hash ^= 1;
    foreign.seal(foreign.head());
    let hash = foreign.machine_hash;
    bench.sessions.send_raw(&foreign).unwrap();
    let mut sample = standing().sample(Kind::Imu, 0, bench.rods);
    sample.seal(Head {
        source: NEXT,
        machine_hash: hash,
        ..Head::default()
    });
    bench.samples.as_ref().unwrap().send_raw(&sample).unwrap();
    bench.row();
    assert_eq!(
        (bench.last.session, bench.last.mode()),
        (SESSION, Mode::Follow)
    );
}

#[test]
fn the_program_ends_with_its_session_when_the_valves_are_closed() {
    for stays in [false, true] {
        let mut bench = Bench::following(&format!("end{stays}"), stays, 0.05);
        bench.send(&mut WireSample::end(), SESSION);
        if !stays {
            assert!(bench.until_end(false) > 10);
            assert_eq!(
                (bench.last.mode(), bench.last.opening[0]),
                (Mode::Hold, 0.0)
            );
            continue;
        }
        for _ in 0..60 {
            bench.pass(MS);
            assert_eq!(bench.cycle(false).0, Progress::Running);
        }
        // it waits for the next session
        assert_eq!((bench.last.session, bench.last.mode()), (0, Mode::Hold));
    }
}

#[test]
fn the_program_closes_the_valves_before_it_obeys_a_signal() {
    for stays in [false, true] {
        let mut bench = Bench::following(&format!("signal{stays}"), stays, 0.05);
        assert!(bench.until_end(true) > 10);
        assert_eq!(
            (bench.last.mode(), bench.last.opening[0]),
            (Mode::Hold, 0.0)
        );
        assert!(bench.last.reasons().has(HoldReason::NoRow));
    }
}

#[test]
fn the_loop_runs_until_the_end_and_returns_its_counts() {
    let mut bench = Bench::following("run", false, 0.05);
    let rows = bench.last.rows;
    bench.send(&mut WireSample::end(), SESSION);
    bench.clock.look_ns.set(MS / 10);
    let housekeeping = Housekeeping::start(&bench.world.address()).unwrap();
    let counts = bench.control.run(&housekeeping).unwrap();
    assert_eq!((counts.rows, counts.lost, counts.refused), (rows, 0, 0));
    bench.receive();
    assert_eq!(
        (bench.last.mode(), bench.last.opening[0]),
        (Mode::Hold, 0.0)
    );
}

// requirement: TW-CONTROL-07
#[test]
fn acknowledgements_count_for_the_fault_that_was_seen() {
    let mut bench = Bench::following("seen", true, 0.05);
    let hash = standing().session.machine_hash;
    let mut operator = bench.node.sender::<WireAcknowledge>(5, hash).unwrap();
    let before = WireAcknowledge::of_command(&bench.last);
    bench.disobey_until_it_is_found();
    bench.obedience = 1.0;
    // seen before there was a fault, and of somebody else's command
    let seen = WireAcknowledge::of_command(&bench.last);
    let other = WireAcknowledge {
        verdict_source: seen.verdict_source ^ 1,
        ..seen
    };
    for mut acknowledgement in [before, other] {
        operator.send(&mut acknowledgement).unwrap();
        bench.row();
        bench.row();
        assert!(bench.last.has_rod_fault());
    }
    operator.send(&mut seen.clone()).unwrap();
    bench.row();
    bench.row();
    assert!(!bench.last.has_rod_fault());
}

/// The end of a session mends no rod: the control that stays holds in the next one, too.
// requirement: TW-CONTROL-07
#[test]
fn rod_that_does_not_obey_is_known_in_the_session_after_the_end() {
    let mut bench = Bench::following("over", true, 0.05);
    bench.disobey_until_it_is_found();
    bench.send(&mut WireSample::end(), SESSION);
    for _ in 0..60 {
        bench.pass(MS);
        bench.cycle(false);
    }
    assert_eq!((bench.last.session, bench.last.mode()), (0, Mode::Hold));
    bench.sessions.send_raw(&announcement(NEXT)).unwrap();
    for _ in 0..60 {
        bench.pass(MS);
        bench.cycle(false);
    }
    assert_eq!(bench.last.session, NEXT);
    assert!(bench.last.has_rod_fault(), "{:?}", bench.last);
}

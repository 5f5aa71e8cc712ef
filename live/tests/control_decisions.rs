//! Every decision of the control on both sides, in the process of the test: no shared memory, no monitor, and time that
//! the test steers. What the programs do together is tested in `control.rs`.

use tipwatch_live::control::Control;
use tipwatch_live::safety_limits::{
    CLOSING_PERIOD_NS, CLOSING_RATE, DEADLINE_NS, GOOD_ROWS, HEARTBEAT_NS, MAX_ROW_AGE_NS,
    PERSISTENT, PERSISTENT_LATE, UNTIMED_SILENCE_NS,
};
use tipwatch_live::wire::command::{HoldReason, Mode};
use tipwatch_live::wire::session::{Progress, Session};
use tipwatch_live::wire::topics::{
    EVENT_BETWEEN, EVENT_ROW, Kind, Wire, WireCommand, WireSample, WireVerdict,
};
use tipwatch_live::wire::verdict::GroundUnknown;
use tipwatch_mechanics::estimation::support_configuration::GroundGap;
use tipwatch_mechanics::machine::Proofs;
use tipwatch_mechanics::state::{Reason, Reasons};
use tipwatch_mechanics::verdict::{Basis, InputFault, InputFaults, Level};

use crate::support::standing::{
    SESSION, START, follows, move_rods, seal_sample, seal_verdict, standing, verdict,
};

const MS: i64 = 1_000_000;
/// Time from row to row (ns).
const ROW_NS: i64 = 10 * MS;

/// A control of a machine that stands still, with rods that obey the valves.
struct Bench {
    control: Control,
    sequence: u64,
    now_ns: i64,
    /// Whether verdicts that permit motion come with every row.
    is_judged: bool,
    rods: [f64; 2],
    /// Velocity of the rods over what their valves ask for.
    obedience: f64,
    /// Time from the look at the clock to the publication of a command (ns).
    publishing_ns: i64,
    imu: usize,
    commands: Vec<WireCommand>,
}

impl Bench {
    fn new() -> Self {
        Self::with(|_| {})
    }

    fn with(change: impl FnOnce(&mut Session)) -> Self {
        let world = standing();
        let mut session = world.session.clone();
        change(&mut session);
        Self {
            control: Control::new(world.machine.clone(), &world.sensors, &session, START).unwrap(),
            sequence: 0,
            now_ns: START,
            is_judged: true,
            rods: [-0.18; 2],
            obedience: 1.0,
            publishing_ns: 0,
            imu: 0,
            commands: Vec::new(),
        }
    }

    fn last(&self) -> WireCommand {
        self.commands
            .last()
            .copied()
            .unwrap_or_else(WireCommand::closed)
    }

    /// Whether the last command holds the valves for this reason.
    fn has(&self, reason: HoldReason) -> bool {
        self.last().reasons().has(reason)
    }

    fn seal(&mut self, wire: &mut WireSample) {
        seal_sample(wire, SESSION, self.sequence, self.now_ns);
        self.sequence += 1;
    }

    /// Gives the control a message; returns what is to come.
    fn take(&mut self, wire: &WireSample) -> Progress {
        let (commands, published_ns) = (&mut self.commands, self.now_ns + self.publishing_ns);
        let mut publish = |command: &mut WireCommand| {
            commands.push(*command);
            published_ns
        };
        self.control.take(wire, self.now_ns, &mut publish).unwrap()
    }

    fn tick(&mut self) -> Option<WireCommand> {
        let (commands, published_ns) = (&mut self.commands, self.now_ns + self.publishing_ns);
        let before = commands.len();
        let mut publish = |command: &mut WireCommand| {
            commands.push(*command);
            published_ns
        };
        self.control.tick(self.now_ns, &mut publish);
        (commands.len() > before).then(|| *commands.last().unwrap())
    }

    /// A verdict of this level, valid from now.
    fn verdict(&self, level: Level) -> WireVerdict {
        verdict(level, self.now_ns)
    }

    fn sample(&mut self, kind: Kind) -> WireSample {
        self.imu += usize::from(kind == Kind::Imu);
        standing().sample(kind, self.imu, self.rods)
    }

    /// The samples of the next row, and the row's command. The program's cycle ends after that.
    fn row(&mut self) -> WireCommand {
        self.changed_row(|_| {})
    }

    fn changed_row(&mut self, change: impl Fn(&mut WireSample)) -> WireCommand {
        let command = self.row_only(change);
        self.tick();
        command
    }

    /// Gives the samples of the next row without the end of a cycle, and returns the row's command.
    fn row_only(&mut self, change: impl Fn(&mut WireSample)) -> WireCommand {
        self.row_after(ROW_NS, change)
    }

    fn row_after(&mut self, period_ns: i64, change: impl Fn(&mut WireSample)) -> WireCommand {
        self.now_ns += period_ns;
        let command = self.last();
        move_rods(&mut self.rods, &command, self.obedience, period_ns);
        if self.is_judged {
            self.control.verdict(&self.verdict(Level::Safe));
        }
        for kind in [Kind::Imu, Kind::Odometry, Kind::Joints] {
            let mut wire = self.sample(kind);
            change(&mut wire);
            self.seal(&mut wire);
            assert_eq!(self.take(&wire), Progress::Running);
        }
        self.last()
    }

    /// Rows until the valves follow, and are open at least that far.
    fn runs_in(&mut self, opening: f64) {
        for _ in 0..1000 {
            if follows(&self.row(), opening) {
                return;
            }
        }
        panic!(
            "{:?} {:?}",
            self.last().reasons().iter().collect::<Vec<_>>(),
            self.last()
        );
    }
}

fn no_rod(wire: &mut WireSample) {
    if wire.kind == Kind::Joints as u32 {
        wire.values[standing().rods[0]] = f64::NAN;
    }
}

// requirement: TW-CONTROL-11
#[test]
fn valves_follow_after_enough_good_rows() {
    let mut bench = Bench::new();
    let first = bench.tick().unwrap();
    let reasons: Vec<_> = first.reasons().iter().collect();
    assert_eq!(reasons, [HoldReason::NoRow, HoldReason::NoVerdict]);
    assert_eq!((first.mode(), first.event), (Mode::Hold, EVENT_BETWEEN));
    assert_eq!((first.session, first.actuator_count), (SESSION, 2));
    let (mut starting, mut rows) = (0, 0);
    while bench.last().mode() != Mode::Follow {
        let command = bench.row();
        rows += 1;
        assert!(rows < 100, "{command:?}");
        assert_eq!((command.event, command.rows), (EVENT_ROW, rows));
        assert_eq!(command.sample_sequence, 3 * rows - 1);
        assert_eq!(command.sample_published_ns, bench.now_ns);
        for (measured, rod) in command.measured.iter().zip(bench.rods) {
            assert!((measured - rod).abs() < 1e-9, "{measured} {rod}");
        }
        assert_eq!(
            (command.level, command.verdict_sequence),
            (Level::Safe as u32, 5)
        );
        let reasons: Vec<_> = command.reasons().iter().collect();
        match &reasons[..] {
            [HoldReason::RowInvalid] => assert_eq!(starting, 0),
            [HoldReason::Starting] => starting += 1,
            _ => assert!(reasons.is_empty(), "{reasons:?}"),
        }
    }
    assert_eq!(starting, GOOD_ROWS - 1);
    assert_eq!(
        (bench.control.session(), bench.control.counts().rows),
        (SESSION, rows)
    );
    for _ in 0..20 {
        let command = bench.row();
        assert_eq!(command.mode(), Mode::Follow);
        assert!(command.status().is_some() && command.cost.is_finite());
        assert!(command.reference[..2].iter().all(|rod| rod.is_finite()));
    }
}

#[test]
fn references_and_valves_move_within_their_limits() {
    let mut bench = Bench::new();
    let mut before = bench.last();
    let seconds = ROW_NS as f64 * 1e-9;
    for _ in 0..200 {
        let command = bench.row();
        for rod in 0..2 {
            let step = command.reference[rod] - before.reference[rod];
            // the machine file allows 0.1 m/s; NaN before the valves follow
            assert!(!(step.abs() > 0.1 * seconds + 1e-12), "{step}");
            let turn = (command.opening[rod] - before.opening[rod]).abs();
            assert!(turn <= 20.0 * seconds + 1e-12, "{turn}");
        }
        before = command;
    }
    assert_eq!(before.mode(), Mode::Follow);
    assert!(
        bench.rods.iter().all(|rod| *rod > -0.175),
        "{:?}",
        bench.rods
    );
}

// requirement: TW-CONTROL-04
#[test]
fn motion_is_permitted_by_known_levels_without_a_latched_fault() {
    let (none, values) = (InputFaults::NONE, InputFault::NotFinite.into());
    for (level, latched, faults, permits) in [
        (Level::Safe, Level::Safe, none, true),
        (Level::Danger, Level::Danger, none, true),
        (Level::Danger, Level::Danger, values, false),
        (Level::Assumed, Level::Assumed, none, true),
        (Level::Unknown, Level::Safe, none, false),
        (Level::Unknown, Level::Fault, none, false),
        (Level::Fault, Level::Safe, values, false),
        (Level::Safe, Level::Fault, none, false),
    ] {
        let mut bench = Bench::new();
        bench.runs_in(0.0);
        bench.is_judged = false;
        let mut verdict = bench.verdict(level);
        verdict.latched_level = latched as u32;
        verdict.held_faults = faults.bits();
        seal_verdict(&mut verdict, standing().session.machine_hash);
        bench.control.verdict(&verdict);
        let command = bench.row();
        assert_eq!(
            command.mode() == Mode::Follow,
            permits,
            "{level:?} {latched:?}"
        );
        assert_eq!(bench.has(HoldReason::Verdict), !permits);
        assert!(!bench.has(HoldReason::Starting));
    }
}

/// Whatever the level and its basis: that loads are known on supports without reference loads is no exception.
// requirement: TW-CONTROL-04
#[test]
fn valves_do_not_follow_while_the_ground_is_unknown() {
    for (gap, permits) in [
        (None, true),
        (Some(GroundUnknown::Gap(GroundGap::Transition)), false),
        (Some(GroundUnknown::Gap(GroundGap::Taken)), false),
        (Some(GroundUnknown::Impossible), false),
        (Some(GroundUnknown::NoReferenceLoads), false),
    ] {
        for level in [Level::Safe, Level::Warning, Level::Danger] {
            let mut bench = Bench::new();
            bench.runs_in(0.0);
            bench.is_judged = false;
            let mut verdict = bench.verdict(level);
            verdict.ground_gap = gap.map_or(0, GroundUnknown::number);
            seal_verdict(&mut verdict, standing().session.machine_hash);
            bench.control.verdict(&verdict);
            let follows = bench.row().mode() == Mode::Follow;
            assert_eq!(follows, permits, "{level:?} {gap:?}");
        }
    }
}

/// Whatever the level. That the alarm is not on the disk says nothing of the sensors.
// requirement: TW-CONTROL-04
#[test]
fn valves_do_not_follow_doubted_sensors() {
    let none = InputFaults::NONE;
    let unsaved = InputFaults::from(InputFault::AlarmUnsaved);
    let mut both = InputFaults::from(InputFault::Stale);
    both.add_all(unsaved);
    let contradicted = {
        let mut reasons = Reasons::NONE;
        reasons.add(Reason::Contradiction);
        u32::from(reasons.bits())
    };
    for (basis, cautions, held_reasons, permits) in [
        (Basis::Assumed, none, 0, true),
        (Basis::Doubted, none, 0, false),
        (Basis::Doubted, none, contradicted, false),
        (Basis::Doubted, InputFault::Stale.into(), 0, false),
        (Basis::Doubted, unsaved, 0, true),
        (Basis::Doubted, unsaved, contradicted, false),
        (Basis::Doubted, both, 0, false),
    ] {
        for level in [Level::Warning, Level::Danger] {
            let mut bench = Bench::new();
            bench.runs_in(0.0);
            bench.is_judged = false;
            let mut verdict = bench.verdict(level);
            verdict.basis = basis as u32;
            verdict.held_cautions = cautions.bits();
            verdict.held_reasons = held_reasons;
            seal_verdict(&mut verdict, standing().session.machine_hash);
            bench.control.verdict(&verdict);
            let follows = bench.row().mode() == Mode::Follow;
            assert_eq!(
                follows, permits,
                "{level:?} {basis:?} {cautions:?} {held_reasons}"
            );
        }
    }
}

// requirement: TW-CONTROL-03
#[test]
fn verdicts_that_are_damaged_or_of_others_are_ignored() {
    let own = standing().session.machine_hash;
    let forged: [fn(&mut WireVerdict); 4] = [
        |verdict| verdict.checksum ^= 1,
        |verdict| {
            verdict.session ^= 1;
            seal_verdict(verdict, standing().session.machine_hash);
        },
        |verdict| seal_verdict(verdict, standing().session.machine_hash ^ 1),
        |verdict| {
            verdict.session ^= 1;
            seal_verdict(verdict, standing().session.machine_hash ^ 1);
        },
    ];
    for forge in forged {
        let mut bench = Bench::new();
        bench.runs_in(0.0);
        bench.is_judged = false;
        let mut fault = bench.verdict(Level::Fault);
        forge(&mut fault);
        bench.control.verdict(&fault);
        assert_eq!(bench.row().mode(), Mode::Follow);
        // nor does one renew what has expired
        for _ in 0..15 {
            let mut safe = bench.verdict(Level::Safe);
            forge(&mut safe);
            bench.control.verdict(&safe);
            bench.row();
        }
        assert!(bench.has(HoldReason::NoVerdict));
        let mut whole = bench.verdict(Level::Safe);
        seal_verdict(&mut whole, own);
        bench.control.verdict(&whole);
        bench.row();
        assert!(!bench.has(HoldReason::NoVerdict));
    }
}

// requirement: TW-CONTROL-03
#[test]
fn verdicts_count_until_they_expire() {
    for (late_ns, counts) in [(0, true), (1, false)] {
        let mut bench = Bench::new();
        bench.runs_in(0.0);
        let mut verdict = bench.verdict(Level::Safe);
        verdict.valid_until_ns = bench.now_ns + 30 * MS;
        seal_verdict(&mut verdict, standing().session.machine_hash);
        bench.control.verdict(&verdict);
        bench.now_ns += 30 * MS + late_ns;
        let command = bench.tick().unwrap();
        assert_eq!(command.mode() == Mode::Follow, counts);
        assert_eq!(bench.has(HoldReason::NoVerdict), !counts);
    }
}

// requirement: TW-CONTROL-01
#[test]
fn rows_count_until_they_are_too_old() {
    for (age_ns, counts) in [(MAX_ROW_AGE_NS, true), (MAX_ROW_AGE_NS + 1, false)] {
        let mut bench = Bench::new();
        bench.runs_in(0.0);
        bench.now_ns += age_ns;
        let command = bench.tick().unwrap();
        assert_eq!(command.mode() == Mode::Follow, counts, "{age_ns}");
        assert_eq!(bench.has(HoldReason::NoRow), !counts);
    }
    // time says nothing of the rows of an untimed session
    let mut bench = Bench::with(|session| session.pace = 0.0);
    bench.runs_in(0.0);
    bench.now_ns += MAX_ROW_AGE_NS + 1;
    assert_eq!(bench.tick().unwrap().mode(), Mode::Follow);
    bench.now_ns += UNTIMED_SILENCE_NS;
    bench.tick();
    assert!(!bench.has(HoldReason::NoRow) && bench.has(HoldReason::Input));
}

// requirement: TW-CONTROL-02
#[test]
fn rows_without_a_known_state_close_the_valves() {
    let mut bench = Bench::new();
    // no posture from the first row on
    for _ in 0..60 {
        bench.changed_row(no_rod);
        assert!(bench.has(HoldReason::RowInvalid) && !bench.has(HoldReason::Starting));
    }
    bench.runs_in(0.0);
    // the first one does, though the state of its row is bridged
    for _ in 0..30 {
        assert_ne!(bench.changed_row(no_rod).mode(), Mode::Follow);
        assert!(bench.has(HoldReason::RowInvalid));
    }
    bench.runs_in(0.0);
}

/// A stroke that no linkage can have gives no posture to begin with, though each row says what was measured.
// requirement: TW-CONTROL-02
#[test]
fn controls_do_not_begin_with_an_impossible_posture() {
    let mut bench = Bench::new();
    bench.rods[0] = 5.0;
    for k in 0..100 {
        bench.row();
        assert!(bench.has(HoldReason::RowInvalid), "{k}");
    }
    // back where it was, it has jumped: somebody must say that it can be trusted
    bench.rods[0] = -0.18;
    for k in 0..300 {
        assert_ne!(bench.row().mode(), Mode::Follow, "{k}");
    }
    let mut verdict = bench.verdict(Level::Safe);
    verdict.acknowledged_signals = Proofs::ALL.bits();
    seal_verdict(&mut verdict, standing().session.machine_hash);
    bench.control.verdict(&verdict);
    bench.runs_in(0.0);
}

// requirement: TW-CONTROL-05
#[test]
fn faults_of_the_input_close_the_valves() {
    let mut bench = Bench::new();
    bench.runs_in(0.0);
    for sent in 1..=PERSISTENT {
        let mut wire = bench.sample(Kind::Imu);
        bench.seal(&mut wire);
        bench.sequence -= 1;
        wire.source = SESSION ^ 1;
        wire.seal(wire.head());
        bench.take(&wire);
        bench.tick();
        assert_eq!(bench.has(HoldReason::Input), sent == PERSISTENT);
    }
    assert_ne!(bench.last().mode(), Mode::Follow);
    // the row reports it again
    let command = bench.row_only(|_| {});
    assert!(command.reasons().has(HoldReason::Input));
    bench.runs_in(0.0);
    // and of the messages that a row is made of, every one is counted
    assert_eq!(bench.control.counts().refused, u64::from(PERSISTENT));
}

// requirement: TW-CONTROL-09
#[test]
fn rods_outside_their_stroke_close_the_valves() {
    let mut bench = Bench::new();
    bench.runs_in(0.0);
    assert!(!bench.has(HoldReason::OutsideStroke));
    let mut is_seen = false;
    for _ in 0..20 {
        // by steps that a rod can make
        bench.rods[0] += 0.0125;
        is_seen |= bench.row().reasons().has(HoldReason::OutsideStroke);
    }
    assert!(is_seen);
    assert_eq!(bench.last().mode(), Mode::Hold);
}

// requirement: TW-CONTROL-07, TW-CONTROL-08
#[test]
fn rods_that_do_not_obey_close_the_valves_until_acknowledged() {
    for (obedience, fault, other) in [
        (0.0, HoldReason::NotFollowing, HoldReason::WrongWay),
        (-1.0, HoldReason::WrongWay, HoldReason::NotFollowing),
    ] {
        let mut bench = Bench::new();
        bench.obedience = obedience;
        let mut rows = 0;
        while !bench.has(fault) {
            bench.row();
            rows += 1;
            assert!(rows < 1000, "{fault:?} {:?}", bench.last());
        }
        assert!(!bench.has(other));
        bench.obedience = 1.0;
        for _ in 0..50 {
            bench.row();
        }
        assert!(bench.has(fault) && bench.last().mode() == Mode::Hold);
        // whoever takes over takes that over, too
        let mut next = Bench::new();
        next.control.succeed(&bench.control);
        next.row();
        assert!(next.has(fault));
        for mut bench in [bench, next] {
            bench.control.acknowledge();
            bench.runs_in(0.0);
            assert!(!bench.has(fault));
        }
    }
}

// requirement: TW-CONTROL-10
#[test]
fn late_commands_close_the_valves() {
    let mut bench = Bench::new();
    bench.runs_in(0.0);
    let after = |bench: &mut Bench, delays_ns: &[i64]| {
        for delay_ns in delays_ns {
            bench.publishing_ns = *delay_ns;
            bench.row_only(|_| {});
        }
        bench.publishing_ns = 0;
        bench.row_only(|_| {}).reasons().has(HoldReason::Late)
    };
    let late = DEADLINE_NS + 1;
    assert!(!after(
        &mut bench,
        &[DEADLINE_NS; 2 * PERSISTENT_LATE as usize]
    ));
    assert!(!after(&mut bench, &[late, late, 0, late, late]));
    assert!(after(&mut bench, &[late; PERSISTENT_LATE as usize]));
    bench.runs_in(0.0);
}

#[test]
fn valves_close_smoothly_and_follow_again_only_when_closed() {
    let mut bench = Bench::new();
    bench.runs_in(0.05);
    let mut before = bench.last();
    // a fault for one row
    let mut unknown = bench.verdict(Level::Unknown);
    seal_verdict(&mut unknown, standing().session.machine_hash);
    bench.control.verdict(&unknown);
    bench.tick();
    assert!(bench.has(HoldReason::Verdict));
    let (mut good, mut ramps) = (0, 0);
    while bench.last().mode() != Mode::Follow {
        let command = bench.row_after(MS, |_| {});
        good += 1;
        assert!(good < 100);
        for (now, was) in command.opening.iter().zip(before.opening) {
            assert!(
                (now - was).abs() <= CLOSING_RATE * 1e-3 + 1e-12,
                "{now} {was}"
            );
            assert!(command.mode() == Mode::Follow || now.abs() <= was.abs());
        }
        if command.mode() == Mode::Ramp {
            assert!(command.opening != [0.0; 2]);
            ramps += 1;
        }
        let is_closed = before.opening == [0.0; 2];
        assert!(command.mode() != Mode::Follow || is_closed, "{before:?}");
        before = command;
    }
    // 0.05 of an opening takes longer than the good rows
    assert!(ramps >= 11 && good > GOOD_ROWS, "{ramps} {good}");
}

#[test]
fn references_begin_where_the_rods_are() {
    let mut bench = Bench::new();
    bench.runs_in(0.02);
    bench.is_judged = false;
    for _ in 0..40 {
        bench.row();
    }
    assert_eq!(bench.last().opening, [0.0; 2]);
    // somebody else moves them, by less than would be noticed
    for _ in 0..20 {
        bench.rods = bench.rods.map(|rod| rod + 0.001);
        bench.row();
    }
    for _ in 0..40 {
        bench.row();
    }
    bench.is_judged = true;
    while bench.last().mode() != Mode::Follow {
        bench.row();
    }
    let command = bench.last();
    for (reference, rod) in command.reference.iter().zip(bench.rods) {
        assert!((reference - rod).abs() < 5e-4, "{reference} {rod}");
    }
}

#[test]
fn commands_are_repeated_in_time_and_changes_sent_at_once() {
    // closed: from time to time
    let mut bench = Bench::new();
    assert!(bench.tick().is_some());
    bench.now_ns += HEARTBEAT_NS - 1;
    assert!(bench.tick().is_none());
    bench.now_ns += 1;
    assert_eq!(bench.tick().unwrap().event, EVENT_BETWEEN);
    // following: the same
    bench.runs_in(0.1);
    bench.now_ns += HEARTBEAT_NS - 1;
    assert!(bench.tick().is_none());
    bench.now_ns += 1;
    assert!(bench.tick().is_some());
    // a change: at once
    assert!(bench.tick().is_none());
    bench.control.verdict(&bench.verdict(Level::Unknown));
    let command = bench.tick().unwrap();
    assert_eq!(command.mode(), Mode::Ramp);
    // closing: often
    assert!(bench.tick().is_none());
    bench.now_ns += CLOSING_PERIOD_NS - 1;
    assert!(bench.tick().is_none());
    bench.now_ns += 1;
    let next = bench.tick().unwrap();
    assert!(next.opening[0].abs() < command.opening[0].abs());
    // another reason: at once, too
    bench.control.end();
    let over = bench.tick().unwrap();
    assert!(over.reasons().has(HoldReason::NoRow));
    assert!(bench.tick().is_none());
}

#[test]
fn successor_goes_on_from_the_openings_before() {
    let mut bench = Bench::new();
    bench.runs_in(0.05);
    let before = bench.last();
    let mut next = Bench::new();
    next.control.succeed(&bench.control);
    next.now_ns = bench.now_ns + MS;
    let command = next.tick().unwrap();
    assert_eq!(command.mode(), Mode::Ramp);
    for (now, was) in command.opening.iter().zip(before.opening) {
        let step = was.abs() - now.abs();
        assert!(
            (step - was.abs().min(CLOSING_RATE * 1e-3)).abs() < 1e-12,
            "{now} {was}"
        );
    }
    assert!(!next.has(HoldReason::NotFollowing) && !next.has(HoldReason::WrongWay));
}

#[test]
fn ended_controls_are_done_when_the_valves_are_closed() {
    let mut bench = Bench::new();
    assert!(!bench.control.is_done());
    bench.runs_in(0.05);
    let mut end = WireSample::end();
    bench.seal(&mut end);
    assert_eq!(bench.take(&end), Progress::Ended);
    assert!(!bench.control.is_done());
    bench.control.end();
    let mut cycles = 0;
    while !bench.control.is_done() {
        bench.now_ns += MS;
        bench.tick();
        cycles += 1;
        assert!(cycles < 100);
        assert!(bench.has(HoldReason::NoRow));
    }
    assert!(cycles > 10);
    let last = bench.last();
    assert_eq!((last.mode(), last.opening), (Mode::Hold, [0.0; 2]));
}

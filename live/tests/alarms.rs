//! An alarm stays until somebody who has seen it acknowledges it: over the end of a session, a restart of the monitor and
//! a kill, and whatever else arrives as an acknowledgement.

use std::time::{Duration, Instant};

use jiff::{SignedDuration, Timestamp};
use tipwatch_analyze::setup::commissioning::from_log;
use tipwatch_binding::{Commissioning, MachineFile};
use tipwatch_live::alarm::{AlarmFile, AlarmStore, Kept};
use tipwatch_live::node::{LiveNode, Sender};
use tipwatch_live::wire::session::machine_hash;
use tipwatch_live::wire::topics::{Head, Kind, Wire, WireAcknowledge, WireVerdict};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Basis, InputFault, Latch, Level};

use crate::support::World;
use crate::support::feed::{Feed, Time};
use crate::support::killing::Reading;
use crate::support::producing::Producing;
use crate::support::steered::Steered;

/// A wheel of this machine lifts at 1 s and comes down again.
const MACHINE: &str = "tiny_lift";

struct Bench {
    feed: Feed<Steered>,
    node: LiveNode,
    world: World,
}

impl Bench {
    fn new(test: &str) -> Self {
        let world = World::new(test);
        let node = world.join();
        let feed = feed(&node, Steered::monitor(&world, MACHINE));
        Self { feed, node, world }
    }

    /// The alarm is raised and over: a verdict that carries it.
    fn raised(test: &str) -> (Self, WireVerdict) {
        let mut bench = Self::new(test);
        bench.feed.send(1060);
        let verdict = bench.last();
        assert_eq!(verdict.latched_level, Level::Danger as u32);
        assert!(
            verdict.verdict().level < Level::Danger,
            "{:?}",
            verdict.verdict()
        );
        (bench, verdict)
    }

    /// The newest verdict.
    fn last(&mut self) -> WireVerdict {
        last(&mut self.feed)
    }

    fn acknowledger(&self) -> Sender<WireAcknowledge> {
        self.node.sender(0, 0).unwrap()
    }
}

fn feed(node: &LiveNode, time: Steered) -> Feed<Steered> {
    feed_of(node, MACHINE, time)
}

fn feed_of(node: &LiveNode, machine: &str, time: Steered) -> Feed<Steered> {
    let mut feed = Feed::new(node, machine, time);
    feed.wait_for_monitor();
    feed
}

/// The newest verdict.
fn last(feed: &mut Feed<Steered>) -> WireVerdict {
    feed.time.pass(Duration::from_millis(1));
    let mut last = None;
    while last.is_none() {
        while let Some(verdict) = feed.verdicts.receive(|v| *v).unwrap() {
            last = Some(verdict);
        }
        // without samples there is one every 20 ms
        feed.time.pass(Duration::from_millis(1));
    }
    last.unwrap()
}

// requirement: TW-VERDICT-20
#[test]
fn alarm_outlives_the_end_of_its_session() {
    let (mut bench, _) = Bench::raised("end");
    bench.feed.end();
    // without a session too
    assert_eq!(bench.last().latch(), Latch::raised(Level::Danger));
    let Feed { time, producer, .. } = bench.feed;
    drop(producer);
    let mut next = feed(&bench.node, time);
    next.send(100);
    let verdict = last(&mut next);
    assert_eq!(verdict.latched_level, Level::Danger as u32);
    assert_eq!(verdict.inherited_alarm, Level::Danger as u32);
}

// requirement: TW-VERDICT-20
#[test]
fn alarm_outlives_a_restart_of_the_monitor() {
    let (mut bench, before) = Bench::raised("restart");
    bench.feed.time.stop_monitor();
    bench.feed.time.start_monitor();
    bench.feed.wait_for_monitor();
    let verdict = bench.last();
    assert_ne!(verdict.source, before.source);
    assert_eq!(verdict.latch(), Latch::raised(Level::Danger));
    assert!(verdict.verdict().latched_level >= Level::Danger);
    // an acknowledgement goes to the monitor that is there
    let mut sender = bench.acknowledger();
    let mut old = WireAcknowledge::of(&before);
    sender.send_for(before.machine_hash, &mut old).unwrap();
    bench.feed.send(5);
    assert_eq!(bench.last().latch(), Latch::raised(Level::Danger));
    let mut new = WireAcknowledge::of(&verdict);
    sender.send_for(verdict.machine_hash, &mut new).unwrap();
    bench.feed.send(5);
    // it has not seen yet that the alarm is over, nor has the next one
    for _ in 0..2 {
        let latch = bench.last().latch();
        assert_eq!(
            (latch.level, latch.is_acknowledged),
            (Some(Level::Danger), true)
        );
        bench.feed.time.stop_monitor();
        bench.feed.time.start_monitor();
        bench.feed.find(|_| false);
    }
}

// requirement: TW-VERDICT-20
#[test]
fn alarm_outlives_a_kill() {
    let world = World::new("killed");
    let node = world.join();
    let machine = crate::support::data("tiny_lift.toml");
    let producing = Producing::start(&world.address(), MACHINE);
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let reading = Reading::new(&node);
    let raised = reading.wait_for("the alarm", |verdict| verdict.alarm != 0);
    let file = AlarmFile::new(world.state.path(), raised.machine_hash, "hdmm_rigid");
    // the time that a write to the disk takes
    for _ in 0..500 {
        if file.read().unwrap().latch != Latch::default() {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    monitor.kill();
    node.remove_dead_nodes();
    let _monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let first = reading.wait_for("a new monitor", |verdict| verdict.source != raised.source);
    assert_eq!(first.alarm, Level::Danger as u32);
    assert!(first.verdict().latched_level >= Level::Danger);
    producing.end();
}

// requirement: TW-VERDICT-21
#[test]
fn only_an_acknowledgement_of_the_alarm_counts() {
    let (mut bench, seen) = Bench::raised("forged");
    let good = |change: &dyn Fn(&mut WireAcknowledge)| {
        let mut message = WireAcknowledge::of(&seen);
        message.seal(Head {
            machine_hash: seen.machine_hash,
            ..Head::default()
        });
        change(&mut message);
        message
    };
    let again = |message: &mut WireAcknowledge| message.seal(message.head());
    let forged: [(&str, WireAcknowledge); 7] = [
        ("zeros", WireAcknowledge::blank()),
        ("checksum", good(&|message| message.checksum ^= 1)),
        ("magic", good(&|message| message.magic ^= 1)),
        (
            "machine",
            good(&|message| {
                message.machine_hash ^= 1;
                again(message);
            }),
        ),
        (
            "another monitor",
            good(&|message| {
                message.verdict_source ^= 1;
                again(message);
            }),
        ),
        (
            "before the alarm",
            good(&|message| {
                message.verdict_sequence = seen.alarm_sequence - 1;
                again(message);
            }),
        ),
        (
            "not published yet",
            good(&|message| {
                message.verdict_sequence = u64::MAX;
                again(message);
            }),
        ),
    ];
    let sender = bench.acknowledger();
    for (what, message) in &forged {
        sender.send_raw(message).unwrap();
        bench.feed.send(3);
        assert_eq!(bench.last().latch(), Latch::raised(Level::Danger), "{what}");
    }
    sender.send_raw(&good(&|_| ())).unwrap();
    bench.feed.send(5);
    assert_eq!(bench.last().latch(), Latch::default());
}

// requirement: TW-VERDICT-20, TW-VERDICT-21
#[test]
fn acknowledgement_without_a_session_is_of_the_alarm_before() {
    let (mut bench, _) = Bench::raised("idle");
    bench.feed.end();
    bench.feed.find(|_| false);
    let idle = bench.last();
    assert_eq!(idle.session, 0);
    let mut sender = bench.acknowledger();
    let mut message = WireAcknowledge::of(&idle);
    sender.send_for(idle.machine_hash, &mut message).unwrap();
    bench.feed.time.pass(Duration::from_millis(1));
    bench.feed.find(|_| false);
    let acknowledged = bench.last();
    // nobody knows whether it is over
    assert_eq!(acknowledged.alarm, Level::Danger as u32);
    assert_eq!(acknowledged.alarm_acknowledged, 1);
    let Feed { time, producer, .. } = bench.feed;
    drop(producer);
    let mut next = feed(&bench.node, time);
    next.send(50);
    let inherited = last(&mut next);
    assert_eq!(inherited.inherited_acknowledged, 1);
    // the wheel lifts again
    next.send(1010);
    let raised = last(&mut next);
    assert_eq!(raised.latch(), Latch::raised(Level::Danger));
    assert!(raised.alarm_sequence > inherited.sequence);
}

// requirement: TW-VERDICT-20
#[test]
fn damaged_alarm_file_counts_as_an_alarm() {
    let bench = Bench::new("damaged");
    let hash = bench.feed.hash;
    let Bench { world, node, feed } = bench;
    let Feed {
        mut time, producer, ..
    } = feed;
    drop(producer);
    time.stop_monitor();
    let file = AlarmFile::new(world.state.path(), hash, "hdmm_rigid");
    for damage in ["", "tipwatch-alarm 3 0000000000000000 none 0 - 00000000\n"] {
        std::fs::write(file.path(), damage).unwrap();
        time.start_monitor();
        let mut next = self::feed(&node, time);
        let verdict = last(&mut next);
        assert_eq!(verdict.latch(), Latch::raised(Level::Fault), "{damage:?}");
        assert_eq!(verdict.latched_level, Level::Fault as u32);
        let producer;
        Feed { time, producer, .. } = next;
        drop(producer);
        time.stop_monitor();
    }
}

// requirement: TW-FAULT-19
#[test]
fn alarm_that_cannot_be_saved_is_a_caution() {
    let mut world = World::new("unsaved");
    // a folder below a file
    let blocked = world.state.path().join("blocked");
    std::fs::write(&blocked, "").unwrap();
    let good = std::mem::replace(&mut world.state_folder, blocked);
    let mut feed = feed(&world.join(), Steered::monitor(&world, MACHINE));
    feed.send(100);
    let verdict = last(&mut feed);
    assert!(verdict.conditions().cautions.has(InputFault::AlarmUnsaved));
    assert!(verdict.verdict().level >= Level::Warning);
    drop(good);
}

// requirement: TW-FAULT-19
#[test]
fn removed_folder_of_the_alarm_is_made_again_and_told() {
    let world = World::new("removed");
    let monitor = world.monitor(
        &crate::support::data("tiny_lift.toml"),
        &["--quiet", "--stay"],
    );
    let is_kept = || {
        let files = std::fs::read_dir(&world.state_folder)
            .into_iter()
            .flatten()
            .flatten();
        let mut names = files.map(|file| file.path());
        names.any(|path| path.extension().is_some_and(|ending| ending == "txt"))
    };
    let wait = || {
        let start = Instant::now();
        while !is_kept() {
            assert!(start.elapsed() < crate::support::LIMIT);
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    wait();
    std::fs::remove_dir_all(&world.state_folder).unwrap();
    wait();
    let ended = monitor.kill();
    assert!(ended.err.contains("was removed"), "{}", ended.err);
}

/// A drive that moves all joints and the platform.
const DRIVE: &str = "commissioning";
/// Samples of a part of it that turns the machine.
const TURNS: usize = 6000;

/// Ends a session without its monitor.
fn ended(mut feed: Feed<Steered>) -> Steered {
    feed.end();
    feed.time
}

fn is_doubted(verdict: &WireVerdict) -> bool {
    let it = verdict.verdict();
    let may_be_so = matches!(it.level, Level::Safe | Level::Assumed | Level::Notice);
    it.basis == Basis::Doubted
        && !may_be_so
        && verdict
            .row_reasons()
            .iter()
            .any(|r| r == Reason::Contradiction)
}

/// An IMU that is mounted the other way round is found by the motion, and is found from then on: when the motion that showed
/// it is over, in the next session, and by the next monitor, until another commissioning.
// requirement: TW-VERDICT-29
#[test]
fn contradiction_stays_until_another_commissioning() {
    let started = Timestamp::now();
    let world = World::new("turned");
    let node = world.join();
    let mut wrong = feed_of(&node, DRIVE, Steered::monitor(&world, DRIVE));
    for sample in &mut wrong.samples {
        if sample.kind == Kind::Imu as u32 {
            for at in [0, 1, 3, 4] {
                sample.values[at] = -sample.values[at];
            }
        }
    }
    let found = wrong.rows(TURNS);
    let first = found.iter().position(is_doubted).unwrap();
    assert!(found[first..].iter().all(is_doubted), "from row {first} on");
    let hash = wrong.hash;
    let file = AlarmFile::new(world.state.path(), hash, "hdmm_rigid");

    // the next session, whose sensors show nothing
    let mut next = feed_of(&node, DRIVE, ended(wrong));
    let inherited = next.rows(400);
    assert!(inherited.len() > 50);
    assert!(inherited.iter().all(is_doubted));
    assert!(inherited.iter().all(|row| row.inherited_contradiction == 1));

    // the next monitor, and an acknowledgement of its alarm
    next.time.stop_monitor();
    let contradicted = file.read().unwrap().contradicted.unwrap();
    assert!((started..=later()).contains(&contradicted));
    next.time.start_monitor();
    next.wait_for_monitor();
    let seen = last(&mut next);
    let mut acknowledger: Sender<WireAcknowledge> = node.sender(0, 0).unwrap();
    let mut message = WireAcknowledge::of(&seen);
    acknowledger.send_for(hash, &mut message).unwrap();
    assert!(next.rows(400).iter().all(is_doubted));

    // a commissioning ends it if its drive is later and shows all that the loads hang on, and as long as it is bound
    let old = commissioned();
    let from = |time: Timestamp, open: &[&str]| {
        let mut made = Commissioning {
            recorded_from_ns: i64::try_from(time.as_nanosecond()).ok(),
            ..old.clone()
        };
        for item in &mut made.items {
            if open.iter().any(|open| item.key.starts_with(open)) {
                item.status = "not_shown".into();
            }
        }
        made
    };
    let after = contradicted + SignedDuration::from_secs(1);
    let cases = [
        ("the drive of before, assessed again", old.clone(), false),
        ("a file of version 1", unstamped(&old), false),
        (
            "a drive by a clock since the start of a controller",
            from(Timestamp::UNIX_EPOCH + SignedDuration::from_hours(1), &[]),
            false,
        ),
        ("three seconds of standing", from(after, &[""]), false),
        (
            "a drive without the arm",
            from(after, &["joint.lift."]),
            false,
        ),
        (
            "a drive at the time of the contradiction",
            from(contradicted, &[]),
            false,
        ),
        ("a drive of tomorrow", from(tomorrow(), &[]), false),
        (
            "a file of version 2, which does not say where its joints were",
            without_positions(from(after, &[])),
            false,
        ),
        ("a drive afterwards", from(after, &[]), true),
        (
            "a drive without the gyro",
            from(after, &["imu.angular"]),
            false,
        ),
        ("a drive afterwards, again", from(after, &[]), true),
        ("the drive of before", old.clone(), false),
    ];
    // no drive is of the future
    while Timestamp::now() <= after {
        std::thread::sleep(Duration::from_millis(10));
    }
    let mut time = ended(next);
    for (what, commissioning, ends) in cases {
        time.stop_monitor();
        time.commissioning = Some(Box::leak(Box::new(commissioning)));
        time.start_monitor();
        let mut good = feed_of(&node, DRIVE, time);
        let judged = good.rows(400);
        let inherits = |row: &WireVerdict| row.inherited_contradiction == 1;
        assert!(judged.len() > 50, "{what}");
        assert!(judged.iter().all(|row| inherits(row) != ends), "{what}");
        let is_calm = |row: &WireVerdict| row.verdict().level.sees_no_danger();
        assert_eq!(judged.iter().any(is_calm), ends, "{what}");
        time = ended(good);
    }
    time.stop_monitor();
    assert_eq!(file.read().unwrap().contradicted, Some(contradicted));
}

/// The result of the drive of the test data.
fn commissioned() -> Commissioning {
    let data = |extension: &str| crate::support::data(&format!("{DRIVE}.{extension}"));
    let file = MachineFile::read(&data("toml")).unwrap();
    let made = from_log(&data("mcap"), &file).unwrap().file;
    assert!(made.recorded_from_ns.is_some());
    made
}

fn without_positions(mut made: Commissioning) -> Commissioning {
    made.schema = 2;
    for item in &mut made.items {
        item.range = None;
    }
    made
}

fn unstamped(made: &Commissioning) -> Commissioning {
    Commissioning {
        recorded_from_ns: None,
        ..made.clone()
    }
}

/// After all that happens now, to the second.
fn later() -> Timestamp {
    Timestamp::from_second(Timestamp::now().as_second() + 1).unwrap()
}

fn tomorrow() -> Timestamp {
    Timestamp::now() + SignedDuration::from_hours(24)
}

/// The machine of the tests with this serial number: its hash and its identity.
fn with_serial(folder: &std::path::Path, serial: &str, comment: &str) -> (u64, String) {
    let text = std::fs::read_to_string(crate::support::data("tiny_lift.toml")).unwrap();
    std::fs::copy(
        crate::support::data("tiny_lift.urdf"),
        folder.join("tiny_lift.urdf"),
    )
    .unwrap();
    let path = folder.join("machine.toml");
    std::fs::write(&path, format!("{comment}\nserial = \"{serial}\"\n{text}")).unwrap();
    let file = MachineFile::read(&path).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    (machine_hash(&file, &urdf), file.spec.identity())
}

// requirement: TW-VERDICT-20
#[test]
fn what_is_name_and_what_is_serial_number_is_part_of_the_identity() {
    let mut spec = MachineFile::read(&crate::support::data("tiny_lift.toml"))
        .unwrap()
        .spec;
    let mut identity = |name: &str, serial: Option<&str>| {
        spec.name = name.into();
        spec.serial = serial.map(Into::into);
        spec.identity()
    };
    assert_ne!(
        identity("crane 1", Some("2")),
        identity("crane", Some("1 2"))
    );
    assert_ne!(identity("crane 1", None), identity("crane", Some("1")));
    // as it was kept before there were serial numbers
    assert_eq!(identity("crane", None), "crane");
}

/// Two machines of one name share neither an alarm nor a contradiction; one whose file was edited keeps both.
// requirement: TW-VERDICT-20
#[test]
fn serial_number_tells_machines_of_one_name_apart() {
    let (folder, files) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let open = |serial: &str, comment: &str| {
        let (hash, identity) = with_serial(files.path(), serial, comment);
        AlarmStore::open(folder.path(), hash, &identity, Some("hdmm_rigid")).unwrap()
    };
    let raised = Kept::alarm(Latch::raised(Level::Danger)).contradicted_at(Timestamp::now());
    let (mut first, _) = open("A-1", "");
    first.keep(&raised);
    drop(first);
    assert_eq!(open("A-2", "").1, Kept::default());
    assert_eq!(open("A-1", "").1, raised);
    assert_eq!(open("A-1", "# edited").1, raised);
    // and back
    let (mut first, kept) = open("A-1", "");
    assert_eq!(kept, raised);
    // taken over: it is not there twice
    first.keep(&Kept::default());
    drop(first);
    assert_eq!(open("A-1", "# edited").1, Kept::default());
    assert_eq!(open("A-2", "# edited").1, Kept::default());
}

//! The machine file says what is needed: a session that lacks a bound sensor or contradicts the file is refused, and a
//! client sees why.

use std::path::Path;
use std::time::Duration;

use anyhow::Result;
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_live::node::{LiveNode, Producer, Receiver, SessionFollower, SessionHost};
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::opening::{Untimed, open_session};
use tipwatch_live::wire::refusal::{Refusal, SessionRefused};
use tipwatch_live::wire::session::{Progress, Session};
use tipwatch_live::wire::topics::{Kind, WireRefusal, WireSample, WireSession, WireVerdict};
use tipwatch_mechanics::verdict::{InputFault, Level};

use crate::support::feed::{Feed, Time, machine, samples};
use crate::support::steered::Steered;
use crate::support::{World, data};

type Change = fn(&mut Session);

/// Returns the refusal of a changed session of this machine; `None` if the session is accepted.
fn refused(session: &Session, file: &MachineFile, urdf: &Urdf) -> Option<SessionRefused> {
    let wire = WireSession::try_from(session).unwrap();
    let opened = open_session(&wire, file, urdf, Untimed::Refused);
    opened.err().map(|error| SessionRefused::of(&error))
}

/// A session is refused for this reason, in these words, after a change.
fn assert_refused(
    session: &Session,
    file: &MachineFile,
    urdf: &Urdf,
    reason: Refusal,
    words: &str,
    change: Change,
) {
    let mut changed = session.clone();
    change(&mut changed);
    let found = refused(&changed, file, urdf).unwrap_or_else(|| panic!("{words}"));
    assert_eq!(found.reason, reason, "{}", found.text);
    assert!(found.text.contains(words), "{words}: {}", found.text);
}

// requirement: TW-REFUSAL-01, TW-REFUSAL-02, TW-REFUSAL-03, TW-REFUSAL-04, TW-REFUSAL-05, TW-REFUSAL-06, TW-REFUSAL-07
#[test]
fn session_that_contradicts_the_machine_file_is_refused() {
    let (file, urdf) = machine("tiny_lift");
    let (LogSamples { session, .. }, _) = samples("tiny_lift");
    assert_eq!(refused(&session, &file, &urdf), None);
    let changes: [(Refusal, &str, Change); 11] = [
        (Refusal::OtherMachine, "hash", |s| s.machine_hash ^= 1),
        (Refusal::Untimed, "pace 0", |s| s.pace = 0.0),
        (Refusal::Damaged, "pace", |s| s.pace = f64::NAN),
        (Refusal::SensorMissing, "no imu", |s| s.imu = false),
        (Refusal::SensorMissing, "no odometry", |s| {
            s.odometry = false;
        }),
        (Refusal::SensorUnknown, "index 3", |s| {
            s.actuated_joints = vec![3];
        }),
        (Refusal::Joints, "joint", |s| s.streams = Vec::new()),
        (Refusal::Joints, "slew", |s| {
            s.streams[0].retain(|joint| joint != "slew");
        }),
        (Refusal::Joints, "\"gripper\"", |s| {
            s.streams[0].push("gripper".into());
        }),
        (Refusal::Joints, "twice", |s| {
            s.streams[0].push("slew".into());
        }),
        // a link of the URDF that is elsewhere than [imu]
        (Refusal::ImuMounting, "mounting", |s| {
            s.imu_frame = Some("arm_slew".into());
        }),
    ];
    for (reason, words, change) in changes {
        assert_refused(&session, &file, &urdf, reason, words, change);
    }
}

/// A machine file of the test data with more text, and its session.
fn extended(folder: &Path, change: impl FnOnce(String) -> String) -> (MachineFile, Urdf, Session) {
    let path = folder.join("machine.toml");
    let text = std::fs::read_to_string(data("tiny_lift.toml")).unwrap();
    std::fs::write(&path, change(text)).unwrap();
    std::fs::copy(data("tiny_lift.urdf"), folder.join("tiny_lift.urdf")).unwrap();
    let file = MachineFile::read(&path).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let (LogSamples { session, .. }, _) = samples("tiny_lift");
    let machine_hash = tipwatch_live::wire::session::machine_hash(&file, &urdf);
    let session = Session {
        machine_hash,
        ..session
    };
    (file, urdf, session)
}

// requirement: TW-REFUSAL-04
#[test]
fn bound_tool_wrench_is_required() {
    let folder = tempfile::tempdir().unwrap();
    let (file, urdf, mut session) = extended(folder.path(), |text| {
        text.replace("odometry = ", "tool_wrench = \"/tool\"\nodometry = ")
    });
    session.tool_wrench = true;
    assert_eq!(refused(&session, &file, &urdf), None);
    session.tool_wrench = false;
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::SensorMissing);
    assert!(found.text.contains("no tool wrench"), "{}", found.text);
}

// requirement: TW-REFUSAL-04, TW-REFUSAL-05
#[test]
fn every_signal_that_tells_of_supports_is_required() {
    let (file, urdf) = machine("crane");
    let (LogSamples { session, .. }, _) = samples("crane");
    // one of the wheels together, and one of each foot
    assert_eq!(session.switches, [0, 1, 2, 3, 4]);
    assert_eq!(session.actuated_joints, [0, 1, 2, 3]);
    assert_eq!(refused(&session, &file, &urdf), None);
    let changes: [(Refusal, &str, Change); 4] = [
        (Refusal::SensorMissing, "ORR", |s| {
            s.switches.retain(|it| *it != 4);
        }),
        (Refusal::SensorMissing, "FL, FR, RL, RR", |s| {
            s.switches.retain(|it| *it != 0);
        }),
        (Refusal::SensorUnknown, "index 5", |s| s.switches.push(5)),
        (Refusal::SensorMissing, "\"ORR\"", |s| {
            s.actuated_joints.retain(|it| *it != 3);
        }),
    ];
    for (reason, words, change) in changes {
        assert_refused(&session, &file, &urdf, reason, words, change);
    }
}

// requirement: TW-REFUSAL-04, TW-REFUSAL-05
#[test]
fn every_load_sensor_is_required() {
    let folder = tempfile::tempdir().unwrap();
    let (file, urdf, mut session) = extended(folder.path(), |text| {
        text + "\n[signals.wheels.FL]\nload = { topic = \"/loads\", field = \"fl\" }\n"
    });
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::SensorMissing, "{}", found.text);
    session.load_sensors = vec![0];
    assert_eq!(refused(&session, &file, &urdf), None);
    session.load_sensors = vec![0, 1];
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::SensorUnknown, "{}", found.text);
}

// requirement: TW-REFUSAL-04, TW-REFUSAL-05
#[test]
fn every_force_of_the_arm_is_required() {
    let folder = tempfile::tempdir().unwrap();
    let file = MachineFile::read(&crate::arm_forces::with_forces(folder.path(), "")).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let log = data("lift_payload.mcap");
    let mut session = LogSamples::read(&log, &file, None).unwrap().session;
    assert_eq!(session.force_signals, [0, 1, 2]);
    assert_eq!(refused(&session, &file, &urdf), None);
    session.force_signals.pop();
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::SensorMissing, "{}", found.text);
    session.force_signals = vec![0, 1, 2, 3];
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::SensorUnknown, "{}", found.text);
}

// requirement: TW-REFUSAL-08
#[test]
fn spans_of_time_do_not_suit_a_monitor() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("machine.toml");
    let text = std::fs::read_to_string(data("crane.toml")).unwrap();
    let signal = "set = { topic = \"/outriggers/set\", field = \"data[3]\" }";
    std::fs::write(&path, text.replace(signal, "set = [[10.2, 33.3]]")).unwrap();
    std::fs::copy(data("crane.urdf"), folder.path().join("crane.urdf")).unwrap();
    let file = MachineFile::read(&path).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let (LogSamples { session, .. }, _) = samples("crane");
    let session = Session {
        machine_hash: tipwatch_live::wire::session::machine_hash(&file, &urdf),
        switches: vec![0, 1, 2, 3],
        load_sensors: Vec::new(),
        joint_commands: Vec::new(),
        payload_signals: Vec::new(),
        force_signals: Vec::new(),
        ..session
    };
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::Unsuitable, "{}", found.text);
    assert!(found.text.contains("supports.ORR"), "{}", found.text);
}

// requirement: TW-REFUSAL-08
#[test]
fn machine_that_is_always_quasi_static_does_not_suit_a_monitor() {
    let folder = tempfile::tempdir().unwrap();
    let (file, urdf, session) = extended(folder.path(), |text| {
        text + "\n[quasi_static]\nmode = \"always\"\n"
    });
    let found = refused(&session, &file, &urdf).unwrap();
    assert_eq!(found.reason, Refusal::Unsuitable, "{}", found.text);
    assert!(found.text.contains("estimator.max_gap"), "{}", found.text);
}

// requirement: TW-REFUSAL-07
#[test]
fn imu_whose_mounting_nobody_knows_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (file, urdf, mut session) = extended(folder.path(), |text| {
        let (before, after) = text.split_once("[imu]").unwrap();
        let (_, after) = after.split_once("\n[wheels.FL]").unwrap();
        format!("{before}[wheels.FL]{after}")
    });
    session.imu_frame = Some("/arm_slew".into());
    assert_eq!(refused(&session, &file, &urdf), None);
    for frame in [None, Some("somewhere".to_string())] {
        session.imu_frame = frame;
        let found = refused(&session, &file, &urdf).unwrap();
        assert_eq!(found.reason, Refusal::ImuMounting, "{}", found.text);
    }
}

// requirement: TW-FAULT-18, TW-REFUSAL-04
#[test]
fn client_sees_why_a_session_is_refused() {
    let world = World::new("refused");
    let node = world.join();
    let refusals: Receiver<WireRefusal> = node.receiver().unwrap();
    let time = Steered::monitor(&world, "tiny_lift");
    let mut feed = Feed::with(&node, "tiny_lift", time, |session| session.odometry = false);
    let is_told = |verdict: &WireVerdict| {
        verdict.refusal == Refusal::SensorMissing as u32
            && verdict.conditions().faults.has(InputFault::SessionRefused)
            && verdict.level == Level::Fault as u32
    };
    let told = feed.wait_for(Duration::from_millis(100), is_told).unwrap();
    assert_eq!((told.refused_session, told.session), (feed.source, 0));
    let refusal = refusals.receive(|message| *message).unwrap().unwrap();
    assert_eq!(refusal.session, feed.source);
    assert!(
        refusal.text().contains("found no odometry"),
        "{}",
        refusal.text()
    );
    // its samples give no rows
    feed.send(300);
    feed.time.pass(Duration::from_millis(100));
    while let Some(verdict) = feed.verdicts.receive(|v| *v).unwrap() {
        assert!(is_told(&verdict));
    }
    // late joiners see it too
    let late: Receiver<WireRefusal> = node.receiver().unwrap();
    feed.time.pass(Duration::from_millis(10));
    let kept = late.receive(|message| message.session).unwrap();
    assert_eq!(kept, Some(feed.source));
    // and the next session is followed
    let Feed { time, producer, .. } = feed;
    drop(producer);
    let mut next = Feed::new(&node, "tiny_lift", time);
    next.wait_for_monitor();
    next.send(50);
    let last = std::iter::from_fn(|| next.verdicts.receive(|v| *v).unwrap()).last();
    let last = last.unwrap();
    assert_eq!((last.refusal, last.refused_session), (0, 0));
}

// requirement: TW-FAULT-18, TW-REFUSAL-03
#[test]
fn monitor_refuses_an_untimed_session_and_says_so() {
    let world = World::new("pace0");
    let monitor = world.monitor(&data("tiny.toml"), &["--json"]);
    let mut replay = world.replay("tiny", &["--speed", "max", "--wait", "60"]);
    let monitor = monitor.end();
    assert_eq!(monitor.status.code(), Some(1));
    assert!(monitor.err.contains("--allow-untimed"), "{}", monitor.err);
    assert!(monitor.out.contains("session_refused"), "{}", monitor.out);
    assert!(!monitor.out.contains("\"event\":\"row\""));
    let _ = replay.child.kill();
}

// requirement: TW-REFUSAL-03
#[test]
fn control_refuses_an_untimed_session() {
    let world = World::new("pace0control");
    let control = world.control(&data("second_paper.toml"), &["--stay"]);
    let options = ["--speed", "max", "--wait", "60"];
    let mut replay = world.replay("second_paper", &options);
    let control = control.end();
    assert_eq!(control.status.code(), Some(1));
    assert!(control.err.contains("pace 0"), "{}", control.err);
    let _ = replay.child.kill();
}

/// Follows any session, up to its end.
struct AnySession;

impl SessionHost for AnySession {
    type Session = u64;

    fn id(session: &u64) -> u64 {
        *session
    }

    fn begin(&mut self, announced: &WireSession, _: Option<&u64>) -> Result<u64> {
        Ok(announced.source)
    }

    fn succeed(&mut self, _: &mut u64, _: u64) -> Result<()> {
        Ok(())
    }

    fn reject(&mut self, _: &mut u64, _: &anyhow::Error) {}

    fn take(&mut self, _: &mut u64, sample: &WireSample) -> Result<Progress> {
        Ok(match sample.kind == Kind::End as u32 {
            true => Progress::Ended,
            false => Progress::Running,
        })
    }
}

#[test]
fn producer_that_ends_its_session_while_samples_are_taken_is_not_lost() {
    for is_killed in [false, true] {
        let world = World::new("goes");
        let node = world.join();
        let (LogSamples { session, .. }, wires) = samples("tiny");
        let mut producer = Producer::new(&node, session.id, session.machine_hash).unwrap();
        let mut announced = WireSession::try_from(&session).unwrap();
        producer.announce(&mut announced).unwrap();
        let mut follower = SessionFollower::new(&node).unwrap();
        producer.update_connections().unwrap();
        follower.look_for_session(&mut AnySession).unwrap();
        assert_eq!(follower.active, Some(session.id));
        producer.send(&mut wires[0].clone()).unwrap();
        let progress = follower.take_samples(&mut AnySession).unwrap();
        assert_eq!(progress, Progress::Running);
        assert!(!follower.has_lost_producer());

        // everything was taken, and whether there is a producer is asked after that
        producer.send(&mut wires[1].clone()).unwrap();
        if !is_killed {
            producer.send(&mut WireSample::end()).unwrap();
        }
        drop(producer);
        assert!(!follower.has_lost_producer());
        // nor is a producer lost while samples of it wait
        let taken = follower.take_sample(&mut AnySession).unwrap();
        assert_eq!(taken, Some(Progress::Running));
        assert!(!follower.has_lost_producer());
        let progress = follower.take_samples(&mut AnySession).unwrap();
        assert_eq!(progress == Progress::Ended, !is_killed);
        assert_eq!(follower.has_lost_producer(), is_killed);
    }
}

/// Samples of a session that nobody announced are counted, and those of one that was refused are not among them.
// requirement: TW-RECORD-03
#[test]
fn samples_of_no_announced_session_are_counted() {
    // nor are late ones of the session before it
    for (is_announced, is_late) in [(false, false), (true, false), (true, true)] {
        let world = World::new("unannounced");
        let node = world.join();
        let (LogSamples { session, .. }, wires) = samples("tiny");
        let mut producer = Producer::new(&node, session.id, session.machine_hash).unwrap();
        let mut follower = SessionFollower::new(&node).unwrap();
        producer.update_connections().unwrap();
        if is_announced {
            let mut announced = WireSession::try_from(&session).unwrap();
            producer.announce(&mut announced).unwrap();
            follower.look_for_session(&mut AnySession).unwrap();
            // as if it had been refused
            follower.active = None;
        }
        for wire in &wires[..3] {
            producer.send(&mut wire.clone()).unwrap();
        }
        if is_late {
            drop(producer);
            let other = session.id ^ 1;
            let mut next = Producer::new(&node, other, session.machine_hash).unwrap();
            let mut announced = WireSession::try_from(&session).unwrap();
            next.announce(&mut announced).unwrap();
            follower.look_for_session(&mut AnySession).unwrap();
            assert_eq!(follower.active.take(), Some(other));
        }
        follower.take_samples(&mut AnySession).unwrap();
        assert_eq!(follower.unannounced(), if is_announced { 0 } else { 3 });
    }
}

#[test]
fn readers_leave_the_places_of_the_monitor() {
    let world = World::new("places");
    let node = world.join();
    let mut held: Vec<Receiver<WireSample>> = Vec::new();
    held.extend((0..8).map(|_| node.receiver().unwrap()));
    let refused = node.receiver::<WireSample>().unwrap_err();
    assert!(format!("{refused:#}").contains("are kept for monitor"));
    let monitor = LiveNode::new(&world.address(), "tipwatch-monitor").unwrap();
    held.extend((0..4).map(|_| monitor.receiver().unwrap()));
    assert!(monitor.receiver::<WireSample>().is_err());
}

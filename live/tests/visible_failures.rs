//! A signal that failed visibly, such as a slew encoder that slipped, stays doubted over restarts of the monitor and from
//! session to session, until it is back, somebody trusts it as it is, or a later commissioning has proven it.

use std::collections::BTreeSet;

use jiff::{SignedDuration, Timestamp};
use tipwatch_binding::{Commissioning, CommissioningItem, MachineFile};
use tipwatch_live::alarm::{AlarmFile, DoubtedSignals, Kept};
use tipwatch_live::node::{LiveNode, Sender};
use tipwatch_live::operator::acknowledge_signal;
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::names::Names;
use tipwatch_live::wire::topics::{Kind, WireAcknowledge, WireMachine, WireSample, WireVerdict};
use tipwatch_mechanics::machine::{Proof, Proofs};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{Basis, Latch, Level};

use crate::payloads::rows_of;
use crate::support::feed::Feed;
use crate::support::steered::Steered;
use crate::support::{World, data};

/// All joints of this machine move, and no wheel lifts.
const MACHINE: &str = "commissioning";
/// A wheel of these lifts, while the slew is not near zero.
const LIFTING: [&str; 2] = ["tiny_lift", "side_reach"];
/// Sample at which its joint slips, after which nobody knows where the arm is.
const SLIPS_AT: usize = 300;

/// Failure of the samples of a session from the next one on.
type Failure<'f> = &'f dyn Fn(&mut Feed<Steered>);

/// The slew encoder slips by a quarter of a turn.
fn slews(feed: &mut Feed<Steered>) {
    shift(feed, "slew", std::f64::consts::FRAC_PI_2);
}

/// From the next sample on a joint shows so much more (rad).
fn shift(feed: &mut Feed<Steered>, joint: &str, by: f64) {
    let place = feed.place_of(joint);
    let joints = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Joints as u32);
    joints.for_each(|sample| sample.values[place] += by);
}

/// All joints show zero.
fn joints_show_zero(feed: &mut Feed<Steered>) {
    let joints = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Joints as u32);
    joints.for_each(|sample| {
        let count = sample.value_count as usize;
        sample.values[..count].fill(0.0);
    });
}

/// The slew shows zero, and its velocity.
fn slew_shows_zero(feed: &mut Feed<Steered>) {
    let place = feed.place_of("slew");
    let joints = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Joints as u32);
    joints.for_each(|sample| sample.values[place] = 0.0);
}

/// The accelerometer shows this length along its vertical axis (m/s^2).
fn steps_to(feed: &mut Feed<Steered>, length: f64) {
    let imu = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Imu as u32);
    imu.for_each(|sample| sample.values[2] += length - 9.81);
}

/// The accelerometer shows 3 m/s^2 to the side: its length says nothing of that.
fn steps_aside(feed: &mut Feed<Steered>) {
    let imu = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Imu as u32);
    imu.for_each(|sample| sample.values[1] += 3.0);
}

/// The heading of the IMU shows a quarter of a turn more, as where its housing turned.
fn turns_heading(feed: &mut Feed<Steered>) {
    let imu = feed
        .samples
        .iter_mut()
        .filter(|it| it.kind == Kind::Imu as u32);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    imu.for_each(|sample| {
        let xyzw = &mut sample.values[6..10];
        let [x, y, z, w] = [xyzw[0], xyzw[1], xyzw[2], xyzw[3]];
        assert!(w.is_finite(), "it measures an attitude");
        xyzw.copy_from_slice(&[x - y, y + x, z + w, w - z].map(|it| half * it));
    });
}

struct Bench {
    machine: &'static str,
    world: World,
    node: LiveNode,
    slew: Proof,
    lift: Proof,
    /// Sequence numbers of samples that complete rows with a wheel off the ground.
    lifted: BTreeSet<u64>,
    samples: usize,
}

impl Bench {
    fn new(test: &str) -> Self {
        Self::of(test, MACHINE)
    }

    fn of(test: &str, machine: &'static str) -> Self {
        let world = World::new(test);
        let node = world.join();
        let machines = node.receiver::<WireMachine>().unwrap();
        let mut good = feed(&node, machine, Steered::monitor(&world, machine));
        let described = machines.receive(|machine| *machine).unwrap().unwrap();
        let names = Names::try_from(&described).unwrap();
        let signal = |name| names.signal(name).unwrap();
        let samples = good.samples.len();
        let rows = good.rows(samples);
        let is_up = |row: &&WireVerdict| {
            let wheels = &row.otf[..row.wheel_count as usize];
            wheels.iter().any(|otf| *otf <= 0.0)
        };
        let lifted = rows.iter().filter(is_up).map(|row| row.sample_sequence);
        let lifted: BTreeSet<u64> = lifted.collect();
        let mut bench = Self {
            machine,
            world,
            node,
            slew: signal("slew"),
            lift: signal("joint.lift"),
            lifted,
            samples,
        };
        bench.forget(good);
        bench
    }

    /// Ends a session and its monitor; nothing of both is kept.
    fn forget(&mut self, feed: Feed<Steered>) {
        drop(ended(feed));
        std::fs::remove_dir_all(&self.world.state_folder).unwrap();
    }

    fn monitor(&self) -> Steered {
        Steered::monitor(&self.world, self.machine)
    }

    /// A session in which this fails: its monitor has seen it, `after` so many samples.
    fn failed(&self, failure: Failure<'_>, after: usize) -> Feed<Steered> {
        let mut feed = feed(&self.node, self.machine, self.monitor());
        feed.rows(SLIPS_AT);
        failure(&mut feed);
        feed.rows(after);
        feed
    }

    /// Of rows with a wheel off the ground, how many there are and how many see no reason to stop.
    fn lifted_and_calm(&self, rows: &[WireVerdict]) -> [usize; 2] {
        let lifted = rows
            .iter()
            .filter(|row| self.lifted.contains(&row.sample_sequence));
        let lifted: Vec<&WireVerdict> = lifted.collect();
        let calm = lifted.iter().filter(|row| is_calm(row)).count();
        [lifted.len(), calm]
    }
}

fn feed(node: &LiveNode, machine: &str, time: Steered) -> Feed<Steered> {
    let mut feed = Feed::new(node, machine, time);
    feed.wait_for_monitor();
    feed
}

/// Ends a session without its monitor.
fn ended(mut feed: Feed<Steered>) -> Steered {
    feed.end();
    feed.time
}

/// Restarts the monitor in the middle of a session.
fn restart(feed: &mut Feed<Steered>) {
    feed.time.stop_monitor();
    feed.time.start_monitor();
    feed.wait_for_monitor();
}

fn is_calm(row: &WireVerdict) -> bool {
    matches!(
        row.verdict().level,
        Level::Safe | Level::Assumed | Level::Notice
    )
}

fn doubts(row: &WireVerdict, signal: Proof) -> bool {
    Proofs::from_bits(row.doubted).has(signal)
}

/// Signals that fail visibly in a log, after which the monitor is restarted in the middle of the session, follows another one,
/// and is restarted between sessions.
// requirement: TW-VERDICT-31
#[test]
fn what_failed_visibly_is_never_safe_after_a_restart() {
    let failures: [(&str, Failure<'_>); 7] = [
        ("slew by 90 degrees", &slews),
        ("slew by -90 degrees", &|feed| shift(feed, "slew", -1.571)),
        ("slew to zero", &slew_shows_zero),
        ("all joints to zero", &joints_show_zero),
        ("accelerometer to 13", &|feed| steps_to(feed, 13.0)),
        ("accelerometer to 20", &|feed| steps_to(feed, 20.0)),
        ("accelerometer to 38", &|feed| steps_to(feed, 38.0)),
    ];
    // calm rows of those with a wheel up, of what is kept and of what is not
    println!(
        "machine      failure              restart after     same     next  monitor  forgotten"
    );
    let mut forgotten = 0;
    for machine in LIFTING {
        let mut bench = Bench::of("failed", machine);
        for (what, failure) in failures {
            // at once, before anybody knows whether it stays, and when that is known
            for after in [60, 400] {
                let mut same = bench.failed(failure, after);
                restart(&mut same);
                let left = bench.samples - same.next;
                let in_same = bench.lifted_and_calm(&same.rows(left));
                let mut next = feed(&bench.node, machine, ended(same));
                failure(&mut next);
                let in_next = bench.lifted_and_calm(&next.rows(bench.samples));
                drop(ended(next));
                let mut next = feed(&bench.node, machine, bench.monitor());
                failure(&mut next);
                let in_last = bench.lifted_and_calm(&next.rows(bench.samples));
                bench.forget(next);
                let mut anew = feed(&bench.node, machine, bench.monitor());
                failure(&mut anew);
                let in_anew = bench.lifted_and_calm(&anew.rows(bench.samples));
                bench.forget(anew);
                let said = [in_same, in_next, in_last, in_anew]
                    .map(|[lifted, calm]| format!("{calm}/{lifted}"));
                let [same, next, last, none] = said;
                println!(
                    "{machine:12} {what:20} {after:13} {same:>8} {next:>8} {last:>8} {none:>10}"
                );
                for [lifted, calm] in [in_same, in_next, in_last] {
                    assert_eq!(
                        calm, 0,
                        "{machine}, {what}, restart after {after}: {lifted}"
                    );
                }
                assert!(in_next[0] > 20 && in_last[0] > 20);
                forgotten += in_anew[1];
            }
        }
    }
    // without what is kept the test would show nothing
    assert!(forgotten > 0);
}

/// An accelerometer that steps to the side while the odometry shows that the machine does not go there.
// requirement: TW-VERDICT-31
#[test]
fn accelerometer_that_stepped_aside_is_doubted_until_a_person_trusts_it() {
    let bench = Bench::of("stepped", LIFTING[1]);
    let force = Proof::SpecificForce;
    let mut same = feed(&bench.node, bench.machine, bench.monitor());
    same.rows(400);
    steps_aside(&mut same);
    // half a second passes before anybody knows that it stays
    let rows = same.rows(200);
    assert!(rows.iter().any(|row| doubts(row, force)));
    restart(&mut same);
    assert!(same.rows(100).iter().all(|row| doubts(row, force)));
    let mut next = feed(&bench.node, bench.machine, ended(same));
    steps_aside(&mut next);
    let rows = next.rows(bench.samples - 100);
    assert!(rows.iter().all(|row| doubts(row, force)));
    let [lifted, calm] = bench.lifted_and_calm(&rows);
    assert!(lifted > 20 && calm == 0, "{calm} of {lifted}");
    trust(&bench, &mut next, &rows[rows.len() - 1], force);
}

/// A person trusts a signal that this verdict doubts: the next ones do not.
fn trust(bench: &Bench, feed: &mut Feed<Steered>, seen: &WireVerdict, signal: Proof) {
    let alone: Proofs = [signal].into_iter().collect();
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let mut message = WireAcknowledge::of_signals(seen, alone);
    sender.send_for(feed.hash, &mut message).unwrap();
    let rows = feed.rows(100);
    assert!(
        rows.iter()
            .any(|row| row.acknowledged_signals == alone.bits())
    );
    assert!(!doubts(&rows[rows.len() - 1], signal));
}

/// The heading of an IMU jumps as its housing would by a quarter of a turn.
// requirement: TW-VERDICT-31
#[test]
fn housing_that_turned_is_doubted_in_the_next_sessions_until_a_person_trusts_it() {
    let bench = Bench::of("turned", LIFTING[1]);
    let turned = Proof::AngularVelocity;
    let mut same = feed(&bench.node, bench.machine, bench.monitor());
    assert!(!same.rows(400).iter().any(|row| doubts(row, turned)));
    turns_heading(&mut same);
    assert!(same.rows(100).iter().any(|row| doubts(row, turned)));
    restart(&mut same);
    assert!(same.rows(100).iter().all(|row| doubts(row, turned)));
    let mut next = feed(&bench.node, bench.machine, ended(same));
    let rows = next.rows(400);
    assert!(rows.iter().all(|row| doubts(row, turned)));
    trust(&bench, &mut next, &rows[rows.len() - 1], turned);
}

/// An encoder that slips while no monitor runs, for so short that the joint cannot have moved so far.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_slipped_while_no_monitor_ran_is_doubted_where_it_cannot_have_moved() {
    let bench = Bench::of("unseen", "side_reach");
    for (missed, by, is_told) in [
        (0, 0.0, false),
        // the URDF allows 10 rad/s, and twice that is credible
        (0, 3.1, true),
        (400, 3.1, false),
    ] {
        let mut slips = feed(&bench.node, bench.machine, bench.monitor());
        slips.rows(SLIPS_AT);
        slips.time.stop_monitor();
        shift(&mut slips, "slew", by);
        slips.send(missed);
        slips.time.start_monitor();
        slips.wait_for_monitor();
        let rows = slips.rows(bench.samples - slips.next);
        let doubted = rows.iter().skip(10).filter(|row| doubts(row, bench.slew));
        let expected = if is_told { rows.len() - 10 } else { 0 };
        assert_eq!(doubted.count(), expected, "{by} after {missed}");
        drop(ended(slips));
        std::fs::remove_dir_all(&bench.world.state_folder).unwrap();
    }
}

/// The lean of the platform ends a doubt only of a joint that is right: one that is still off is doubted however the arm moves.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_is_still_off_is_doubted_however_the_arm_moves() {
    let mut bench = Bench::new("off");
    let slips = [
        ("slew", 0.3),
        ("slew", -std::f64::consts::FRAC_PI_2),
        ("slew", std::f64::consts::PI),
        ("lift", 0.3),
        ("lift", -0.3),
        ("tilt", 0.4),
        ("tilt", -0.4),
        ("extension", 0.4),
        ("extension", -0.3),
    ];
    for (joint, by) in slips {
        let slips = |feed: &mut Feed<Steered>| shift(feed, joint, by);
        let mut next = feed(&bench.node, MACHINE, ended(bench.failed(&slips, 400)));
        slips(&mut next);
        let rows = next.rows(bench.samples);
        let is_doubted = |row: &&WireVerdict| row.doubted != 0 || row.row_reasons().have_doubt();
        let doubted = rows.iter().filter(is_doubted).count();
        println!(
            "{joint} by {by}: {doubted} of {} rows are doubted",
            rows.len()
        );
        assert!(rows.len() > 1000, "{joint} by {by}: {} rows", rows.len());
        assert_eq!(doubted, rows.len(), "{joint} by {by}");
        assert!(!rows.iter().any(is_calm), "{joint} by {by}");
        bench.forget(next);
    }
}

/// The session after one in which the slew has slipped: it is doubted there.
fn slipped(bench: &Bench) -> (Feed<Steered>, Proof) {
    let slipped = bench.failed(&slews, 600);
    let slew = bench.slew;
    let mut next = feed(&bench.node, bench.machine, ended(slipped));
    slews(&mut next);
    let rows = next.rows(300);
    assert!(rows.len() > 50 && rows.iter().all(|row| doubts(row, slew)));
    assert!(
        rows.iter()
            .all(|row| row.verdict().basis == Basis::Doubted && !is_calm(row))
    );
    (next, slew)
}

// requirement: TW-VERDICT-31
#[test]
fn joint_is_trusted_again_when_somebody_acknowledges_it() {
    let bench = Bench::new("trusted");
    let (mut feed, slew) = slipped(&bench);
    let seen = feed.rows(20).pop().unwrap();
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let hash = feed.hash;
    let mut send = |message: &mut WireAcknowledge| sender.send_for(hash, message).unwrap();
    // of the alarm, of another joint, by who has not seen it
    send(&mut WireAcknowledge::of(&seen));
    let other = [bench.lift].into_iter().collect();
    send(&mut WireAcknowledge::of_signals(&seen, other));
    let slew_alone: Proofs = [slew].into_iter().collect();
    let unseen = WireVerdict {
        sequence: 0,
        ..seen
    };
    send(&mut WireAcknowledge::of_signals(&unseen, slew_alone));
    assert!(feed.rows(40).iter().all(|row| doubts(row, slew)));
    send(&mut WireAcknowledge::of_signals(&seen, slew_alone));
    let rows = feed.rows(600);
    let first = rows
        .iter()
        .position(|row| row.acknowledged_signals != 0)
        .unwrap();
    assert_eq!(rows[first].acknowledged_signals, slew_alone.bits());
    assert_trusted_for_good(&rows[first..], &mut feed);
}

/// An encoder that stopped, and that nobody has mended.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_still_repeats_itself_is_not_trusted() {
    let bench = Bench::new("repeats");
    let slew = bench.slew;
    let mut feed = bench.failed(&slew_shows_zero, 900);
    let seen = feed.rows(20).pop().unwrap();
    assert!(doubts(&seen, slew));
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let slew_alone: Proofs = [slew].into_iter().collect();
    assert_eq!(feed.time.not_trusted(), Proofs::NONE);
    let mut message = WireAcknowledge::of_signals(&seen, slew_alone);
    sender.send_for(feed.hash, &mut message).unwrap();
    let rows = feed.rows(100);
    // it has arrived, is refused, and is not told as one that was taken
    assert_eq!(feed.time.not_trusted(), slew_alone);
    assert!(rows.iter().all(|row| row.acknowledged_signals == 0));
    assert!(rows.iter().all(|row| doubts(row, slew)));
}

/// Who has seen that it slipped has not seen that it slipped further.
// requirement: TW-VERDICT-31
#[test]
fn acknowledgement_of_a_signal_does_not_count_for_what_it_did_afterwards() {
    let bench = Bench::new("further");
    let (mut feed, slew) = slipped(&bench);
    let seen = feed.rows(20).pop().unwrap();
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let hash = feed.hash;
    let slew_alone: Proofs = [slew].into_iter().collect();
    shift(&mut feed, "slew", 0.7);
    assert!(feed.rows(300).iter().all(|row| doubts(row, slew)));
    let mut message = WireAcknowledge::of_signals(&seen, slew_alone);
    sender.send_for(hash, &mut message).unwrap();
    let rows = feed.rows(40);
    assert!(rows.iter().all(|row| doubts(row, slew)));
    let mut message = WireAcknowledge::of_signals(&rows[rows.len() - 1], slew_alone);
    sender.send_for(hash, &mut message).unwrap();
    assert!(feed.rows(300).iter().any(|row| row.doubted == 0));
}

/// That no signal is doubted in these rows, nor in the next session.
fn assert_trusted_for_good(rows: &[WireVerdict], feed: &mut Feed<Steered>) {
    assert!(rows.iter().all(|row| row.doubted == 0));
    assert!(rows.iter().any(is_calm), "it is trusted");
    restart(feed);
    let rows = feed.rows(300);
    assert!(!rows.is_empty() && rows.iter().all(|row| row.doubted == 0));
}

// requirement: TW-VERDICT-31
#[test]
fn joint_is_trusted_again_when_it_is_back() {
    let bench = Bench::new("back");
    let (mut feed, slew) = slipped(&bench);
    shift(&mut feed, "slew", -std::f64::consts::FRAC_PI_2);
    let rows = feed.rows(600);
    let first = rows.iter().position(|row| row.doubted == 0).unwrap();
    assert!(rows[..first].iter().all(|row| doubts(row, slew)));
    assert_trusted_for_good(&rows[first..], &mut feed);
}

/// A drive proves its sign and scale, and not where its zero is: the slew is still 90 degrees off.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_has_slipped_is_doubted_whatever_a_later_commissioning_has_proven() {
    let bench = Bench::new("proven");
    let (feed_before, slew) = slipped(&bench);
    let mut time = ended(feed_before);
    let slipped = Timestamp::now();
    let drive = |begins: Timestamp, joint: &str| Commissioning {
        recorded_from_ns: i64::try_from(begins.as_nanosecond()).ok(),
        ..commissioning_of(joint)
    };
    let cases = [
        (
            "a drive of before",
            drive(slipped - SignedDuration::from_hours(1), "slew"),
        ),
        ("a drive of another joint", drive(slipped, "lift")),
        ("a drive afterwards", drive(slipped, "slew")),
    ];
    for (what, commissioning) in cases {
        time.stop_monitor();
        time.commissioning = Some(Box::leak(Box::new(commissioning)));
        time.start_monitor();
        let mut next = feed(&bench.node, bench.machine, time);
        slews(&mut next);
        let rows = next.rows(300);
        assert!(rows.len() > 50, "{what}");
        assert!(rows.iter().all(|row| doubts(row, slew)), "{what}");
        time = ended(next);
    }
}

/// The result of a drive that has proven this joint, and nothing else.
fn commissioning_of(joint: &str) -> Commissioning {
    let item = |key: String| CommissioningItem {
        key,
        status: "proven".into(),
        value: None,
        sigma: None,
        expected: None,
        excluded_sigmas: None,
        range: Some([-100.0, 100.0]),
        text: String::new(),
    };
    Commissioning {
        schema: 3,
        machine: "hdmm_rigid".into(),
        machine_file_sha256: String::new(),
        urdf_sha256: String::new(),
        tipwatch_version: String::new(),
        source: String::new(),
        source_sha256: String::new(),
        made_at: String::new(),
        recorded_from_ns: None,
        duration_s: 60.0,
        items: ["sign", "scale", "identity"]
            .map(|key| item(format!("joint.{joint}.{key}")))
            .into(),
        explanations: Vec::new(),
        seal: String::new(),
    }
}

/// A person acknowledges a failed joint by its name, and no signal that is not doubted.
// requirement: TW-VERDICT-31
#[test]
fn joint_is_acknowledged_by_its_name() {
    let bench = Bench::new("named");
    let (mut feed, slew) = slipped(&bench);
    let address = bench.world.address();
    // the loops of the monitor and of the command are in two threads
    let acknowledge = |feed: &mut Feed<Steered>, name: &'static str| {
        let address = address.clone();
        let asking = std::thread::spawn(move || acknowledge_signal(&address, name));
        while !asking.is_finished() {
            feed.send(1);
        }
        asking.join().unwrap()
    };
    let refused = acknowledge(&mut feed, "lift").unwrap_err().to_string();
    assert!(refused.contains("joint.slew"), "{refused}");
    assert!(acknowledge(&mut feed, "nobody").is_err());
    assert!(feed.rows(20).iter().all(|row| doubts(row, slew)));
    acknowledge(&mut feed, "slew").unwrap();
    feed.find(|_| false);
    assert!(feed.rows(20).iter().all(|row| row.doubted == 0));
}

/// A failed signal is kept by its name, and a file of an older version holds none.
// requirement: TW-VERDICT-31
#[test]
fn failed_signal_is_kept_by_name_and_in_a_file_of_before_there_is_none() {
    let bench = Bench::new("kept");
    let mut feed = bench.failed(&slews, 600);
    let hash = feed.hash;
    let file = AlarmFile::new(bench.world.state.path(), hash, "hdmm_rigid");
    feed.time.stop_monitor();
    let kept = file.read().unwrap();
    let signals: Vec<_> = kept.doubted.iter().collect();
    assert_eq!(signals.len(), 1);
    assert_eq!(signals[0].name.to_string(), "joint.slew");
    assert!((signals[0].by - std::f64::consts::FRAC_PI_2).abs() < 0.1);
    assert!(signals[0].since <= Timestamp::now());
    let text = std::fs::read_to_string(file.path()).unwrap();
    let words: Vec<&str> = text.split(' ').collect();
    assert_eq!(words[1], "5");
    // as version 3 wrote it
    let before = [&["tipwatch-alarm", "3"], &words[2..7]].concat().join(" ");
    let checksum = crc32fast::hash(before.as_bytes());
    std::fs::write(file.path(), format!("{before} {checksum:08x}\n")).unwrap();
    assert!(file.read().unwrap().doubted.is_empty());
    feed.time.start_monitor();
    feed.wait_for_monitor();
    assert!(feed.rows(300).iter().all(|row| row.doubted == 0));
    feed.time.stop_monitor();
    // damaged: a latched fault, as of any damage
    std::fs::write(file.path(), text.replace("slew", "lift")).unwrap();
    feed.time.start_monitor();
    feed.wait_for_monitor();
    let latched = feed.rows(20).pop().unwrap().latch();
    assert_eq!(latched.level, Latch::raised(Level::Fault).level);
}

// requirement: TW-VERDICT-31, TW-FAULT-17
#[test]
fn good_sensors_are_never_doubted_through_restarts_in_motion() {
    let bench = Bench::new("motion");
    let mut good = feed(&bench.node, bench.machine, bench.monitor());
    let step = bench.samples / 21;
    for _ in 0..20 {
        let rows = good.rows(step);
        for row in &rows {
            assert_eq!(row.doubted, 0);
            assert_ne!(row.verdict().level, Level::Fault, "{:?}", row.verdict());
        }
        restart(&mut good);
    }
}
/// The arm stays where it is, without noise, and its velocities are zero.
fn arm_freezes(feed: &mut Feed<Steered>) {
    let next = feed.next;
    let places = ["slew", "lift", "tilt", "extension"].map(|joint| feed.place_of(joint));
    let is_of_joints = |it: &&mut WireSample| it.kind == Kind::Joints as u32;
    let mut joints = feed.samples[next..].iter_mut().filter(is_of_joints);
    let last = *joints.next().unwrap();
    let count = last.value_count as usize;
    for sample in joints {
        for place in places {
            sample.values[place] = last.values[place];
            sample.values[place + count / 2] = 0.0;
        }
    }
}

/// An arm whose encoders stop is a Fault, and stays one over a restart, until they are measured again: in the next session they
/// are where they were, and nothing else would show it.
// requirement: TW-VERDICT-31
#[test]
fn arm_that_froze_is_not_trusted_after_a_restart_until_it_is_measured_again() {
    let bench = Bench::of("froze", "side_reach");
    let mut frozen = feed(&bench.node, bench.machine, bench.monitor());
    let last = |rows: &[WireVerdict]| *rows.last().unwrap();
    // how they flicker at rest must be known
    frozen.rows(500);
    arm_freezes(&mut frozen);
    let before = last(&frozen.rows(700));
    assert_ne!(before.doubted, 0);
    restart(&mut frozen);
    let rows = frozen.rows(300);
    assert_eq!(last(&rows).doubted, before.doubted);
    assert_eq!(last(&rows).verdict().level, Level::Fault);
    let started = rows
        .iter()
        .position(|row| row.verdict().level == Level::Fault);
    assert!(
        rows[..started.unwrap()]
            .iter()
            .all(|row| row.verdict().level == Level::Unknown)
    );
    let left = bench.samples - frozen.next;
    assert_eq!(bench.lifted_and_calm(&frozen.rows(left))[1], 0);
    // mended
    let mut next = feed(&bench.node, bench.machine, ended(frozen));
    let rows = next.rows(bench.samples);
    assert!(rows.iter().skip(10).all(|row| row.doubted == 0));
    assert!(rows.iter().all(|row| row.verdict().level != Level::Fault));
}

/// The encoder of the slew stops for two seconds while it turns, and counts on from there.
fn slew_loses_counts(feed: &mut Feed<Steered>) {
    let (next, place) = (feed.next, feed.place_of("slew"));
    let is_of_joints = |it: &&mut WireSample| it.kind == Kind::Joints as u32;
    let mut joints = feed.samples[next..].iter_mut().filter(is_of_joints);
    let last = *joints.next().unwrap();
    let mut lost = 0.0;
    for sample in joints {
        if sample.log_time_ns < last.log_time_ns + 2_000_000_000 {
            lost = sample.values[place] - last.values[place];
            sample.values[place] = last.values[place];
            sample.values[place + sample.value_count as usize / 2] = 0.0;
        } else {
            sample.values[place] -= lost;
        }
    }
    assert!(lost.abs() > 0.5, "{lost}");
}

/// The monitor restarts while the encoder is stopped: how the slew moved when it stopped is kept.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_loses_counts_over_a_restart_is_doubted_afterwards() {
    let bench = Bench::new("recount");
    let slew = bench.slew;
    let mut feed = feed(&bench.node, bench.machine, bench.monitor());
    let start_ns = feed.samples[0].log_time_ns + 36_000_000_000;
    let stops = feed.samples.iter().position(|it| it.log_time_ns > start_ns);
    feed.rows(stops.unwrap());
    slew_loses_counts(&mut feed);
    let goes_on_ns = feed.samples[feed.next].log_time_ns + 2_000_000_000;
    let is_found = |rows: &[WireVerdict]| rows.last().is_some_and(|row| doubts(row, slew));
    while !is_found(&feed.rows(20)) {}
    assert!(feed.samples[feed.next].log_time_ns < goes_on_ns - 100_000_000);
    restart(&mut feed);
    let left = bench.samples - feed.next - 600;
    let rows = feed.rows(left);
    assert!(rows.last().unwrap().time_ns > rows[0].time_ns + 10_000_000_000);
    assert!(rows.iter().all(|row| doubts(row, slew)));
}

/// What the monitor keeps after a session of good sensors.
fn kept_after_a_session(bench: &Bench) -> AlarmFile {
    let good = feed(&bench.node, bench.machine, bench.monitor());
    let hash = good.hash;
    drop(ended(good));
    AlarmFile::new(&bench.world.state_folder, hash, "hdmm_rigid")
}

/// The lean of the platform had contradicted that the slew stood still as it showed, and the slew is measured again; or it had not
/// shown what its controller asked, and none asks now. After a restart the monitor still knows, and says that it is no proof: Assumed,
/// and never Safe, until somebody acknowledges it.
// requirement: TW-VERDICT-28, TW-VERDICT-31
#[test]
fn joint_that_had_stopped_is_doubted_over_restarts_until_a_person_trusts_it() {
    for kept in ["joint.slew=0~inf", "joint.slew=0~-inf"] {
        is_doubted_over_restarts(&format!("{kept}@2026-11-27T10:00:00Z"));
    }
}

/// Checks this doubt of the slew.
fn is_doubted_over_restarts(kept: &str) {
    let bench = Bench::new("stopped");
    let file = kept_after_a_session(&bench);
    let kept = kept.parse().unwrap();
    file.write(&Kept::default().doubting(kept)).unwrap();
    let mut feed = feed(&bench.node, bench.machine, bench.monitor());
    for _ in 0..2 {
        let rows = feed.rows(600);
        assert!(rows.iter().all(|row| doubts(row, bench.slew)));
        let is_open = |row: &WireVerdict| row.verdict().unproven.has(bench.slew);
        assert!(rows.iter().all(is_open));
        // nothing is wrong with it now
        assert!(rows.iter().any(is_calm));
        restart(&mut feed);
    }
    let seen = *feed.rows(300).last().unwrap();
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let mut message = WireAcknowledge::of_signals(&seen, [bench.slew].into_iter().collect());
    sender.send_for(feed.hash, &mut message).unwrap();
    let rows = feed.rows(300);
    assert!(!doubts(rows.last().unwrap(), bench.slew));
    restart(&mut feed);
    assert!(feed.rows(300).iter().all(|row| row.doubted == 0));
}

/// A joint whose standstill was contradicted, and that shows one value when the monitor ends: both doubts are kept, with the velocity
/// before it stopped.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_had_stopped_and_is_frozen_at_shutdown_keeps_both_doubts() {
    let bench = Bench::new("both");
    let file = kept_after_a_session(&bench);
    let text = "joint.slew=0~-0.3@2026-11-27T10:00:00Z,joint.slew=0~inf@2026-11-27T10:00:00Z";
    let doubted: DoubtedSignals = text.parse().unwrap();
    let kept = (doubted.iter()).fold(Kept::default(), |kept, it| kept.doubting(*it));
    file.write(&kept).unwrap();
    let mut feed = feed(&bench.node, bench.machine, bench.monitor());
    arm_freezes(&mut feed);
    for _ in 0..2 {
        let rows = feed.rows(300);
        assert!(rows.iter().all(|row| doubts(row, bench.slew)));
        feed.time.stop_monitor();
        let kept = file.read().unwrap().doubted;
        let of_slew = kept.iter().filter(|it| it.name.to_string() == "joint.slew");
        assert!(of_slew.eq(doubted.iter()), "{kept}");
        feed.time.start_monitor();
        feed.wait_for_monitor();
    }
}

/// Whatever the arm does afterwards: it may be off by anything.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_has_lost_counts_is_doubted_until_a_person_trusts_it() {
    let bench = Bench::new("counts");
    let slew = bench.slew;
    let mut feed = feed(&bench.node, bench.machine, bench.monitor());
    // it turns alone
    let start_ns = feed.samples[0].log_time_ns + 36_000_000_000;
    let stops = feed.samples.iter().position(|it| it.log_time_ns > start_ns);
    feed.rows(stops.unwrap());
    slew_loses_counts(&mut feed);
    let left = bench.samples - feed.next - 600;
    let rows = feed.rows(left);
    let last_ns = rows.last().unwrap().time_ns;
    assert!(last_ns > rows[0].time_ns + 10_000_000_000);
    let (first, later) = rows.split_at(rows.len() / 3);
    assert!(!doubts(&first[0], slew));
    assert!(later.iter().all(|row| doubts(row, slew)));
    let seen = *later.last().unwrap();
    let mut sender: Sender<WireAcknowledge> = bench.node.sender(0, 0).unwrap();
    let mut message = WireAcknowledge::of_signals(&seen, [slew].into_iter().collect());
    sender.send_for(feed.hash, &mut message).unwrap();
    let trusted = feed.rows(300);
    assert!(!doubts(trusted.last().unwrap(), slew));
}

/// The encoder of a joint shows its noise alone while the controller asks the joint to turn. Hydraulics that are off look the same, so
/// that rows are not doubted.
// requirement: TW-VERDICT-31
#[test]
fn joint_that_does_not_show_what_is_asked_is_doubted_and_its_rows_are_not() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("tiny_lift.urdf"), folder.path().join("tiny_lift.urdf")).unwrap();
    let path = folder.path().join("asked.toml");
    let text = std::fs::read_to_string(data("tiny_lift.toml")).unwrap()
        + "[signals.joints.slew]\ncommand = { topic = \"/joint_states\", field = \"velocity\", joint = \"slew\" }\n";
    std::fs::write(&path, text).unwrap();
    let file = MachineFile::read(&path).unwrap();
    let session = LogSamples::read(&data("tiny_lift.mcap"), &file, None)
        .unwrap()
        .session;
    let urdf = file.urdf(None, None).unwrap();
    let (machine, _) = session.machine(&file, &urdf).unwrap();
    let mut joints = machine.joints().iter();
    let slew = Proof::Joint(joints.position(|joint| joint.name == "slew").unwrap());
    let mut names = session.streams[0].iter();
    let place = names.position(|name| name == "slew").unwrap();
    let rows_with = |is_asked: bool| {
        let (mut first, mut step) = (None, 0.0_f64);
        rows_of("tiny_lift.mcap", &path, Proofs::ALL, |_, mut wire| {
            if wire.kind == Kind::Joints as u32 {
                let first = *first.get_or_insert(wire.values[place]);
                step += 1.0;
                let count = wire.value_count as usize;
                wire.values[place] = first + 2e-4 * (step * step * 0.37).sin();
                wire.values[place + count / 2] = 0.0;
            } else if wire.kind == Kind::Command as u32 {
                wire.values[0] = if is_asked { 0.3 } else { f64::NAN };
            }
            Some(wire)
        })
    };
    let asked = rows_with(true);
    let (_, row) = (asked.iter().find(|(_, row)| doubts(row, slew))).unwrap();
    assert!(row.verdict().unproven.has(slew));
    assert!(!row.row_reasons().has(Reason::Contradiction));
    let idle = rows_with(false);
    let before = idle
        .iter()
        .find(|(_, of)| of.sample_sequence == row.sample_sequence);
    assert!(!doubts(&before.unwrap().1, slew));
}

//! Tests of recordings: offline analysis makes the same loads and verdicts of them, faults included.

use std::path::Path;
use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tipwatch_analyze::analysis::{Analysis, run};
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;
use tipwatch_ingest::{FieldRequest, Log, record_fields};
use tipwatch_live::alarm::{AlarmFile, DoubtedSignal, Kept};
use tipwatch_live::node::{Producer, Sender};
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::session::machine_hash;
use tipwatch_live::wire::topics::{EVENT_ROW, WireAcknowledge, WireVerdict};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Proofs;
use tipwatch_mechanics::verdict::{InputFault, Latch, Level};

use crate::arm_forces::with_forces;
use crate::payloads::{PRESSURES, SCALE, with_payload};
use crate::support::feed::Feed;
use crate::support::killing::{Reading, Times, files, known_sequences, sequences};
use crate::support::numbered::numbered_machine;
use crate::support::offline::causal;
use crate::support::prioritise::prioritise;
use crate::support::producing::Producing;
use crate::support::steered::Steered;
use crate::support::{Ended, LIMIT, World, data};

/// The folder of the only session in `folder`.
fn session_in(folder: &Path) -> std::path::PathBuf {
    let mut sessions = std::fs::read_dir(folder).unwrap();
    let session = sessions.next().unwrap().unwrap().path();
    assert!(sessions.next().is_none(), "one session");
    session
}

fn assert_same_bits(live: f64, offline: f64, what: &str) {
    let same = live.to_bits() == offline.to_bits() || live.is_nan() && offline.is_nan();
    assert!(same, "{what}: {live:e} live, {offline:e} offline");
}

/// Every row that was published is that of the analysis, in the same order.
fn assert_reproduced(live: &[WireVerdict], analysis: &Analysis) {
    let rows = &analysis.rows;
    let verdicts = rows.whole().verdicts.as_ref().unwrap();
    assert_eq!(live.len(), rows.len());
    for (row, live) in live.iter().enumerate() {
        assert_eq!(live.time_ns, rows.times_ns[row]);
        assert_eq!(live.row_reasons(), rows.reasons[row], "row {row}");
        assert_eq!(live.verdict(), verdicts.verdicts[row], "row {row}");
        assert_eq!(live.conditions(), verdicts.recorded[row], "row {row}");
        let offline = |quantity| rows.whole().outcomes.column(quantity)[row];
        assert_same_bits(
            live.utilisation,
            offline(Quantity::Utilisation),
            "utilisation",
        );
        assert_same_bits(
            live.time_to_lift_off_s,
            verdicts.time_to_lift_off_s[row],
            "time to lift-off",
        );
        let predictions = verdicts.predictions.as_ref().expect("a causal analysis");
        assert_same_bits(live.predicted_age_s, predictions.age_s[row], "age");
        for wheel in 0..live.wheel_count as usize {
            assert_same_bits(live.load[wheel], offline(Quantity::Load(wheel)), "load");
            assert_same_bits(live.otf[wheel], offline(Quantity::Otf(wheel)), "otf");
            assert_same_bits(
                live.otf_sigma[wheel],
                offline(Quantity::OtfSigma(wheel)),
                "sigma",
            );
        }
        let on = rows.machine_at(row);
        let edges = on.map_or(&[][..], |on| on.polygon().edges());
        assert_eq!(live.edge_count as usize, edges.len());
        for (edge, on_set) in edges.iter().enumerate() {
            let mut all = analysis.machine.polygon().edges().iter();
            let column = all.position(|named| named.name == on_set.name).unwrap();
            let angle = offline(Quantity::ForceAngle(column));
            assert_same_bits(live.force_angle[edge], angle, "force angle");
            let ends = [live.edge_from[edge], live.edge_to[edge]];
            let names = ends.map(|wheel| &analysis.machine.wheels()[wheel as usize].name);
            let wheels = on.unwrap().wheels();
            assert_eq!(names, [&wheels[on_set.from].name, &wheels[on_set.to].name]);
        }
    }
}

/// Sends a session to a monitor and a recorder; the rows that the monitor published.
fn recorded_session(
    world: &World,
    folder: &Path,
    mut send_next: impl FnMut(&mut Feed<Steered>, &[WireVerdict]),
) -> (Vec<WireVerdict>, Ended) {
    let recorder = world.record(&data("tiny_lift.toml"), folder, &[]);
    let monitor = Steered::monitor(world, "tiny_lift");
    let mut feed = Feed::new(&world.join(), "tiny_lift", monitor);
    feed.wait_for_monitor();
    while feed.producer.readers() < 2 || files(folder).is_empty() {
        feed.producer.update_connections().unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    let mut rows = Vec::new();
    while feed.next < 1000 {
        send_next(&mut feed, &rows);
        while let Some(row) = feed.find(|v| v.event == EVENT_ROW && v.session == feed.source) {
            rows.push(row);
        }
    }
    feed.end();
    while let Some(row) = feed.find(|v| v.event == EVENT_ROW && v.session == feed.source) {
        rows.push(row);
    }
    (rows, recorder.end())
}

/// Records a session with every kind of fault, and returns its verdicts.
fn faulty_session(world: &World, folder: &Path) -> Vec<WireVerdict> {
    let (rows, recorder) = recorded_session(world, folder, |feed, _| {
        match feed.next {
            // lost: few, then many
            200..=202 => feed.next += 3,
            320 => feed.next += 25,
            // not finite
            440..=452 => feed.inject_sealed(|sample| sample.values[0] = f64::NAN),
            // the clock goes back
            560..=568 => feed.inject_sealed(|sample| sample.time_ns -= 100_000_000),
            // torn
            640..=645 => feed.inject(|sample| sample.values[100] = 1.0),
            // a joint that jumps, a force that no machine feels
            700..=716 => {
                let jump = 30.0 * (feed.next - 699) as f64;
                feed.inject_sealed(|sample| sample.values[0] += jump);
            }
            // silence: longer than the estimator bridges
            760 => feed.next += 90,
            _ => feed.send(1),
        }
    });
    assert!(recorder.err.contains("not recorded"), "{}", recorder.err);
    rows
}

// requirement: TW-RECORD-05, TW-VERDICT-24
#[test]
fn offline_reproduces_a_faulty_session() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("rec");
    let rows = faulty_session(&world, folder.path());
    let analysis = causal(&session_in(folder.path()), &data("tiny_lift.toml"));
    assert_reproduced(&rows, &analysis);
    // 118 were left out and 6 torn
    let reports =
        |note: &tipwatch_mechanics::machine::Note| note.contains(" 124 samples and 0 verdicts");
    assert!(analysis.notes.iter().any(reports), "{:?}", analysis.notes);
    for fault in [
        InputFault::Lost,
        InputFault::NotFinite,
        InputFault::Disordered,
        InputFault::Torn,
        InputFault::OutOfRange,
        InputFault::ImpossibleRate,
        InputFault::Stale,
    ] {
        let was_told = rows.iter().any(|row| row.conditions().faults.has(fault));
        assert!(was_told, "{}", fault.name());
    }
    let levels = |level| rows.iter().any(|row| row.verdict().level == level);
    assert!(levels(Level::Danger) && levels(Level::Fault));
}

// requirement: TW-RECORD-05, TW-VERDICT-20
#[test]
fn offline_reproduces_an_inherited_alarm() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("inherited");
    let (file, urdf) = crate::support::feed::machine("tiny_lift");
    let hash = machine_hash(&file, &urdf);
    let alarm = AlarmFile::new(&world.state_folder, hash, &file.spec.name);
    let kept = Kept::alarm(Latch::raised(Level::Danger));
    alarm.write(&kept).unwrap();
    let rows = faulty_session(&world, folder.path());
    assert_eq!(rows[0].latched_level, Level::Danger as u32);
    let analysis = causal(&session_in(folder.path()), &data("tiny_lift.toml"));
    assert_reproduced(&rows, &analysis);
}

// requirement: TW-RECORD-05, TW-VERDICT-31
#[test]
fn offline_reproduces_an_inherited_doubt_and_its_acknowledgement() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("doubted");
    let (file, urdf) = crate::support::feed::machine("tiny_lift");
    let hash = machine_hash(&file, &urdf);
    let alarm = AlarmFile::new(&world.state_folder, hash, &file.spec.name);
    let slipped = |signal: &str| signal.parse::<DoubtedSignal>().unwrap();
    let kept = Kept::default()
        .doubting(slipped("joint.lift=0.4~0.02@2026-11-27T10:00:00Z"))
        .doubting(slipped("joint.slew=-1.5~0.02@2026-11-27T10:00:00Z"));
    alarm.write(&kept).unwrap();
    let mut acknowledger: Sender<WireAcknowledge> = world.join().sender(0, 0).unwrap();
    let (rows, _) = recorded_session(&world, folder.path(), |feed, rows| {
        if let (Some(seen), 300 | 500) = (rows.last(), feed.next) {
            // one of them, then what is left
            let doubted = Proofs::from_bits(seen.doubted).iter(64).next();
            let signals = doubted.into_iter().collect();
            let mut message = WireAcknowledge::of_signals(seen, signals);
            acknowledger.send_for(hash, &mut message).unwrap();
        }
        feed.send(1);
    });
    let doubts = |row: &WireVerdict| row.doubted.count_ones();
    assert_eq!(doubts(&rows[0]), 2);
    assert_eq!(doubts(rows.last().unwrap()), 0);
    assert!(rows.iter().any(|row| doubts(row) == 1));
    let acknowledged = rows.iter().filter(|row| row.acknowledged_signals != 0);
    assert_eq!(acknowledged.count(), 2);
    let log = session_in(folder.path());
    let analysis = causal(&log, &data("tiny_lift.toml"));
    assert_reproduced(&rows, &analysis);
    // with samples of both sides in view, rows that the monitor doubted are doubted, too
    let file = MachineFile::read(&data("tiny_lift.toml")).unwrap();
    let smoothed = run::analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
    let at = |time_ns| {
        smoothed
            .rows
            .times_ns
            .iter()
            .position(|it| *it == time_ns)
            .unwrap()
    };
    for row in [&rows[30], &rows[rows.len() - 2]] {
        let reasons = smoothed.rows.reasons[at(row.time_ns)];
        assert_eq!(reasons.have_doubt(), row.doubted != 0);
    }
}

/// Replays a log to a monitor and a recorder, losing nothing: the rows that the monitor published.
fn recorded_replay(
    world: &World,
    log: &Path,
    machine: &Path,
    out: &Path,
    split: &str,
) -> Vec<WireVerdict> {
    let _prioritised = prioritise();
    let recorder = world.record(machine, out, &["--split", split]);
    let mut monitor = world.monitor(machine, &["--quiet", "--allow-untimed"]);
    let reading = Reading::new(&world.join());
    let options = ["--speed", "max", "--lossless", "--readers", "2"];
    let replay = world.replay_log(log, machine, &[&options[..], &["--wait", "60"]].concat());
    let (mut rows, mut sequences) = (Vec::new(), Vec::new());
    let mut is_over = false;
    while !is_over {
        // the monitor may judge long after the replay's end; a look after its own end: what it published is still there
        is_over = monitor.child.try_wait().unwrap().is_some();
        while let Some(row) = reading.0.receive(|v| *v).unwrap() {
            sequences.push(row.sequence);
            if row.event == EVENT_ROW {
                rows.push(row);
            }
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    for process in [replay, monitor, recorder] {
        let ended = process.end();
        assert!(ended.status.success(), "{}", ended.err);
    }
    // what is missing here was not read; what is missing otherwise, the monitor never got or lost
    let unread: Vec<_> = (sequences.iter().zip(&sequences[1..]))
        .filter(|(a, b)| **b != **a + 1)
        .collect();
    let last = rows.last().expect("no row was read");
    assert_eq!(
        (unread, last.lost, last.rows),
        (vec![], 0, rows.len() as u64)
    );
    rows
}

fn assert_same_columns(a: &Analysis, b: &Analysis) {
    assert_eq!(a.rows.times_ns, b.rows.times_ns);
    let outcomes = &a.rows.whole().outcomes;
    for (quantity, column) in outcomes.quantities.iter().zip(&outcomes.columns) {
        for (a, b) in column.iter().zip(b.rows.whole().outcomes.column(*quantity)) {
            assert_same_bits(*a, *b, &format!("{quantity:?}"));
        }
    }
}

#[test]
fn recording_replays_to_the_same_verdicts() {
    let folder = tempfile::tempdir().unwrap();
    let mut world = World::new("again");
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let (first, second) = (folder.path().join("1"), folder.path().join("2"));
    let first_rows = recorded_replay(&world, &log, &machine, &first, "0.001");
    let recorded = session_in(&first);
    assert!(files(&first).len() > 1, "split by time");
    // another monitor without the alarm of the first
    world.state_folder = folder.path().join("state");
    let second_rows = recorded_replay(&world, &recorded, &machine, &second, "0.001");
    assert_eq!((first_rows.len(), second_rows.len()), (400, 400));
    for (a, b) in first_rows.iter().zip(&second_rows) {
        assert_eq!((a.time_ns, a.verdict()), (b.time_ns, b.verdict()));
        assert_same_bits(a.load[0], b.load[0], "load");
    }
    // and the recording gives what the log gave
    assert_same_columns(&causal(&log, &machine), &causal(&recorded, &machine));
}

#[test]
fn recording_keeps_scaled_and_shifted_signals() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("number");
    let log = data("tiny.mcap");
    let machine = numbered_machine(folder.path());
    let text = std::fs::read_to_string(&machine).unwrap();
    let text = text + "\n[clock]\noffset = { \"/imu/data\" = 0.004 }\n";
    std::fs::write(&machine, text).unwrap();
    let out = folder.path().join("out");
    let rows = recorded_replay(&world, &log, &machine, &out, "0.001");
    let recorded = causal(&session_in(&out), &machine);
    assert_reproduced(&rows, &recorded);
    assert_same_columns(&causal(&log, &machine), &recorded);
}

// requirement: TW-RECORD-05
#[test]
fn recording_keeps_what_tells_of_supports_and_their_loads() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("feet");
    let (log, machine) = (data("crane.mcap"), data("crane.toml"));
    let out = folder.path().join("out");
    let rows = recorded_replay(&world, &log, &machine, &out, "1");
    let recorded = causal(&session_in(&out), &machine);
    assert_reproduced(&rows, &recorded);
    assert_same_columns(&causal(&log, &machine), &recorded);
}

// requirement: TW-RECORD-01
#[test]
fn recording_keeps_load_sensors_and_commands() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("recorded_cells");
    let mut text = std::fs::read_to_string(data("crane.toml")).unwrap();
    // one alone, and two together, that show twice what they should
    text += "[signals.wheels.OFL]\nload = { topic = \"/outriggers/force\", field = \"data[0]\", scale = 2.0 }\n\
             [[signals.load_sums]]\nname = \"Rear axle\"\nwheels = [\"ORL\", \"ORR\"]\n\
             load = { topic = \"/outriggers/force\", field = \"data[2]\", scale = 4.0 }\n\
             [signals.joints.slew]\ncommand = { topic = \"/joint_states\", field = \"velocity\", joint = \"slew\", offset = 0.1 }\n";
    std::fs::copy(data("crane.urdf"), folder.path().join("crane.urdf")).unwrap();
    let machine = folder.path().join("cells.toml");
    std::fs::write(&machine, text).unwrap();
    let (log, out) = (data("crane.mcap"), folder.path().join("out"));
    let rows = recorded_replay(&world, &log, &machine, &out, "1");
    assert!(rows.iter().any(|row| row.load_doubt & 1 != 0));
    assert!(rows[1..].iter().all(|row| row.commanded.count_ones() == 1));
    let recorded = causal(&session_in(&out), &machine);
    assert_reproduced(&rows, &recorded);
    assert_same_columns(&causal(&log, &machine), &recorded);
}

// requirement: TW-RECORD-01
#[test]
fn recording_keeps_what_tells_of_payloads() {
    let folder = tempfile::tempdir().unwrap();
    for (test, force, mass) in [
        ("recorded_scale", "", SCALE),
        ("recorded_lift", PRESSURES, "\"estimate\""),
    ] {
        let world = World::new(test);
        let machine = with_payload(folder.path(), force, mass);
        let (log, out) = (data("lift_payload.mcap"), folder.path().join(test));
        let rows = recorded_replay(&world, &log, &machine, &out, "1");
        assert!(rows.iter().filter(|row| row.payload_mass_kg > 0.0).count() > 300);
        let recorded = causal(&session_in(&out), &machine);
        assert_reproduced(&rows, &recorded);
        assert_same_columns(&causal(&log, &machine), &recorded);
    }
}

// requirement: TW-RECORD-01
#[test]
fn recording_keeps_forces_of_the_arm() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("recorded_forces");
    let machine = with_forces(folder.path(), ", scale = 2.0");
    let (log, out) = (data("lift_payload.mcap"), folder.path().join("out"));
    let rows = recorded_replay(&world, &log, &machine, &out, "1");
    assert!(rows.iter().any(|row| row.doubted_forces != 0));
    let recorded = causal(&session_in(&out), &machine);
    assert_reproduced(&rows, &recorded);
    assert_same_columns(&causal(&log, &machine), &recorded);
}

/// Returns the number of samples that the recorder refused: a busy computer may hold up the producer until its clock and the
/// samples' disagree.
fn refused(recorder: &Ended) -> u64 {
    let (_, count) = recorder.err.rsplit_once("refused: ").unwrap();
    count.split(' ').next().unwrap().parse().unwrap()
}

/// Waits for so many more samples; delays from sample to verdict (ms) of the rows published meanwhile.
fn delays(reading: &Reading, producing: &Producing, samples: u64) -> Times {
    reading.drain();
    let from_ns = monotonic_ns();
    let last = producing.sent() + samples;
    while producing.sent() < last {
        std::thread::sleep(Duration::from_millis(2));
    }
    let mut times = Times::default();
    while let Some(row) = reading.0.receive(|v| *v).unwrap() {
        if row.event == EVENT_ROW && row.published_ns > from_ns {
            times
                .0
                .push((row.published_ns - row.sample_published_ns) as f64 * 1e-6);
        }
    }
    times
}

/// Whether there are at least half as many rows for each sample as before. A monitor that waits 100 ms at every row for a disk or
/// a recorder makes a tenth of them; a busy computer delays samples and rows.
fn keeps_up((rows, samples): (&Times, u64), (rows_before, samples_before): (&Times, u64)) -> bool {
    let count = |times: &Times| times.0.len() as u64;
    2 * count(rows) * samples_before > count(rows_before) * samples
}

// requirement: TW-RECORD-01
#[test]
fn full_disk_does_not_delay_the_monitor() {
    let _prioritised = prioritise();
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("disk");
    let machine = data("forwarder6.toml");
    let producing = Producing::start(&world.address(), "forwarder6");
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let reading = Reading::new(&world.join());
    reading.wait_for("a row", |verdict| verdict.event == EVENT_ROW);

    let alone = delays(&reading, &producing, 100);
    // a file is limited to half a megabyte or one, depending on the shell: every further write fails
    let mut limited = Command::new("sh");
    limited.args([
        "-c",
        "trap '' XFSZ; ulimit -f 1024; exec \"$0\" \"$@\"",
        env!("CARGO_BIN_EXE_tipwatch-live"),
    ]);
    let out = folder.path().to_str().unwrap();
    let arguments = ["record", out, "--machine", machine.to_str().unwrap()];
    let recorder = world.start_by(limited, &arguments);
    let full = delays(&reading, &producing, 2000);
    recorder.signal("-STOP");
    let stopped = delays(&reading, &producing, 100);
    recorder.signal("-CONT");
    alone.print("sample to verdict, no recorder");
    full.print("sample to verdict, disk full");
    stopped.print("sample to verdict, recorder stopped");
    assert!(keeps_up((&full, 2000), (&alone, 100)));
    assert!(keeps_up((&stopped, 100), (&alone, 100)));
    producing.end();
    let recorder = recorder.end();
    drop(monitor);
    assert!(
        recorder.err.contains("retrying in a new file"),
        "{}",
        recorder.err
    );
    assert!(
        recorder.err.contains("not recorded: 0 samples, 0 verdicts"),
        "{}",
        recorder.err
    );
    // the files are consecutive, and no good sample is missing
    let files = files(folder.path());
    assert!(files.len() > 1, "{files:?}");
    // the last file may begin with the session's last verdicts
    let spans = files.iter().filter_map(|file| known_sequences(file));
    let mut spans: Vec<_> = spans.collect();
    spans.sort_unstable();
    let inside: u64 = spans.iter().map(|(_, _, holes)| holes).sum();
    let between = spans.windows(2).map(|pair| pair[1].0 - pair[0].1 - 1);
    assert!(
        inside + between.sum::<u64>() <= refused(&recorder),
        "{spans:?}"
    );
}

mod needs_strace {
    use super::*;

    /// Every write of the recorder takes 0.1 s longer.
    // requirement: TW-RECORD-01
    #[test]
    #[ignore = "needs strace, which makes writes slow"]
    fn slow_disk_loses_nothing_and_delays_nobody() {
        let _prioritised = prioritise();
        let folder = tempfile::tempdir().unwrap();
        let world = World::new("slow");
        let machine = data("forwarder6.toml");
        let producing = Producing::start(&world.address(), "forwarder6");
        let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
        let reading = Reading::new(&world.join());
        reading.wait_for("a row", |verdict| verdict.event == EVENT_ROW);
        let alone = delays(&reading, &producing, 100);
        let mut slowed = Command::new("strace");
        slowed.args(["-f", "-qq", "-o", "/dev/null", "-e", "trace=write"]);
        slowed.args(["-e", "inject=write:delay_enter=100000"]);
        slowed.arg(env!("CARGO_BIN_EXE_tipwatch-live"));
        let out = folder.path().to_str().unwrap();
        let arguments = ["record", out, "--machine", machine.to_str().unwrap()];
        let recorder = world.start_by(slowed, &arguments);
        // a program whose every write waits is slow to join, too
        while files(folder.path()).is_empty() {
            std::thread::sleep(Duration::from_millis(5));
        }
        let slow = delays(&reading, &producing, 400);
        alone.print("sample to verdict, no recorder");
        slow.print("sample to verdict, slow disk");
        assert!(keeps_up((&slow, 400), (&alone, 100)));
        producing.end();
        let recorder = recorder.end();
        drop(monitor);
        assert!(
            recorder.err.contains("not recorded: 0 samples, 0 verdicts"),
            "{}",
            recorder.err
        );
        let files = files(folder.path());
        assert!(sequences(&files[0]).2 <= refused(&recorder), "holes");
    }
}

/// Ten seconds of samples are far more than its queue holds.
// requirement: TW-RECORD-03
#[test]
fn stopped_recorder_reports_what_it_missed() {
    let _prioritised = prioritise();
    let folder = tempfile::tempdir().unwrap();
    let world = World::new("stop");
    let machine = data("forwarder6.toml");
    let producing = Producing::start(&world.address(), "forwarder6");
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let reading = Reading::new(&world.join());
    reading.wait_for("a row", |verdict| verdict.event == EVENT_ROW);
    let recorder = world.record(&machine, folder.path(), &[]);
    let recording = delays(&reading, &producing, 200);
    recorder.signal("-STOP");
    let stopped = delays(&reading, &producing, 2500);
    recorder.signal("-CONT");
    let slowest_ms = producing.shared.slowest_ns.load(Ordering::Relaxed) as f64 * 1e-6;
    recording.print("sample to verdict, recorder at work");
    stopped.print("sample to verdict, recorder stopped");
    println!("the producer's slowest send meanwhile: {slowest_ms:.3} ms");
    assert!(keeps_up((&stopped, 2500), (&recording, 200)));
    std::thread::sleep(Duration::from_millis(300));
    producing.end();
    let recorder = recorder.end();
    drop(monitor);
    assert_eq!(recorder.status.code(), Some(3), "{}", recorder.err);
    let log = Log::open(&files(folder.path())[0]).unwrap();
    let gap = FieldRequest::raw("/tipwatch/record_gap", "samples");
    let (gaps, _) = record_fields(&log, &[gap], None).unwrap();
    let missed: f64 = gaps[0].values.iter().sum();
    let (_, _, holes) = sequences(&files(folder.path())[0]);
    let unexplained = holes as f64 - missed;
    assert!(missed > 100.0 && unexplained >= 0.0, "{missed} {holes}");
    assert!(unexplained <= refused(&recorder) as f64, "{missed} {holes}");
}

/// Stopped before a session was announced; one that stays waits for those to come.
// requirement: TW-RECORD-03
#[test]
fn recorder_without_a_session_says_so() {
    for (more, code) in [(&[][..], 1), (&["--stay"][..], 0)] {
        let folder = tempfile::tempdir().unwrap();
        let world = World::new("nosession");
        let producer = Producer::new(&world.join(), 7, 9).unwrap();
        let recorder = world.record(&data("tiny.toml"), folder.path(), more);
        let start = std::time::Instant::now();
        while producer.readers() == 0 {
            assert!(start.elapsed() < LIMIT, "no recorder");
            std::thread::sleep(Duration::from_millis(2));
        }
        recorder.signal("-TERM");
        let recorder = recorder.end();
        assert_eq!(recorder.status.code(), Some(code), "{}", recorder.err);
        let told = "expected the announcement of a session";
        assert!(recorder.err.contains(told), "{}", recorder.err);
        assert!(files(folder.path()).is_empty());
    }
}

/// A recorder of a machine that goes on, once its first file has so many bytes.
fn recording(world: &World, folder: &Path) -> (Producing, crate::support::Process) {
    // those of an earlier recorder do not count: this one must have joined before the session ends
    let earlier = files(folder);
    let producing = Producing::start(&world.address(), "forwarder6");
    let recorder = world.record(&data("forwarder6.toml"), folder, &[]);
    let is_long = |file: &std::path::PathBuf| {
        !earlier.contains(file) && file.metadata().is_ok_and(|m| m.len() > 60_000)
    };
    let start = std::time::Instant::now();
    while !files(folder).iter().any(is_long) {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "nothing recorded"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    (producing, recorder)
}

// requirement: TW-RECORD-03
#[test]
fn removed_or_replaced_folder_is_made_anew_and_its_loss_counted() {
    let _prioritised = prioritise();
    let acts: [fn(&Path, &Path); 3] = [
        |session, _| std::fs::remove_dir_all(session).unwrap(),
        |session, root| {
            std::fs::rename(session, root.with_extension("moved")).unwrap();
            std::fs::create_dir(session).unwrap();
        },
        |session, _| {
            let file = std::fs::read_dir(session).unwrap().next().unwrap();
            std::fs::write(session.join("other"), "").unwrap();
            std::fs::rename(session.join("other"), file.unwrap().path()).unwrap();
        },
    ];
    for act in acts {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("out");
        let world = World::new("gonefolder");
        let (producing, recorder) = recording(&world, &root);
        let session = session_in(&root);
        let before = files(&root);
        act(&session, &root);
        let removed = std::time::Instant::now();
        let is_new = |file: &std::path::PathBuf| {
            !before.contains(file) && file.metadata().is_ok_and(|m| m.len() > 1000)
        };
        while !files(&root).iter().any(is_new) {
            assert!(removed.elapsed() < Duration::from_secs(60), "not noticed");
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis(300));
        producing.end();
        let recorder = recorder.end();
        assert_eq!(recorder.status.code(), Some(3), "{}", recorder.err);
        assert!(
            recorder.err.contains("removed or replaced"),
            "{}",
            recorder.err
        );
        let (_, lost) = recorder.err.rsplit_once("not recorded: ").unwrap();
        let lost: f64 = lost.split(' ').next().unwrap().parse().unwrap();
        assert!(lost > 20.0, "{}", recorder.err);
        // the new file tells of it too
        let new = files(&root).into_iter().find(is_new).unwrap();
        let gap = FieldRequest::raw("/tipwatch/record_gap", "samples");
        let (gaps, _) = record_fields(&Log::open(&new).unwrap(), &[gap], None).unwrap();
        assert_eq!(gaps[0].values.iter().sum::<f64>(), lost);
    }
}

/// The only file of a recorder that was killed.
fn killed_file(folder: &Path) -> std::path::PathBuf {
    let world = World::new("killedfile");
    let (producing, recorder) = recording(&world, folder);
    recorder.kill();
    producing.end();
    files(folder).remove(0)
}

// requirement: TW-RECORD-02
#[test]
fn killed_file_is_complete_for_every_reader() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(killed_file(folder.path())).unwrap();
    let messages: Result<Vec<_>, _> = mcap::MessageStream::new(&bytes).unwrap().collect();
    assert!(messages.unwrap().len() > 30);
}

// requirement: TW-RECORD-04
#[test]
fn next_recorder_closes_a_file_that_was_cut() {
    let folder = tempfile::tempdir().unwrap();
    let file = killed_file(folder.path());
    let bytes = std::fs::read(&file).unwrap();
    std::fs::write(&file, &bytes[..bytes.len() - 77]).unwrap();
    let world = World::new("closing");
    let (producing, recorder) = recording(&world, folder.path());
    producing.end();
    let recorder = recorder.end();
    assert!(
        recorder.err.contains("closed after an interrupted"),
        "{}",
        recorder.err
    );
    let bytes = std::fs::read(&file).unwrap();
    let messages: Result<Vec<_>, _> = mcap::MessageStream::new(&bytes).unwrap().collect();
    assert!(messages.unwrap().len() > 30);
}

mod needs_python {
    use super::*;

    #[test]
    #[ignore = "needs Python with the package mcap; TIPWATCH_PYTHON names the interpreter"]
    fn python_reads_a_killed_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = killed_file(folder.path());
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or_else(|_| "python3".into());
        let script = "import sys; from mcap.reader import make_reader\n\
                      print(len(list(make_reader(open(sys.argv[1], 'rb')).iter_messages())))";
        let read = Command::new(python)
            .args(["-c", script])
            .arg(&file)
            .output();
        let read = read.unwrap();
        let count: usize = String::from_utf8_lossy(&read.stdout)
            .trim()
            .parse()
            .unwrap();
        let bytes = std::fs::read(&file).unwrap();
        assert_eq!(count, mcap::MessageStream::new(&bytes).unwrap().count());
        assert!(count > 30);
    }
}

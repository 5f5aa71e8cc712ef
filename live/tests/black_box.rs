//! The black box of the recorder, and recorders that join or leave at the wrong moment.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use tipwatch_live::wire::topics::{EVENT_ROW, WireVerdict};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::verdict::Level;

use crate::support::feed::{Feed, RealTime};
use crate::support::killing::{Random, Reading, files, left_over, sequences};
use crate::support::offline::causal;
use crate::support::prioritise::prioritise;
use crate::support::producing::Producing;
use crate::support::{World, data};

/// The lines of the list of clips.
fn list(root: &Path) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(root.join("clips.jsonl")).unwrap_or_default();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn clips(root: &Path) -> Vec<PathBuf> {
    let is_clip = |path: &PathBuf| path.extension().is_some_and(|e| e == "mcap");
    files(root).into_iter().filter(is_clip).collect()
}

/// Time that the estimator of an analysis needs until its loads are close to those of a monitor that had run before (s).
const SETTLED_S: f64 = 1.0;
/// Largest difference of the loads from then on, as a share of the machine's weight.
const SETTLED_SHARE: f64 = 0.005;

/// A clip that begins in the middle of a session gives the monitor's verdicts, once the estimator has settled.
#[test]
fn clip_gives_the_verdicts_of_the_monitor() {
    let _prioritised = prioritise();
    let world = World::new("clip");
    let folder = tempfile::tempdir().unwrap();
    let machine = data("tiny_lift.toml");
    let options = [
        "--on",
        "danger,lift-off",
        "--before",
        "0.2",
        "--after",
        "0.3",
    ];
    let recorder = world.record(&machine, folder.path(), &options);
    let monitor = world.monitor(&machine, &["--quiet"]);
    // the monitor ends with the session: who connects to it later reads nothing
    let reading = Reading::new(&world.join());
    reading.wait_for("the monitor", |_| true);
    let replay = world.replay("tiny_lift", &["--readers", "2", "--wait", "60"]);
    assert!(replay.end().status.success());
    let mut rows: Vec<WireVerdict> = Vec::new();
    while let Some(row) = reading.0.receive(|v| *v).unwrap() {
        rows.extend((row.event == EVENT_ROW).then_some(row));
    }
    monitor.end();
    let recorder = recorder.end();
    assert_eq!(recorder.status.code(), Some(0), "{}", recorder.err);
    assert!(
        recorder.err.contains("1 clips, 0 of them shorter"),
        "{}",
        recorder.err
    );
    let is_danger = |row: &&WireVerdict| row.level == Level::Danger as u32;
    let levels: Vec<(u32, u32)> = rows.iter().map(|row| (row.level, row.faults)).collect();
    let Some(first_danger) = rows.iter().find(is_danger) else {
        panic!("no danger in {} rows: {levels:?}", rows.len());
    };
    let [clip] = &clips(folder.path())[..] else {
        panic!("{:?}", files(folder.path()));
    };
    let analysis = causal(clip, &machine);
    // the span: 0.2 s before the danger, less what a busy computer is late
    let first_ns = analysis.rows.times_ns[0];
    let before_s = (first_danger.time_ns - first_ns) as f64 * 1e-9;
    assert!((0.1..0.3).contains(&before_s), "{before_s} s");
    let weight_n = analysis.machine.mass() * analysis.machine.gravity();
    let verdicts = analysis.rows.whole().verdicts.as_ref().unwrap();
    let (mut compared, mut by_half_second) = (0, [0.0_f64; 8]);
    for live in &rows {
        let Ok(row) = analysis.rows.times_ns.binary_search(&live.time_ns) else {
            continue;
        };
        let since_s = (live.time_ns - first_ns) as f64 * 1e-9;
        let difference = (0..live.wheel_count as usize).map(|wheel| {
            let offline = analysis.rows.whole().outcomes.column(Quantity::Load(wheel))[row];
            (offline - live.load[wheel]).abs()
        });
        let difference = difference.fold(0.0, f64::max);
        let largest = &mut by_half_second[((since_s * 2.0) as usize).min(7)];
        *largest = largest.max(difference);
        if since_s > SETTLED_S {
            assert_eq!(
                verdicts.verdicts[row].level as u32, live.level,
                "{since_s} s"
            );
            assert!(
                difference < SETTLED_SHARE * weight_n,
                "{since_s} s: {difference} N"
            );
            compared += 1;
        }
    }
    println!(
        "{compared} rows; largest difference of a load in each half second (N): {by_half_second:.1?} of {weight_n:.0}"
    );
    assert!(compared > 50, "{compared}");
}

/// The clips that are being written, or were when their recorder was killed.
fn partial(folder: &Path) -> Vec<PathBuf> {
    let files = files(folder).into_iter();
    let partial = files.filter(|path| path.extension().is_some_and(|e| e == "partial"));
    partial.collect()
}

/// Killed again and again: a listed clip stays as it was, and every file can be read.
#[test]
fn killed_black_box_loses_no_finished_clip() {
    let _prioritised = prioritise();
    let world = World::new("bbkill");
    let folder = tempfile::tempdir().unwrap();
    let machine = data("tiny_lift.toml");
    let producing = Producing::start(&world.address(), "tiny_lift");
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    Reading::new(&world.join()).wait_for("a row", |verdict| verdict.event == EVENT_ROW);
    let mut random = Random::new();
    let mut known: BTreeSet<(String, String)> = BTreeSet::new();
    let options = [
        "--on",
        "danger",
        "--before",
        "0.1",
        "--after",
        "0.05",
        "--longest",
        "1",
    ];
    for _ in 0..4 {
        let recorder = world.record(&machine, folder.path(), &options);
        // clips of a second: at least one is finished, another begun
        std::thread::sleep(Duration::from_millis(random.between(2500, 4500)));
        // killed between two clips it leaves nothing to close
        let deadline = Instant::now() + Duration::from_secs(20);
        while partial(folder.path()).is_empty() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        recorder.kill();
        for line in list(folder.path()) {
            let text = |key: &str| line[key].as_str().unwrap().to_owned();
            known.insert((text("file"), text("sha256")));
        }
    }
    // the last start closes what the last kill left
    let recorder = world.record(&machine, folder.path(), &options);
    std::thread::sleep(Duration::from_millis(1500));
    producing.end();
    let recorder = recorder.end();
    drop(monitor);
    let now = list(folder.path());
    let listed = |file: &str| now.iter().find(|line| line["file"] == file).unwrap();
    for (file, sha256) in &known {
        assert_eq!(listed(file)["sha256"], sha256.as_str(), "{file}");
    }
    let found = clips(folder.path());
    assert_eq!(found.len(), now.len(), "every clip is listed");
    let is_partial = |clip: &PathBuf| clip.to_string_lossy().contains("_partial");
    let partial_count = found.iter().filter(|clip| is_partial(clip)).count();
    let finished = found.len() - partial_count;
    println!("{finished} finished clips, {partial_count} partial");
    assert!(finished > 3, "{}", recorder.err);
    assert!(partial_count > 0, "none was interrupted: {}", recorder.err);
    for clip in found {
        let bytes = std::fs::read(&clip).unwrap();
        let messages: Result<Vec<_>, _> = mcap::MessageStream::new(&bytes).unwrap().collect();
        let mut messages = messages.unwrap().into_iter();
        let has_samples = messages.any(|m| !m.channel.topic.starts_with("/tipwatch"));
        // an interrupted clip may have just begun
        assert!(has_samples || is_partial(&clip), "{}", clip.display());
        if has_samples {
            assert_eq!(sequences(&clip).2, 0, "holes in {}", clip.display());
        }
    }
    let unfinished = partial(folder.path());
    assert!(unfinished.is_empty(), "{unfinished:?}");
    assert_eq!(left_over(&world).0, 0);
}

/// The end of a session reaches only recorders that joined before it was sent.
#[test]
fn recorder_that_joins_after_the_end_of_a_session_ends() {
    let world = World::new("late");
    let folder = tempfile::tempdir().unwrap();
    let mut feed = Feed::new(&world.join(), "tiny_lift", RealTime);
    feed.send(10);
    feed.end();
    let recorder = world.record(&data("tiny_lift.toml"), folder.path(), &[]);
    let start = Instant::now();
    while files(folder.path()).is_empty() {
        assert!(start.elapsed() < Duration::from_secs(60), "never joined");
        feed.producer.update_connections().unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    drop(feed);
    let recorder = recorder.end();
    assert_eq!(recorder.status.code(), Some(0), "{}", recorder.err);
    assert!(
        recorder.err.contains("the producer is gone"),
        "{}",
        recorder.err
    );
    // the file is finished, not only readable
    let bytes = std::fs::read(&files(folder.path())[0]).unwrap();
    assert!(mcap::Summary::read(&bytes).unwrap().is_some());
}

/// While the recorder waits for the last verdicts of a session, the next one may begin.
#[test]
fn session_right_after_another_is_recorded_whole() {
    let _prioritised = prioritise();
    let world = World::new("next");
    let folder = tempfile::tempdir().unwrap();
    let machine = data("tiny_lift.toml");
    let recorder = world.record(&machine, folder.path(), &["--stay"]);
    let _monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let node = world.join();
    for _ in 0..2 {
        let mut feed = Feed::new(&node, "tiny_lift", RealTime);
        feed.wait_for_monitor();
        while feed.producer.readers() < 2 {
            std::thread::sleep(Duration::from_millis(1));
        }
        feed.producer.update_connections().unwrap();
        feed.send(300);
        feed.end();
        // until readers have read the end
        std::thread::sleep(Duration::from_millis(60));
    }
    std::thread::sleep(Duration::from_millis(300));
    recorder.signal("-TERM");
    let recorder = recorder.end();
    let counts: Vec<_> = files(folder.path())
        .iter()
        .map(|file| sequences(file))
        .collect();
    assert_eq!(counts.len(), 2, "{}", recorder.err);
    for (_, last, holes) in counts {
        assert_eq!((last, holes), (299, 0), "{}", recorder.err);
    }
}

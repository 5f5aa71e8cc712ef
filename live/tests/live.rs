//! The program as a user runs it: replay and monitor as processes, joined by shared memory only.

#![allow(
    clippy::unwrap_used,
    reason = "a test that panics has failed, helpers included"
)]

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::options::{Estimator, Options};
use tipwatch_analyze::run;
use tipwatch_binding::MachineFile;
use tipwatch_live::recording::Recording;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::signal::Reason;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data");
/// Far beyond what any test takes: only so that none hangs.
const LIMIT: Duration = Duration::from_secs(120);

fn data(name: &str) -> PathBuf {
    Path::new(DATA).join(name)
}

/// A world of its own in shared memory.
struct World {
    prefix: String,
}

impl World {
    fn new(test: &str) -> Self {
        Self {
            prefix: format!("tw{}{test}_", std::process::id()),
        }
    }

    fn start(&self, command: &str, machine: &Path, more: &[&str]) -> Process {
        let child = Command::new(env!("CARGO_BIN_EXE_tipwatch-live"))
            .arg(command)
            .args(more)
            .arg("--machine")
            .arg(machine)
            .args(["--prefix", &self.prefix])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Process::watch(child)
    }

    fn replay(&self, more: &[&str]) -> Process {
        let log = data("tiny.mcap");
        let arguments: Vec<&str> = [log.to_str().unwrap()]
            .into_iter()
            .chain(more.iter().copied())
            .collect();
        self.start("replay", &data("tiny.toml"), &arguments)
    }
}

impl Drop for World {
    fn drop(&mut self) {
        // iceoryx2 leaves one small file of each prefix behind.
        for entry in std::fs::read_dir("/dev/shm")
            .into_iter()
            .flatten()
            .flatten()
        {
            if entry
                .file_name()
                .to_string_lossy()
                .starts_with(&self.prefix)
            {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

type Text = std::thread::JoinHandle<String>;

/// A process that is killed when the test ends, however it ends.
struct Process {
    child: Child,
    out: Option<Text>,
    err: Option<Text>,
}

struct Ended {
    status: ExitStatus,
    out: String,
    err: String,
}

impl Process {
    fn watch(mut child: Child) -> Self {
        let out = reader_of(child.stdout.take().unwrap());
        let err = reader_of(child.stderr.take().unwrap());
        Self {
            child,
            out: Some(out),
            err: Some(err),
        }
    }

    fn end(mut self) -> Ended {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if start.elapsed() > LIMIT {
                self.child.kill().unwrap();
                break self.child.wait().unwrap();
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let text = |thread: Option<Text>| thread.unwrap().join().unwrap();
        Ended {
            status,
            out: text(self.out.take()),
            err: text(self.err.take()),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn reader_of(mut pipe: impl Read + Send + 'static) -> Text {
    std::thread::spawn(move || {
        let mut text = String::new();
        pipe.read_to_string(&mut text).unwrap();
        text
    })
}

/// What `tipwatch analyze --estimator causal` computes from the same log.
fn expected() -> Analysis {
    let file = MachineFile::read(&data("tiny.toml")).unwrap();
    let options = Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    run::analyse(&data("tiny.mcap"), &file, options, &mut |_| {}).unwrap()
}

/// What follows `"key":` in a line of JSON, up to the end of the value.
fn after<'a>(text: &'a str, key: &str) -> &'a str {
    let mark = format!("\"{key}\":");
    let start = text
        .find(&mark)
        .unwrap_or_else(|| panic!("no {key} in {text}"))
        + mark.len();
    let value = &text[start..];
    match value.as_bytes()[0] {
        b'{' => &value[..=value.find('}').unwrap()],
        b'[' => &value[..=value.find(']').unwrap()],
        _ => &value[..value.find([',', '}']).unwrap()],
    }
}

fn assert_same(json: &str, number: f64, place: &str) {
    if number.is_finite() {
        // the standard library's reading is exact; serde_json's is not by default
        assert_eq!(
            json.parse::<f64>().unwrap().to_bits(),
            number.to_bits(),
            "{place}"
        );
    } else {
        assert_eq!(json, "null", "{place}");
    }
}

fn assert_same_row(line: &str, analysis: &Analysis, row: usize) {
    let rows = &analysis.rows;
    let value: serde_json::Value = serde_json::from_str(line).unwrap();
    assert_eq!(value["schema"], 1);
    assert_eq!(value["time_ns"], rows.times_ns[row]);
    assert_eq!(value["valid"], rows.reasons[row].is_empty());
    let reasons: Vec<&str> = rows.reasons[row].iter().map(Reason::name).collect();
    assert_eq!(value["reasons"], serde_json::json!(reasons));
    let number = |quantity| rows.outcomes.column(quantity)[row];
    type OfWheel = fn(usize) -> Quantity;
    let by_wheel: [(&str, OfWheel); 4] = [
        ("load_n", Quantity::Load),
        ("otf_n", Quantity::Otf),
        ("load_min_n", Quantity::LoadLeast),
        ("load_max_n", Quantity::LoadLargest),
    ];
    for (key, quantity) in by_wheel {
        for (index, wheel) in analysis.machine.wheels().iter().enumerate() {
            let json = after(after(line, key), &wheel.name.to_lowercase());
            assert_same(json, number(quantity(index)), key);
        }
    }
    let single = [
        ("zmp_x_m", Quantity::ZmpX),
        ("zmp_y_m", Quantity::ZmpY),
        ("zmp_margin_m", Quantity::ZmpMargin),
        ("normal_force_n", Quantity::NormalForce),
    ];
    for (key, quantity) in single {
        assert_same(after(line, key), number(quantity), key);
    }
}

fn assert_all_rows(monitor: &Ended) {
    assert!(monitor.status.success(), "{}", monitor.err);
    let analysis = expected();
    let lines: Vec<&str> = monitor.out.lines().collect();
    assert!(
        analysis
            .rows
            .reasons
            .iter()
            .any(|reasons| reasons.is_empty())
    );
    assert_eq!(lines.len(), analysis.rows.len(), "{}", monitor.err);
    for (row, line) in lines.iter().enumerate() {
        assert_same_row(line, &analysis, row);
    }
    assert!(
        monitor
            .err
            .contains("0 lost, 0 refused, 0 repeated, 0 sent before joining"),
        "{}",
        monitor.err
    );
}

#[test]
fn live_rows_equal_those_from_the_file_to_the_bit() {
    let world = World::new("bits");
    let monitor = world.start("monitor", &data("tiny.toml"), &["--json"]);
    let replay = world
        .replay(&["--speed", "max", "--lossless", "--wait", "60"])
        .end();
    assert!(replay.status.success(), "{}", replay.err);
    assert_all_rows(&monitor.end());
}

#[test]
fn replay_may_come_first() {
    let world = World::new("first");
    let replay = world.replay(&["--speed", "max", "--lossless", "--wait", "60"]);
    std::thread::sleep(Duration::from_millis(300));
    let monitor = world.start("monitor", &data("tiny.toml"), &["--json"]);
    assert_all_rows(&monitor.end());
    assert!(replay.end().status.success());
}

#[cfg(target_os = "linux")]
#[test]
fn a_lossless_replay_waits_for_a_reader_that_is_held_up() {
    let world = World::new("held");
    let monitor = world.start("monitor", &data("tiny.toml"), &["--json"]);
    std::thread::sleep(Duration::from_millis(300));
    let signal = |name: &str| {
        let id = monitor.child.id().to_string();
        assert!(
            Command::new("kill")
                .args([name, &id])
                .status()
                .unwrap()
                .success()
        );
    };
    signal("-STOP");
    let mut replay = world.replay(&["--speed", "max", "--lossless", "--wait", "60"]);
    std::thread::sleep(Duration::from_millis(600));
    // the log has more samples than a queue has room for
    assert!(replay.child.try_wait().unwrap().is_none());
    signal("-CONT");
    assert_all_rows(&monitor.end());
    assert!(replay.end().status.success());
}

#[test]
fn another_machine_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let machine = folder.path().join("tiny.toml");
    let text = std::fs::read_to_string(data("tiny.toml")).unwrap();
    std::fs::write(
        &machine,
        text.replace("front_share = 0.5", "front_share = 0.4"),
    )
    .unwrap();
    std::fs::copy(data("tiny.urdf"), folder.path().join("tiny.urdf")).unwrap();

    let world = World::new("other");
    let monitor = world.start("monitor", &machine, &["--json"]);
    let replay = world.replay(&["--speed", "max", "--lossless", "--wait", "60"]);
    let monitor = monitor.end();
    assert_eq!(monitor.status.code(), Some(1));
    assert!(
        monitor
            .err
            .contains("expected the machine of the session, hash"),
        "{}",
        monitor.err
    );
    assert_eq!(monitor.out, "");
    // and the replay notices that nobody reads any more, or had sent all before
    replay.end();
}

#[test]
fn a_lossless_replay_without_reader_says_so() {
    let replay = World::new("alone")
        .replay(&["--speed", "max", "--lossless", "--wait", "0.1"])
        .end();
    assert_eq!(replay.status.code(), Some(1));
    assert!(
        replay.err.contains("expected a reader within 0.1 s"),
        "{}",
        replay.err
    );
}

#[test]
fn a_replay_without_reader_ends_at_once() {
    let replay = World::new("lossy").replay(&["--speed", "max"]).end();
    assert!(replay.status.success(), "{}", replay.err);
}

#[test]
fn a_monitor_whose_writer_is_killed_ends_with_an_error() {
    let world = World::new("killed");
    let monitor = world.start("monitor", &data("tiny.toml"), &["--json"]);
    let mut replay = world.replay(&["--speed", "0.1", "--lossless", "--wait", "60"]);
    std::thread::sleep(Duration::from_millis(800));
    replay.child.kill().unwrap();
    drop(replay);
    let monitor = monitor.end();
    assert_eq!(monitor.status.code(), Some(1), "{}", monitor.err);
    assert!(monitor.err.contains("writer has gone"), "{}", monitor.err);
}

#[test]
fn a_lossless_replay_whose_reader_is_killed_ends_with_an_error() {
    let world = World::new("reader");
    let mut monitor = world.start("monitor", &data("tiny.toml"), &["--json"]);
    let replay = world.replay(&["--speed", "0.1", "--lossless", "--wait", "60"]);
    std::thread::sleep(Duration::from_millis(800));
    monitor.child.kill().unwrap();
    drop(monitor);
    let replay = replay.end();
    assert_eq!(replay.status.code(), Some(1), "{}", replay.err);
    assert!(
        replay.err.contains("the reader has gone after"),
        "{}",
        replay.err
    );
}

#[test]
fn a_session_of_another_hash_is_refused() {
    let file = MachineFile::read(&data("tiny.toml")).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let mut session = Recording::read(&data("tiny.mcap"), &file, None)
        .unwrap()
        .session;
    assert!(session.machine(&file, &urdf).is_ok());
    session.machine_hash ^= 1;
    let error = session.machine(&file, &urdf).unwrap_err().to_string();
    assert!(
        error.contains("expected the machine of the session"),
        "{error}"
    );
}

//! Signals that the machine file binds number by number, replayed: the monitor gives the same rows as with
//! the usual types of messages.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::support::data;
use crate::support::numbered::numbered_machine;

/// The rows of a monitor that a replay of the tiny log feeds.
fn rows(machine: &Path, world: &str) -> Vec<Value> {
    let prefix = format!("tw{}{world}_", std::process::id());
    // a pipe would fill up while nobody reads it, and hold up the monitor
    let folder = tempfile::TempDir::new().unwrap();
    let printed = folder.path().join("rows.jsonl");
    let start = |arguments: &[&str], output: Stdio| {
        Command::new(env!("CARGO_BIN_EXE_tipwatch-live"))
            .args(arguments)
            .args(["--machine", machine.to_str().unwrap(), "--prefix", &prefix])
            .stdin(Stdio::null())
            .stdout(output)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let log = data("tiny.mcap");
    let monitor = start(
        &[
            "monitor",
            "--json",
            "--allow-untimed",
            "--state",
            folder.path().to_str().unwrap(),
        ],
        File::create(&printed).unwrap().into(),
    );
    let replay = start(
        &[
            "replay",
            log.to_str().unwrap(),
            "--speed",
            "max",
            "--lossless",
            "--wait",
            "60",
        ],
        Stdio::piped(),
    );
    let replayed = replay.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&replayed.stderr);
    if !replayed.status.success() {
        let mut monitor = monitor;
        monitor.kill().unwrap();
        panic!("{said}");
    }
    let monitored = monitor.wait_with_output().unwrap();
    assert!(monitored.status.success());
    for entry in std::fs::read_dir("/dev/shm")
        .into_iter()
        .flatten()
        .flatten()
    {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
    let text = std::fs::read_to_string(printed).unwrap();
    // between rows the verdict changes with the time of the computer
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .filter(|line: &Value| line["event"] == "row")
        .collect()
}

#[test]
fn single_number_topics_replay_to_the_same_rows() {
    let folder = tempfile::TempDir::new().unwrap();
    let by_type = rows(&data("tiny.toml"), "type");
    let by_number = rows(&numbered_machine(folder.path()), "number");
    assert!(by_type.len() > 100);
    assert_eq!(by_type.len(), by_number.len());
    let mut valid = 0;
    for (a, b) in by_type.iter().zip(&by_number) {
        assert_eq!(a["time_ns"], b["time_ns"]);
        assert_eq!(a["reasons"], b["reasons"]);
        for wheel in ["fl", "fr", "rl", "rr"] {
            if let Some(load) = a["load_n"][wheel].as_f64() {
                let other = b["load_n"][wheel].as_f64().unwrap();
                assert!((load - other).abs() < 1e-6, "{a} {b}");
                valid += 1;
            }
        }
    }
    assert!(valid > 400, "{valid}");
}

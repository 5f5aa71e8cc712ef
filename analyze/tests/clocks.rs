//! Logs with wrong clocks: reported, and corrected or rejected.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::support::{code_and_stderr, data, into, stdout, text, tipwatch};

const S: i64 = 1_000_000_000;
/// A day (ns).
const DAY: i64 = 86_400 * S;

/// The times of a message.
struct Times {
    topic: String,
    /// The header's stamp (ns).
    stamp: i64,
    log: i64,
}

/// The short log with its times changed; every message of the topics begins with a header.
fn changed(folder: &Path, change: impl Fn(&mut Times)) -> PathBuf {
    let bytes = fs::read(data("tiny.mcap")).unwrap();
    let path = folder.join("changed.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        let topic = message.channel.topic.clone();
        if !["/joint_states", "/imu/data", "/odom"].contains(&topic.as_str()) {
            writer.write(&message).unwrap();
            continue;
        }
        let mut data = message.data.to_vec();
        let number = |at: usize| u32::from_le_bytes(data[at..at + 4].try_into().unwrap());
        let mut times = Times {
            topic,
            stamp: i64::from(number(4)) * S + i64::from(number(8)),
            log: message.log_time as i64,
        };
        change(&mut times);
        data[4..8].copy_from_slice(&((times.stamp / S) as i32).to_le_bytes());
        data[8..12].copy_from_slice(&((times.stamp % S) as u32).to_le_bytes());
        message.data = Cow::Owned(data);
        message.log_time = times.log as u64;
        message.publish_time = times.log as u64;
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    path
}

/// Exit code, messages, summary.
fn analyzed(log: &Path) -> (i32, String, Option<Value>) {
    let out = TempDir::new().unwrap();
    let machine = data("tiny.toml");
    let output = tipwatch(&into("analyze", log, &machine, out.path()));
    let (code, messages) = code_and_stderr(&output);
    let summary = fs::read_to_string(out.path().join("summary.json")).ok();
    (
        code,
        messages,
        summary.map(|text| serde_json::from_str(&text).unwrap()),
    )
}

/// The finding of a kind, with its topics.
fn finding<'a>(summary: &'a Value, kind: &str) -> &'a Value {
    let findings = summary["clock"]["findings"].as_array().unwrap();
    let found = findings.iter().find(|finding| finding["kind"] == kind);
    found.unwrap_or_else(|| panic!("no {kind} in {findings:?}"))
}

fn least_loads(summary: &Value) -> Vec<f64> {
    let wheels = summary["wheels"].as_object().unwrap();
    let load = |wheel: &Value| wheel["least_load_n"].as_f64().unwrap();
    wheels.values().map(load).collect()
}

fn assert_close(found: &Value, expected: &Value, share: f64) {
    for (a, b) in least_loads(found).iter().zip(least_loads(expected)) {
        assert!((a - b).abs() < share * b, "{a} N, expected {b} N");
    }
}

#[test]
fn loads_do_not_depend_on_the_epoch() {
    let folder = TempDir::new().unwrap();
    let (code, messages, sound) = analyzed(&data("tiny.mcap"));
    assert_eq!(code, 0, "{messages}");
    let sound = sound.unwrap();
    assert_eq!(sound["clock"]["findings"].as_array().unwrap().len(), 0);
    let start = sound["rows"]["first_ns"].as_i64().unwrap() - 3 * S;

    let simulated = changed(folder.path(), |times| times.stamp -= start);
    let summary = analyzed(&simulated).2.unwrap();
    let found = finding(&summary, "simulation_time");
    assert_eq!(found["topics"].as_array().unwrap().len(), 3);
    assert_eq!(found["treatment"], "handled");
    assert_close(&summary, &sound, 1e-9);

    let replayed = changed(folder.path(), |times| {
        times.log = start + 30 * DAY + (times.log - start) / 4;
    });
    let summary = analyzed(&replayed).2.unwrap();
    assert_eq!(finding(&summary, "replayed_log")["treatment"], "handled");
    assert_close(&summary, &sound, 1e-9);

    let imu_since_boot = changed(folder.path(), |times| {
        if times.topic == "/imu/data" {
            times.stamp -= start;
        }
    });
    let summary = analyzed(&imu_since_boot).2.unwrap();
    let found = finding(&summary, "other_epoch");
    assert_eq!(found["topics"][0], "/imu/data");
    assert_eq!(found["treatment"], "handled");
    assert_close(&summary, &sound, 0.01);

    let without_stamps = changed(folder.path(), |times| {
        if times.topic == "/odom" {
            times.stamp = 0;
        }
    });
    let summary = analyzed(&without_stamps).2.unwrap();
    assert_eq!(finding(&summary, "no_header_stamp")["topics"][0], "/odom");
    assert_close(&summary, &sound, 0.01);
}

#[test]
fn a_looped_recording_gives_two_independent_runs() {
    let folder = TempDir::new().unwrap();
    let sound = analyzed(&data("tiny.mcap")).2.unwrap();
    let (first, last) = (&sound["rows"]["first_ns"], &sound["rows"]["last_ns"]);
    let middle = (first.as_i64().unwrap() + last.as_i64().unwrap()) / 2;
    let looped = changed(folder.path(), |times| {
        // the second half repeats the times of the first
        if times.stamp >= middle {
            times.stamp -= middle - first.as_i64().unwrap();
        }
    });
    let summary = analyzed(&looped).2.unwrap();
    // the clock of each topic jumps at a different log time
    let findings = summary["clock"]["findings"].as_array().unwrap();
    let restarts = findings.iter().filter(|f| f["kind"] == "clock_restart");
    let topics = |f: &Value| f["topics"].as_array().unwrap().len();
    assert_eq!(restarts.clone().map(topics).sum::<usize>(), 3);
    for found in restarts {
        let done = found["done"].as_str().unwrap();
        assert!(done.contains("one after the other"), "{done}");
    }
    let longer = summary["rows"]["duration_s"].as_f64().unwrap()
        - sound["rows"]["duration_s"].as_f64().unwrap();
    assert!((longer - 1.0).abs() < 0.02, "{longer} s longer");
    assert_close(&summary, &sound, 0.05);
}

#[test]
fn irreconcilable_clocks_are_rejected_with_the_reason() {
    let folder = TempDir::new().unwrap();
    let start = 1_700_000_000 * S;
    let joints_apart = changed(folder.path(), |times| {
        if times.topic == "/joint_states" {
            times.stamp -= start;
        }
        times.log = start;
    });
    let (code, messages, _) = analyzed(&joints_apart);
    // the three topics disagree; those that agree with each other decide
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("/joint_states")
            && messages.contains("log times of all its messages are equal"),
        "{messages}"
    );
}

#[test]
fn inspect_shows_clocks_and_offsets() {
    let inspected = |more: &[&str]| {
        let log = data("hard_brake.mcap");
        stdout(&tipwatch(&[&["inspect", text(&log)], more].concat()))
    };
    let json: Value = serde_json::from_str(&inspected(&["--json"])).unwrap();
    assert_eq!(json["clock"]["time"], "header");
    assert!(json["clock"]["offsets"].is_null());
    assert!(
        json["clock"]["offsets_note"]
            .as_str()
            .unwrap()
            .contains("--machine")
    );
    let imu = json["topics"]
        .as_array()
        .unwrap()
        .iter()
        .find(|t| t["name"] == "/imu/data");
    let offset = &imu.unwrap()["timing"]["header_minus_log"];
    assert!(
        offset["drift_ppm"].as_f64().unwrap().abs() < 100.0,
        "{offset}"
    );
    let machine = data("hard_brake.toml");
    let text = inspected(&["--machine", machine.to_str().unwrap()]);
    assert!(text.contains("/odom: correction of its stamps: "), "{text}");
    assert!(text.contains("standard deviation"), "{text}");
}

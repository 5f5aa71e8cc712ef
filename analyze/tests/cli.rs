//! The command line: outputs, exit codes, and one clear message for each error.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tempfile::TempDir;

use super::support::{code_and_stderr, data, into, text, tipwatch};

/// Runs `analyze` on `log` with a machine file; returns exit code, stderr and the output folder.
fn analyze(log: &Path, machine: &Path, more: &[&str]) -> (i32, String, TempDir) {
    let out = TempDir::new().unwrap();
    let mut args = into("analyze", log, machine, out.path()).to_vec();
    args.extend(more);
    let output = tipwatch(&args);
    let (code, messages) = code_and_stderr(&output);
    (code, messages, out)
}

/// The definition of a common type; that of a text and names for another.
fn definition(type_name: &str) -> String {
    let known = tipwatch_ingest::known_definition(type_name);
    known.unwrap_or_else(|| "string data\nstring[] name".to_owned())
}

/// An MCAP with these topics and types, three messages of four bytes on each.
fn log_of(folder: &Path, topics: &[(&str, &str)]) -> PathBuf {
    let path = folder.join("log.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    for (id, (topic, type_name)) in (1..).zip(topics) {
        let schema = mcap::Schema {
            id,
            name: (*type_name).into(),
            encoding: "ros2msg".into(),
            data: Cow::Owned(definition(type_name).into_bytes()),
        };
        let channel = Arc::new(mcap::Channel {
            id,
            topic: (*topic).into(),
            schema: Some(Arc::new(schema)),
            message_encoding: "cdr".into(),
            metadata: BTreeMap::new(),
        });
        for sequence in 0..3 {
            let message = mcap::Message {
                channel: channel.clone(),
                sequence,
                log_time: u64::from(sequence),
                publish_time: u64::from(sequence),
                data: Cow::Borrowed(&[0, 1, 0, 0]),
            };
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    path
}

#[test]
fn analyze_writes_all_outputs_and_prints_findings() {
    let (code, messages, out) = analyze(&data("tiny_lift.mcap"), &data("tiny_lift.toml"), &[]);
    assert_eq!(code, 0, "{messages}");
    for file in [
        "samples.parquet",
        "events.parquet",
        "sensitivity.parquet",
        "summary.json",
        "report.html",
    ] {
        assert!(
            fs::metadata(out.path().join(file)).unwrap().len() > 1000,
            "{file}"
        );
    }
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.path().join("summary.json")).unwrap())
            .unwrap();
    assert_eq!(summary["schema"], 6);
    assert_eq!(summary["model"]["others"][0]["name"], "closed-form");
    assert_eq!(summary["sensitivity"]["wheel"], "rl");
    let events = summary["events"].as_object().unwrap();
    assert!(
        events.contains_key("wheel_light") && events.contains_key("wheel_lift"),
        "{events:?}"
    );
    for (kind, group) in events {
        let event = &group["worst"];
        assert!(group["count"].as_u64() >= Some(1) && event["kind"] == **kind);
        let certainty = event["certainty"].as_f64().unwrap();
        assert!((0.5..=1.0).contains(&certainty), "{event}");
        let shares = event["causes"]["shares"].as_array().unwrap();
        let percent: f64 = shares.iter().map(|s| s["percent"].as_f64().unwrap()).sum();
        assert!((percent - 100.0).abs() < 1e-6, "{event}");
    }
    assert_eq!(
        summary["provenance"]["log"][0]["sha256"]
            .as_str()
            .unwrap()
            .len(),
        64
    );
    assert!(messages.to_lowercase().contains("rl"), "{messages}");
}

#[test]
fn closed_form_writes_terms_or_rejects_the_machine() {
    let asked = ["--model", "closed-form", "--columns", "terms"];
    let (code, messages, out) = analyze(&data("tiny.mcap"), &data("tiny.toml"), &asked);
    assert_eq!(code, 0, "{messages}");
    assert!(!out.path().join("sensitivity.parquet").exists());
    let table = fs::read(out.path().join("samples.parquet")).unwrap();
    let has = |name: &str| {
        table
            .windows(name.len())
            .any(|bytes| bytes == name.as_bytes())
    };
    assert!(has("term_11_fl") && has("sideslip_rear_axle") && !has("cause_slope_fl"));
    let (code, messages, _) = analyze(&data("forwarder6.mcap"), &data("forwarder6.toml"), &asked);
    assert_eq!(code, 1);
    assert!(
        messages.contains("closed-form") && messages.contains("wheels"),
        "{messages}"
    );
}

#[test]
fn monte_carlo_writes_bands() {
    let (code, messages, out) = analyze(
        &data("tiny.mcap"),
        &data("tiny.toml"),
        &["--monte-carlo", "50"],
    );
    assert_eq!(code, 0, "{messages}");
    let table = fs::read(out.path().join("monte_carlo.parquet")).unwrap();
    let has = |name: &str| {
        table
            .windows(name.len())
            .any(|bytes| bytes == name.as_bytes())
    };
    assert!(has("load_fl_low") && has("arm_moment_z_high"));
    let text = fs::read_to_string(out.path().join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["monte_carlo"]["draws"], 50);
    let half_band = summary["monte_carlo"]["mean_half_band"]["load_fl"]
        .as_f64()
        .unwrap();
    assert!((300.0..5000.0).contains(&half_band), "{half_band}");
}

#[test]
fn fail_on_exits_with_4_only_if_the_event_occurred() {
    let lift = analyze(
        &data("tiny_lift.mcap"),
        &data("tiny_lift.toml"),
        &["--fail-on", "wheel_lift"],
    );
    assert_eq!(lift.0, 4, "{}", lift.1);
    let none = analyze(
        &data("tiny.mcap"),
        &data("tiny.toml"),
        &["--fail-on", "wheel_lift"],
    );
    assert_eq!(none.0, 0, "{}", none.1);
}

#[test]
fn a_damaged_chunk_is_reported_with_times_and_topics() {
    let folder = TempDir::new().unwrap();
    let mut bytes = fs::read(data("swing_lift.mcap")).unwrap();
    let index = mcap::Summary::read(&bytes).unwrap().unwrap();
    let chunk = &index.chunk_indexes[1];
    let middle = (chunk.chunk_start_offset + chunk.chunk_length / 2) as usize;
    bytes[middle..middle + 40].fill(0x55);
    let log = folder.path().join("damaged.mcap");
    fs::write(&log, &bytes).unwrap();
    let summary = |log: &Path| -> (i32, serde_json::Value, TempDir) {
        let (code, messages, out) = analyze(log, &data("swing_lift.toml"), &[]);
        let text = fs::read_to_string(out.path().join("summary.json")).expect(&messages);
        (code, serde_json::from_str(&text).unwrap(), out)
    };
    let (_, clean, _) = summary(&data("swing_lift.mcap"));
    let (code, damaged, out) = summary(&log);
    assert_eq!(code, 3);
    let ranges = damaged["losses"]["ranges"].as_array().unwrap();
    let [range] = ranges.as_slice() else {
        panic!("{ranges:?}")
    };
    let bytes_lost = range["start_byte"].as_u64().unwrap()..range["end_byte"].as_u64().unwrap();
    assert!(bytes_lost.contains(&(middle as u64)));
    let (first, last) = (&range["first_time_ns"], &range["last_time_ns"]);
    assert!(first.as_i64().unwrap() < last.as_i64().unwrap());
    let inputs = clean["inputs"].as_array().unwrap();
    for (before, after) in inputs.iter().zip(damaged["inputs"].as_array().unwrap()) {
        let count = |input: &serde_json::Value| input["timing"]["message_count"].as_u64().unwrap();
        let lost = count(before) - count(after);
        let topic = before["topic"].as_str().unwrap();
        assert!(lost > 0, "{topic}");
        assert_eq!(range["messages"][topic], lost, "{range}");
        assert_eq!(damaged["losses"]["missing_messages"][topic], lost);
    }
    let imu = &range["messages"]["/imu/data"];
    let sentence = format!("{imu} messages of /imu/data");
    let report = fs::read_to_string(out.path().join("report.html")).unwrap();
    assert!(report.contains(&sentence) && report.contains("log times"));
    let inspected = tipwatch(&["inspect", text(&log)]);
    assert_eq!(inspected.status.code(), Some(3));
    let messages = String::from_utf8(inspected.stdout).unwrap();
    assert!(
        messages.contains(&sentence) && messages.contains("log times"),
        "{messages}"
    );
}

#[test]
fn a_truncated_log_is_analysed_and_exits_with_3() {
    let folder = TempDir::new().unwrap();
    let bytes = fs::read(data("tiny_lift.mcap")).unwrap();
    let log = folder.path().join("cut.mcap");
    fs::write(&log, &bytes[..bytes.len() * 3 / 4]).unwrap();
    let (code, messages, out) = analyze(&log, &data("tiny_lift.toml"), &[]);
    assert_eq!(code, 3, "{messages}");
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.path().join("summary.json")).unwrap())
            .unwrap();
    assert!(
        summary["rows"]["valid"].as_u64().unwrap() > 50,
        "{}",
        summary["rows"]
    );
    assert!(!summary["losses"]["ranges"].as_array().unwrap().is_empty());
}

#[test]
fn a_recovered_log_is_intact_and_has_the_same_rows() {
    let folder = TempDir::new().unwrap();
    let bytes = fs::read(data("tiny_lift.mcap")).unwrap();
    let (log, whole) = (
        folder.path().join("cut.mcap"),
        folder.path().join("whole.mcap"),
    );
    fs::write(&log, &bytes[..bytes.len() * 3 / 4]).unwrap();
    let recovered = tipwatch(&["recover", text(&log), "-o", text(&whole)]);
    let messages = String::from_utf8_lossy(&recovered.stderr).into_owned();
    assert_eq!(recovered.status.code(), Some(3), "{messages}");
    assert!(
        messages.contains("messages of") && messages.contains("lost:"),
        "{messages}"
    );
    let again = tipwatch(&["recover", text(&log), "-o", text(&whole)]);
    assert_eq!(
        again.status.code(),
        Some(1),
        "an existing file is never overwritten"
    );
    let rows = |log: &Path, code: i32| {
        let (found, messages, out) = analyze(log, &data("tiny_lift.toml"), &[]);
        assert_eq!(found, code, "{messages}");
        let text = fs::read_to_string(out.path().join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        (summary["rows"].clone(), summary["wheels"].clone())
    };
    assert_eq!(rows(&log, 3), rows(&whole, 0));
}

#[test]
fn nothing_is_written_next_to_the_log() {
    let folder = TempDir::new().unwrap();
    for name in ["tiny.mcap", "tiny.toml", "tiny.urdf"] {
        fs::copy(data(name), folder.path().join(name)).unwrap();
    }
    let (code, messages, _out) = analyze(
        &folder.path().join("tiny.mcap"),
        &folder.path().join("tiny.toml"),
        &[],
    );
    assert_eq!(code, 0, "{messages}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn each_error_has_one_clear_message() {
    let folder = TempDir::new().unwrap();
    let machine = data("tiny.toml");
    let says = |log: &Path, machine: &Path, code: i32, parts: &[&str]| {
        let (found, messages, _out) = analyze(log, machine, &[]);
        assert_eq!(found, code, "{messages}");
        for part in parts {
            assert!(messages.contains(part), "\"{part}\" is not in: {messages}");
        }
    };
    says(Path::new("missing.mcap"), &machine, 1, &["missing.mcap"]);
    says(
        &data("tiny.mcap"),
        Path::new("missing.toml"),
        1,
        &["missing.toml"],
    );

    let no_log = folder.path().join("photo.mcap");
    fs::write(&no_log, b"\xff\xd8\xff\xe0 a photograph").unwrap();
    says(
        &no_log,
        &machine,
        1,
        &["photo.mcap", "not a log", "expected MCAP"],
    );
    fs::write(&no_log, b"").unwrap();
    says(&no_log, &machine, 1, &["photo.mcap"]);

    says(
        &log_of(folder.path(), &[]),
        &machine,
        1,
        &["/joint_states", "no topics"],
    );
    says(
        &log_of(folder.path(), &[("/chatter", "std_msgs/msg/String")]),
        &machine,
        1,
        &["/chatter", "sensor_msgs/msg/JointState"],
    );
    let wrong_type = log_of(folder.path(), &[("/joint_states", "std_msgs/msg/String")]);
    says(
        &wrong_type,
        &machine,
        1,
        &[
            "/joint_states",
            "sensor_msgs/msg/JointState",
            "std_msgs/msg/String",
        ],
    );

    let two_imus = log_of(
        folder.path(),
        &[
            ("/joint_states", "sensor_msgs/msg/JointState"),
            ("/a", "sensor_msgs/msg/Imu"),
            ("/b", "sensor_msgs/msg/Imu"),
        ],
    );
    let unnamed = folder.path().join("unnamed.toml");
    fs::copy(data("tiny.urdf"), folder.path().join("tiny.urdf")).unwrap();
    fs::write(
        &unnamed,
        fs::read_to_string(&machine)
            .unwrap()
            .replace("imu = \"/imu/data\"", ""),
    )
    .unwrap();
    says(
        &two_imus,
        &unnamed,
        1,
        &["several candidates", "/a", "/b", "[signals]"],
    );
}

#[test]
fn usage_errors_exit_with_2() {
    for line in [
        "analyze",
        "analyze x.mcap",
        "frobnicate",
        "analyze x --machine m --out o --rate -3",
    ] {
        let args: Vec<&str> = line.split(' ').collect();
        assert_eq!(tipwatch(&args).status.code(), Some(2), "{line}");
    }
}

#[test]
fn inspect_shows_topics_and_bindings_as_text_and_json() {
    let log = data("tiny.mcap");
    let output = tipwatch(&["inspect", text(&log), "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let inspection: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let signal = |name: &str| {
        let signals = inspection["signals"].as_array().unwrap();
        signals.iter().find(|s| s["signal"] == name).unwrap()["topic"]
            .as_str()
            .map(str::to_string)
    };
    assert_eq!(signal("imu").as_deref(), Some("/imu/data"));
    assert_eq!(signal("joint_states").as_deref(), Some("/joint_states"));
    assert_eq!(signal("tool_wrench"), None);
    let people = String::from_utf8(tipwatch(&["inspect", text(&log)]).stdout).unwrap();
    assert!(
        people.contains("/joint_states") && people.contains("Hz"),
        "{people}"
    );
}

#[test]
fn the_demo_finds_the_lifted_wheel() {
    let out = TempDir::new().unwrap();
    let output = tipwatch(&["demo", "--out", text(out.path())]);
    assert_eq!(output.status.code(), Some(0));
    let messages = String::from_utf8(output.stdout).unwrap();
    assert!(
        messages.contains("report: ") && messages.lines().count() >= 2,
        "{messages}"
    );
    assert!(out.path().join("report.html").exists());
}

#[test]
fn completions_are_printed_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        assert!(
            tipwatch(&["completions", shell]).stdout.len() > 500,
            "{shell}"
        );
    }
}

#[test]
fn the_reason_for_a_missing_log_is_given_once() {
    let (code, messages, _) = analyze(Path::new("missing.mcap"), &data("tiny.toml"), &[]);
    assert_eq!(code, 1);
    assert_eq!(
        messages,
        "error: missing.mcap: cannot be read: No such file or directory (os error 2)\n"
    );
}

/// Runs a command whose standard output and standard error nobody reads; returns its exit code.
fn unread(args: &[&str]) -> Option<i32> {
    let closed = || {
        let (read, write) = std::io::pipe().unwrap();
        drop(read);
        write
    };
    let mut command = super::support::command(args);
    command.stdout(closed()).stderr(closed());
    command.status().unwrap().code()
}

#[test]
fn nothing_panics_where_nobody_reads() {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data("tiny.mcap"), data("tiny.toml"));
    let (log, machine) = (text(&log), text(&machine));
    let at = |name: &str| folder.path().join(name);
    let (out, fleet) = (at("out"), at("fleet"));
    let (out, fleet) = (text(&out), text(&fleet));
    let demo = at("demo");
    let done: &[&[&str]] = &[
        &["analyze", log, "--machine", machine, "--out", out, "-v"],
        &["compare", out, out],
        &["compare", out, out, "--json"],
        &["completions", "bash"],
        &["schema"],
        &["inspect", log],
        &["check-machine", machine],
        &["screen", log, "--machine", machine, "--out", fleet],
        &["query", fleet, "SELECT * FROM logs"],
        &["demo", "--out", text(&demo)],
    ];
    for args in done {
        assert_eq!(unread(args), Some(0), "{args:?}");
    }
    // an error that nobody reads is still one, and a mistake in the arguments, too
    assert_eq!(unread(&["inspect", "missing.mcap"]), Some(1));
    assert_eq!(unread(&["compare", log]), Some(2));
}

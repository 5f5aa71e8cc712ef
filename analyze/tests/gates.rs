//! Gates fail closed: logs of which nothing, or too little, can be computed, and logs that cannot be read.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::support::{
    Copied, code_and_stderr, copy_log, data, fill_imu_with_nan, into, json, run_python, stdout,
    text, tipwatch,
};

/// Done; a log failed; a rule is broken; nothing is decided. The last three add up.
const DONE: i32 = 0;
const FAILED: i32 = 1;
const BROKEN: i32 = 4;
const UNDECIDED: i32 = 8;

/// A copy of `tiny_lift.mcap`, whose wheel RL lifts from 0.9 to 2.4 s of 4.0 s.
fn copy(folder: &TempDir, name: &str, edit: &mut dyn FnMut(&mut Copied<'_>) -> bool) -> PathBuf {
    let path = folder.path().join(name);
    copy_log(&data("tiny_lift.mcap"), &path, &[], edit);
    path
}

/// No joint states from 0.3 to 2.9 s: the lift is lost, and no row is.
fn with_hole(folder: &TempDir, name: &str) -> PathBuf {
    copy(folder, name, &mut |message| {
        message.topic != "/joint_states" || !(0.3..2.9).contains(&message.time_s)
    })
}

fn with_nan_imu(folder: &TempDir, name: &str) -> PathBuf {
    copy(folder, name, &mut |message| {
        if message.topic == "/imu/data" {
            fill_imu_with_nan(&mut message.data);
        }
        true
    })
}

fn analyze(log: &Path, out: &Path, more: &[&str]) -> (i32, String) {
    let machine = data("tiny_lift.toml");
    let mut args = into("analyze", log, &machine, out).to_vec();
    args.extend(more);
    code_and_stderr(&tipwatch(&args))
}

fn screen(logs: &Path, out: &Path, more: &[&str]) -> (i32, String) {
    let machine = data("tiny_lift.toml");
    let mut args = into("screen", logs, &machine, out).to_vec();
    args.extend(more);
    code_and_stderr(&tipwatch(&args))
}

fn write(folder: &TempDir, name: &str, content: &str) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, content).unwrap();
    path
}

#[test]
fn a_log_without_a_computable_row_decides_nothing() {
    let folder = TempDir::new().unwrap();
    let nan = with_nan_imu(&folder, "nan.mcap");
    let silent = copy(&folder, "silent.mcap", &mut |message| {
        !["/imu/data", "/odom"].contains(&message.topic)
    });
    // a rule that accepts unknown values does not accept a log that decides nothing
    let lenient = "[[rule]]\nquantity = 'worst_margin'\nat_least = 0.0\nunknown = 'pass'\n";
    let policy = write(&folder, "policy.toml", lenient);
    let out = folder.path().join("out");
    for log in [&nan, &silent] {
        for more in [
            &[][..],
            &["--min-valid", "0"],
            &["--fail-on", "tip_over"],
            &["--policy", text(&policy)],
        ] {
            let (code, messages) = analyze(log, &out, more);
            assert_eq!(code, UNDECIDED, "{more:?}: {messages}");
            assert!(
                messages.contains("not decided: loads cannot be computed"),
                "{messages}"
            );
        }
        let judgement = json(&out.join("policy.json"));
        assert_eq!(judgement["passed"], false, "{judgement}");
        let rule = &judgement["rules"][0];
        assert_eq!(
            (&rule["passed"], &rule["decided"]),
            (&false.into(), &false.into())
        );
        assert!(
            rule["found"].as_str().unwrap().starts_with("not decided: "),
            "{rule}"
        );
        let summary = json(&out.join("summary.json"));
        assert_eq!(
            summary["coverage"]["valid_share"], 0.0,
            "{}",
            summary["coverage"]
        );
    }
}

#[test]
fn a_hole_in_the_joint_states_is_lost_time() {
    let folder = TempDir::new().unwrap();
    let log = with_hole(&folder, "hole.mcap");
    let out = folder.path().join("out");
    let (code, messages) = analyze(&log, &out, &["--fail-on", "wheel_lift"]);
    assert_eq!(code, UNDECIDED, "{messages}");
    assert!(
        messages.contains("rule violated: no wheel_lift: not decided: "),
        "{messages}"
    );
    let summary = json(&out.join("summary.json"));
    let coverage = |key: &str| summary["coverage"][key].as_f64().unwrap();
    assert!(
        (coverage("covered_s") - 4.0).abs() < 0.02,
        "{}",
        summary["coverage"]
    );
    assert!(
        (coverage("computable_s") - 1.4).abs() < 0.1,
        "{}",
        summary["coverage"]
    );
    let share = coverage("computable_s") / coverage("covered_s");
    assert!((coverage("valid_share") - share).abs() < 1e-9);
    let headline = summary["findings"][0].as_str().unwrap();
    assert!(
        headline.starts_with("In the 1.") && headline.contains("of 4.0 s"),
        "{headline}"
    );
    // rows at a regular rate do not bridge the hole either
    analyze(&log, &out, &["--rate", "2"]);
    let at_rate = json(&out.join("summary.json"))["coverage"]["valid_share"]
        .as_f64()
        .unwrap();
    assert!(at_rate <= share + 0.05, "{at_rate}");
    // whoever accepts less gets an answer about what is left, and the policy may say so
    let (code, messages) = analyze(
        &log,
        &out,
        &["--fail-on", "wheel_lift", "--min-valid", "0.3"],
    );
    assert_eq!(code, DONE, "{messages}");
    let policy = write(
        &folder,
        "policy.toml",
        "min_valid = 0.3\n[[rule]]\nevent = 'wheel_lift'\n",
    );
    assert_eq!(analyze(&log, &out, &["--policy", text(&policy)]).0, DONE);
    let share = "[[rule]]\nquantity = 'valid_share'\nat_least = 0.9\n";
    let policy = write(&folder, "share.toml", &format!("min_valid = 0.3\n{share}"));
    assert_eq!(analyze(&log, &out, &["--policy", text(&policy)]).0, BROKEN);
    for (share, is_usage) in [("1.5", true), ("nan", true), ("1", false)] {
        let (code, messages) = analyze(&log, &out, &["--min-valid", share]);
        assert_eq!(code, if is_usage { 2 } else { UNDECIDED }, "{messages}");
    }
}

#[test]
fn an_event_in_the_computable_time_breaks_its_rule_all_the_same() {
    let folder = TempDir::new().unwrap();
    let log = copy(&folder, "start.mcap", &mut |message| {
        message.topic != "/joint_states" || message.time_s < 1.6
    });
    let out = folder.path().join("out");
    let (code, messages) = analyze(&log, &out, &["--fail-on", "wheel_lift"]);
    assert_eq!(code, BROKEN + UNDECIDED, "{messages}");
    let (code, messages) = analyze(&log, &out, &["--fail-on", "tip_over"]);
    assert_eq!(code, UNDECIDED, "{messages}");
}

#[test]
fn a_log_that_goes_on_after_its_sensors_has_lost_that_time() {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("long.mcap");
    let other: Vec<f64> = (0..120).map(|i| f64::from(i) * 0.1).collect();
    copy_log(&data("tiny.mcap"), &log, &other, &mut |_| true);
    let out = folder.path().join("out");
    assert_eq!(analyze(&log, &out, &[]).0, UNDECIDED);
    let coverage = json(&out.join("summary.json"))["coverage"].clone();
    assert!(
        (coverage["covered_s"].as_f64().unwrap() - 11.9).abs() < 0.02,
        "{coverage}"
    );
    assert!(
        (coverage["computable_s"].as_f64().unwrap() - 3.0).abs() < 0.05,
        "{coverage}"
    );
    // only the requested range counts
    assert_eq!(analyze(&log, &out, &["--to", "2.5"]).0, DONE);
    let coverage = json(&out.join("summary.json"))["coverage"].clone();
    assert!(
        (coverage["covered_s"].as_f64().unwrap() - 2.5).abs() < 0.02,
        "{coverage}"
    );
    assert_eq!(
        analyze(&log, &out, &["--from", "1", "--to", "6"]).0,
        UNDECIDED
    );
    // a single message with the clock of 1970 does not make the log fifty years long
    copy_log(&data("tiny.mcap"), &log, &[-1.7e9], &mut |_| true);
    let (code, messages) = analyze(&log, &out, &[]);
    assert_eq!(code, DONE, "{messages}");
}

#[test]
fn one_message_of_each_sensor_decides_nothing() {
    let folder = TempDir::new().unwrap();
    let mut seen = std::collections::BTreeSet::new();
    let log = copy(&folder, "one.mcap", &mut |message| {
        seen.insert(message.topic.to_owned())
    });
    let out = folder.path().join("out");
    let (code, messages) = analyze(&log, &out, &["--fail-on", "tip_over"]);
    assert_eq!(code, UNDECIDED, "{messages}");
    // without any joint state there are no rows: the log cannot be analysed
    let log = copy(&folder, "none.mcap", &mut |message| {
        message.topic != "/joint_states"
    });
    let (code, messages) = analyze(&log, &out, &["--fail-on", "tip_over"]);
    assert_eq!(code, FAILED, "{messages}");
    assert!(
        messages.contains("rule violated: every log can be analysed"),
        "{messages}"
    );
}

#[test]
fn whatif_compare_and_demo_fail_closed_too() {
    let folder = TempDir::new().unwrap();
    let (log, out) = (with_nan_imu(&folder, "nan.mcap"), folder.path().join("out"));
    let (machine, good) = (data("tiny_lift.toml"), data("tiny_lift.mcap"));
    let compare = |a: &Path, b: &Path| {
        let output = tipwatch(&["compare", text(a), text(b), "--machine", text(&machine)]);
        let counts = stdout(&output);
        (output.status.code().unwrap(), counts)
    };
    assert_eq!(compare(&good, &log).0, UNDECIDED);
    assert_eq!(compare(&good, &good).0, DONE);
    analyze(&log, &out, &[]);
    assert_eq!(compare(&out, &good).0, UNDECIDED);

    let suspended = folder.path().join("suspended.mcap");
    copy_log(
        &data("second_paper.mcap"),
        &suspended,
        &[],
        &mut |message| message.topic != "/joint_states" || message.time_s < 6.0,
    );
    let machine = data("second_paper.toml");
    let replay = |log: &Path| {
        let args = [
            "whatif",
            text(log),
            "--machine",
            text(&machine),
            "--out",
            text(&out),
            "--quiet",
        ];
        code_and_stderr(&tipwatch(&args))
    };
    let (code, messages) = replay(&suspended);
    assert_eq!(code, UNDECIDED, "{messages}");
    assert!(messages.contains("not decided"), "{messages}");
    let (code, messages) = code_and_stderr(&tipwatch(&["demo", "--out", text(&out)]));
    assert_eq!(code, DONE, "{messages}");
    assert!(messages.contains("computable: 1"), "{messages}");
}

#[test]
fn exit_codes_tell_unreadable_logs_from_broken_policies() {
    let folder = TempDir::new().unwrap();
    let photo = write(&folder, "photo.mcap", "photograph");
    let strict = write(&folder, "strict.toml", "[[rule]]\nevent = 'wheel_lift'\n");
    let accepting = "failed_logs = 'pass'\n[[rule]]\nevent = 'wheel_lift'\n";
    let accepting = write(&folder, "accepting.toml", accepting);
    let (calm, lift) = (data("tiny.mcap"), data("tiny_lift.mcap"));
    let hole = with_hole(&folder, "hole.mcap");
    let cases: [(&[&Path], &Path, i32); 8] = [
        (&[&calm], &strict, DONE),
        (&[&calm, &lift], &strict, BROKEN),
        (&[&calm, &photo], &strict, FAILED),
        (&[&calm, &photo], &accepting, DONE),
        (&[&lift, &photo], &strict, FAILED + BROKEN),
        (&[&lift, &photo], &accepting, BROKEN),
        (&[&hole, &photo], &strict, FAILED + UNDECIDED),
        (
            &[&hole, &photo, &lift],
            &strict,
            FAILED + BROKEN + UNDECIDED,
        ),
    ];
    for (i, (logs, policy, expected)) in cases.into_iter().enumerate() {
        let place = |name: &str| folder.path().join(format!("{name}{i}"));
        let list: String = logs
            .iter()
            .map(|log| format!("{}\n", log.display()))
            .collect();
        let list = write(&folder, "logs.list", &list);
        let (code, messages) = screen(&list, &place("fleet"), &["--policy", text(policy)]);
        assert_eq!(code, expected, "case {i}: {messages}");
        let result = json(&place("fleet").join("policy.json"));
        assert_eq!(result["passed"], expected == DONE, "case {i}: {result}");
        let failed = u64::from(expected & FAILED != 0);
        assert_eq!(result["logs_failed"], failed, "case {i}: {result}");

        let mut args = vec!["analyze"];
        args.extend(logs.iter().map(|log| text(log)));
        let (machine, out) = (data("tiny_lift.toml"), place("out"));
        args.extend(["--machine", text(&machine), "--out", text(&out)]);
        args.extend(["--policy", text(policy)]);
        let (code, messages) = code_and_stderr(&tipwatch(&args));
        assert_eq!(code, expected, "case {i}: {messages}");
        if logs.contains(&photo.as_path()) {
            let result = json(&out.join("photo/policy.json"));
            assert_eq!(
                result["passed"],
                *policy == *accepting,
                "case {i}: {result}"
            );
        }
    }
}

/// A fleet of the good lift, the same with a hole, one without any computable row, a calm log, and two
/// files in different folders that are no logs.
fn uncertain_fleet() -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let logs = folder.path().join("logs");
    fs::create_dir_all(logs.join("deeper")).unwrap();
    fs::copy(data("tiny_lift.mcap"), logs.join("lift.mcap")).unwrap();
    fs::copy(data("tiny.mcap"), logs.join("calm.mcap")).unwrap();
    fs::rename(with_hole(&folder, "hole"), logs.join("hole.mcap")).unwrap();
    fs::rename(with_nan_imu(&folder, "nan"), logs.join("nan.mcap")).unwrap();
    fs::write(logs.join("photo.mcap"), "photograph").unwrap();
    fs::write(logs.join("deeper/photo.mcap"), "photograph ").unwrap();
    (folder, logs)
}

#[test]
fn logs_with_holes_are_marked_and_do_not_rank_as_harmless() {
    let (folder, logs) = uncertain_fleet();
    let out = folder.path().join("fleet");
    let (code, messages) = screen(&logs, &out, &[]);
    assert_eq!(code, FAILED + UNDECIDED, "{messages}");
    assert!(
        messages.contains("2 not decided") && messages.contains("hole.mcap: "),
        "{messages}"
    );
    let page = fs::read_to_string(out.join("fleet.html")).unwrap();
    let ranking = page.split("Worst margin</th>").nth(1).unwrap();
    let place = |name: &str| ranking.find(&format!("{name}.mcap")).unwrap();
    assert!(place("lift") < place("hole") && place("hole") < place("nan"));
    assert!(place("nan") < place("calm"));
    let of_hole = &ranking[place("hole")..place("nan")];
    assert!(
        of_hole.contains("of 4.0 s (3") && of_hole.contains("not decided"),
        "{of_hole}"
    );
    assert!(
        !ranking[place("calm")..]
            .split("</tr>")
            .next()
            .unwrap()
            .contains("holes")
    );

    let mut reasons = Vec::new();
    for entry in fs::read_dir(out.join("state")).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "json")
        {
            let record = json(&path);
            let facts = &record["result"]["facts"];
            match record["path"].as_str().unwrap() {
                path if path.ends_with("nan.mcap") => {
                    assert!(facts["event_counts"]["wheel_lift"].is_null(), "{facts}");
                    assert!(facts["exposure"]["exposed_s"].is_null(), "{facts}");
                    assert!(facts["exposure"]["margin_s"].is_null(), "{facts}");
                }
                path if path.ends_with("photo.mcap") => {
                    reasons.push(record["result"]["reason"].as_str().unwrap().to_owned());
                }
                path if path.ends_with("calm.mcap") => {
                    assert_eq!(facts["event_counts"]["wheel_lift"], 0, "{facts}");
                    assert_eq!(facts["missing_messages"], 0, "{facts}");
                }
                _ => {}
            }
        }
    }
    assert!(
        reasons.iter().all(|reason| !reason.contains("photo.mcap")),
        "{reasons:?}"
    );
    assert_eq!(reasons.len(), 2);
}

#[test]
fn counts_of_an_unfinished_log_are_unknown() {
    let folder = TempDir::new().unwrap();
    let bytes = fs::read(data("tiny_lift.mcap")).unwrap();
    let log = folder.path().join("cut.mcap");
    fs::write(&log, &bytes[..bytes.len() * 3 / 4]).unwrap();
    let rule = "[[rule]]\nquantity = 'lost_messages'\nat_most = 0\n";
    let policy = write(&folder, "policy.toml", rule);
    let out = folder.path().join("out");
    let (code, messages) = analyze(&log, &out, &["--policy", text(&policy)]);
    assert_eq!(code, BROKEN, "{messages}");
    let found = json(&out.join("policy.json"))["rules"][0]["found"].clone();
    assert!(
        found.as_str().unwrap().contains("no computable value"),
        "{found}"
    );
}

#[test]
fn implausible_sizes_are_refused() {
    let folder = TempDir::new().unwrap();
    let (log, out) = (data("tiny_lift.mcap"), folder.path().join("out"));
    for (option, value) in [
        ("--rate", "1e9"),
        ("--rate", "inf"),
        ("--rate", "10001"),
        ("--from", "nan"),
        ("--to", "inf"),
        ("--monte-carlo", "1000000"),
    ] {
        let (code, messages) = analyze(&log, &out, &[option, value]);
        assert_eq!(code, 2, "{option} {value}: {messages}");
    }
    // joint states 50 minutes apart, so that a permitted rate asks for more rows than memory holds
    let sparse = copy(&folder, "sparse.mcap", &mut |message| {
        message.time_s *= 3e5;
        if message.topic != "/robot_description" {
            let seconds = 1_780_000_000 + message.time_s as i32;
            message.data[4..8].copy_from_slice(&seconds.to_le_bytes());
        }
        true
    });
    let (code, messages) = analyze(&sparse, &out, &["--rate", "10000"]);
    assert_eq!(code, FAILED, "{messages}");
    for part in [
        "expected at most",
        "rows",
        "found 1",
        "s of joint states at --rate 10000",
    ] {
        assert!(messages.contains(part), "\"{part}\" is not in: {messages}");
    }
    #[cfg(target_os = "linux")]
    for option in ["--policy", "--machine"] {
        let mut args = vec![
            "analyze",
            text(&log),
            option,
            "/dev/zero",
            "--out",
            text(&out),
        ];
        let machine = data("tiny_lift.toml");
        if option == "--policy" {
            args.extend(["--machine", text(&machine)]);
        }
        let (code, messages) = code_and_stderr(&tipwatch(&args));
        assert_eq!(code, FAILED, "{messages}");
        assert!(messages.contains("at most 67108864 bytes"), "{messages}");
    }
}

/// Every query of the tutorial, over a fleet with lifts of unknown and of low certainty.
#[test]
#[ignore = "needs python3 with polars, duckdb"]
fn documented_queries_hold_for_uncertain_lifts() {
    let (folder, logs) = uncertain_fleet();
    for i in 0..2 {
        let lifted = copy(&folder, "copy", &mut |message| {
            message.topic != "/odom" || message.time_s > 0.05 * f64::from(i + 1)
        });
        fs::rename(lifted, logs.join(format!("lift_{i}.mcap"))).unwrap();
    }
    let out = folder.path().join("fleet");
    screen(&logs, &out, &[]);
    // one lift of unknown, one of low certainty
    for entry in fs::read_dir(out.join("state")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let mut record = json(&path);
        let name = record["path"].as_str().unwrap().to_owned();
        let certainty = match name {
            name if name.ends_with("lift_0.mcap") => Value::Null,
            name if name.ends_with("lift_1.mcap") => 0.6.into(),
            _ => continue,
        };
        for event in record["result"]["events"].as_array_mut().unwrap() {
            event["certainty"] = certainty.clone();
        }
        fs::write(&path, record.to_string()).unwrap();
    }
    let gathered = tipwatch(&["screen", "--gather", "--out", text(&out), "--quiet"]);
    assert_eq!(gathered.status.code(), Some(FAILED + UNDECIDED));
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(crate_folder.join("../book/src/tutorial/fleet.md")).unwrap();
    let blocks = page.split("```python\n").skip(1);
    let code: String = blocks
        .map(|block| block.split("```").next().unwrap())
        .collect();
    let checks = r#"
names = [path.split("/")[-1] for path in worst["path"]]
assert names[:3] and all("lift" in name for name in names[:3]), names
assert worst["worst_margin"].null_count() == 0 and "nan.mcap" not in names, names
assert dict(zip(names, worst["valid_share"]))["hole.mcap"] < 0.5, worst
assert sorted(path.split("/")[-1] for path in unknown["path"]) == ["hole.mcap", "nan.mcap"], unknown
assert lifts["lifts"].sum() == 3 and lifts["certain"].sum() == 1, lifts
assert lifts["uncertain"].sum() == 2, lifts
assert lifts["per_hour"].null_count() == 0 and lifts["per_hour"][0] > 0, lifts
rows = trend.fetchall()
assert len(rows) == 1 and rows[0][3] == 6 and rows[0][4] == 2, rows
groups = reasons.fetchall()
assert sum(row[1] for row in groups) == 2 and "/" not in groups[0][0], groups
hours = exposure.fetchall()
assert len(hours) == 1 and abs(sum(hours[0][2:]) - hours[0][1]) < 1e-6, hours
"#;
    let script = write(
        &folder,
        "queries.py",
        &format!("import os\nos.chdir(os.path.dirname(__file__))\n{code}{checks}"),
    );
    run_python(&[text(&script)]);
}

//! Regression test: fingerprints of all results, compared with those recorded in `data/golden`. A number may differ by the
//! bound of `digest`, everything else not at all.
//!
//! The programs run as a user runs them, so that moving code inside the crates cannot change what is compared.
//! `TIPWATCH_MINT_GOLDEN=1` records new ones: re-mint only with a reason in the commit message.
//!
//! Recorded on x86-64 Linux with the GNU C library; debug and release builds must agree. Sine, cosine and arctangent of
//! states are our own, but some values depend on the platform's mathematical functions and may differ in the last bit
//! elsewhere: fixed rotations of the URDF (sine, cosine; hence loads of machines with rotated joints), certainties of
//! events (`exp`), clock offsets (`exp`, `ln`, `tanh`, `hypot`), limits of linkages and offsets of the centre of mass
//! (`hypot`), angles of the IMU check (`acos`).

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use tipwatch_tests::digest::{self, Change};
use tipwatch_tests::{data, fingerprint};

const MODELS: [&str; 3] = ["whole-body", "variable-inertia", "closed-form"];
const ESTIMATORS: [&str; 2] = ["smoother", "causal"];

/// Fingerprints of some runs.
#[derive(Default)]
struct Record(String);

impl Record {
    fn section(&mut self, title: &str, lines: impl IntoIterator<Item = String>) {
        self.0.push_str(&format!("[{title}]\n"));
        for line in lines {
            self.0.push_str(&line);
            self.0.push('\n');
        }
        self.0.push('\n');
    }

    /// Runs `tipwatch` with an output folder: exit code and fingerprint of the folder.
    fn results(&mut self, title: &str, arguments: &[&str]) {
        let out = tempfile::tempdir().unwrap();
        let every_bit: &[&str] = match arguments[0] {
            "analyze" => &["--precision", "64", "--derived", "full"],
            _ => &[],
        };
        let output = program("tipwatch")
            .args(arguments)
            .args(every_bit)
            .arg("--out")
            .arg(out.path())
            .output()
            .unwrap();
        let code = format!("exit code {}", output.status.code().unwrap());
        let lines = fingerprint::folder(out.path()).unwrap();
        self.section(title, std::iter::once(code).chain(lines));
    }

    /// Runs `tipwatch` with a document on standard output: exit code and fingerprint of the document.
    fn document(&mut self, title: &str, arguments: &[&str]) {
        let output = program("tipwatch").args(arguments).output().unwrap();
        let code = format!("exit code {}", output.status.code().unwrap());
        let document = serde_json::from_slice(&output.stdout).unwrap();
        let lines = fingerprint::documents(&[document]);
        self.section(title, std::iter::once(code).chain(lines));
    }

    /// Analyses a log with a model and an estimator.
    fn analysis(&mut self, log: &Path, machine: &Path, model: &str, estimator: &str) {
        let title = format!("analyze {} {model} {estimator}", name(log));
        let mut arguments = vec!["analyze", text(log), "--machine", text(machine)];
        arguments.extend(["--model", model, "--estimator", estimator]);
        self.results(&title, &arguments);
    }

    /// Analyses a log with all models and both estimators. What follows from the loads is compared with one model.
    fn analyses(&mut self, log: &Path, machine: &Path) {
        for model in MODELS {
            for estimator in ESTIMATORS {
                let mut whole = Record::default();
                whole.analysis(log, machine, model, estimator);
                let is_kept = |line: &&str| {
                    model == MODELS[0]
                        || ["[", "exit code", "samples.parquet", "events.parquet"]
                            .iter()
                            .any(|start| line.starts_with(start))
                };
                let lines: Vec<&str> = whole.0.lines().filter(is_kept).collect();
                self.0.push_str(&lines.join("\n"));
                self.0.push_str("\n\n");
            }
        }
    }

    /// Fingerprint of the monitor's output for a lossless replay at maximum speed.
    fn session(&mut self, log: &Path) {
        let machine = log.with_extension("toml");
        let prefix = format!("golden{}{}_", std::process::id(), name(log));
        let start = |arguments: &[&str]| {
            let mut command = program("tipwatch-live");
            command.args(arguments).args(["--machine", text(&machine)]);
            command.args(["--prefix", &prefix]).stderr(Stdio::null());
            Running(command.stdout(Stdio::piped()).spawn().unwrap())
        };
        let state = tempfile::tempdir().unwrap();
        let monitor = [
            "monitor",
            "--json",
            "--allow-untimed",
            "--state",
            text(state.path()),
        ];
        let mut monitor = start(&monitor);
        let replay = ["replay", text(log), "--speed", "max", "--lossless"];
        let mut replay = start(&[&replay[..], &["--wait", "60"]].concat());
        let mut printed = String::new();
        let mut pipe = monitor.0.stdout.take().unwrap();
        pipe.read_to_string(&mut printed).unwrap();
        assert!(replay.0.wait().unwrap().success() && monitor.0.wait().unwrap().success());
        remove_shared_memory(&prefix);
        let rows: Vec<serde_json::Value> = (printed.lines())
            .map(|line| serde_json::from_str(line).unwrap())
            .filter(|row: &serde_json::Value| row["event"] == "row")
            .collect();
        assert!(rows.len() > 100, "{} rows", rows.len());
        let title = format!("live session {}", name(log));
        self.section(&title, fingerprint::documents(&rows));
    }

    /// Compares with the recorded file, or writes it.
    fn check(&self, name: &str) {
        let path = data("golden").join(format!("{name}.txt"));
        if std::env::var_os("TIPWATCH_MINT_GOLDEN").is_some() {
            fs::write(&path, &self.0).unwrap();
            return;
        }
        let recorded =
            fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let differences = differences(&recorded, &self.0);
        assert!(
            differences.is_empty(),
            "{}: {} lines differ from the recorded results:\n{}\nTIPWATCH_MINT_GOLDEN=1 records anew: only with a \
             reason in the commit message",
            path.display(),
            differences.len(),
            differences[..differences.len().min(30)].join("\n")
        );
    }
}

/// Returns the lines that differ beyond the bound, each with its section and numbers before and after.
fn differences(recorded: &str, found: &str) -> Vec<String> {
    let lines = |text: &str| {
        let mut section = "";
        let mut lines = std::collections::BTreeMap::new();
        for line in text.lines().filter(|line| !line.is_empty()) {
            match (line.starts_with('['), line.split_once(" = ")) {
                (true, _) => section = line,
                (_, Some((key, values))) => {
                    lines.insert(format!("{section} {key}"), values.to_string());
                }
                (_, None) => {
                    lines.insert(format!("{section} {line}"), String::new());
                }
            }
        }
        lines
    };
    let (recorded, found) = (lines(recorded), lines(found));
    let mut all = Vec::new();
    for (key, old) in &recorded {
        match found.get(key).map(|new| digest::change(old, new)) {
            None => all.push(format!("{key}: no longer there, was {old}")),
            Some(Change::Beyond(text)) => all.push(format!("{key}: {text}")),
            Some(Change::None | Change::WithinBound) => {}
        }
    }
    let is_new = |key: &&String| !recorded.contains_key(*key);
    let new = found.keys().filter(is_new);
    all.extend(new.map(|key| format!("{key}: new, {}", found[key])));
    all
}

/// A process that is killed when the test ends, even by a panic.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Every prefix leaves a small file behind.
fn remove_shared_memory(prefix: &str) {
    for folder in ["/dev/shm", "/tmp/iceoryx2"] {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(prefix) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

fn program(name: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
    command.arg(name).stdin(Stdio::null());
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn name(log: &Path) -> String {
    log.file_stem().unwrap().to_string_lossy().into_owned()
}

/// A log of the repository with its machine file.
fn fixture(name: &str) -> (PathBuf, PathBuf) {
    let log = data(&format!("{name}.mcap"));
    (log.clone(), log.with_extension("toml"))
}

/// All models and both estimators on a log of the repository, with a file of its own.
fn analyses_keep_their_bits(fixture_name: &str) {
    let (log, machine) = fixture(fixture_name);
    let mut record = Record::default();
    record.analyses(&log, &machine);
    record.check(fixture_name);
}

macro_rules! analyses {
    ($($test:ident: $fixture:literal,)+) => {
        $(#[test]
        fn $test() {
            analyses_keep_their_bits($fixture);
        })+
    };
}

analyses! {
    analyses_of_bogie_bump_keep_their_bits: "bogie_bump",
    analyses_of_bogie_drive_keep_their_bits: "bogie_drive",
    analyses_of_corner_brake_keep_their_bits: "corner_brake",
    analyses_of_folded_arm_keep_their_bits: "folded_arm",
    analyses_of_forwarder6_keep_their_bits: "forwarder6",
    analyses_of_forwarder6_bump_keep_their_bits: "forwarder6_bump",
    analyses_of_hard_brake_keep_their_bits: "hard_brake",
    analyses_of_lift_payload_keep_their_bits: "lift_payload",
    analyses_of_second_paper_keep_their_bits: "second_paper",
    analyses_of_swing_lift_keep_their_bits: "swing_lift",
    analyses_of_tiny_keep_their_bits: "tiny",
    analyses_of_tiny_lift_keep_their_bits: "tiny_lift",
}

#[test]
fn optional_tables_and_options_keep_their_bits() {
    let mut record = Record::default();
    let demo = data("../../analyze/demo/demo.mcap");
    record.analysis(
        &demo,
        &demo.with_extension("toml"),
        "whole-body",
        "smoother",
    );
    let analyze = |name: &str| -> Vec<String> {
        let (log, machine) = fixture(name);
        ["analyze", text(&log), "--machine", text(&machine)]
            .map(String::from)
            .into()
    };
    let all: [(&str, &[&str]); 5] = [
        ("tiny", &["--columns", "parts", "--monte-carlo", "20"]),
        ("tiny", &["--columns", "terms", "--model", "closed-form"]),
        (
            "second_paper",
            &[
                "--columns",
                "terms",
                "--model",
                "variable-inertia",
                "--to",
                "6",
            ],
        ),
        (
            "hard_brake",
            &[
                "--model",
                "closed-form",
                "--closed-form-input",
                "accelerometer",
            ],
        ),
        (
            "swing_lift",
            &[
                "--rate",
                "40",
                "--from",
                "1",
                "--apply-clock-offsets",
                "estimated",
            ],
        ),
    ];
    for (name, options) in all {
        let base = analyze(name);
        let arguments: Vec<&str> = base
            .iter()
            .map(String::as_str)
            .chain(options.iter().copied())
            .collect();
        record.results(&format!("analyze {name} {}", options.join(" ")), &arguments);
    }
    record.check("options");
}

#[test]
fn suspension_replays_keep_their_bits() {
    let mut record = Record::default();
    for name in ["bogie_bump", "folded_arm", "second_paper"] {
        let (log, machine) = fixture(name);
        for suspension in ["locked", "recorded", "literal", "look-ahead"] {
            let mut arguments = vec!["whatif", text(&log), "--machine", text(&machine)];
            arguments.extend(["--suspension", suspension, "--to", "8"]);
            if suspension == "literal" {
                arguments.extend(["--step", "1.7"]);
            }
            record.results(&format!("whatif {name} {suspension}"), &arguments);
        }
    }
    record.check("whatif");
}

#[test]
fn a_screen_keeps_its_bits() {
    let mut record = Record::default();
    let logs: Vec<PathBuf> = (0..24)
        .map(|i| data(&format!("coverage_{i:02}.mcap")))
        .collect();
    let machine = data("coverage.toml");
    let mut arguments = vec!["screen", "--machine", text(&machine)];
    arguments.extend(logs.iter().map(|log| text(log)));
    record.results("screen coverage_00 to _23", &arguments);
    record.check("screen");
}

#[test]
fn comparisons_keep_their_bits() {
    let mut record = Record::default();
    let (tiny, machine) = fixture("tiny");
    let (lift, _) = fixture("tiny_lift");
    let base = ["compare", text(&tiny), "--machine", text(&machine)];
    record.results(
        "compare tiny, two estimators",
        &[&base[..], &["--estimator-b", "causal"]].concat(),
    );
    record.results(
        "compare tiny, two models",
        &[&base[..], &["--model-b", "closed-form"]].concat(),
    );
    let both = [
        "compare",
        text(&tiny),
        text(&lift),
        "--machine",
        text(&machine),
    ];
    record.results("compare tiny, tiny_lift", &both);
    record.check("compare");
}

#[test]
fn facts_about_logs_and_machines_keep_their_bits() {
    let mut record = Record::default();
    for name in ["tiny", "forwarder6", "lift_payload", "second_paper"] {
        let (log, machine) = fixture(name);
        let with_machine = ["inspect", text(&log), "--machine", text(&machine), "--json"];
        record.document(&format!("inspect {name}"), &with_machine);
        let with_log = [
            "check-machine",
            text(&machine),
            "--log",
            text(&log),
            "--json",
        ];
        record.document(&format!("check-machine {name}"), &with_log);
    }
    record.check("facts");
}

#[test]
fn live_sessions_keep_their_bits() {
    let mut record = Record::default();
    for name in [
        "tiny",
        "tiny_lift",
        "forwarder6",
        "lift_payload",
        "second_paper",
    ] {
        record.session(&fixture(name).0);
    }
    record.check("live");
}

mod needs_shared {
    use super::{Record, data};
    use tipwatch_tests::beside;

    #[test]
    #[ignore = "needs ../shared"]
    fn shared_simulated_logs_keep_their_bits() {
        let mut record = Record::default();
        for name in [
            "drive_brake",
            "drive_brake_clean",
            "flat_arm",
            "flat_arm_clean",
        ] {
            let log = beside(&format!("sim/{name}.mcap"));
            record.analyses(&log, &log.with_extension("toml"));
        }
        let machine = beside("sim/drive_brake.toml");
        for other in ["sim/drive_brake.bag", "sim/drive_brake_db3"] {
            record.analysis(&beside(other), &machine, "whole-body", "smoother");
        }
        record.check("shared_sim");
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn logs_of_real_robots_keep_their_bits() {
        let mut record = Record::default();
        for name in ["abitobot", "turtlebot3"] {
            let (log, machine) = (
                beside(&format!("real/{name}")),
                data(&format!("{name}.toml")),
            );
            record.analyses(&log, &machine);
        }
        // this log has no machine file
        let jackal = beside("real/jackal/test2.bag");
        record.document(
            "inspect jackal",
            &["inspect", super::text(&jackal), "--json"],
        );
        record.check("shared_real");
    }
}

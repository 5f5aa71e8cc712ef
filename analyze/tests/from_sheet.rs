//! `machine new`: from a data sheet to wheel loads.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::setup::first_machine::{self, Draft, open_values};
use tipwatch_analyze::setup::from_sheet::{self, LogOfMachine};
use tipwatch_binding::MachineFile;
use tipwatch_datasheet::{Sheet, Template};
use tipwatch_ingest::Ros2Writer;
use tipwatch_mechanics::{Quantity, RestingMachine};

use crate::support::{analysed, code_and_stderr, stdout, text, tipwatch};

#[derive(Serialize)]
struct Header((i32, u32), String);
#[derive(Serialize)]
struct JointState(Header, Vec<String>, Vec<f64>, Vec<f64>, Vec<f64>);
#[derive(Serialize)]
struct Imu(
    Header,
    [f64; 4],
    [f64; 9],
    [f64; 3],
    [f64; 9],
    [f64; 3],
    [f64; 9],
);

/// Writes the example sheet of a kind of machine; returns its path.
fn sheet(folder: &Path, template: &str) -> PathBuf {
    let output = tipwatch(&["machine", "example", template]);
    let path = folder.join(format!("{template}.toml"));
    fs::write(&path, stdout(&output)).unwrap();
    path
}

fn new(sheet: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    tipwatch(&[&["machine", "new", text(sheet), "--out", text(out)], more].concat())
}

/// A log of the machine at rest on level ground in one posture: four seconds at 100 Hz.
fn log_at_rest(path: &Path, names: &[String], positions: &[f64]) {
    let mut writer = Ros2Writer::create(path).unwrap();
    let states = writer
        .topic("/joint_states", "sensor_msgs/msg/JointState", None)
        .unwrap();
    let imu = writer
        .topic("/imu/data", "sensor_msgs/msg/Imu", None)
        .unwrap();
    for row in 0..400_u32 {
        let time = i64::from(row) * 10_000_000 + 1_000_000_000;
        let header = |frame: &str| {
            let (seconds, rest) = (time / 1_000_000_000, time % 1_000_000_000);
            Header(
                (
                    i32::try_from(seconds).unwrap(),
                    u32::try_from(rest).unwrap(),
                ),
                frame.into(),
            )
        };
        let zeros = vec![0.0; names.len()];
        let state = JointState(
            header(""),
            names.to_vec(),
            positions.to_vec(),
            zeros,
            vec![],
        );
        writer.write(states, time, &state).unwrap();
        let level = [0.0, 0.0, 0.0, 1.0];
        let sample = Imu(
            header("base_link"),
            level,
            [0.0; 9],
            [0.0; 3],
            [0.0; 9],
            [0.0, 0.0, 9.806_65],
            [0.0; 9],
        );
        writer.write(imu, time, &sample).unwrap();
    }
    writer.finish().unwrap();
}

fn mean_loads(analysis: &Analysis) -> Vec<f64> {
    let wheels = analysis.machine.wheels().len();
    (0..wheels)
        .map(|wheel| {
            let column = analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
            let finite: Vec<f64> = column.iter().copied().filter(|v| v.is_finite()).collect();
            assert!(finite.len() > 300, "{} rows", finite.len());
            finite.iter().sum::<f64>() / finite.len() as f64
        })
        .collect()
}

/// The whole way: sheet, machine, log, analysis. The loads are the sheet's axle loads, and in another posture those of
/// the machine at rest.
#[test]
fn a_log_of_a_machine_from_its_sheet_gives_the_axle_loads_of_the_sheet() {
    for template in [
        "wheel-loader",
        "forklift",
        "forwarder",
        "mobile-crane",
        "crawler-excavator",
        "telehandler",
        "truck-crane",
        "wheeled-excavator",
        "harvester",
    ] {
        let folder = TempDir::new().unwrap();
        let out = folder.path().join("machine");
        let made = new(&sheet(folder.path(), template), &out, &[]);
        let (code, messages) = code_and_stderr(&made);
        assert_eq!(code, 0, "{template}: {messages}");
        let path = out.join("machine.toml");
        let file = MachineFile::read(&path).unwrap();
        let machine = file.check_alone().unwrap();
        let names: Vec<String> = machine
            .joints()
            .iter()
            .map(|joint| joint.name.clone())
            .collect();
        let mut positions = machine.reference().posture.positions.clone();
        let log = folder.path().join("rest.mcap");
        log_at_rest(&log, &names, &positions);
        let analysis = analysed(&log, &path);
        let found = mean_loads(&analysis);
        let index = |name: &String| {
            analysis
                .machine
                .wheels()
                .iter()
                .position(|w| w.name == *name)
                .unwrap()
        };
        for sum in &file.spec.weighed.as_ref().unwrap().sums {
            let load: f64 = sum.wheels.iter().map(|name| found[index(name)]).sum();
            let stated = sum.load * 9.806_65;
            assert!(
                (load / stated - 1.0).abs() < 1e-3,
                "{template}, {}: {load} N, sheet {stated} N",
                sum.label()
            );
        }
        let arm = machine.joints().iter().position(|joint| {
            joint.spins_wheel.is_none()
                && joint.constant.is_none()
                && !joint.name.contains("articulation")
        });
        positions[arm.unwrap()] += 0.15;
        let other = folder.path().join("other.mcap");
        log_at_rest(&other, &names, &positions);
        let found = mean_loads(&analysed(&other, &path));
        let resting = RestingMachine::new(&machine, &positions);
        let mean = resting.outcome().normal_force / found.len() as f64;
        for (a, b) in found.iter().zip(&resting.outcome().load) {
            assert!(
                (a - b).abs() < 0.03 * mean,
                "{template}: {found:?} {:?}",
                resting.outcome().load
            );
        }
    }
}

#[test]
fn check_machine_compares_with_the_sheet_and_tells_what_was_assumed() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("m");
    let output = new(&sheet(folder.path(), "forklift"), &out, &[]);
    let text_out = stdout(&output);
    for expected in [
        "axle 1",
        "within two sigma",
        "assumed:",
        "because",
        "1489 kg (sheet)",
    ] {
        assert!(text_out.contains(expected), "{expected}: {text_out}");
    }
    let machine_file = fs::read_to_string(out.join("machine.toml")).unwrap();
    for expected in [
        "# assumed:",
        "# source: Jungheinrich",
        "[weighed]",
        "# [signals.joints.mast]",
        "com = ",
    ] {
        assert!(
            machine_file.contains(expected),
            "{expected}: {machine_file}"
        );
    }
    let again = new(&folder.path().join("forklift.toml"), &out, &[]);
    let (code, messages) = code_and_stderr(&again);
    assert!(
        code == 1 && messages.contains("does not exist yet"),
        "{messages}"
    );
}

/// A log whose joints have other names and units: its signals are bound.
#[test]
fn signals_of_a_log_are_bound() {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("drive.mcap");
    let names = ["articulation", "boom", "bucket", "other"].map(String::from);
    log_at_rest(&log, &names, &[0.0, -0.63, 0.63, 1.0]);
    let out = folder.path().join("m");
    let output = new(
        &sheet(folder.path(), "wheel-loader"),
        &out,
        &["--log", text(&log)],
    );
    let (code, messages) = code_and_stderr(&output);
    assert_eq!(code, 0, "{messages}");
    let machine_file = fs::read_to_string(out.join("machine.toml")).unwrap();
    assert!(
        machine_file.contains("joint_states = [\"/joint_states\"]"),
        "{machine_file}"
    );
    assert!(
        machine_file.contains("imu = \"/imu/data\""),
        "{machine_file}"
    );
    assert!(
        !machine_file.contains("# [signals.joints.boom]"),
        "{machine_file}"
    );
    let sum: f64 = mean_loads(&analysed(&log, &out.join("machine.toml")))
        .iter()
        .sum();
    assert!((sum / (15_200.0 * 9.806_65) - 1.0).abs() < 1e-3, "{sum}");
}

/// A log of a wheel loader at rest that has two of its three joints.
fn without_the_bucket(folder: &Path) -> PathBuf {
    let log = folder.join("drive.mcap");
    let names = ["articulation", "boom"].map(String::from);
    log_at_rest(&log, &names, &[0.0, -0.63]);
    log
}

/// As `inspect --write-machine` asks: where the IMU is, what the tool carries, and where joints stood that no message has.
#[test]
fn what_a_log_leaves_open_is_asked_for() {
    let folder = TempDir::new().unwrap();
    let log = without_the_bucket(folder.path());
    let out = folder.path().join("m");
    let answers = [
        ("imu.xyz", "-1 m, 0, 180 cm"),
        ("imu.rpy", "0, 0, 90"),
        ("payload.mass", "2 t"),
        ("signals.joints.bucket.position", "20"),
    ];
    let mut asked = Vec::new();
    let ask = &mut |draft: &mut Draft| {
        let open = open_values(draft);
        assert_eq!(open.unranked, None);
        let mut input = String::new();
        for value in &open.values {
            let answer = answers.iter().find(|(key, _)| *key == value.key);
            input.push_str(answer.map_or("", |(_, answer)| answer));
            input.push('\n');
            asked.push(value.key.clone());
        }
        first_machine::ask(draft, &mut Cursor::new(input), &mut Vec::new()).unwrap();
        Ok(())
    };
    let sheet = Sheet::from_toml(Template::WheelLoader.example(), "sheet.toml").unwrap();
    let of = LogOfMachine {
        log: &log,
        databases: &[],
    };
    let made = from_sheet::create(&sheet, &out, Some(of), None, ask).unwrap();
    assert_eq!(made.of_log.unwrap().missing, None);
    for (key, _) in answers {
        assert!(asked.iter().any(|it| it == key), "{key}: {asked:?}");
    }
    let file = out.join("machine.toml");
    let spec = MachineFile::read(&file).unwrap().spec;
    let imu = spec.imu.unwrap();
    assert_eq!(imu.xyz, [-1.0, 0.0, 1.8]);
    assert!((imu.rpy[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    assert_eq!(spec.payload.len(), 1);
    assert_eq!(spec.unconfirmed, Vec::<String>::new());
    let sum: f64 = mean_loads(&analysed(&log, &file)).iter().sum();
    assert!((sum / (17_200.0 * 9.806_65) - 1.0).abs() < 1e-3, "{sum}");
}

/// Where nobody can be asked, the keys are named, and what is guessed of the log is marked as such.
#[test]
fn without_a_terminal_the_keys_are_named() {
    let folder = TempDir::new().unwrap();
    let log = without_the_bucket(folder.path());
    let out = folder.path().join("m");
    let sheet = sheet(folder.path(), "wheel-loader");
    let made = new(&sheet, &out, &["--log", text(&log)]);
    let (code, messages) = code_and_stderr(&made);
    assert_eq!(code, 0, "{messages}");
    for part in [
        "imu.xyz",
        "payload.mass",
        "signals.joints.bucket.position",
        "bucket",
    ] {
        assert!(messages.contains(part), "{part}: {messages}");
    }
    let spec = MachineFile::read(&out.join("machine.toml")).unwrap().spec;
    assert_eq!(spec.unconfirmed, ["imu"]);
    assert!(spec.payload.is_empty());
}

#[test]
fn a_wrong_sheet_is_an_error_and_leaves_nothing() {
    let folder = TempDir::new().unwrap();
    let path = sheet(folder.path(), "forklift");
    let wrong = fs::read_to_string(&path)
        .unwrap()
        .replace("load = 1817", "load = 817");
    fs::write(&path, wrong).unwrap();
    let out = folder.path().join("m");
    let (code, messages) = code_and_stderr(&new(&path, &out, &[]));
    assert!(
        code == 1 && messages.contains("axles.load") && messages.contains("3306"),
        "{messages}"
    );
    assert!(!out.exists());
    let (code, messages) = code_and_stderr(&tipwatch(&["machine", "new"]));
    assert!(code == 2 && messages.contains("--template"), "{messages}");
    let (code, messages) = code_and_stderr(&tipwatch(&["machine", "new", "--template", "boat"]));
    assert!(code == 2 && messages.contains("forklift"), "{messages}");
}

#[test]
fn every_kind_of_machine_has_an_example() {
    let list = stdout(&tipwatch(&["machine", "templates"]));
    let names: Vec<&str> = list
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert_eq!(names.len(), 10, "{list}");
    let folder = TempDir::new().unwrap();
    for name in names {
        let out = folder.path().join(format!("{name}_out"));
        let (code, messages) =
            code_and_stderr(&new(&sheet(folder.path(), name), &out, &["--quiet"]));
        assert_eq!((code, messages.as_str()), (0, ""), "{name}");
    }
}

/// A crawler on outriggers that are set for two seconds: its weight is on them, then on the tracks.
#[test]
fn tracks_carry_where_the_outriggers_do_not() {
    let folder = TempDir::new().unwrap();
    let path = sheet(folder.path(), "crawler-excavator");
    let pair = |behind: f64| {
        format!("\n[[outriggers]]\nbehind = {behind}\nbase = 4.5\npad = 0.6\nset = true\n")
    };
    let with_pads = fs::read_to_string(&path).unwrap() + &pair(-2.2) + &pair(2.2);
    fs::write(&path, with_pads).unwrap();
    let out = folder.path().join("machine");
    let (code, messages) = code_and_stderr(&new(&path, &out, &[]));
    assert_eq!(code, 0, "{messages}");
    let file = out.join("machine.toml");
    let text = fs::read_to_string(&file).unwrap();
    let spans = text
        .replace("\nset = true\n", "\nset = [[0.0, 2.0]]\n")
        .replace("\n[contact]\n", "\n[contact]\ntransition = 0.3\n");
    assert_eq!(spans.matches("set = [[").count(), 4, "{text}");
    fs::write(&file, spans).unwrap();
    let machine = MachineFile::read(&file).unwrap().check_alone().unwrap();
    let names: Vec<String> = machine.joints().iter().map(|j| j.name.clone()).collect();
    let log = folder.path().join("rest.mcap");
    log_at_rest(&log, &names, &machine.reference().posture.positions);
    let analysis = analysed(&log, &file);
    let weight = 22_600.0 * 9.806_65;
    let sum = |row: usize, prefix: &str| {
        let wheels = analysis.machine.wheels().iter().enumerate();
        let of_kind = wheels.filter(|(_, wheel)| wheel.name.starts_with(prefix));
        let load = |(wheel, _)| analysis.rows.whole().value(Quantity::Load(wheel), row);
        of_kind
            .map(load)
            .filter(|load: &f64| load.is_finite())
            .sum::<f64>()
    };
    let (mut on_pads, mut on_tracks) = (0, 0);
    for row in 0..analysis.rows.len() {
        let t = analysis.rows.seconds(row);
        let [pads, tracks] =
            [sum(row, "OUTRIGGER"), sum(row, "LEFT") + sum(row, "RIGHT")].map(|load| load / weight);
        if (0.4..1.6).contains(&t) {
            assert!(
                (pads - 1.0).abs() < 1e-3 && tracks.abs() < 1e-9,
                "{t} s: {pads} {tracks}"
            );
            on_pads += 1;
        }
        if (2.4..3.9).contains(&t) {
            assert!(
                (tracks - 1.0).abs() < 1e-3 && pads.abs() < 1e-9,
                "{t} s: {pads} {tracks}"
            );
            on_tracks += 1;
        }
    }
    assert!(on_pads > 100 && on_tracks > 100, "{on_pads} {on_tracks}");
}

//! Sensors that are wrong but plausible by themselves, found by comparison with each other: each fault is injected
//! into logs in which a wheel is in the air.

use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_analyze::events::EventKind;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::Level;
use tipwatch_tests::{
    Values, analysed, analysed_with, by, data, write_edited, write_edited_without,
};

/// A log, and the time in which a wheel is in the air (s after its first row).
struct Scene {
    log: &'static str,
    airborne_s: [f64; 2],
}

const LIFT: Scene = Scene {
    log: "lift.mcap",
    airborne_s: [6.10, 7.65],
};
const SWING: Scene = Scene {
    log: "swing_lift.mcap",
    airborne_s: [1.83, 2.51],
};

/// A log on which no constant was chosen.
const SIDE: Scene = Scene {
    log: "side_reach.mcap",
    airborne_s: [3.98, 6.39],
};

/// A change of a message, with the memory of the fault.
type Edit = fn(&mut Values<'_>, &mut Memory);

/// Memory of an injected fault: the first value of each signal, and the number of messages.
#[derive(Default)]
struct Memory {
    first: std::collections::BTreeMap<&'static str, f64>,
    messages: u32,
}

impl Memory {
    fn first(&mut self, values: &Values<'_>, name: &'static str) -> f64 {
        *self.first.entry(name).or_insert_with(|| values.get(name))
    }

    /// Noise between -1 and 1.
    fn noise(&mut self) -> f64 {
        self.messages += 1;
        let wave = (f64::from(self.messages) * 12.9898).sin() * 43_758.545_3;
        2.0 * wave.rem_euclid(1.0) - 1.0
    }
}

const AXES: [[&str; 3]; 2] = [
    ["force.x", "force.y", "force.z"],
    ["turning.x", "turning.y", "turning.z"],
];
const ATTITUDE: [&str; 4] = ["attitude.x", "attitude.y", "attitude.z", "attitude.w"];

/// Turns the housing of the IMU: everything that it measures.
fn turn_imu(values: &mut Values<'_>, by: UnitQuaternion<f64>) {
    for names in AXES {
        let turned = by.inverse() * Vector3::from(names.map(|name| values.get(name)));
        for (name, value) in names.into_iter().zip(turned.iter()) {
            values.set(name, *value);
        }
    }
    let [x, y, z, w] = ATTITUDE.map(|name| values.get(name));
    let attitude = Quaternion::new(w, x, y, z) * by.into_inner();
    for (name, value) in ATTITUDE.into_iter().zip(attitude.coords.iter()) {
        values.set(name, *value);
    }
}

/// Turns the IMU by an angle about its forward axis and one about its upward axis (rad).
fn turned_imu(values: &mut Values<'_>, [roll, yaw]: [f64; 2]) {
    if values.topic == "/imu/data" {
        turn_imu(values, UnitQuaternion::from_euler_angles(roll, 0.0, yaw));
    }
}

fn flip(values: &mut Values<'_>, joint: &str) {
    if values.topic == "/joint_states" {
        values.scale(&format!("position.{joint}"), -1.0);
        values.scale(&format!("velocity.{joint}"), -1.0);
    }
}

/// An encoder that has stopped, and its noise (rad, m).
fn stop(values: &mut Values<'_>, joint: &'static str, noise: f64, memory: &mut Memory) {
    if values.topic == "/joint_states" {
        let name = format!("position.{joint}");
        let first = *memory.first.entry(joint).or_insert(values.get(&name));
        values.set(&name, first + noise * memory.noise());
        values.set(&format!("velocity.{joint}"), 0.0);
    }
}

fn swap(values: &mut Values<'_>, [a, b]: [&str; 2]) {
    if values.topic == "/joint_states" {
        for list in ["position", "velocity"] {
            values.exchange(&format!("{list}.{a}"), &format!("{list}.{b}"));
        }
    }
}

/// Wrong sensors.
const WRONG: [(&str, Edit); 19] = [
    ("IMU turned by 180 degrees", |it, _| {
        turned_imu(it, [0.0, std::f64::consts::PI]);
    }),
    ("sign of the slew", |it, _| flip(it, "slew")),
    ("sign of the lift", |it, _| flip(it, "lift")),
    ("sign of the tilt", |it, _| flip(it, "tilt")),
    ("IMU stuck, with noise", |it, memory| {
        if it.topic == "/imu/data" {
            for (names, noise) in AXES.into_iter().zip([0.03, 0.001]) {
                for name in names {
                    let first = memory.first(it, name);
                    it.set(name, first + noise * 1.7 * memory.noise());
                }
            }
            for name in ATTITUDE {
                let first = memory.first(it, name);
                it.set(name, first + 1e-4 * memory.noise());
            }
        }
    }),
    ("specific force drifts to 2.9 m/s2", |it, _| {
        if it.topic == "/imu/data" {
            it.shift("force.y", -2.9 * it.time_s / 12.0);
        }
    }),
    ("IMU turned by 10 degrees", |it, _| {
        turned_imu(it, [-10_f64.to_radians(), 0.0]);
    }),
    ("slew and lift swapped", |it, _| swap(it, ["slew", "lift"])),
    ("lift and tilt swapped", |it, _| swap(it, ["lift", "tilt"])),
    ("slew and tilt swapped", |it, _| swap(it, ["slew", "tilt"])),
    ("slew and extension swapped", |it, _| {
        swap(it, ["slew", "extension"]);
    }),
    ("lift and extension swapped", |it, _| {
        swap(it, ["lift", "extension"]);
    }),
    ("slew encoder stands still", |it, memory| {
        stop(it, "slew", 0.0, memory);
    }),
    ("slew encoder stands still, with noise", |it, memory| {
        stop(it, "slew", NOISE, memory);
    }),
    ("lift encoder stands still", |it, memory| {
        stop(it, "lift", 0.0, memory);
    }),
    ("lift encoder stands still, with noise", |it, memory| {
        stop(it, "lift", NOISE, memory);
    }),
    (
        "extension encoder stands still, with noise",
        |it, memory| {
            stop(it, "extension", NOISE, memory);
        },
    ),
    ("tilt encoder stands still", |it, memory| {
        stop(it, "tilt", 0.0, memory);
    }),
    ("tilt encoder stands still, with noise", |it, memory| {
        stop(it, "tilt", NOISE, memory);
    }),
];
/// Noise of an encoder that stands still (rad, m).
const NOISE: f64 = 3e-4;

/// Verdicts on a log with a wrong sensor.
struct Found {
    /// Rows with a wheel in the air, and those of them called Safe or Notice.
    airborne: usize,
    called_safe: usize,
    /// Rows that are called Safe or Notice while signals contradict each other.
    safe_beside_doubt: usize,
    /// Time of the first contradiction (s after the first row).
    at_s: Option<f64>,
}

fn judged(scene: &Scene, edit: Edit, policy: &str) -> Found {
    let dir = TempDir::new().unwrap();
    let source = data(scene.log);
    let copy = |extension: &str| {
        dir.path()
            .join(source.file_name().unwrap())
            .with_extension(extension)
    };
    std::fs::copy(source.with_extension("urdf"), copy("urdf")).unwrap();
    let machine = std::fs::read_to_string(source.with_extension("toml")).unwrap();
    let machine = format!("{machine}\n[plausibility]\ncontradiction = \"{policy}\"\n");
    std::fs::write(copy("toml"), machine).unwrap();
    let mut memory = Memory::default();
    write_edited(&source, &copy("mcap"), &mut |_, values| {
        edit(values, &mut memory);
    });
    // The verdicts of the causal estimator are those of a monitor.
    let analysis = analysed(&copy("mcap"), causal());
    let verdicts = &analysis.rows.whole().verdicts.as_ref().unwrap().verdicts;
    let [from_s, to_s] = scene.airborne_s;
    let airborne = (0..analysis.rows.len()).filter(|&row| {
        let time_s = analysis.rows.seconds(row);
        from_s <= time_s && time_s <= to_s
    });
    let airborne: Vec<usize> = airborne.collect();
    let is_safe = |row: &&usize| {
        let level = verdicts[**row].level;
        level.sees_no_danger() || level == Level::Notice
    };
    let faulty =
        (0..analysis.rows.len()).find(|&row| analysis.rows.reasons[row].has(Reason::Contradiction));
    let is_doubted = |row: &&usize| analysis.rows.reasons[**row].has(Reason::Contradiction);
    let beside = (airborne.iter()).filter(|row| is_safe(row) && is_doubted(row));
    Found {
        safe_beside_doubt: beside.count(),
        called_safe: airborne.iter().filter(is_safe).count(),
        airborne: airborne.len(),
        at_s: faulty.map(|row| analysis.rows.seconds(row)),
    }
}

fn causal() -> Options {
    by(Estimator::Causal)
}

/// Contradictions found in a log.
fn contradictions(analysis: &Analysis) -> Vec<String> {
    let is_contradiction = |kind: FaultKind| kind == FaultKind::Contradiction;
    (analysis.events.iter())
        .filter(|event| event.kind == EventKind::InputFault)
        .filter(|event| {
            event
                .fault
                .as_ref()
                .is_some_and(|fault| is_contradiction(fault.kind))
        })
        .map(|event| format!("{} {} {}", event.subject, event.worst, event.unit))
        .collect()
}

/// Injects every fault; also prints the results, for `--nocapture`.
#[expect(
    clippy::print_stdout,
    reason = "the table is what one runs this test for"
)]
fn table(scene: &Scene) -> Vec<(&'static str, Found, Found)> {
    let rows = WRONG.into_iter().map(|(name, edit)| {
        let [without, with] = ["report", "invalid"].map(|policy| judged(scene, edit, policy));
        println!(
            "{:16} {:36} of {:3} rows in the air safe: {:3} without, {:3} with; fault from {:?} s",
            Path::new(scene.log).file_stem().unwrap().display(),
            name,
            with.airborne,
            without.called_safe,
            with.called_safe,
            with.at_s
        );
        (name, without, with)
    });
    rows.collect()
}

/// Asserts that no lifted row of a doubted log is Safe or Notice once the doubt stands, and that the faults `found` are doubted:
/// the motion of the log shows them.
fn doubted(scene: &Scene, found: &[&str]) {
    for (name, without, with) in table(scene) {
        assert!(with.called_safe <= without.called_safe, "{name}");
        assert!(with.safe_beside_doubt == 0, "{name}");
        if found.contains(&name) {
            assert!(with.at_s.is_some(), "{name} is not doubted");
        }
    }
}

// requirement: TW-FAULT-14
#[test]
fn wrong_sensors_that_the_motion_shows_are_doubted() {
    doubted(
        &LIFT,
        &[
            "IMU turned by 180 degrees",
            "sign of the slew",
            "sign of the lift",
            "sign of the tilt",
            "slew and extension swapped",
            "lift and extension swapped",
            "slew encoder stands still",
            "slew encoder stands still, with noise",
        ],
    );
}

// requirement: TW-FAULT-14
#[test]
fn wrong_sensors_are_doubted_in_a_short_log() {
    doubted(
        &SWING,
        &[
            "IMU turned by 180 degrees",
            "sign of the lift",
            "sign of the tilt",
            "lift and extension swapped",
        ],
    );
}

// requirement: TW-FAULT-14
#[test]
fn wrong_sensors_are_doubted_in_a_log_of_other_motion() {
    doubted(
        &SIDE,
        &[
            "IMU turned by 180 degrees",
            "sign of the lift",
            "sign of the tilt",
            "slew and extension swapped",
            "lift and extension swapped",
        ],
    );
}

/// Analyses a copy of a drive without odometry, its sensors changed by `edit`.
fn driven_without_odometry(log: &str, edit: Edit) -> Analysis {
    let dir = TempDir::new().unwrap();
    let source = data(log);
    let copy = |extension: &str| {
        dir.path()
            .join(source.file_name().unwrap())
            .with_extension(extension)
    };
    std::fs::copy(source.with_extension("urdf"), copy("urdf")).unwrap();
    let machine = std::fs::read_to_string(source.with_extension("toml")).unwrap();
    let bound = machine
        .lines()
        .filter(|line| !line.starts_with("odometry ="));
    std::fs::write(copy("toml"), bound.collect::<Vec<_>>().join("\n")).unwrap();
    let mut memory = Memory::default();
    write_edited_without(&source, &copy("mcap"), "/odom", &mut |_, values| {
        edit(values, &mut memory);
    });
    analysed(&copy("mcap"), causal())
}

const DRIVES: [&str; 3] = ["hard_brake.mcap", "corner_brake.mcap", "commissioning.mcap"];

#[test]
fn wheels_that_speed_up_while_the_machine_slows_down_are_found_without_odometry() {
    const WHEELS: [&str; 4] = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];
    let wrong: [(&str, Edit); 2] = [
        ("wheels", |it, _| {
            WHEELS.iter().for_each(|wheel| flip(it, wheel));
        }),
        WRONG[0],
    ];
    for log in DRIVES {
        let good = contradictions(&driven_without_odometry(log, |_, _| {}));
        assert!(good.is_empty(), "{log}: {good:?}");
        for (name, edit) in &wrong {
            let found = contradictions(&driven_without_odometry(log, *edit));
            let is_found = found
                .iter()
                .any(|it| it.starts_with("imu.specific_force against the speeds of the wheels"));
            assert!(is_found, "{log}, {name}: {found:?}");
        }
    }
}

/// Notes name each joint that the motion of a log does not test, and no joint that it tests.
#[test]
fn what_is_not_tested_is_stated() {
    let note = |log: &str| {
        let analysis = analysed(&data(log), Options::default());
        let notes = analysis.notes.iter();
        let mut notes = notes.filter(|note| note.starts_with("Not tested by the motion"));
        let found = notes.next().cloned();
        assert!(notes.next().is_none(), "{log}: said twice");
        found
    };
    // It turns, travels and slews far. Its other joints move, and lean the platform a little.
    let drive = note("commissioning.mcap").unwrap();
    for tested in [
        "slew",
        "steer",
        "signs about the vertical",
        "direction of travel",
    ] {
        assert!(!drive.contains(tested), "{drive}");
    }
    assert!(drive.contains("tilt"), "{drive}");
    // The arm slews on four wheels, and reaches out mostly on three: those are no test of the joints that reach.
    let standing = note("side_reach.mcap").unwrap();
    for untested in ["tilt", "signs about the vertical", "direction of travel"] {
        assert!(standing.contains(untested), "{standing}");
    }
    assert!(!standing.contains("slew"), "{standing}");
    // It travels, and the arm does nothing.
    let travelling = note("hard_brake.mcap").unwrap();
    for joint in ["slew", "lift", "tilt", "extension"] {
        assert!(travelling.contains(joint), "{travelling}");
    }
    assert!(!travelling.contains("direction of travel"), "{travelling}");
}

#[test]
fn good_logs_contradict_nothing() {
    let folder = std::fs::read_dir(data("")).unwrap();
    let logs = folder.map(|entry| entry.unwrap().path());
    let mut logs: Vec<_> = logs
        .filter(|path| path.extension().is_some_and(|e| e == "mcap"))
        .collect();
    logs.push(data(LIFT.log));
    logs.sort();
    assert!(logs.len() > 35);
    for log in logs {
        let stem = log.file_stem().unwrap().to_string_lossy().into_owned();
        let own = log.with_file_name(format!("{}.toml", stem.trim_end_matches("_clean")));
        let machine = if own.exists() {
            own
        } else {
            data("coverage.toml")
        };
        let found = contradictions(&analysed_with(&log, &machine, Options::default()));
        assert!(found.is_empty(), "{}: {found:?}", log.display());
    }
}

mod needs_shared {
    use super::*;
    use tipwatch_tests::beside;

    #[test]
    #[ignore = "needs ../shared"]
    fn simulated_and_real_logs_contradict_nothing() {
        for name in [
            "drive_brake",
            "drive_brake_clean",
            "flat_arm",
            "flat_arm_clean",
        ] {
            let log = beside(&format!("sim/{name}.mcap"));
            let found = contradictions(&analysed(&log, Options::default()));
            assert!(found.is_empty(), "{name}: {found:?}");
        }
        for (log, machine) in [
            ("real/abitobot", "abitobot.toml"),
            ("real/turtlebot3", "turtlebot3.toml"),
        ] {
            let analysis = analysed_with(&beside(log), &data(machine), Options::default());
            let found = contradictions(&analysis);
            assert!(found.is_empty(), "{log}: {found:?}");
        }
    }
}

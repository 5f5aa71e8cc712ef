//! Safe is earned: what a commissioning or the motion has proven, and what a verdict is without it.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_binding::{Commissioning, CommissioningItem, MachineFile, sha256};
use tipwatch_mechanics::machine::Proof;
use tipwatch_mechanics::verdict::{Basis, Level};

use tipwatch_tests::data;

/// A copy of the machine file of a log with these changes, beside its URDF.
fn machine(name: &str, edit: impl Fn(String) -> String) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let source = data(name);
    let copy = |extension: &str| {
        let name = source.file_name().unwrap();
        folder.path().join(name).with_extension(extension)
    };
    fs::copy(source.with_extension("urdf"), copy("urdf")).unwrap();
    let text = fs::read_to_string(source.with_extension("toml")).unwrap();
    fs::write(copy("toml"), edit(text)).unwrap();
    let path = copy("toml");
    (folder, path)
}

/// A commissioning in which every item is proven, but for those that `open` names.
fn commission(path: &Path, open: &[&str]) {
    let file = MachineFile::read(path).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    let machine = file.check_alone().unwrap();
    let mut keys: Vec<String> = [
        "imu.specific_force.scale",
        "imu.mounting.up",
        "imu.mounting.forward",
        "imu.mounting.tilt",
        "imu.angular_velocity.yaw",
        "imu.angular_velocity.roll_pitch",
        "travel.forward",
    ]
    .map(String::from)
    .into();
    for joint in machine.joints() {
        let parts = ["sign", "scale", "velocity"];
        keys.extend(parts.map(|part| format!("joint.{}.{part}", joint.name)));
    }
    let item = |key: String| CommissioningItem {
        status: match open.contains(&key.as_str()) {
            true => "not_shown".into(),
            false => "proven".into(),
        },
        key,
        value: None,
        sigma: None,
        expected: None,
        excluded_sigmas: None,
        text: String::new(),
    };
    let mut made = Commissioning {
        schema: 1,
        machine: machine.name().into(),
        machine_file_sha256: sha256(file.text.as_bytes()),
        urdf_sha256: sha256(urdf.text.as_bytes()),
        tipwatch_version: "test".into(),
        source: "test".into(),
        source_sha256: String::new(),
        made_at: "2026-01-01T00:00:00Z".into(),
        duration_s: 60.0,
        items: keys.into_iter().map(item).collect(),
        explanations: Vec::new(),
        seal: String::new(),
    };
    made.seal = sha256(made.to_json().as_bytes());
    fs::write(path.with_file_name("commissioning.json"), made.to_json()).unwrap();
}

fn named(text: String) -> String {
    format!("commissioning = \"commissioning.json\"\n{text}")
}

fn on_plane_ground(text: String) -> String {
    text.replace("[contact]\n", "[contact]\nground = \"plane\"\n")
}

fn causal(log: &str, machine: &Path) -> Analysis {
    let options = Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    let file = MachineFile::read(machine).unwrap();
    analyse(&data(log), &file, options, &mut |_| {}).unwrap()
}

/// Number of rows at each level.
fn count(analysis: &Analysis, level: Level) -> usize {
    let verdicts = &analysis.rows.verdicts.as_ref().unwrap().verdicts;
    verdicts.iter().filter(|v| v.level == level).count()
}

// requirement: TW-VERDICT-28
#[test]
fn commissioned_machine_on_plane_ground_is_safe_and_no_other() {
    let log = "commissioning.mcap";
    let (_folder, path) = machine(log, |text| named(on_plane_ground(text)));
    commission(&path, &[]);
    let good = causal(log, &path);
    let (safe, assumed) = (count(&good, Level::Safe), count(&good, Level::Assumed));
    assert!(
        safe > good.rows.len() / 2 && assumed == 0,
        "{safe} {assumed}"
    );
    assert_eq!(count(&good, Level::Fault), 0);
    let verdicts = &good.rows.verdicts.as_ref().unwrap().verdicts;
    for verdict in verdicts.iter().filter(|v| v.level == Level::Safe) {
        assert_eq!(verdict.basis, Basis::Proven);
        assert!(verdict.unproven.is_empty());
    }
    // each thing that is missing takes the proof away, and not the alarm
    type Change = (&'static [&'static str], bool, Proof);
    let missing: [Change; 3] = [
        (&["imu.mounting.up"], true, Proof::SpecificForce),
        (&["joint.slew.scale"], true, Proof::Joint(usize::MAX)),
        (&[], false, Proof::Ground),
    ];
    for (open, is_plane, proof) in missing {
        let (_folder, path) = machine(log, |text| match is_plane {
            true => named(on_plane_ground(text)),
            false => named(text),
        });
        commission(&path, open);
        let found = causal(log, &path);
        let verdicts = &found.rows.verdicts.as_ref().unwrap().verdicts;
        // the motion may prove a joint later
        let (first, before) = (&verdicts[30], &verdicts[..30]);
        assert!(before.iter().all(|v| v.level != Level::Safe), "{open:?}");
        let proof = match proof {
            Proof::Joint(_) => {
                let joints = found.machine.joints();
                Proof::Joint(joints.iter().position(|j| j.name == "slew").unwrap())
            }
            other => other,
        };
        assert!(first.unproven.has(proof), "{proof:?}: {:?}", first.unproven);
        // other ground is another split of the load
        for (a, b) in verdicts[..if is_plane { verdicts.len() } else { 0 }]
            .iter()
            .zip(&good.rows.verdicts.as_ref().unwrap().verdicts)
        {
            let is_calm = |level: Level| level.sees_no_danger();
            assert_eq!(is_calm(a.level), is_calm(b.level));
        }
    }
}

/// A drive made to move everything proves joints and gyro by itself, and never the mounting of the accelerometer.
// requirement: TW-VERDICT-28
#[test]
fn motion_proves_what_it_shows() {
    let log = "commissioning.mcap";
    let (_folder, path) = machine(log, on_plane_ground);
    let found = causal(log, &path);
    let verdicts = &found.rows.verdicts.as_ref().unwrap().verdicts;
    let joints = found.machine.joints();
    let names = |row: usize| verdicts[row].unproven.names(&found.machine);
    let (first, last) = (names(0), names(verdicts.len() - 1));
    for joint in ["slew", "lift", "tilt", "extension"] {
        assert!(joints.iter().any(|it| it.name == joint));
        assert!(first.contains(&format!("joint.{joint}")), "{first:?}");
    }
    assert!(last.len() < first.len(), "{first:?} {last:?}");
    assert!(last.contains(&"imu.specific_force".to_owned()), "{last:?}");
    assert_eq!(count(&found, Level::Safe), 0);
    assert!(count(&found, Level::Assumed) > 0);
}

#[test]
fn what_no_load_hangs_on_needs_no_proof() {
    let (_folder, path) = machine("tiny.mcap", |text| text);
    let file = MachineFile::read(&path).unwrap();
    let mut machine = file.check_alone().unwrap();
    machine.set_reference_loads().unwrap();
    let sensors = tipwatch_mechanics::state::Sensors {
        joints: Vec::new(),
        imu: true,
        odometry: true,
        tool_wrench: false,
        actuators: Vec::new(),
    };
    let needed = machine.needed_proofs(&sensors).names(&machine);
    let expected = [
        "imu.specific_force",
        "imu.angular_velocity",
        "ground",
        "joint.extension",
        "joint.lift",
        "joint.slew",
        "joint.tilt",
    ];
    let mut sorted = needed.clone();
    sorted[3..].sort();
    assert_eq!(sorted, expected, "{needed:?}");
}

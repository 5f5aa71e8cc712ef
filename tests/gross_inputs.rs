//! Gross inputs: signals in other units and impossible machines, made from small logs. Nothing is concluded from
//! them, and what is only unusual is no gross input.

use std::process::Command;

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::inputs::GrossInputKind;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::report::findings;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{LogFacts, Machine};
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::Level;
use tipwatch_mechanics::{MachineError, MachineSpec, Quantity, State};
use tipwatch_tests::{Values, analysed_with, data, write_edited, write_edited_without};

/// An edit of a message's values.
type Edit = fn(&mut Values<'_>);

const RAD_TO_DEG: f64 = 57.295_779_513;
const ARM: [&str; 3] = ["slew", "lift", "tilt"];
const AXES: [&str; 3] = ["x", "y", "z"];
const QUATERNION: [&str; 4] = ["x", "y", "z", "w"];

/// A fault in every message of a log, and the gross input that it is.
struct Case {
    name: &'static str,
    log: &'static str,
    edit: Edit,
    kind: GrossInputKind,
    /// A word of the headline or the correction.
    says: &'static str,
}

fn scale_force(values: &mut Values<'_>, factor: f64) {
    scale(values, "/imu/data", &["force"], &AXES, factor);
}

fn scale_joints(values: &mut Values<'_>, lists: &[&str], names: &[&str], factor: f64) {
    scale(values, "/joint_states", lists, names, factor);
}

/// Multiplies numbers of the messages of a topic.
fn scale(values: &mut Values<'_>, topic: &str, lists: &[&str], names: &[&str], factor: f64) {
    if values.topic == topic {
        for list in lists {
            for name in names {
                values.scale(&format!("{list}.{name}"), factor);
            }
        }
    }
}

fn gravity_removed(values: &mut Values<'_>) {
    if values.topic == "/imu/data" {
        let [x, y, z, w] = QUATERNION.map(|part| values.get(&format!("attitude.{part}")));
        let up = [
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        ];
        for (axis, up) in AXES.iter().zip(up) {
            values.shift(&format!("force.{axis}"), -9.8066 * up);
        }
    }
}

fn attitude_down(values: &mut Values<'_>) {
    if values.topic == "/imu/data" {
        let [x, y, z, w] = QUATERNION.map(|part| values.get(&format!("attitude.{part}")));
        for (part, value) in [("x", w), ("y", z), ("z", -y), ("w", -x)] {
            values.set(&format!("attitude.{part}"), value);
        }
    }
}

fn wheels_exchanged(values: &mut Values<'_>) {
    if values.topic == "/joint_states" {
        for axle in ["f", "r"] {
            for list in ["position", "velocity"] {
                let [left, right] = ["l", "r"].map(|side| format!("{list}.wheel_{axle}{side}"));
                values.exchange(&left, &right);
            }
        }
    }
}

fn force_turned(values: &mut Values<'_>) {
    if values.topic == "/imu/data" {
        let [y, z] = [values.get("force.y"), values.get("force.z")];
        values.set("force.y", z);
        values.set("force.z", -y);
    }
}

/// One fault a row: the log, the gross input, a word of its headline or correction, the name, the change.
macro_rules! cases {
    ($($log:ident $kind:ident $says:literal $name:literal $edit:expr;)*) => {
        &[$(Case {
            name: $name,
            log: stringify!($log),
            edit: $edit,
            kind: GrossInputKind::$kind,
            says: $says,
        }),*]
    };
}

const BOTH: [&str; 2] = ["position", "velocity"];
const WHEELS: [&str; 4] = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];
const CASES: &[Case] = cases! {
    tiny_lift SpecificForceScale "units of g" "specific force in g" |it| scale_force(it, 1.0 / 9.806_65);
    tiny_lift SpecificForceScale "thousandths of g" "specific force in thousandths of g"
        |it| scale_force(it, 1000.0 / 9.806_65);
    corner_brake SpecificForceScale "feet" "specific force in feet per second squared, machine in motion"
        |it| scale_force(it, 1.0 / 0.3048);
    tiny_lift SpecificForceScale "scale = 1.2" "specific force of a wrong scale" |it| scale_force(it, 0.8);
    tiny_lift SpecificForceScale "gravity seems to be removed" "gravity removed" gravity_removed;
    tiny_lift SpecificForceDirection "opposite sign" "specific force of the opposite sign" |it| scale_force(it, -1.0);
    corner_brake AngularVelocityScale "degrees per second" "angular velocity in degrees per second"
        |it| scale(it, "/imu/data", &["turning"], &AXES, RAD_TO_DEG);
    tiny_lift JointPositionScale "degrees" "joint positions in degrees"
        |it| scale_joints(it, &["position"], &ARM, RAD_TO_DEG);
    tiny_lift JointPositionScale "degrees" "joint positions and velocities in degrees"
        |it| scale_joints(it, &BOTH, &ARM, RAD_TO_DEG);
    tiny_lift JointVelocityScale "degrees per second" "joint velocities in degrees per second"
        |it| scale_joints(it, &["velocity"], &ARM, RAD_TO_DEG);
    tiny_lift JointVelocityScale "opposite sign" "joint velocities of the opposite sign"
        |it| scale_joints(it, &["velocity"], &ARM, -1.0);
    tiny_lift JointPositionScale "millimetres" "a stroke in millimetres"
        |it| scale_joints(it, &BOTH, &["extension"], 1000.0);
    tiny_lift Attitude "length 1" "quaternions that are not of unit length"
        |it| scale(it, "/imu/data", &["attitude"], &QUATERNION, 3.0);
    tiny_lift Attitude "where up is" "an attitude whose z axis points down" attitude_down;
    corner_brake OdometryScale "kilometres per hour" "odometry in kilometres per hour"
        |it| scale(it, "/odom", &["velocity"], &["x"], 3.6);
    corner_brake OdometryScale "millimetres per second" "odometry in millimetres per second"
        |it| scale(it, "/odom", &["velocity"], &["x"], 1000.0);
    corner_brake JointVelocityScale "revolutions per minute" "wheel velocities in revolutions per minute"
        |it| scale_joints(it, &["velocity"], &WHEELS, 9.549_3);
    corner_brake WheelsExchanged "exchanged" "left and right wheels exchanged" wheels_exchanged;
    tiny_lift Attitude "where up is" "a specific force turned to the side" force_turned;
};

fn edited(folder: &TempDir, log: &str, edit: Edit) -> Analysis {
    let path = folder.path().join("edited.mcap");
    let from = data(&format!("{log}.mcap"));
    write_edited(&from, &path, &mut |_, values| edit(values));
    analysed_with(&path, &data(&format!("{log}.toml")), Options::default())
}

// requirement: TW-VERDICT-13
#[test]
fn nothing_is_concluded_from_signals_in_other_units() {
    let mut missed = Vec::new();
    for case in CASES {
        let folder = TempDir::new().unwrap();
        let analysis = edited(&folder, case.log, case.edit);
        let gross = &analysis.gross_inputs;
        let fits = |input: &&tipwatch_analyze::analysis::inputs::GrossInput| {
            input.kind == case.kind
                && (input.headline.contains(case.says) || input.fix.contains(case.says))
        };
        if !gross.iter().any(|input| fits(&input)) {
            missed.push(format!("{}: {gross:?}", case.name));
            continue;
        }
        let claims = (analysis.events.iter())
            .filter(|event| event.kind.is_stability())
            .count();
        let is_marked = |row: usize| analysis.rows.reasons[row].has(Reason::GrossInput);
        let all_marked = (0..analysis.rows.len()).all(is_marked);
        let verdicts = &analysis.rows.whole().verdicts.as_ref().unwrap().verdicts;
        let all_fault = verdicts.iter().all(|verdict| verdict.level == Level::Fault);
        let first = &findings(&analysis)[0];
        let is_first = first.headline.contains(&gross[0].headline)
            && first.evidence.last().unwrap().contains(&gross[0].fix);
        if claims > 0 || !all_marked || !all_fault || !is_first {
            missed.push(format!(
                "{}: {claims} {all_marked} {all_fault} {first}",
                case.name
            ));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}

#[test]
fn good_and_unusual_logs_have_no_gross_input() {
    for log in [
        "tiny",
        "tiny_lift",
        "corner_brake",
        "hard_brake",
        "swing_lift",
        "second_paper",
    ] {
        let analysis = edited(&TempDir::new().unwrap(), log, |_| ());
        assert_eq!(analysis.gross_inputs, [], "{log}");
    }
    let unusual: [(&str, Edit); 4] = [
        ("encoders with a wrong zero", |it| {
            if it.topic == "/joint_states" {
                it.shift("position.steer_fl", 10.4);
            }
        }),
        ("a slewing joint that is one turn further", |it| {
            if it.topic == "/joint_states" {
                it.shift("position.slew", std::f64::consts::TAU);
            }
        }),
        ("an accelerometer with a bias of 0.3 m/s^2", |it| {
            if it.topic == "/imu/data" {
                it.shift("force.z", 0.3);
            }
        }),
        ("a slope of 20 degrees more", |it| {
            if it.topic == "/imu/data" {
                let [y, z] = [it.get("force.y"), it.get("force.z")];
                let (sin, cos) = 20.0_f64.to_radians().sin_cos();
                it.set("force.y", cos * y - sin * z);
                it.set("force.z", sin * y + cos * z);
            }
        }),
    ];
    for (name, edit) in unusual {
        let analysis = edited(&TempDir::new().unwrap(), "tiny", edit);
        assert_eq!(analysis.gross_inputs, [], "{name}");
    }
}

/// An analysis with a changed machine file.
fn with_machine_text(log: &str, change: impl Fn(String) -> String) -> Analysis {
    let path = data(&format!("{log}.toml"));
    let text = change(std::fs::read_to_string(&path).unwrap());
    let file = MachineFile::from_text(&path, &text).unwrap();
    let log = data(&format!("{log}.mcap"));
    analyse(&log, &file, Options::default(), &mut |_| {}).unwrap()
}

#[test]
fn angles_beyond_a_full_circle_are_told() {
    let with_angles = |scale: f64| {
        with_machine_text("tiny", |text| {
            let field = |field: &str, scale: f64| {
                format!("{{ topic = \"/imu/data\", field = \"{field}\", scale = {scale:?} }}")
            };
            let triple = |list: &str| {
                let of = |axis: &str| field(&format!("{list}.{axis}"), 1.0);
                format!("[{}, {}, {}]", of("x"), of("y"), of("z"))
            };
            // for small angles twice the vector of the quaternion
            let angles =
                ["x", "y", "z"].map(|axis| field(&format!("orientation.{axis}"), 2.0 * scale));
            let imu = format!(
                "imu = {{ specific_force = {}, angular_velocity = {}, roll_pitch_yaw = [{}] }}",
                triple("linear_acceleration"),
                triple("angular_velocity"),
                angles.join(", ")
            );
            text.replace("imu = \"/imu/data\"", &imu)
        })
    };
    assert_eq!(with_angles(1.0).gross_inputs, []);
    let gross = with_angles(180.0 * RAD_TO_DEG).gross_inputs;
    let angles = gross
        .iter()
        .find(|input| input.headline.contains("roll_pitch_yaw"));
    let angles = angles.unwrap_or_else(|| panic!("{gross:?}"));
    assert_eq!(angles.kind, GrossInputKind::Attitude);
    assert!(angles.fix.contains("0.0174533"), "{}", angles.fix);
}

fn planar(values: &mut Values<'_>) {
    if ["/imu/data", "/odom"].contains(&values.topic) {
        let [z, w] = ["z", "w"].map(|part| values.get(&format!("attitude.{part}")));
        let length = z.hypot(w);
        for (part, value) in [("x", 0.0), ("y", 0.0), ("z", z / length), ("w", w / length)] {
            values.set(&format!("attitude.{part}"), value);
        }
    }
}

#[test]
fn exactly_planar_attitude_leaves_the_slope_unknown() {
    let folder = TempDir::new().unwrap();
    let analysis = edited(&folder, "tiny_lift", planar);
    assert_eq!(analysis.gross_inputs, []);
    assert!(
        analysis
            .notes
            .iter()
            .any(|note| note.contains("unknown, not 0 degrees"))
    );
    let mut state = State::zero(&analysis.machine);
    analysis.rows.state(100, &mut state);
    assert_eq!(state.base.known_up(), None);
    // loads follow from the specific force
    let whole = analysed_with(
        &data("tiny_lift.mcap"),
        &data("tiny_lift.toml"),
        Options::default(),
    );
    let load = |analysis: &Analysis| {
        analysis
            .rows
            .whole()
            .outcomes
            .column(Quantity::Load(0))
            .to_vec()
    };
    // but for the bias of the accelerometer, which an attitude helps to find
    for (without, with) in load(&analysis).iter().zip(load(&whole)) {
        assert!((without - with).abs() < 2e-3 * with, "{without} {with}");
    }
    assert!(
        analysis
            .events
            .iter()
            .any(|event| event.kind.is_stability())
    );
}

#[test]
fn planar_odometry_in_place_of_an_imu_is_not_level_ground() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("edited.mcap");
    let machine = folder.path().join("machine.toml");
    let text = std::fs::read_to_string(data("tiny_lift.toml")).unwrap();
    let text = text
        .replace("imu = \"/imu/data\"\n", "")
        .replace("tiny_lift.urdf", data("tiny_lift.urdf").to_str().unwrap());
    std::fs::write(&machine, text).unwrap();
    for (edit, kinds) in [
        (planar as Edit, vec![GrossInputKind::SlopeUnknown]),
        (|_| (), vec![]),
    ] {
        write_edited_without(&data("tiny_lift.mcap"), &path, "/imu/data", &mut |_, v| {
            edit(v);
        });
        let analysis = analysed_with(&path, &machine, Options::default());
        let found: Vec<_> = analysis
            .gross_inputs
            .iter()
            .map(|input| input.kind)
            .collect();
        assert_eq!(found, kinds);
        let load = analysis.rows.whole().outcomes.column(Quantity::Load(0));
        assert_eq!(load.iter().any(|load| load.is_finite()), kinds.is_empty());
    }
}

#[test]
fn the_program_tells_gross_inputs_first_and_fails() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("edited.mcap");
    write_edited(&data("tiny_lift.mcap"), &path, &mut |_, values| {
        scale_force(values, 1.0 / 9.806_65);
    });
    let out = folder.path().join("out");
    let output = Command::new(env!("CARGO_BIN_EXE_programs"))
        .args(["tipwatch", "analyze"])
        .arg(&path)
        .arg("--machine")
        .arg(data("tiny_lift.toml"))
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_ne!(output.status.code(), Some(0), "{told}");
    let first = told.lines().find(|line| line.starts_with("- ")).unwrap();
    assert!(
        first.contains("No conclusion is possible") && first.contains("units of g"),
        "{told}"
    );
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["gross_inputs"][0]["kind"], "specific_force_scale");
    assert!(
        summary["gross_inputs"][0]["fix"]
            .as_str()
            .unwrap()
            .contains("9.80665")
    );
    assert_eq!(summary["rows"]["valid"], 0);
    assert!(summary["wheels"]["rl"]["least_otf_n"].is_null());
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("No conclusion is possible"));
}

/// The machine of `tiny_lift` with changed texts.
fn machine(toml: &[(&str, &str)], urdf: &[(&str, &str)]) -> Result<Machine, MachineError> {
    let read = |name: &str, changes: &[(&str, &str)]| {
        let mut text = std::fs::read_to_string(data(name)).unwrap();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        text
    };
    let spec = MachineSpec::from_toml(&read("tiny_lift.toml", toml), "machine.toml").unwrap();
    spec.check(
        &read("tiny_lift.urdf", urdf),
        "machine.urdf",
        LogFacts::default(),
    )
}

const BASE_INERTIAL: &str = "<inertial><origin xyz='0 0 0' rpy='0 0 0'/><mass value='2200.0'/><inertia ixx='480.0' ixy='0.0' ixz='12.0' iyy='980.0' iyz='6.0' izz='1224.0'/></inertial>";

/// Replacements in a text.
type Changes = &'static [(&'static str, &'static str)];

#[test]
fn impossible_machines_are_refused_with_the_likely_correction() {
    let cases: [(&str, Changes, Changes, &[&str]); 14] = [
        (
            "radius in mm",
            &[("radius = 0.35", "radius = 350")],
            &[],
            &["wheels.FL.radius", "millimetres", "0.35"],
        ),
        (
            "radius in inches",
            &[("radius = 0.35", "radius = 13.78")],
            &[],
            &["inches", "0.35"],
        ),
        (
            "a diameter",
            &[("radius = 0.35", "radius = 0.7")],
            &[],
            &["diameter", "0.35"],
        ),
        (
            "radius in mm without a shape",
            &[("radius = 0.35", "radius = 350")],
            &[(
                "<cylinder radius='0.35' length='0.24'/>",
                "<box size='1 1 1'/>",
            )],
            &["distance between the wheels", "0.35"],
        ),
        (
            "overlapping wheels",
            &[("radius = 0.35", "radius = 1.6")],
            &[(
                "<cylinder radius='0.35' length='0.24'/>",
                "<box size='1 1 1'/>",
            )],
            &["not to overlap"],
        ),
        (
            "two wheels on one link",
            &[("wheel_rr", "wheel_rl")],
            &[],
            &["wheels.RR.link", "wheel_rl", "RL"],
        ),
        (
            "left and right mixed up",
            &[
                ("wheel_fl", "x"),
                ("wheel_fr", "wheel_fl"),
                ("\"x\"", "\"wheel_fr\""),
            ],
            &[],
            &["on the left", "on the right"],
        ),
        (
            "front and rear mixed up",
            &[
                ("wheel_fl", "x"),
                ("wheel_rl", "wheel_fl"),
                ("\"x\"", "\"wheel_rl\""),
                ("wheel_fr", "y"),
                ("wheel_rr", "wheel_fr"),
                ("\"y\"", "\"wheel_rr\""),
            ],
            &[],
            &["named front", "x points forward"],
        ),
        (
            "a base without inertial",
            &[],
            &[(BASE_INERTIAL, "")],
            &["base_link", "a base with mass", "<inertial>"],
        ),
        (
            "a base of a gram",
            &[],
            &[(
                "<mass value='2200.0'/><inertia ixx='480.0' ixy='0.0' ixz='12.0' iyy='980.0' iyz='6.0' izz='1224.0'/>",
                "<mass value='0.001'/><inertia ixx='0.0001' ixy='0' ixz='0' iyy='0.0001' iyz='0' izz='0.0001'/>",
            )],
            &["a base with mass"],
        ),
        (
            "a mass without inertia",
            &[],
            &[(
                "<inertia ixx='480.0' ixy='0.0' ixz='12.0' iyy='980.0' iyz='6.0' izz='1224.0'/>",
                "",
            )],
            &["base_link", "an inertia for its mass"],
        ),
        (
            "22 g with 1 kg m^2",
            &[],
            &[(
                "<mass value='60.0'/><inertia ixx='2.15' ixy='0.0' ixz='0.0' iyy='3.675' iyz='0.0' izz='2.15'/>",
                "<mass value='0.022'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>",
            )],
            &["wheel_fl", "radius of gyration of 6.74 m"],
        ),
        (
            "wheels placed in mm",
            &[],
            &[
                ("xyz='1.15 0.875", "xyz='1150 875"),
                ("xyz='1.15 -0.875", "xyz='1150 -875"),
                ("xyz='-1.15 0.875", "xyz='-1150 875"),
                ("xyz='-1.15 -0.875", "xyz='-1150 -875"),
            ],
            &["wheels", "m apart", "another unit"],
        ),
        (
            "an arm placed in mm",
            &[],
            &[("xyz='0.5 0 0.25'", "xyz='500 0 250'")],
            &["arm_slew", "millimetres"],
        ),
    ];
    machine(&[], &[]).unwrap();
    for (name, toml, urdf, words) in cases {
        let error = machine(toml, urdf).expect_err(name).to_string();
        for word in words {
            assert!(error.contains(word), "{name}: {word}: {error}");
        }
    }
}

#[test]
fn unusual_machines_are_accepted() {
    let cases: [(&str, Changes, Changes); 5] = [
        (
            "a tyre larger than its rim",
            &[("radius = 0.35", "radius = 0.5")],
            &[],
        ),
        (
            "wheels without sides in their names",
            &[("[wheels.FL]", "[wheels.a]"), ("[wheels.FR]", "[wheels.b]")],
            &[],
        ),
        (
            "a light sensor without inertia",
            &[],
            &[(
                "<mass value='0.001'/><inertia ixx='0.001' ixy='0.0' ixz='0.0' iyy='0.001' iyz='0.0' izz='0.001'/>",
                "<mass value='0.2'/>",
            )],
        ),
        (
            "a heavy base",
            &[],
            &[("<mass value='2200.0'/>", "<mass value='20000.0'/>")],
        ),
        (
            "a placeholder inertia",
            &[],
            &[(
                "<mass value='0.001'/><inertia ixx='0.001' ixy='0.0' ixz='0.0' iyy='0.001' iyz='0.0' izz='0.001'/>",
                "<mass value='0.0001'/><inertia ixx='0.005' ixy='0' ixz='0' iyy='0.005' iyz='0' izz='0.005'/>",
            )],
        ),
    ];
    for (name, toml, urdf) in cases {
        let machine = machine(toml, urdf);
        assert!(machine.is_ok(), "{name}: {:?}", machine.err());
    }
}

#[test]
fn a_machine_that_rests_where_it_would_tip_over_is_told() {
    let folder = TempDir::new().unwrap();
    let urdf = std::fs::read_to_string(data("folded_arm.urdf"));
    // the chassis' centre of mass three metres to the left of where it is
    let urdf = urdf.unwrap();
    let moved = urdf.replacen(
        "<origin xyz='0.3 0.0 0.12'",
        "<origin xyz='0.3 3.0 0.12'",
        1,
    );
    assert_ne!(urdf, moved);
    std::fs::write(folder.path().join("moved.urdf"), moved).unwrap();
    let text = std::fs::read_to_string(data("folded_arm.toml")).unwrap();
    let machine = folder.path().join("machine.toml");
    std::fs::write(&machine, text.replace("folded_arm.urdf", "moved.urdf")).unwrap();
    let analysis = analysed_with(&data("folded_arm.mcap"), &machine, Options::default());
    let found: Vec<_> = analysis
        .gross_inputs
        .iter()
        .map(|input| input.kind)
        .collect();
    assert_eq!(
        found,
        [GrossInputKind::RestsWhileTipping],
        "{:?}",
        analysis.gross_inputs
    );
    assert!(
        analysis
            .events
            .iter()
            .all(|event| !event.kind.is_stability())
    );
}

#[test]
fn forces_of_jacks_in_another_unit_lift_nothing() {
    let with_jacks = |scale: f64| {
        with_machine_text("crane", |text| {
            let mut text = text;
            for k in 0..4 {
                let field =
                    format!("force = {{ topic = \"/outriggers/force\", field = \"data[{k}]\"");
                assert!(text.contains(&field));
                text = text.replace(&field, &format!("{field}, scale = {scale:?}"));
            }
            text
        })
    };
    assert_eq!(with_jacks(1.0).gross_inputs, []);
    for (scale, says) in [
        (0.001, "kN"),
        (1.0 / 9.806_65, "kg"),
        (-1.0, "negative scale"),
    ] {
        let analysis = with_jacks(scale);
        let [input] = analysis.gross_inputs.as_slice() else {
            panic!("{scale}: {:?}", analysis.gross_inputs);
        };
        assert_eq!(input.kind, GrossInputKind::ActuatorScale);
        assert!(input.fix.contains(says), "{scale}: {input:?}");
        let claims = analysis.events.iter();
        let claims = claims.filter(|event| event.kind.is_stability());
        assert_eq!(claims.count(), 0, "{scale}");
    }
}

#[test]
fn a_gyro_that_is_marked_as_not_measured_is_told_as_missing() {
    let folder = TempDir::new().unwrap();
    let analysis = edited(&folder, "tiny_lift", |values| {
        if values.topic == "/imu/data" {
            values.set("turning.covariance", -1.0);
            for axis in AXES {
                values.set(&format!("turning.{axis}"), 0.0);
            }
        }
    });
    let notes: Vec<&str> = analysis.notes.iter().map(|note| &**note).collect();
    let told = notes
        .iter()
        .filter(|note| note.contains("no message gives the angular velocity"));
    assert_eq!(told.count(), 1, "{notes:?}");
    let findings: Vec<String> = findings(&analysis)
        .iter()
        .map(ToString::to_string)
        .collect();
    assert!(
        !findings.iter().any(|text| text.contains("Frozen")),
        "{findings:?}"
    );
    assert!(analysis.undecided(0.5).is_some());
}

//! Commissioning: a good drive proves every sensor; a wrong one is contradicted with its correction, or not shown, and
//! never proven.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tipwatch_binding::{MachineFile, arrivals, bind};
use tipwatch_calibration::commissioning::{Answers, Assessment, Item, Recording, Status, assess};
use tipwatch_ingest::Log;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{Commissioned, Proof};
use tipwatch_mechanics::state::{Sample, Sensor, Sensors};

/// A machine and the samples of its drive.
struct Drive {
    machine: Machine,
    sensors: Sensors,
    samples: Vec<(Sensor, i64, Vec<f64>)>,
}

static STEERED: LazyLock<Drive> = LazyLock::new(|| drive("commissioning"));
static WIDE: LazyLock<Drive> = LazyLock::new(|| drive("commissioning_wide"));
static BOGIE: LazyLock<Drive> = LazyLock::new(|| drive("commissioning_bogie"));

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../tests/data")
        .join(name)
}

fn drive(name: &str) -> Drive {
    read(
        &data(&format!("{name}.mcap")),
        &data(&format!("{name}.toml")),
    )
}

fn read(log: &Path, machine: &Path) -> Drive {
    let file = MachineFile::read(machine).unwrap();
    let log = Log::open(log).unwrap();
    let urdf = file.urdf(None, Some(&log)).unwrap();
    let bound = bind(&log, &file.spec, &urdf.text, &urdf.name).unwrap();
    let (columns, _) = bound.record(&log, &mut |_| {}).unwrap();
    let sensors = bound.sensors.iter().map(|bound| bound.sensor);
    let samples = arrivals(sensors.zip(&columns).collect());
    Drive {
        samples: samples
            .map(|(s, _)| (s.sensor, s.stamp_ns, s.values.to_vec()))
            .collect(),
        sensors: bound.matched.sensors.clone(),
        machine: bound.machine,
    }
}

/// Context of an edit of a sample.
struct At<'a> {
    drive: &'a Drive,
    /// Seconds since the first sample.
    time_s: f64,
}

impl At<'_> {
    /// Column of a joint's position.
    fn column(&self, name: &str) -> usize {
        let joints = &self.drive.sensors.joints[0].joints;
        let is_it = |joint: &&usize| self.drive.machine.joints()[**joint].name == name;
        let found = joints.iter().find(is_it).unwrap();
        joints.iter().position(|joint| joint == found).unwrap()
    }

    fn joints(&self) -> usize {
        self.drive.sensors.joints[0].joints.len()
    }
}

/// Assesses the drive with every sample changed; `false` drops it.
fn assessed(
    drive: &Drive,
    edit: &mut dyn FnMut(&At<'_>, Sensor, &mut Vec<f64>) -> bool,
) -> Assessment {
    let mut recording = Recording::new(&drive.sensors);
    let start_ns = drive.samples[0].1;
    for (sensor, stamp_ns, values) in &drive.samples {
        let mut values = values.clone();
        let at = At {
            drive,
            time_s: (stamp_ns - start_ns) as f64 * 1e-9,
        };
        if edit(&at, *sensor, &mut values) {
            let sample = Sample::new(*sensor, *stamp_ns, &values);
            let _ = recording.push(&sample);
        }
    }
    assess(&drive.machine, &drive.sensors, &recording, &Answers::new())
}

fn item<'a>(assessment: &'a Assessment, key: &str) -> &'a Item {
    let found = assessment.items.iter().find(|item| item.key == key);
    found.unwrap_or_else(|| panic!("no item {key}"))
}

/// All items as lines, for a failed assertion.
fn told(assessment: &Assessment) -> String {
    let line = |item: &Item| format!("{} {}: {}\n", item.key, item.status, item.text);
    let items: String = assessment.items.iter().map(line).collect();
    format!("{items}{:?}", assessment.explanations)
}

/// Requires that these items are contradicted, that the explanations contain `says`, and that none of `never` is proven.
#[track_caller]
fn assert_contradicted(assessment: &Assessment, keys: &[&str], says: &str) {
    for key in keys {
        assert_eq!(
            item(assessment, key).status,
            Status::Contradicted,
            "{key}\n{}",
            told(assessment)
        );
    }
    let is_said = assessment
        .explanations
        .iter()
        .any(|text| text.contains(says));
    assert!(is_said, "expected \"{says}\"\n{}", told(assessment));
}

fn turn_imu(values: &mut [f64], by: UnitQuaternion<f64>) {
    for at in [0, 3] {
        let turned = by.inverse() * Vector3::new(values[at], values[at + 1], values[at + 2]);
        values[at..at + 3].copy_from_slice(turned.as_slice());
    }
    let attitude = Quaternion::new(values[9], values[6], values[7], values[8]) * by.into_inner();
    values[6..10].copy_from_slice(attitude.coords.as_slice());
}

#[test]
fn a_good_drive_proves_everything() {
    let found = assessed(&STEERED, &mut |_, _, _| true);
    assert!(found.is_complete(), "{}", told(&found));
    assert!(found.items.len() > 30 && found.explanations.is_empty());
    for what in [
        "stand",
        "drive forward",
        "drive backward",
        "brake",
        "circle left",
        "turn right",
        "move slew alone",
        "move lift alone",
    ] {
        assert!(
            found.steps.iter().any(|step| step.what == what),
            "{what}: {:?}",
            found.steps
        );
    }
    for item in &found.items {
        assert!(
            item.figure.is_some() && item.sigmas.is_none_or(|sigmas| sigmas >= 5.0),
            "{item:?}"
        );
    }
}

/// Nothing is said of positions that the drive has not shown.
// requirement: TW-VERDICT-28
#[test]
fn joints_are_proven_where_they_moved_alone() {
    let found = assessed(&STEERED, &mut |_, _, _| true);
    let range = |key: &str| item(&found, key).range;
    // it turns by 25 degrees to both sides
    let top = 25_f64.to_radians();
    let [least, greatest] = range("joint.slew.scale").unwrap();
    assert!((least + top).abs() < 0.03 && (greatest - top).abs() < 0.03);
    assert_eq!(range("joint.slew.sign"), range("joint.slew.scale"));
    let [right, left] = range("joint.steer_fl.steering").unwrap();
    assert!(right < -0.1 && left > 0.1, "{right} {left}");
    for key in ["joint.slew.velocity", "imu.mounting.up"] {
        assert_eq!(range(key), None, "{key}");
    }
    let half = assessed(&STEERED, &mut |at, sensor, values| {
        !matches!(sensor, Sensor::Joints(_)) || values[at.column("slew")] > -0.05
    });
    let shown = item(&half, "joint.slew.scale").range;
    assert!(
        shown.is_none_or(|[least, _]| least > -0.06),
        "{shown:?}\n{}",
        told(&half)
    );
    // a person has seen all that was recorded
    let mut recording = Recording::new(&STEERED.sensors);
    for (sensor, stamp_ns, values) in STEERED.samples.iter().take(400) {
        let _ = recording.push(&Sample::new(*sensor, *stamp_ns, values));
    }
    let answers: Answers = [("joint.slew.scale".to_owned(), true)].into();
    let confirmed = assess(&STEERED.machine, &STEERED.sensors, &recording, &answers);
    let confirmed = item(&confirmed, "joint.slew.scale");
    assert_eq!(confirmed.status, Status::Confirmed);
    let [least, greatest] = confirmed.range.unwrap();
    assert!(greatest - least < 0.1, "it stood: {least} {greatest}");
}

/// The drive by which a machine is to be commissioned goes where its arm works.
// requirement: TW-VERDICT-28
#[test]
fn a_drive_over_the_range_of_the_arm_proves_it_there() {
    let found = assessed(&WIDE, &mut |_, _, _| true);
    assert!(found.is_complete(), "{}", told(&found));
    let all = Proof::all(WIDE.machine.joints().len()).collect();
    let ranges = WIDE.machine.joints().iter().map(|joint| {
        let item = |part: &str| {
            let key = format!("joint.{}.{part}", joint.name);
            found.items.iter().find(|item| item.key == key)
        };
        let it = item("scale").or_else(|| item("steering"))?;
        let ([from, to], [least, greatest]) = (it.range?, it.recorded?);
        assert!(least <= from && to <= greatest, "{}", it.key);
        it.range
    });
    let proven = Commissioned::new(&WIDE.machine, all, ranges.collect());
    let column = |name: &str| {
        let mut joints = WIDE.machine.joints().iter();
        joints.position(|joint| joint.name == name).unwrap()
    };
    for (name, works) in [
        ("slew", [-3.1, 3.1]),
        ("lift", [-1.45, -0.75]),
        ("tilt", [-2.1, -1.65]),
        ("extension", [0.1, 0.7]),
    ] {
        let joint = column(name);
        let nothing: Vec<[f64; 2]> = Vec::new();
        assert_eq!(proven.unproven_within(joint, works), nothing, "{name}");
        // the limits of its URDF are those of no machine
        let limits = WIDE.machine.joints()[joint].limits.unwrap();
        let open = proven.unproven_within(joint, limits);
        assert_eq!(open.len(), if name == "slew" { 0 } else { 2 }, "{name}");
    }
}

#[test]
fn an_imu_turned_by_right_angles_is_named() {
    use std::f64::consts::{FRAC_PI_2, PI};
    for axis in 0..3 {
        for angle in [FRAC_PI_2, PI, -FRAC_PI_2] {
            let mut turn = Vector3::zeros();
            turn[axis] = angle;
            let by = UnitQuaternion::from_scaled_axis(turn);
            let found = assessed(&STEERED, &mut |_, sensor, values| {
                if sensor == Sensor::Imu {
                    turn_imu(values, by);
                }
                true
            });
            let key = if axis == 2 {
                "imu.mounting.forward"
            } else {
                "imu.mounting.up"
            };
            let degrees = angle.abs().to_degrees().round();
            let says = format!("{degrees} degrees about {}", ["x", "y", "z"][axis]);
            assert_contradicted(&found, &[key], &says);
        }
    }
}

#[test]
fn a_housing_turned_by_ten_degrees_is_named() {
    for axis in 0..3 {
        let mut turn = Vector3::zeros();
        turn[axis] = 10_f64.to_radians();
        let by = UnitQuaternion::from_scaled_axis(turn);
        let found = assessed(&STEERED, &mut |_, sensor, values| {
            if sensor == Sensor::Imu {
                turn_imu(values, by);
            }
            true
        });
        let key = if axis == 2 {
            "imu.mounting.forward"
        } else {
            "imu.mounting.tilt"
        };
        assert_eq!(
            item(&found, key).status,
            Status::Contradicted,
            "{axis}\n{}",
            told(&found)
        );
    }
}

fn scale_joint(drive: &Drive, name: &str, factor: f64) -> Assessment {
    assessed(drive, &mut |at, sensor, values| {
        if matches!(sensor, Sensor::Joints(_)) {
            let column = at.column(name);
            values[column] *= factor;
            values[at.joints() + column] *= factor;
        }
        true
    })
}

fn swap_joints(drive: &Drive, [a, b]: [&str; 2]) -> Assessment {
    assessed(drive, &mut |at, sensor, values| {
        if matches!(sensor, Sensor::Joints(_)) {
            let [a, b] = [a, b].map(|name| at.column(name));
            values.swap(a, b);
            values.swap(at.joints() + a, at.joints() + b);
        }
        true
    })
}

const ARM: [&str; 4] = ["slew", "lift", "tilt", "extension"];
const STEER: [&str; 2] = ["steer_fl", "steer_fr"];
const WHEELS: [&str; 4] = ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"];

/// The item that answers for sign and order of a joint.
fn sign(joint: &str) -> String {
    let part = match joint {
        _ if joint.starts_with("wheel") => "rotation",
        _ if joint.starts_with("steer") => "steering",
        _ => "sign",
    };
    format!("joint.{joint}.{part}")
}

#[test]
fn flipped_joints_are_named() {
    for joint in ARM.iter().chain(&STEER).chain(&WHEELS) {
        let found = scale_joint(&STEERED, joint, -1.0);
        let says = format!("joint \"{joint}\" is of the opposite sign");
        assert_contradicted(&found, &[&sign(joint)], &says);
    }
}

#[test]
fn exchanged_joints_are_contradicted_and_never_proven() {
    let all: Vec<&str> = ARM.iter().chain(&STEER).chain(&WHEELS).copied().collect();
    for (place, a) in all.iter().enumerate() {
        for b in &all[place + 1..] {
            let found = swap_joints(&STEERED, [a, b]);
            let both = [a, b].map(|joint| item(&found, &sign(joint)).status);
            assert!(!both.contains(&Status::Proven), "{a} {b}\n{}", told(&found));
            assert!(!found.is_complete(), "{a} {b}\n{}", told(&found));
            assert!(
                found.count(Status::Contradicted) > 0,
                "{a} {b}\n{}",
                told(&found)
            );
            let is_named = found.explanations.iter().any(|text| {
                text.contains(&format!("\"{a}\""))
                    && text.contains(&format!("\"{b}\""))
                    && text.contains("exchanged")
            });
            assert!(
                is_named || found.explanations.is_empty(),
                "{a} {b}\n{}",
                told(&found)
            );
        }
    }
}

#[test]
fn wrong_scales_of_joints_are_contradicted() {
    let degrees = 180.0 / std::f64::consts::PI;
    for (factor, says) in [(degrees, "degrees"), (2.0, "twice"), (0.5, "half")] {
        for joint in ["slew", "steer_fl", "wheel_rl", "tilt"] {
            let found = scale_joint(&STEERED, joint, factor);
            let key = match joint {
                "slew" | "tilt" => format!("joint.{joint}.scale"),
                _ => sign(joint),
            };
            let status = item(&found, &key).status;
            assert_ne!(status, Status::Proven, "{joint} {says}\n{}", told(&found));
            assert!(
                found.count(Status::Contradicted) > 0 || joint == "tilt" || joint == "slew",
                "{joint} {says}\n{}",
                told(&found)
            );
        }
    }
}

#[test]
fn wrong_odometry_and_gyroscopes_are_named() {
    type Edit = fn(&mut [f64]);
    let cases: [(Sensor, Edit, &str, &str); 8] = [
        (
            Sensor::Odometry,
            |v| v[..3].iter_mut().for_each(|v| *v = -*v),
            "odometry.velocity",
            "the odometry's velocity is of the opposite sign",
        ),
        (
            Sensor::Odometry,
            |v| v[..3].iter_mut().for_each(|v| *v *= 2.0),
            "odometry.velocity",
            "the odometry's velocity is twice",
        ),
        (
            Sensor::Odometry,
            |v| v[..3].iter_mut().for_each(|v| *v *= 3.6),
            "odometry.velocity",
            "kilometres per hour",
        ),
        (
            Sensor::Odometry,
            |v| v[5] = -v[5],
            "odometry.angular_velocity",
            "the odometry's angular velocity",
        ),
        (
            Sensor::Imu,
            |v| v[5] = -v[5],
            "imu.angular_velocity.yaw",
            "z axis is of the opposite sign",
        ),
        (
            Sensor::Imu,
            |v| v[3..6].iter_mut().for_each(|v| *v *= 57.295_78),
            "imu.angular_velocity.yaw",
            "degrees",
        ),
        (
            Sensor::Imu,
            |v| v.swap(3, 5),
            "imu.angular_velocity.yaw",
            "x axis is delivered as z",
        ),
        (
            Sensor::Imu,
            |v| v[..3].iter_mut().for_each(|v| *v *= 2.0),
            "imu.specific_force.scale",
            "twice",
        ),
    ];
    for (edited, edit, key, says) in cases {
        let found = assessed(&STEERED, &mut |_, sensor, values| {
            if sensor == edited {
                edit(values);
            }
            true
        });
        assert_contradicted(&found, &[key], says);
    }
}

#[test]
fn axes_of_the_accelerometer_alone_are_named() {
    type Edit = fn(&mut [f64]);
    let cases: [(Edit, &str); 6] = [
        (
            |v| v[0] = -v[0],
            "accelerometer's x axis is of the opposite sign",
        ),
        (
            |v| v[1] = -v[1],
            "accelerometer's y axis is of the opposite sign",
        ),
        (
            |v| v[2] = -v[2],
            "accelerometer's z axis is of the opposite sign",
        ),
        (
            |v| v.swap(0, 1),
            "accelerometer's x axis is delivered as y, its y axis is delivered as x",
        ),
        (|v| v.swap(0, 2), "accelerometer's x axis is delivered as z"),
        (|v| v.swap(1, 2), "accelerometer's y axis is delivered as z"),
    ];
    for drive in [&*STEERED, &*BOGIE] {
        for (edit, says) in cases {
            let found = assessed(drive, &mut |_, sensor, values| {
                if sensor == Sensor::Imu {
                    edit(values);
                }
                true
            });
            assert_contradicted(&found, &["imu.specific_force.axes"], says);
            assert_eq!(found.explanations.len(), 1, "{says}\n{}", told(&found));
        }
    }
}

#[test]
fn steering_angles_that_are_all_of_the_opposite_sign_are_named() {
    let found = assessed(&STEERED, &mut |at, sensor, values| {
        if matches!(sensor, Sensor::Joints(_)) {
            for column in STEER.map(|name| at.column(name)) {
                values[column] = -values[column];
                values[at.joints() + column] = -values[at.joints() + column];
            }
        }
        true
    });
    let keys = STEER.map(sign);
    let says = "\"steer_fr\" and \"steer_fl\" are of the opposite sign";
    assert_contradicted(&found, &[&keys[0], &keys[1]], says);
    assert_eq!(found.count(Status::Contradicted), 2, "{}", told(&found));
}

/// The orientation shows which is which. Without one, only the lean by the arm does, on which its encoders rest, too.
#[test]
fn exchanged_roll_and_pitch_rates_are_contradicted() {
    type Edit = fn(&mut Vec<f64>);
    let wrong: [Edit; 3] = [
        |values| values.swap(3, 4),
        |values| {
            values.swap(3, 4);
            values[3] = -values[3];
        },
        |values| values[3] = -values[3],
    ];
    for (case, edit) in wrong.into_iter().enumerate() {
        let found = assessed(&STEERED, &mut |_, sensor, values| {
            if sensor == Sensor::Imu {
                edit(values);
            }
            true
        });
        let item = item(&found, "imu.angular_velocity.roll_pitch");
        assert_eq!(
            item.status,
            Status::Contradicted,
            "{case}\n{}",
            told(&found)
        );
        let is_named = found
            .explanations
            .iter()
            .any(|text| text.contains("gyro") || text.contains("axis"));
        assert!(is_named, "{case}\n{}", told(&found));
    }
    let without = assessed(&STEERED, &mut |_, sensor, values| {
        if sensor == Sensor::Imu {
            values.swap(3, 4);
            values[6..10].fill(f64::NAN);
        }
        true
    });
    let status = item(&without, "imu.angular_velocity.roll_pitch").status;
    assert_ne!(status, Status::Proven, "{}", told(&without));
    assert!(!without.is_complete());
}

#[test]
fn encoders_that_stand_still_are_never_proven() {
    for joint in ARM.iter().chain(&STEER).chain(&WHEELS) {
        let mut first = None;
        let found = assessed(&STEERED, &mut |at, sensor, values| {
            if matches!(sensor, Sensor::Joints(_)) {
                let column = at.column(joint);
                values[column] = *first.get_or_insert(values[column]);
                values[at.joints() + column] = 0.0;
            }
            true
        });
        let found_item = item(&found, &sign(joint));
        assert_ne!(
            found_item.status,
            Status::Proven,
            "{joint}\n{}",
            told(&found)
        );
        assert!(!found.is_complete());
        if *joint == "slew" || !ARM.contains(joint) {
            assert_eq!(
                found_item.status,
                Status::Contradicted,
                "{joint}\n{}",
                told(&found)
            );
        }
    }
}

#[test]
fn what_was_not_excited_is_not_shown() {
    // The machine only stands and drives straight.
    let found = assessed(&STEERED, &mut |at, _, _| at.time_s < 11.0);
    assert_eq!(found.count(Status::Contradicted), 0, "{}", told(&found));
    for joint in ARM {
        let lean = item(&found, &sign(joint));
        assert_eq!(lean.status, Status::NotShown, "{}", told(&found));
        assert!(
            lean.text.contains(&format!("move {joint} alone")),
            "{}",
            lean.text
        );
    }
    assert_eq!(item(&found, "imu.mounting.tilt").status, Status::NotShown);
    assert_eq!(
        item(&found, "imu.mounting.forward").status,
        Status::Proven,
        "{}",
        told(&found)
    );
}

#[test]
fn short_noisy_and_damaged_recordings_prove_nothing_wrong() {
    let short = assessed(&STEERED, &mut |at, _, _| at.time_s < 0.5);
    assert_eq!(
        short.count(Status::Proven) + short.count(Status::Contradicted),
        0,
        "{}",
        told(&short)
    );

    let mut state = 7_u64;
    let mut noise = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let noisy = assessed(&STEERED, &mut |_, sensor, values| {
        let size = match sensor {
            Sensor::Imu => 3.0,
            Sensor::Odometry => 2.0,
            _ => 0.5,
        };
        values.iter_mut().for_each(|value| *value += size * noise());
        true
    });
    for joint in ARM {
        assert_ne!(
            item(&noisy, &sign(joint)).status,
            Status::Proven,
            "{}",
            told(&noisy)
        );
    }
    assert!(!noisy.is_complete());

    // Four of five seconds are missing, and every seventh sample is not a number.
    let mut count = 0;
    let damaged = assessed(&STEERED, &mut |at, _, values| {
        count += 1;
        if count % 7 == 0 {
            values.fill(f64::NAN);
        }
        at.time_s.rem_euclid(5.0) < 1.0
    });
    assert_eq!(damaged.count(Status::Contradicted), 0, "{}", told(&damaged));
    assert!(!damaged.is_complete());
}

#[test]
fn another_machine_is_proven_as_far_as_it_was_excited() {
    let found = assessed(&BOGIE, &mut |_, _, _| true);
    assert_eq!(found.count(Status::Contradicted), 0, "{}", told(&found));
    for key in [
        "imu.mounting.up",
        "imu.mounting.forward",
        "imu.angular_velocity.yaw",
        "odometry.velocity",
        "joint.slew.sign",
        "joint.suspension_left.sign",
    ] {
        assert_eq!(
            item(&found, key).status,
            Status::Proven,
            "{key}\n{}",
            told(&found)
        );
    }
    let flipped = scale_joint(&BOGIE, "slew", -1.0);
    assert_contradicted(
        &flipped,
        &["joint.slew.sign"],
        "joint \"slew\" is of the opposite sign",
    );
    let exchanged = swap_joints(&BOGIE, ["suspension_left", "suspension_right"]);
    assert_ne!(
        item(&exchanged, "joint.suspension_left.sign").status,
        Status::Proven
    );
    assert!(
        exchanged.count(Status::Contradicted) > 0,
        "{}",
        told(&exchanged)
    );
}

#[test]
fn a_person_may_confirm_or_deny_what_signals_leave_open() {
    let drive = &*STEERED;
    let mut recording = Recording::new(&drive.sensors);
    for (sensor, stamp_ns, values) in drive.samples.iter().take(2000) {
        let sample = Sample::new(*sensor, *stamp_ns, values);
        let _ = recording.push(&sample);
    }
    let answered = |yes: bool| {
        let answers = Answers::from([("joint.slew.sign".to_string(), yes)]);
        let found = assess(&drive.machine, &drive.sensors, &recording, &answers);
        item(&found, "joint.slew.sign").status
    };
    assert_eq!(answered(true), Status::Confirmed);
    assert_eq!(answered(false), Status::Contradicted);
}

/// No ordinary log contradicts its machine file.
#[test]
fn good_logs_contradict_nothing() {
    let folder = std::fs::read_dir(data("")).unwrap();
    let mut logs: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
    logs.retain(|path| path.extension().is_some_and(|e| e == "mcap"));
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
        let found = assessed(&read(&log, &machine), &mut |_, _, _| true);
        assert_eq!(
            found.count(Status::Contradicted),
            0,
            "{}\n{}",
            log.display(),
            told(&found)
        );
    }
}

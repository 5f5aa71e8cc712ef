//! Logs whose topics are shared, contradict themselves or are missing.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use tempfile::TempDir;

use super::support::{code_and_stderr, data, into, tipwatch};

const MS: i64 = 1_000_000;
const S: i64 = 1_000_000_000;

/// A message of joint states.
#[derive(Clone)]
struct Joints {
    stamp_ns: i64,
    names: Vec<String>,
    /// Positions and velocities.
    numbers: [Vec<f64>; 2],
}

impl Joints {
    fn parse(data: &[u8]) -> Self {
        let mut at = 12;
        let number = |at: &mut usize| {
            *at = at.next_multiple_of(4);
            *at += 4;
            u32::from_le_bytes(data[*at - 4..*at].try_into().unwrap()) as usize
        };
        let frame = number(&mut at);
        at += frame;
        let names = (0..number(&mut at)).map(|_| {
            let length = number(&mut at);
            at += length;
            String::from_utf8(data[at - length..at - 1].to_vec()).unwrap()
        });
        let names: Vec<String> = names.collect();
        let numbers = [0, 1].map(|_| {
            let count = number(&mut at);
            // doubles are aligned from the end of the encapsulation on
            at = (at - 4).next_multiple_of(8) + 4;
            let double = |k: usize| data[at + 8 * k..at + 8 * k + 8].try_into().unwrap();
            let doubles = (0..count).map(|k| f64::from_le_bytes(double(k))).collect();
            at += 8 * count;
            doubles
        });
        let seconds = i32::from_le_bytes(data[4..8].try_into().unwrap());
        let nanoseconds = u32::from_le_bytes(data[8..12].try_into().unwrap());
        Self {
            stamp_ns: i64::from(seconds) * S + i64::from(nanoseconds),
            names,
            numbers,
        }
    }

    fn encoded(&self) -> Vec<u8> {
        fn number(data: &mut Vec<u8>, number: usize) {
            data.resize(data.len().next_multiple_of(4), 0);
            data.extend((number as u32).to_le_bytes());
        }
        let mut data = vec![0, 1, 0, 0];
        data.extend(((self.stamp_ns / S) as i32).to_le_bytes());
        data.extend(((self.stamp_ns % S) as u32).to_le_bytes());
        number(&mut data, 1);
        data.push(0);
        number(&mut data, self.names.len());
        for name in &self.names {
            number(&mut data, name.len() + 1);
            data.extend(name.as_bytes());
            data.push(0);
        }
        for numbers in &self.numbers {
            number(&mut data, numbers.len());
            data.resize((data.len() - 4).next_multiple_of(8) + 4, 0);
            data.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        }
        number(&mut data, 0);
        data
    }

    /// The joints that are wanted, measured some time later as they move on.
    fn part(&self, later_ns: i64, is_wanted: impl Fn(&str) -> bool) -> Self {
        let places: Vec<usize> = (0..self.names.len())
            .filter(|&k| is_wanted(&self.names[k]))
            .collect();
        let later_s = later_ns as f64 * 1e-9;
        let [positions, velocities] = &self.numbers;
        Self {
            stamp_ns: self.stamp_ns + later_ns,
            names: places.iter().map(|&k| self.names[k].clone()).collect(),
            numbers: [
                places
                    .iter()
                    .map(|&k| positions[k] + later_s * velocities[k])
                    .collect(),
                places.iter().map(|&k| velocities[k]).collect(),
            ],
        }
    }
}

/// The short log with other messages in place of each one: their data and log times.
fn changed(folder: &TempDir, change: impl Fn(&str, i64, &[u8]) -> Vec<(i64, Vec<u8>)>) -> PathBuf {
    let bytes = fs::read(data("tiny.mcap")).unwrap();
    let path = folder.path().join("changed.mcap");
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let topic = message.channel.topic.clone();
        for (log_ns, data) in change(&topic, message.log_time as i64, &message.data) {
            let changed = mcap::Message {
                channel: Arc::clone(&message.channel),
                sequence: message.sequence,
                log_time: log_ns as u64,
                publish_time: log_ns as u64,
                data: Cow::Owned(data),
            };
            writer.write(&changed).unwrap();
        }
    }
    writer.finish().unwrap();
    path
}

/// The short log with other joint states.
fn with_joints(folder: &TempDir, change: impl Fn(Joints) -> Vec<Joints>) -> PathBuf {
    changed(folder, |topic, log_ns, data| match topic {
        "/joint_states" => {
            let joints = Joints::parse(data);
            let delay_ns = log_ns - joints.stamp_ns;
            let message = |joints: Joints| (joints.stamp_ns + delay_ns, joints.encoded());
            change(joints).into_iter().map(message).collect()
        }
        _ => vec![(log_ns, data.to_vec())],
    })
}

/// Exit code, messages, summary.
fn analyzed(log: &Path, machine: &Path) -> (i32, String, Value) {
    let out = TempDir::new().unwrap();
    let arguments = into("analyze", log, machine, out.path());
    let (code, messages) = code_and_stderr(&tipwatch(&arguments));
    let summary = fs::read_to_string(out.path().join("summary.json")).unwrap_or("null".into());
    (code, messages, serde_json::from_str(&summary).unwrap())
}

/// A machine file beside the fixtures' URDF, with something replaced.
fn machine(folder: &TempDir, replace: &[(&str, &str)]) -> PathBuf {
    let mut machine = fs::read_to_string(data("tiny.toml")).unwrap();
    for (old, new) in replace {
        assert!(machine.contains(old), "{old}");
        machine = machine.replace(old, new);
    }
    fs::copy(data("tiny.urdf"), folder.path().join("tiny.urdf")).unwrap();
    let path = folder.path().join("machine.toml");
    fs::write(&path, machine).unwrap();
    path
}

fn assert_loads_are_close(found: &Value, expected: &Value, share: f64) {
    for (name, wheel) in expected["wheels"].as_object().unwrap() {
        let load = |wheel: &Value| wheel["least_load_n"].as_f64().unwrap();
        let (found, expected) = (load(&found["wheels"][name]), load(wheel));
        let off = (found - expected).abs();
        assert!(
            off < share * expected,
            "{name}: {found} N, expected {expected} N"
        );
    }
}

#[test]
fn publishers_may_share_the_topic_of_the_joint_states() {
    let folder = TempDir::new().unwrap();
    let sound = analyzed(&data("tiny.mcap"), &data("tiny.toml")).2;
    let is_wheel = |name: &str| name.starts_with("wheel") || name.starts_with("steer");
    let shared = with_joints(&folder, |joints| {
        let mut gripper = joints.part(MS, |_| false);
        gripper.names.push("gripper".into());
        gripper.numbers[0].push(0.1);
        let arm = joints.part(0, |name| !is_wheel(name));
        vec![arm, gripper, joints.part(3 * MS, is_wheel)]
    });
    let (code, messages, summary) = analyzed(&shared, &data("tiny.toml"));
    assert_eq!(code, 0, "{messages}");
    assert_eq!(summary["rows"]["count"], sound["rows"]["count"]);
    assert_loads_are_close(&summary, &sound, 0.01);
}

#[test]
fn a_joint_that_a_message_names_twice_is_refused() {
    let folder = TempDir::new().unwrap();
    let twice = |other: f64| {
        with_joints(&folder, |mut joints| {
            joints.names.push("lift".into());
            let lift = joints.numbers[0][1];
            joints.numbers[0].push(lift + other);
            joints.numbers[1].push(0.0);
            vec![joints]
        })
    };
    let (code, messages, _) = analyzed(&twice(0.5), &data("tiny.toml"));
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("joint \"lift\" once in a message") && messages.contains("position[1]"),
        "{messages}"
    );
    // the same twice is no contradiction
    assert_eq!(analyzed(&twice(0.0), &data("tiny.toml")).0, 0);
}

/// A string message.
fn string(text: &str) -> Vec<u8> {
    let length = (text.len() + 1) as u32;
    [
        &[0, 1, 0, 0][..],
        &length.to_le_bytes(),
        text.as_bytes(),
        &[0],
    ]
    .concat()
}

/// The short log with other robot descriptions before its own.
fn with_descriptions(folder: &TempDir, others: &[String]) -> PathBuf {
    changed(folder, |topic, log_ns, data| {
        let mut messages = vec![(log_ns, data.to_vec())];
        if topic == "/robot_description" {
            let other = |text: &String| (log_ns - S, string(text));
            messages.splice(0..0, others.iter().map(other));
        }
        messages
    })
}

#[test]
fn of_several_robot_descriptions_the_last_counts_if_masses_agree() {
    let folder = TempDir::new().unwrap();
    let from_log = machine(&folder, &[("urdf = \"tiny.urdf\"\n", "")]);
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let placeholder = "<robot name='placeholder'><link name='base_link'/></robot>".to_owned();
    let moved = urdf.replacen("<robot", "<!-- an earlier state --><robot", 1);
    let log = with_descriptions(&folder, &[placeholder, moved]);
    let (code, messages, summary) = analyzed(&log, &from_log);
    assert_eq!(code, 0, "{messages}");
    let notes = summary["notes"].as_array().unwrap();
    let is_told = |note: &Value| {
        note.as_str()
            .unwrap()
            .contains("3 different robot descriptions")
    };
    assert!(notes.iter().any(is_told), "{notes:?}");

    let from = urdf.find("mass value='").unwrap() + "mass value='".len();
    let heavier = format!("{}1{}", &urdf[..from], &urdf[from..]);
    let log = with_descriptions(&folder, &[heavier]);
    let (code, messages, _) = analyzed(&log, &from_log);
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("2 different ones: link \"") && messages.contains("urdf = \"FILE\""),
        "{messages}"
    );
    // the machine file decides
    let named = machine(&folder, &[]);
    assert_eq!(analyzed(&log, &named).0, 0);
}

#[test]
fn a_description_an_hour_earlier_belongs_to_no_covered_time() {
    let folder = TempDir::new().unwrap();
    let sound = analyzed(&data("tiny.mcap"), &data("tiny.toml")).2;
    let early = changed(&folder, |topic, log_ns, data| {
        let early_ns = if topic == "/robot_description" {
            3600 * S
        } else {
            0
        };
        vec![(log_ns - early_ns, data.to_vec())]
    });
    let (code, messages, summary) = analyzed(&early, &data("tiny.toml"));
    assert_eq!(code, 0, "{messages}");
    let covered = |summary: &Value| summary["coverage"]["covered_s"].as_f64().unwrap();
    assert!(
        (covered(&summary) - covered(&sound)).abs() < 0.02,
        "{}",
        summary["coverage"]
    );
}

#[test]
fn a_joint_without_a_position_takes_its_constant() {
    let folder = TempDir::new().unwrap();
    let log = with_joints(&folder, |mut joints| {
        joints.numbers[0][0] = f64::NAN;
        joints.numbers[1][0] = f64::NAN;
        vec![joints]
    });
    let slew = "\n[signals.joints.slew]\nposition = 0.0\n";
    let constant = machine(
        &folder,
        &[(
            "odometry = \"/odom\"\n",
            &format!("odometry = \"/odom\"\n{slew}"),
        )],
    );
    let (code, messages, summary) = analyzed(&log, &constant);
    assert_eq!(code, 0, "{messages}");
    let notes = summary["notes"].as_array().unwrap().iter();
    let mut notes = notes.filter_map(Value::as_str);
    assert!(notes.any(|note| note.contains("joint slew") && note.contains("is in no message")));
}

#[test]
fn a_machine_without_measured_joints_has_rows_at_its_imu() {
    let folder = TempDir::new().unwrap();
    let log = changed(&folder, |topic, log_ns, data| match topic {
        "/joint_states" => Vec::new(),
        _ => vec![(log_ns, data.to_vec())],
    });
    let positions = [
        ("lift", -1.2938),
        ("tilt", -1.7278),
        ("slew", 0.0),
        ("extension", 0.2035),
    ];
    let steered = [("steer_fl", 0.0), ("steer_fr", 0.0)];
    let constants: String = (positions.iter().chain(&steered))
        .map(|(joint, position)| format!("\n[signals.joints.{joint}]\nposition = {position:?}\n"))
        .collect();
    let parked = machine(
        &folder,
        &[
            ("joint_states = \"/joint_states\"\n", ""),
            (
                "odometry = \"/odom\"\n",
                &format!("odometry = \"/odom\"\n{constants}"),
            ),
        ],
    );
    let (code, messages, summary) = analyzed(&log, &parked);
    assert_eq!(code, 0, "{messages}");
    let rows = summary["rows"]["count"].as_u64().unwrap();
    assert!(rows > 100, "{rows}");
    assert!(summary["coverage"]["valid_share"].as_f64().unwrap() > 0.95);
    // without the constants nothing tells where the arm is
    let unknown = machine(&folder, &[("joint_states = \"/joint_states\"\n", "")]);
    let (code, messages, _) = analyzed(&log, &unknown);
    assert_eq!(code, 1, "{messages}");
    assert!(messages.contains("expected joint states"), "{messages}");
}

/// Changes a position, by the time since the log began (ns).
type Change = fn(i64, &mut f64);

/// Positions that the joint cannot have reached: no motion leads there, and both sides count for themselves.
#[test]
fn positions_that_no_joint_can_reach_tip_nothing() {
    const BEGIN_NS: i64 = 1_780_000_000 * S;
    let folder = TempDir::new().unwrap();
    let sound = analyzed(&data("tiny.mcap"), &data("tiny.toml")).2;
    let least = |summary: &Value| -> Vec<f64> {
        let wheels = summary["wheels"].as_object().unwrap().values();
        wheels
            .map(|wheel| wheel["least_load_n"].as_f64().unwrap())
            .collect()
    };
    let lift = |joints: &Joints| joints.names.iter().position(|name| name == "lift").unwrap();
    let cases: [(&str, f64, i32, Change); 3] = [
        ("first", 200.0, 0, |at_ns, lift| {
            *lift += if at_ns < 8 * MS { 0.9 } else { 0.0 };
        }),
        ("not read yet", 200.0, 0, |at_ns, lift| {
            *lift = if at_ns < S / 2 { 0.0 } else { *lift };
        }),
        // where it stays, it is as wrong as its zero, or was before: rows keep their loads and are doubted
        ("zero changed", 400.0, 8, |at_ns, lift| {
            *lift += if at_ns > 3 * S / 2 { 0.1 } else { 0.0 };
        }),
    ];
    for (what, tolerance_n, expected_code, change) in cases {
        let log = with_joints(&folder, |mut joints| {
            let (place, at_ns) = (lift(&joints), joints.stamp_ns - BEGIN_NS);
            change(at_ns, &mut joints.numbers[0][place]);
            vec![joints]
        });
        let (code, messages, summary) = analyzed(&log, &data("tiny.toml"));
        assert_eq!(code, expected_code, "{what}: {messages}");
        let events: Vec<&String> = summary["events"].as_object().unwrap().keys().collect();
        assert_eq!(events, ["input_fault"], "{what}");
        for (load, sound) in least(&summary).iter().zip(least(&sound)) {
            assert!(*load > sound - tolerance_n, "{what}: {load} {sound}");
        }
    }
}

//! `inspect --write-machine`: a first machine file from a log and a URDF.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;

use super::support::{analysed, data, tipwatch};

/// Writes the machine file of a log; returns its path, its text and the messages.
fn written(folder: &Path, log: &Path, urdf: Option<&Path>) -> (PathBuf, String, String) {
    let out = folder.join("machine.toml");
    let mut args = vec!["inspect", log.to_str().unwrap(), "--write-machine"];
    args.push(out.to_str().unwrap());
    if let Some(urdf) = urdf {
        args.extend(["--urdf", urdf.to_str().unwrap()]);
    }
    let output = tipwatch(&args);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{messages}");
    let text = fs::read_to_string(&out).unwrap();
    (out, text, messages)
}

fn mean_loads(analysis: &Analysis) -> Vec<f64> {
    let valid: Vec<usize> = (0..analysis.rows.len())
        .filter(|&row| analysis.rows.is_valid(row))
        .collect();
    assert!(valid.len() > 20);
    let mean = |wheel| {
        let column = analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
        valid.iter().map(|&row| column[row]).sum::<f64>() / valid.len() as f64
    };
    (0..analysis.machine.wheels().len()).map(mean).collect()
}

/// Completes the parameters that no URDF contains: the eyes of the cylinders and the mounting of the IMU, from `tiny.toml`.
fn completed(text: &str) -> String {
    let mut text = text.to_owned();
    for (rod, anchor, place) in [
        ("lift_rod_link", "lift_link", "0.376106321013"),
        ("tilt_rod_link", "tilt_link", "0.309011326653"),
    ] {
        let at = |link: &str, x: &str| format!("{{ link = \"{link}\", xyz = [{x}, 0.0, 0.0] }}");
        text = text.replace(&at(rod, "0.0"), &at(rod, "0.745"));
        text = text.replace(&at(anchor, "0.0"), &at(anchor, place));
    }
    let imu = "[imu]\n# link = \"base_link\"\n# xyz = [0.0, 0.0, 0.0]";
    assert!(text.contains(&format!("# {imu}")), "{text}");
    text = text.replace(imu, &imu.replace("[0.0, 0.0, 0.0]", "[0.1, 0.0, 0.05]"));
    // open lines are commented out
    let open = [
        "[[linkage]]",
        "name =",
        "pivot =",
        "cylinder =",
        "rod =",
        "rod_end =",
        "anchor =",
    ];
    let of_imu = ["[imu]", "link = \"base_link\"", "xyz =", "rpy ="];
    let opened = text.lines().map(|line| {
        let rest = line.strip_prefix("# ").unwrap_or(line);
        let is_open = open.iter().chain(&of_imu).any(|key| rest.starts_with(key));
        if is_open { rest } else { line }
    });
    let name = "name = \"tiny\"";
    let opened: Vec<&str> = opened.collect();
    assert!(opened.contains(&name));
    opened.join("\n") + "\n[contact]\ntyre_stiffness = 8.0e5\n"
}

#[test]
fn val_a_completed_file_gives_the_loads_of_a_manual_one() {
    let folder = TempDir::new().unwrap();
    let log = data("tiny.mcap");
    let (out, text, messages) = written(folder.path(), &log, Some(&data("tiny.urdf")));
    assert!(messages.contains("lift_cylinder"), "{messages}");
    let spec = MachineFile::read(&out).unwrap().spec;
    for (wheel, link) in [
        ("FL", "wheel_fl"),
        ("FR", "wheel_fr"),
        ("RL", "wheel_rl"),
        ("RR", "wheel_rr"),
    ] {
        assert_eq!(spec.wheels[wheel].link, link);
        assert!((spec.wheels[wheel].radius - 0.35).abs() < 1e-9);
    }
    assert_eq!(spec.wheels.len(), 4);
    let arm = spec.arm.as_ref().unwrap();
    assert_eq!(
        (arm.root.as_str(), arm.tool.as_deref()),
        ("arm_slew", Some("tool"))
    );
    assert!(
        spec.linkage.is_empty() && text.contains("# pivot = \"lift\""),
        "{text}"
    );
    // it describes a machine, but not yet its cylinders
    let alone = tipwatch(&["check-machine", out.to_str().unwrap()]);
    assert_eq!(alone.status.code(), Some(0));

    fs::write(&out, completed(&text)).unwrap();
    let by_hand = mean_loads(&analysed(&log, &data("tiny.toml")));
    let guessed = mean_loads(&analysed(&log, &out));
    for (a, b) in by_hand.iter().zip(&guessed) {
        // standard gravity instead of the simulation's
        assert!((a - b).abs() < 2e-3 * a, "{by_hand:?} {guessed:?}");
    }
}

#[test]
fn an_existing_file_is_never_overwritten() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("machine.toml");
    fs::write(&out, "evidence").unwrap();
    let args = [
        "inspect",
        data("tiny.mcap").to_str().unwrap(),
        "--write-machine",
        out.to_str().unwrap(),
    ]
    .map(str::to_owned);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let output = tipwatch(&args);
    assert_eq!(output.status.code(), Some(1));
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(
        messages.contains("machine.toml") && messages.contains("exist"),
        "{messages}"
    );
    assert_eq!(fs::read_to_string(&out).unwrap(), "evidence");
}

/// Names of a log or a URDF cannot end a comment or a string.
#[test]
fn names_are_escaped_as_toml_strings() {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let odd = urdf.replace("wheel_fl", "wheel &quot;fl&quot;&#10;gravity = 3");
    let path = folder.path().join("odd.urdf");
    fs::write(&path, odd).unwrap();
    let (out, text, _) = written(folder.path(), &data("tiny.mcap"), Some(&path));
    let spec = MachineFile::read(&out).unwrap().spec;
    assert!((spec.gravity - 9.80665).abs() < 1e-12, "{text}");
    assert_eq!(spec.wheels.len(), 4, "{text}");
    assert!(text.contains("urdf = \"odd.urdf\""), "{text}");
}

/// Joints with other names in the log are found by the words in their names.
#[test]
fn joints_with_similar_names_are_proposed() {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let renamed = urdf.replace("<joint name='slew'", "<joint name='SLEW_joint'");
    let path = folder.path().join("renamed.urdf");
    fs::write(&path, renamed).unwrap();
    let (out, text, _) = written(folder.path(), &data("tiny.mcap"), Some(&path));
    let spec = MachineFile::read(&out).unwrap().spec;
    let slew = &spec.signals.joints["SLEW_joint"];
    let position = slew.position.as_ref().unwrap().field().unwrap();
    assert_eq!(position.topic, "/joint_states", "{text}");
    assert_eq!(position.joint.as_deref(), Some("slew"));
    assert!(slew.velocity.is_some());
}

/// Its wheels are meshes, so the radius is a guess from their scale, and is marked as one.
/// Each suspension cylinder belongs to the bogie next to it, not to the other cylinder.
#[test]
fn cylinders_are_matched_to_the_joints_they_drive() {
    let folder = TempDir::new().unwrap();
    let urdf = data("forwarder6.urdf");
    let (_, text, _) = written(folder.path(), &data("forwarder6.mcap"), Some(&urdf));
    let by_hand = MachineFile::read(&data("forwarder6.toml")).unwrap().spec;
    for linkage in &by_hand.linkage {
        let table = format!(
            "# pivot = \"{}\"\n# cylinder = \"{}\"\n# rod = \"{}\"\n# rod_end = {{ link = \"{}\"",
            linkage.pivot, linkage.cylinder, linkage.rod, linkage.rod_end.link
        );
        assert!(text.contains(&table), "{table} is not in\n{text}");
    }
    for joint in &by_hand.contact.free_joints {
        assert!(text.contains(&format!("\"{joint}\"")), "{joint}");
    }
    let found = text
        .lines()
        .filter(|line| line.starts_with("[wheels."))
        .count();
    assert_eq!(found, by_hand.wheels.len());
}

/// A guess carries a wide standard deviation and a line until a person removes it from the list.
#[test]
fn guesses_stay_doubtful_until_confirmed() {
    let folder = TempDir::new().unwrap();
    let log = data("tiny.mcap");
    let (out, text, _) = written(folder.path(), &log, Some(&data("tiny.urdf")));
    assert!(text.contains("unconfirmed = [\"imu\"]"), "{text}");
    let guessed = completed(&text).replace(
        "unconfirmed = [\"imu\"]",
        "unconfirmed = [\"imu\", \"wheels.FL.radius\"]",
    );
    fs::write(&out, &guessed).unwrap();
    let results = folder.path().join("results");
    let output = tipwatch(&[
        "analyze",
        log.to_str().unwrap(),
        "--machine",
        out.to_str().unwrap(),
        "--out",
        results.to_str().unwrap(),
    ]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{messages}");
    let told: Vec<&str> = (messages.lines())
        .filter(|line| line.starts_with("- Unconfirmed"))
        .collect();
    assert!(
        told.len() == 2 && told[0].contains("IMU") && told[1].contains("wheel FL"),
        "{messages}"
    );
    let report = fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("Unconfirmed: the radius of wheel FL"));
    let doubtful = analysed(&log, &out);
    fs::write(
        &out,
        guessed.replace("unconfirmed = ", "unconfirmed = [] # "),
    )
    .unwrap();
    let confirmed = analysed(&log, &out);
    assert!(
        !confirmed
            .notes
            .iter()
            .any(|note| note.starts_with("Unconfirmed"))
    );
    let sigma = |analysis: &Analysis| {
        analysis
            .rows
            .whole()
            .outcomes
            .column(Quantity::LoadSigma(0))[100]
    };
    assert!(
        sigma(&doubtful) > 3.0 * sigma(&confirmed),
        "{} {}",
        sigma(&doubtful),
        sigma(&confirmed)
    );
    assert_eq!(mean_loads(&doubtful), mean_loads(&confirmed));
    for wrong in ["gravity", "wheels.XX.radius", "signals.joints.nothing"] {
        let list = format!("unconfirmed = [\"{wrong}\"] # ");
        fs::write(&out, guessed.replace("unconfirmed = ", &list)).unwrap();
        let output = tipwatch(&["check-machine", out.to_str().unwrap()]);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{wrong}");
        assert!(
            messages.contains("unconfirmed") && messages.contains(wrong),
            "{messages}"
        );
    }
}

/// `tiny.mcap` without the messages of some topics; the topics stay.
fn without_messages(folder: &Path, topics: &[&str]) -> PathBuf {
    let path = folder.join("silent.mcap");
    let bytes = fs::read(data("tiny.mcap")).unwrap();
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        if topics.contains(&message.channel.topic.as_str()) {
            let channel = &message.channel;
            let schema = channel.schema.as_ref().unwrap();
            let schema = writer
                .add_schema(&schema.name, &schema.encoding, &schema.data)
                .unwrap();
            let encoding = &channel.message_encoding;
            let metadata = Default::default();
            writer
                .add_channel(schema, &channel.topic, encoding, &metadata)
                .unwrap();
        } else {
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
    path
}

/// `tiny.mcap` with copies of topics, of whose messages each comes so many times.
fn with_copies(folder: &Path, copies: &[(&str, &str, usize)]) -> PathBuf {
    let path = folder.join("copies.mcap");
    let bytes = fs::read(data("tiny.mcap")).unwrap();
    let mut writer = mcap::Writer::new(fs::File::create(&path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let channel = &message.channel;
        let schema = channel.schema.as_ref().unwrap();
        let schema = writer
            .add_schema(&schema.name, &schema.encoding, &schema.data)
            .unwrap();
        let of_topic = copies.iter().filter(|(of, ..)| *of == channel.topic);
        let topics = of_topic.flat_map(|&(_, copy, count)| std::iter::repeat_n(copy, count));
        for topic in std::iter::once(channel.topic.as_str()).chain(topics) {
            let encoding = &channel.message_encoding;
            let channel_id = writer
                .add_channel(schema, topic, encoding, &channel.metadata)
                .unwrap();
            let header = mcap::records::MessageHeader {
                channel_id,
                sequence: message.sequence,
                log_time: message.log_time,
                publish_time: message.publish_time,
            };
            writer
                .write_to_known_channel(&header, &message.data)
                .unwrap();
        }
    }
    writer.finish().unwrap();
    path
}

#[test]
fn of_several_topics_of_one_kind_one_is_taken_for_a_stated_reason() {
    let folder = TempDir::new().unwrap();
    let copies = [
        ("/imu/data", "/imu_rear/data", 1),
        ("/joint_states", "/joint_states_command", 2),
        ("/odom", "/odom/desired", 2),
    ];
    let log = with_copies(folder.path(), &copies);
    let (_, text, _) = written(folder.path(), &log, Some(&data("tiny.urdf")));
    let text = text.replace("\n# ", " ");
    for expected in [
        "One of several topics of this type: it comes first in the log, and none has more messages. Check it; others: /imu_rear/data",
        "imu = \"/imu/data\"",
        "Skipped /joint_states_command: another topic also has its joint",
        "joint_states = [\"/joint_states\"]",
        "its name is not that of a command. Check it; others: /odom/desired",
        "odometry = \"/odom\"",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
}

#[test]
fn a_log_without_specific_force_is_never_complete() {
    let folder = TempDir::new().unwrap();
    // with rigid cylinders nothing else is missing
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let urdf = ["lift_cylinder", "lift_rod", "tilt_cylinder", "tilt_rod"]
        .iter()
        .fold(urdf, |urdf, joint| {
            let revolute = format!("<joint name='{joint}' type='revolute'");
            let prismatic = format!("<joint name='{joint}' type='prismatic'");
            let fixed = format!("<joint name='{joint}' type='fixed'");
            urdf.replace(&revolute, &fixed).replace(&prismatic, &fixed)
        });
    let path = folder.path().join("rigid.urdf");
    fs::write(&path, urdf).unwrap();
    for (silent, is_complete) in [
        (vec!["/imu/data"], true),
        (vec!["/imu/data", "/odom"], false),
    ] {
        let log = without_messages(folder.path(), &silent);
        let (out, text, messages) = written(folder.path(), &log, Some(&path));
        assert_eq!(text.contains("complete enough"), is_complete, "{text}");
        assert_eq!(
            messages.contains("neither an IMU nor odometry has messages"),
            !is_complete,
            "{messages}"
        );
        fs::remove_file(out).unwrap();
    }
}

#[test]
fn a_xacro_template_is_recognised() {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let path = folder.path().join("machine.urdf.xacro");
    let template = urdf.replace(
        "<link name='base_link'>",
        "<xacro:property name='m' value='2200'/>\n<link name='base_link'>",
    );
    for text in [
        template.clone(),
        template.replace("<robot ", "<robot xmlns:xacro='http://ros.org/wiki/xacro' "),
    ] {
        fs::write(&path, text).unwrap();
        let out = folder.path().join("machine.toml");
        let output = tipwatch(&[
            "inspect",
            data("tiny.mcap").to_str().unwrap(),
            "--write-machine",
            out.to_str().unwrap(),
            "--urdf",
            path.to_str().unwrap(),
        ]);
        let messages = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{messages}");
        assert!(
            messages.contains("xacro template") && messages.contains("> machine.urdf"),
            "{messages}"
        );
    }
    // what xacro has expanded still declares its name space, and comments may mention it
    let expanded = urdf.replace(
        "<robot ",
        "<!-- from\n<xacro:include/> -->\n<robot xmlns:xacro='http://ros.org/wiki/xacro' ",
    );
    let path = folder.path().join("expanded.urdf");
    fs::write(&path, expanded).unwrap();
    written(folder.path(), &data("tiny.mcap"), Some(&path));
}

/// Wheels without a name or shape that identifies them.
#[test]
fn wheels_with_meshes_are_found_by_geometry() {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let urdf = urdf.replace("wheel_", "part_").replace(
        "<cylinder radius='0.35' length='0.24'/>",
        "<mesh filename='a.dae'/>",
    );
    assert!(!urdf.contains("wheel") && urdf.contains("a.dae"));
    let path = folder.path().join("parts.urdf");
    fs::write(&path, urdf).unwrap();
    let (out, text, _) = written(folder.path(), &data("tiny.mcap"), Some(&path));
    for (wheel, link) in [
        ("FL", "part_fl"),
        ("FR", "part_fr"),
        ("RL", "part_rl"),
        ("RR", "part_rr"),
    ] {
        let table = format!("# [wheels.{wheel}]\n# link = \"{link}\"");
        assert!(text.contains(&table), "{table} is not in\n{text}");
    }
    assert!(
        text.contains("by geometry") && text.contains("Needed: its radius"),
        "{text}"
    );
    assert!(MachineFile::read(&out).is_ok());
}

/// A joint that nobody logs has a constant position, which is noted.
#[test]
fn a_joint_without_messages_takes_a_constant() {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny_lift.urdf")).unwrap();
    let renamed = urdf.replace("<joint name='slew'", "<joint name='turret'");
    assert_ne!(urdf, renamed);
    fs::write(folder.path().join("turret.urdf"), renamed).unwrap();
    let text = fs::read_to_string(data("tiny_lift.toml")).unwrap();
    let text = text
        .replace("tiny_lift.urdf", "turret.urdf")
        .replace("slew = -1.137, ", "");
    let path = folder.path().join("machine.toml");
    let log = data("tiny_lift.mcap");
    let with = |constant: &str| {
        fs::write(
            &path,
            format!("{text}\n[signals.joints.turret]\nposition = {constant}\n"),
        )
        .unwrap();
        let file = MachineFile::read(&path)?;
        analyse(&log, &file, Options::default(), &mut |_| {})
    };
    let measured = mean_loads(&analysed(&log, &data("tiny_lift.toml")));
    let analysis = with("-1.12").unwrap();
    for (a, b) in measured.iter().zip(mean_loads(&analysis)) {
        assert!((a - b).abs() < 0.03 * 8700.0, "{measured:?} {b}");
    }
    let is_noted = |note: &tipwatch_mechanics::machine::Note| {
        note.contains("joint turret") && note.contains("is in no message")
    };
    assert_eq!(
        analysis.notes.iter().filter(|note| is_noted(note)).count(),
        1
    );
    let elsewhere = mean_loads(&with("1.12").unwrap());
    assert!(
        (measured[0] - elsewhere[0]).abs() > 1000.0,
        "{measured:?} {elsewhere:?}"
    );
    assert!(with("nan").is_err());
}

#[test]
fn check_machine_takes_a_urdf() {
    let folder = TempDir::new().unwrap();
    let text = fs::read_to_string(data("tiny.toml")).unwrap();
    let path = folder.path().join("machine.toml");
    fs::write(&path, text.replace("urdf = \"tiny.urdf\"\n", "")).unwrap();
    let run = |more: &[&str]| {
        let output = tipwatch(&[&["check-machine", path.to_str().unwrap()], more].concat());
        (
            output.status.code(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    let urdf = data("tiny.urdf");
    let with_urdf = ["--urdf", urdf.to_str().unwrap()];
    assert_eq!(run(&[]).0, Some(1));
    assert_eq!(run(&with_urdf), (Some(0), String::new()));
    let log = data("tiny.mcap");
    let both = [&with_urdf[..], &["--log", log.to_str().unwrap()]].concat();
    assert_eq!(run(&both), (Some(8), String::new()));
    fs::write(&path, &text).unwrap();
    fs::copy(data("tiny_lift.urdf"), folder.path().join("tiny.urdf")).unwrap();
    let (code, messages) = run(&with_urdf);
    assert_eq!(code, Some(1));
    assert!(messages.contains("--urdf"), "{messages}");
}

mod needs_shared {
    use super::*;
    use crate::support::shared;

    #[test]
    #[ignore = "needs ../shared"]
    fn simulated_machines_are_recognised() {
        for name in [
            "flat_arm",
            "drive_brake",
            "drive_brake_clean",
            "flat_arm_clean",
        ] {
            let log = shared(&format!("sim/{name}.mcap"));
            let folder = TempDir::new().unwrap();
            let (out, text, _) = written(folder.path(), &log, Some(&log.with_extension("urdf")));
            assert_eq!(
                MachineFile::read(&out).unwrap().spec.wheels.len(),
                4,
                "{text}"
            );
            let check = tipwatch(&["check-machine", out.to_str().unwrap(), "--json"]);
            assert_eq!(check.status.code(), Some(0), "{text}");
            let found: serde_json::Value = serde_json::from_slice(&check.stdout).unwrap();
            let mass = found["masses"][4]["mass_kg"].as_f64().unwrap();
            assert!((mass - 3502.938).abs() < 0.01, "{mass}");
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn abitobot_is_recognised_and_analysed() {
        let log = shared("real/abitobot");
        let folder = TempDir::new().unwrap();
        let urdf = log.join("robot_from_xacro.urdf");
        let (out, text, messages) = written(folder.path(), &log, Some(&urdf));
        assert!(!messages.contains("is incomplete"), "{messages}");
        let spec = MachineFile::read(&out).unwrap().spec;
        let links: Vec<&str> = spec.wheels.values().map(|w| w.link.as_str()).collect();
        assert_eq!(
            links,
            [
                "wheel_left_front_link",
                "wheel_right_front_link",
                "wheel_left_back_link",
                "wheel_right_back_link"
            ],
            "{text}"
        );
        assert_eq!(spec.arm.as_ref().unwrap().root, "arm_1_link", "{text}");
        assert_eq!(spec.imu.as_ref().unwrap().link.as_deref(), Some("imu_link"));
        let by_hand = mean_loads(&analysed(&log, &data("abitobot.toml")));
        let guessed = mean_loads(&analysed(&log, &out));
        for (a, b) in by_hand.iter().zip(&guessed) {
            // relative to the mean load: two sources of the wheel radius differ
            let mean_load = by_hand.iter().sum::<f64>() / 4.0;
            assert!(
                (a - b).abs() < 0.01 * mean_load,
                "{by_hand:?} {guessed:?}\n{text}"
            );
        }
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn turtlebot3_is_recognised_from_its_log_alone() {
        let log = shared("real/turtlebot3");
        let folder = TempDir::new().unwrap();
        let (out, text, messages) = written(folder.path(), &log, None);
        assert!(!messages.contains("is incomplete"), "{messages}");
        let spec = MachineFile::read(&out).unwrap().spec;
        let radius = |name: &str| spec.wheels[name].radius;
        assert!((radius("FL") - 0.033).abs() < 1e-9, "{text}");
        assert!((radius("RR") - 0.006).abs() < 1e-6, "{text}");
        assert_eq!(spec.wheels["RL"].link, "caster_back_left_link");
        assert!(spec.arm.is_none() && spec.urdf.is_none());
        let by_hand = analysed(&log, &data("turtlebot3.toml"));
        let guessed = analysed(&log, &out);
        let sum = |analysis: &Analysis| mean_loads(analysis).iter().sum::<f64>();
        assert!((sum(&by_hand) - sum(&guessed)).abs() < 2e-3 * sum(&by_hand));
    }

    /// A log with neither a URDF nor joint states: the file names its signals and what is missing.
    #[test]
    #[ignore = "needs ../shared"]
    fn a_log_without_a_machine_description_gives_its_signals() {
        let log = shared("real/jackal/test2.bag");
        let folder = TempDir::new().unwrap();
        let (out, text, messages) = written(folder.path(), &log, None);
        assert!(messages.contains("a URDF"), "{messages}");
        let spec = MachineFile::read(&out).unwrap().spec;
        assert!(spec.wheels.is_empty() && text.contains("Needed"), "{text}");
        let imu = spec.signals.imu.as_ref().unwrap().topic();
        assert_eq!(imu.map(String::as_str), Some("/imu/data"));
    }
}

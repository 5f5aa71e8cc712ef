//! `inspect --write-machine` at a terminal: the questions, their order, and the use of the answers.

use std::fs;
use std::io::{Cursor, ErrorKind};
use std::path::Path;

use tempfile::TempDir;
use tipwatch_analyze::setup::first_machine::{
    Draft, OpenValue, OpenValues, WriteOptions, ask, draft, open_values, write,
};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::MachineSpec;
use tipwatch_mechanics::machine::Ground;

use super::support::{analysed, data, tipwatch};

fn draft_of(log: &str, folder: &Path) -> Draft {
    let out = folder.join("machine.toml");
    let urdf = data(&format!("{log}.urdf"));
    let log = data(&format!("{log}.mcap"));
    draft(&log, Some(&urdf), &out, &[], WriteOptions::default()).unwrap()
}

fn keys(values: &[OpenValue]) -> Vec<&str> {
    values.iter().map(|value| value.key.as_str()).collect()
}

/// Asks with these answers by key and Enter for everything else; returns the printed text.
fn answered(draft: &mut Draft, open: &OpenValues, answers: &[(&str, &str)]) -> String {
    let is_flat = answers
        .iter()
        .any(|(key, _)| *key == "contact.ground, contact.tyre_stiffness");
    let mut input = String::new();
    for value in &open.values {
        if is_flat && value.key == "contact.roll_moment_distribution" {
            continue;
        }
        let answer = answers.iter().find(|(key, _)| *key == value.key);
        input.push_str(answer.map_or("", |(_, answer)| answer));
        input.push('\n');
    }
    let mut output = Vec::new();
    ask(draft, &mut Cursor::new(&input), &mut output).unwrap();
    String::from_utf8(output).unwrap()
}

fn written(draft: &Draft) -> MachineSpec {
    let (out, missing) = write(draft).unwrap();
    assert_eq!(missing, None);
    MachineFile::read(out).unwrap().spec
}

#[test]
fn what_moves_the_loads_most_is_asked_first() {
    let folder = TempDir::new().unwrap();
    let open = open_values(&draft_of("tiny_lift", folder.path()));
    assert_eq!(open.unranked, None);
    let changes = |values: &[OpenValue]| -> Vec<f64> {
        let effects = values.iter().map(|value| value.effect.as_ref().unwrap());
        effects.map(|effect| effect.change_n).collect()
    };
    let major = changes(&open.values);
    assert!(major.is_sorted_by(|a, b| a >= b), "{major:?}");
    // the mounting of the IMU is asked for as a whole
    let of_imu = |value: &&OpenValue| value.key.starts_with("imu.");
    let others = open.values.iter().filter(|value| !of_imu(value)).count();
    let large = major.iter().filter(|change| **change >= open.least_n);
    assert!(large.count() >= others);
    assert!(
        changes(&open.minor)
            .iter()
            .all(|change| *change < open.least_n)
    );
    // whether there is a load, and how the axles share it all, is not in this log
    let first = [
        "payload.mass",
        "contact.ground, contact.tyre_stiffness",
        "contact.roll_moment_distribution",
        "imu.rpy",
    ];
    assert_eq!(keys(&open.values)[..4], first);
    let mut all = keys(&open.values);
    all.extend(keys(&open.minor));
    for key in [
        "imu.xyz",
        "imu.rpy",
        "linkage.lift",
        "links.tool.mass_sigma",
    ] {
        assert!(all.contains(&key), "{all:?}");
    }
}

/// The effect that a question states is that of the answer.
#[test]
fn val_the_effect_of_a_load_is_that_of_an_analysis_with_it() {
    let folder = TempDir::new().unwrap();
    let mut draft = draft_of("tiny_lift", folder.path());
    let open = open_values(&draft);
    let payload = open.values.iter().find(|value| value.key == "payload.mass");
    let effect = payload.unwrap().effect.clone().unwrap();
    let doubt_kg: f64 = effect.doubt.trim_end_matches(" kg").parse().unwrap();
    let worst_otf_n = |file: &Path| {
        let found = analysed(&data("tiny_lift.mcap"), file).sensitivity.unwrap();
        found.ranked()[0].worst_otf_n
    };
    answered(&mut draft, &open, &[]);
    let (without, _) = write(&draft).unwrap();
    let before = worst_otf_n(without);
    let other = TempDir::new().unwrap();
    let mut draft = draft_of("tiny_lift", other.path());
    answered(&mut draft, &open, &[("payload.mass", "20 kg")]);
    let (with, _) = write(&draft).unwrap();
    let change = (worst_otf_n(with) - before).abs();
    let stated = 20.0 / doubt_kg * effect.change_n;
    assert!(
        (change - stated).abs() < 0.02 * stated,
        "{change} N, {stated} N"
    );
}

#[test]
fn answers_become_the_machine_file() {
    let folder = TempDir::new().unwrap();
    let mut draft = draft_of("tiny_lift", folder.path());
    let open = open_values(&draft);
    let printed = answered(
        &mut draft,
        &open,
        &[
            ("contact.ground, contact.tyre_stiffness", "soft\n800 kN/m"),
            ("payload.mass", "-3\n0.45 t"),
            ("imu.xyz", "0.1, 0\n100 mm, 0, 0.05"),
            ("imu.rpy", "0, 0, 90"),
            ("links.tool.mass_sigma", "30"),
            ("uncertainty.mass_share", "6 %"),
        ],
    );
    // what cannot be an answer is asked again
    for wrong in ["soft", "-3", "0.1, 0"] {
        assert!(printed.contains(&format!("found \"{wrong}\"")), "{printed}");
    }
    let spec = written(&draft);
    let imu = spec.imu.unwrap();
    assert_eq!(imu.xyz, [0.1, 0.0, 0.05]);
    assert!((imu.rpy[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-6);
    assert_eq!(spec.contact.ground, Ground::Plane);
    assert!(spec.contact.tyre_stiffness.is_some());
    assert_eq!(spec.contact.roll_moment_distribution, None);
    assert_eq!(spec.payload.len(), 1);
    assert_eq!(spec.payload[0].link, "tool");
    assert_eq!(spec.links["tool"].mass_sigma, Some(15.0));
    assert!((spec.uncertainty.mass_share - 0.03).abs() < 1e-12);
    // what was not asked for is still a guess
    assert!(spec.unconfirmed.contains(&"signals.joints.tilt_rod".into()));
    assert!(!spec.unconfirmed.contains(&"imu".into()));
}

/// Enter everywhere gives a machine that can be analysed, whose guesses nobody has confirmed.
#[test]
fn enter_keeps_the_guesses_as_guesses() {
    let folder = TempDir::new().unwrap();
    let mut draft = draft_of("tiny_lift", folder.path());
    let open = open_values(&draft);
    answered(&mut draft, &open, &[]);
    let spec = written(&draft);
    assert!(spec.unconfirmed.contains(&"imu".into()));
    assert!(spec.payload.is_empty());
    assert_eq!(spec.contact.ground, Ground::Unknown);
    let file = folder.path().join("machine.toml");
    assert!(
        analysed(&data("tiny_lift.mcap"), &file)
            .digest
            .lightest
            .is_some()
    );
}

/// A crane on its outriggers stands on the supports that the person names, and its wheels carry nothing.
#[test]
fn what_a_machine_stood_on_is_asked_for() {
    let [folder, other] = [(); 2].map(|()| TempDir::new().unwrap());
    let mut draft = draft_of("crane", folder.path());
    let radii = "0.5\n".repeat(4);
    let rest = "\n".repeat(40);
    let mut output = Vec::new();
    let mut input = Cursor::new(format!("{radii}all\nall\n{rest}"));
    ask(&mut draft, &mut input, &mut output).unwrap();
    written(&draft);
    let read = |folder: &TempDir| -> toml::Table {
        fs::read_to_string(folder.path().join("machine.toml"))
            .unwrap()
            .parse()
            .unwrap()
    };
    let file = read(&folder);
    for foot in ["jack_ofl", "jack_ofr", "jack_orl", "jack_orr"] {
        let support = &file["supports"][foot];
        assert_eq!(
            (support["link"].as_str(), support["set"].as_bool()),
            (Some(foot), Some(true))
        );
    }
    for wheel in ["FL", "FR", "RL", "RR"] {
        assert_eq!(file["wheels"][wheel]["raised"].as_bool(), Some(true));
    }
    // without one, nobody asks what it keeps off the ground
    let mut draft = draft_of("crane", other.path());
    let mut output = Vec::new();
    ask(
        &mut draft,
        &mut Cursor::new(format!("{radii}\n{rest}")),
        &mut output,
    )
    .unwrap();
    written(&draft);
    assert!(!read(&other).contains_key("supports"));
    assert!(
        !String::from_utf8(output)
            .unwrap()
            .contains("off the ground")
    );
}

/// Answers given before the terminal was closed are kept.
#[test]
fn answers_that_end_early_are_kept() {
    let folder = TempDir::new().unwrap();
    let mut draft = draft_of("tiny_lift", folder.path());
    let input = "450\n";
    let mut output = Vec::new();
    let ended = ask(&mut draft, &mut Cursor::new(input), &mut output);
    assert_eq!(ended.unwrap_err().kind(), ErrorKind::UnexpectedEof);
    assert_eq!(written(&draft).payload.len(), 1);
}

/// Questions that change the structure of the machine are asked before anything is ranked.
#[test]
fn bogies_are_asked_for_before_the_order_is_computed() {
    let folder = TempDir::new().unwrap();
    let mut draft = draft_of("forwarder6", folder.path());
    let open = open_values(&draft);
    let by_hand = MachineFile::read(&data("forwarder6.toml")).unwrap().spec;
    let bogies = keys(&open.values).into_iter();
    let bogies = bogies
        .take_while(|key| *key != "contact.free_joints")
        .count();
    let before = &open.values[..=bogies];
    assert!(before.iter().all(|value| value.effect.is_none()));
    let answers = [("contact.free_joints", "bogey\nall")];
    answered(&mut draft, &open, &answers);
    let spec = MachineFile::read(write(&draft).unwrap().0).unwrap().spec;
    for joint in &by_hand.contact.free_joints {
        assert!(spec.contact.free_joints.contains(joint), "{joint}");
    }
}

/// A joint whose rod is measured has no position before the eyes of its cylinder are known: there is no order until then.
#[test]
fn the_eyes_of_a_cylinder_are_asked_for_where_the_loads_need_them() {
    let folder = TempDir::new().unwrap();
    let urdf = folder.path().join("rod.urdf");
    let text = fs::read_to_string(data("tiny.urdf")).unwrap();
    let text = text.replace("<joint name='lift'", "<joint name='boom'");
    fs::write(
        &urdf,
        text.replace("<joint name='lift_rod'", "<joint name='lift'"),
    )
    .unwrap();
    let out = folder.path().join("machine.toml");
    let options = WriteOptions::default();
    let mut draft = draft(&data("tiny.mcap"), Some(&urdf), &out, &[], options).unwrap();
    let open = open_values(&draft);
    assert!(open.unranked.is_some());
    assert_eq!(open.values[0].key, "linkage.boom");
    let mut input = "0.745, 0, 0\n0.745, 0, 0, 0.376, 0, 0\n".to_owned();
    input.push_str(&"\n".repeat(open.values.len() + open.minor.len()));
    let mut output = Vec::new();
    ask(&mut draft, &mut Cursor::new(&input), &mut output).unwrap();
    let spec = MachineFile::read(write(&draft).unwrap().0).unwrap().spec;
    assert_eq!(spec.linkage.len(), 1);
    assert_eq!(spec.linkage[0].pivot, "boom");
    assert_eq!(spec.linkage[0].anchor.xyz, [0.376, 0.0, 0.0]);
}

/// Where nobody can be asked, the file is as guessed, and one line names the keys in the order of the questions.
#[test]
fn without_a_terminal_the_keys_are_named() {
    let folder = TempDir::new().unwrap();
    let open = open_values(&draft_of("tiny_lift", folder.path()));
    let out = folder.path().join("machine.toml");
    let [log, urdf] = ["tiny_lift.mcap", "tiny_lift.urdf"].map(data);
    let [log, urdf, out] = [&log, &urdf, &out].map(|path| path.to_str().unwrap());
    let ran = tipwatch(&["inspect", log, "--write-machine", out, "--urdf", urdf]);
    assert_eq!(ran.status.code(), Some(0));
    let messages = String::from_utf8(ran.stderr).unwrap();
    let named = keys(&open.values).join(", ");
    assert_eq!(messages.matches(&named).count(), 1, "{messages}");
    let text = fs::read_to_string(out).unwrap();
    assert!(!text.contains("Stated at the terminal"), "{text}");
}

//! URDFs as robots have them, as a user of the program meets them.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use tempfile::TempDir;
use tipwatch_binding::MachineFile;

use super::support::{code_and_stderr, data, stdout, text, tipwatch};

/// The tiny machine, whose URDF states an inertia of the chassis that no body has.
fn machine() -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let changed = urdf.replacen("ixx='480.0'", "ixx='4800.0'", 1);
    assert_ne!(urdf, changed);
    fs::write(folder.path().join("tiny.urdf"), changed).unwrap();
    let path = folder.path().join("machine.toml");
    fs::copy(data("tiny.toml"), &path).unwrap();
    (folder, path)
}

#[test]
fn impossible_inertias_are_accepted_by_option_and_stay_in_the_provenance() {
    let (folder, machine) = machine();
    let log = data("tiny.mcap");
    let out = folder.path().join("out");
    let analyze = |more: &[&str]| {
        let mut args = vec!["analyze", text(&log), "--machine", text(&machine)];
        args.extend(["--out", text(&out), "--quiet"]);
        args.extend(more);
        code_and_stderr(&tipwatch(&args))
    };
    let (code, message) = analyze(&[]);
    assert_eq!(code, 1, "{message}");
    for word in [
        "base_link",
        "--accept-inertias",
        "could change a wheel load by",
    ] {
        assert!(message.contains(word), "{word}: {message}");
    }
    let (code, message) = analyze(&["--accept-inertias"]);
    assert_eq!(code, 0, "{message}");
    let summary = fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let replaced = &summary["provenance"]["replaced_inertias"];
    assert_eq!(replaced.as_array().unwrap().len(), 1);
    assert_eq!(replaced[0]["link"], "base_link");
    assert!(replaced[0]["load_change_n"].as_f64().unwrap() > 0.0);
    let notes = summary["notes"].as_array().unwrap();
    let is_noted = |note: &Value| {
        note.as_str()
            .unwrap()
            .contains("Impossible inertia, accepted")
    };
    assert!(notes.iter().any(is_noted), "{notes:?}");
    // the record repeats with the option
    let (code, message) = code_and_stderr(&tipwatch(&["verify", text(&out)]));
    assert_eq!(code, 0, "{message}");
    // a fleet by the option and one by the key give the same loads
    let screen = |machine: &PathBuf, out: &str, more: &[&str]| {
        let out = folder.path().join(out);
        let mut args = vec!["screen", text(&log), "--machine", text(machine)];
        args.extend(["--out", text(&out), "--quiet"]);
        args.extend(more);
        code_and_stderr(&tipwatch(&args))
    };
    assert_eq!(screen(&machine, "refused", &[]).0, 1);
    let (code, message) = screen(&machine, "by_option", &["--accept-inertias"]);
    assert_eq!(code, 0, "{message}");
    let stated = fs::read_to_string(&machine).unwrap();
    let by_key = folder.path().join("by_key.toml");
    fs::write(&by_key, format!("accept_inertias = true\n{stated}")).unwrap();
    let (code, message) = screen(&by_key, "by_key", &[]);
    assert_eq!(code, 0, "{message}");
    // the option and a key that contradicts it
    fs::write(&by_key, format!("accept_inertias = false\n{stated}")).unwrap();
    let (code, message) = screen(&by_key, "both", &["--accept-inertias"]);
    assert_ne!(code, 0);
    assert!(message.contains("accept_inertias = false"), "{message}");
}

#[test]
fn the_effective_text_describes_the_machine_that_an_option_accepts() {
    let (_folder, path) = machine();
    let file = MachineFile::read(&path).unwrap();
    assert_eq!(file.effective_text(), file.text);
    assert!(file.check_alone().is_err());
    let file = file.accepting_inertias().unwrap();
    let again = MachineFile::from_text(&path, &file.effective_text()).unwrap();
    assert_eq!(again.effective_text(), file.effective_text());
    let masses = [file, again].map(|file| file.check_alone().unwrap().mass());
    assert_eq!(masses[0], masses[1]);
}

#[test]
fn every_command_names_its_machine_with_machine() {
    let machine = data("tiny.toml");
    let by_position = tipwatch(&["check-machine", text(&machine)]);
    let by_name = tipwatch(&["check-machine", "--machine", text(&machine)]);
    assert_eq!(code_and_stderr(&by_name), (0, String::new()));
    assert_eq!(stdout(&by_name), stdout(&by_position));
    for args in [
        &["check-machine"][..],
        &["check-machine", text(&machine), "--machine", text(&machine)],
    ] {
        assert_eq!(tipwatch(args).status.code(), Some(2), "{args:?}");
    }
    for command in [
        "analyze",
        "screen",
        "compare",
        "inspect",
        "check-machine",
        "validate",
        "identify",
        "whatif",
        "stabilise",
    ] {
        let help = stdout(&tipwatch(&[command, "--help"]));
        for option in ["--machine <", "--accept-inertias"] {
            assert!(help.contains(option), "{command}: {option}");
        }
    }
}

#[test]
fn passive_joints_are_held_still_on_request_with_the_mass_they_carry() {
    let folder = TempDir::new().unwrap();
    let (log, urdf) = (data("tiny.mcap"), data("tiny.urdf"));
    let written = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let mut args = vec!["inspect", text(&log), "--urdf", text(&urdf)];
        args.extend(["--write-machine", text(&out)]);
        args.extend(more);
        let (code, message) = code_and_stderr(&tipwatch(&args));
        assert_eq!(code, 0, "{message}");
        fs::read_to_string(out).unwrap()
    };
    let open = written("open.toml", &[]);
    assert!(open.contains("# [[linkage]]"), "{open}");
    let frozen = written("frozen.toml", &["--freeze-passive"]);
    for joint in ["lift_cylinder", "lift_rod", "tilt_cylinder", "tilt_rod"] {
        assert!(
            frozen.contains(&format!("\n[signals.joints.{joint}]\nposition = ")),
            "{frozen}"
        );
        assert!(
            frozen.contains(&format!("\"signals.joints.{joint}\"")),
            "{frozen}"
        );
    }
    assert!(
        frozen.contains("% of the mass") && !frozen.contains("[[linkage]]"),
        "{frozen}"
    );
    let file = MachineFile::read(&folder.path().join("frozen.toml")).unwrap();
    assert!(file.check_alone().is_ok());
}

//! `check-machine --log`: the result of a commissioning as a file, its exit codes, and its use in an analysis.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::support::{code_and_stderr, data, stdout, text, tipwatch};

/// A copy of the fixture with its machine file changed.
fn machine(edit: impl Fn(String) -> String) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("machine.toml");
    let original = fs::read_to_string(data("commissioning.toml")).unwrap();
    fs::write(&path, edit(original)).unwrap();
    fs::copy(
        data("commissioning.urdf"),
        folder.path().join("commissioning.urdf"),
    )
    .unwrap();
    (folder, path)
}

fn check(machine: &Path, log: &str, result: Option<&Path>) -> (i32, String) {
    let log = data(log);
    let mut arguments = vec!["check-machine", text(machine), "--log", text(&log)];
    arguments.extend(
        result
            .iter()
            .flat_map(|path| ["--commissioning", text(path)]),
    );
    let output = tipwatch(&arguments);
    (output.status.code().unwrap(), stdout(&output))
}

fn analyse(folder: &Path, machine: &Path) -> (i32, String) {
    let log = data("commissioning.mcap");
    let out = folder.join("out");
    let arguments = [
        "analyze",
        text(&log),
        "--machine",
        text(machine),
        "--to",
        "4",
        "--out",
        text(&out),
        "--quiet",
    ];
    code_and_stderr(&tipwatch(&arguments))
}

#[test]
fn the_result_is_bound_to_machine_file_and_urdf() {
    let (folder, path) = machine(|text| format!("commissioning = \"result.json\"\n{text}"));
    let result = folder.path().join("result.json");
    let (code, shown) = check(&path, "commissioning.mcap", Some(&result));
    assert_eq!(code, 0, "{shown}");
    assert!(
        shown.contains("motions recognised") && shown.ends_with("commissioned\n"),
        "{shown}"
    );
    let json: Value = serde_json::from_str(&fs::read_to_string(&result).unwrap()).unwrap();
    assert_eq!(json["items"][0]["status"], "proven");

    let (code, err) = analyse(folder.path(), &path);
    assert_eq!(code, 0, "{err}");
    let summary = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let said = summary["provenance"]["commissioning"].as_str().unwrap();
    assert!(said.starts_with("commissioned at 2"), "{said}");
    let custody = fs::read_to_string(folder.path().join("out/custody.json")).unwrap();
    assert!(custody.contains("\"commissioning\""));

    // Another machine file, another URDF, a result changed by hand, and none at all.
    let good = fs::read_to_string(&path).unwrap();
    fs::write(&path, good.replace("min_load = 500.0", "min_load = 501.0")).unwrap();
    let (code, err) = analyse(folder.path(), &path);
    assert!(
        code == 1 && err.contains("commissioning of this machine file"),
        "{err}"
    );
    fs::write(&path, &good).unwrap();
    let urdf = folder.path().join("commissioning.urdf");
    let text_of_urdf = fs::read_to_string(&urdf).unwrap();
    fs::write(&urdf, text_of_urdf.replace("2200.0", "2201.0")).unwrap();
    let (code, err) = analyse(folder.path(), &path);
    assert!(
        code == 1 && err.contains("commissioning of this URDF"),
        "{err}"
    );
    fs::write(&urdf, text_of_urdf).unwrap();
    let sealed = fs::read_to_string(&result).unwrap();
    fs::write(
        &result,
        sealed.replace("commissioning.mcap", "another.mcap"),
    )
    .unwrap();
    let (code, err) = analyse(folder.path(), &path);
    assert!(
        code == 1 && err.contains("was changed after the commissioning"),
        "{err}"
    );
    fs::remove_file(&result).unwrap();
    let (code, err) = analyse(folder.path(), &path);
    assert!(
        code == 1 && err.contains("result.json: cannot be read"),
        "{err}"
    );
}

#[test]
fn a_log_that_shows_little_does_not_commission() {
    let folder = TempDir::new().unwrap();
    let result = folder.path().join("result.json");
    let tiny = data("tiny.toml");
    let (code, shown) = check(&tiny, "tiny.mcap", Some(&result));
    assert_eq!(code, 8, "{shown}");
    assert!(
        shown.contains("NOT commissioned") && shown.contains("missing: drive forward and brake"),
        "{shown}"
    );
    assert!(result.exists());
    assert_eq!(check(&tiny, "tiny.mcap", None).0, 8);
}

#[test]
fn a_wrong_mounting_is_contradicted() {
    let (_folder, path) = machine(|text| {
        text.replace(
            "rpy = [0.0, 0.0, 0.0]",
            "rpy = [3.141592653589793, 0.0, 0.0]",
        )
    });
    let (code, shown) = check(&path, "commissioning.mcap", None);
    assert_eq!(code & 4, 4, "{shown}");
    assert!(
        shown.contains("the IMU is mounted turned by 180 degrees about x"),
        "{shown}"
    );
}

#[test]
fn an_analysis_without_a_commissioning_says_so() {
    let (folder, path) = machine(|text| text);
    let (code, err) = analyse(folder.path(), &path);
    assert_eq!(code, 0, "{err}");
    let summary = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let said = summary["provenance"]["commissioning"].as_str().unwrap();
    assert!(said.starts_with("not commissioned"), "{said}");
    assert!(summary["provenance"]["commissioning_file"].is_null());
    let report = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(report.contains("not commissioned"));
}

/// No wrong position between the motion of the machine and its limits is found by them.
#[test]
fn limits_far_beyond_the_motion_of_the_drive_are_told() {
    let (folder, path) = machine(|text| text);
    let noted = || {
        let (_, shown) = check(&path, "commissioning.mcap", None);
        let mut notes = shown.lines().filter(|line| line.contains("moved from"));
        notes.next().unwrap_or_default().to_owned()
    };
    let of_lift = "lift (-10.00 to 10.00, moved from ";
    let note = noted();
    let (_, used) = note.split_once(of_lift).expect(&note);
    let (from, used) = used.split_once(" to ").unwrap();
    let (to, _) = used.split_once(')').unwrap();
    let urdf = folder.path().join("commissioning.urdf");
    let text = fs::read_to_string(&urdf).unwrap();
    let (before, lift) = text.split_once("<joint name='lift'").unwrap();
    let limits = format!("lower='{from}' upper='{to}'");
    let lift = lift.replacen("lower='-10' upper='10'", &limits, 1);
    fs::write(&urdf, format!("{before}<joint name='lift'{lift}")).unwrap();
    let note = noted();
    assert!(
        note.contains("slew (") && !note.contains("lift ("),
        "{note}"
    );
}

//! `compare`: differences between two results.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

use super::support::{code_and_stderr, data, into, stdout, text, tipwatch};

/// Exit code, stdout and stderr.
fn run(args: &[&str]) -> (i32, String, String) {
    let output = tipwatch(args);
    let (code, messages) = code_and_stderr(&output);
    (code, stdout(&output), messages)
}

fn compared(args: &[&str]) -> Value {
    let mut all = vec!["compare", "--json"];
    all.extend(args);
    let (code, json, messages) = run(&all);
    assert_eq!(code, 0, "{messages}");
    serde_json::from_str(&json).unwrap()
}

/// A machine file like `tiny_lift.toml` whose chassis is heavier by so many kilogrammes.
fn heavier(folder: &Path, more_kg: f64) -> PathBuf {
    let urdf = fs::read_to_string(data("tiny_lift.urdf")).unwrap();
    let mass = "<mass value='";
    let at = urdf.find(mass).unwrap() + mass.len();
    let end = at + urdf[at..].find('\'').unwrap();
    let value: f64 = urdf[at..end].parse().unwrap();
    let changed = format!("{}{}{}", &urdf[..at], value + more_kg, &urdf[end..]);
    fs::write(folder.join("tiny_lift.urdf"), changed).unwrap();
    let machine = folder.join("heavier.toml");
    fs::copy(data("tiny_lift.toml"), &machine).unwrap();
    machine
}

#[test]
fn a_heavier_machine_differs_by_its_weight() {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let other = heavier(folder.path(), 100.0);
    let out = folder.path().join("out");
    let found = compared(&[
        text(&log),
        "--machine",
        text(&machine),
        "--machine-b",
        text(&other),
        "--out",
        text(&out),
    ]);
    assert_eq!(found["same_log"], true);
    let fact = |name: &str| {
        let facts = found["facts"].as_array().unwrap();
        facts.iter().find(|fact| fact["name"] == name).unwrap()["difference"]
            .as_f64()
            .unwrap()
    };
    assert!((fact("mass of the machine") - 100.0).abs() < 1e-9);
    // named, not hashed
    let inputs = found["inputs"].as_array().unwrap();
    let of_urdf = inputs
        .iter()
        .find(|of| of["key"].as_str().unwrap().ends_with("inertial mass value"));
    let mass_kg = |side: &str| {
        of_urdf.unwrap()[side]
            .as_str()
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    assert!(
        (mass_kg("b") - mass_kg("a") - 100.0).abs() < 1e-9,
        "{inputs:?}"
    );
    assert!(!inputs.iter().any(|of| of["key"] == "urdf.sha256"));
    let columns = found["series"]["columns"].as_array().unwrap();
    let column = |name: &str| {
        columns
            .iter()
            .find(|column| column["column"] == name)
            .unwrap()
    };
    // the weight of 100 kg, at rest and nearly at rest
    let weight = column("normal_force")["mean"].as_f64().unwrap();
    assert!((weight - 981.0).abs() < 15.0, "{weight}");
    let otf: f64 = ["fl", "fr", "rl", "rr"]
        .iter()
        .map(|wheel| column(&format!("otf_{wheel}"))["mean"].as_f64().unwrap())
        .sum();
    assert!((otf - weight).abs() < 1e-6 * weight, "{otf} of {weight}");
    // ranked within a unit
    for pair in columns.windows(2) {
        let rms = |column: &Value| column["rms"].as_f64().unwrap();
        assert!(pair[0]["unit"] != pair[1]["unit"] || rms(&pair[0]) >= rms(&pair[1]));
    }
    let page = fs::read_to_string(out.join("comparison.html")).unwrap();
    assert!(page.contains("OTF RL (N)") && page.contains("B - A, OTF RL (N)"));
    assert!(!page.contains("<script src") && !page.contains("://"));
    assert!(fs::metadata(out.join("comparison.json")).unwrap().len() > 1000);
}

/// A recovered log has other bytes and the same rows.
#[test]
fn a_copy_with_other_bytes_is_compared_row_by_row() {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let copy = folder.path().join("copy.mcap");
    let (code, _, messages) = run(&["recover", text(&log), "-o", text(&copy)]);
    assert_eq!(code, 0, "{messages}");
    assert_ne!(fs::read(&log).unwrap(), fs::read(&copy).unwrap());
    let found = compared(&[text(&log), text(&copy), "--machine", text(&machine)]);
    assert_eq!(found["same_log"], false);
    assert!(found["series"]["rows"].as_u64().unwrap() > 300);
    assert_eq!(found["caveats"].as_array().unwrap().len(), 1);
    let events = found["events"].as_array().unwrap();
    assert!(!events.is_empty());
    for event in events {
        assert!(
            event["a"].is_object() && event["a"] == event["b"],
            "{event}"
        );
    }
}

#[test]
fn results_and_logs_compare_alike() {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let result = |model: &str| {
        let out = folder.path().join(model);
        let args = [
            "analyze",
            text(&log),
            "--machine",
            text(&machine),
            "--out",
            text(&out),
            "--model",
            model,
            "--precision",
            "64",
        ];
        let (code, _, messages) = run(&args);
        assert_eq!(code, 0, "{messages}");
        out
    };
    let (whole, closed) = (result("whole-body"), result("closed-form"));
    let mut of_results = compared(&[text(&whole), text(&closed)]);
    let mut of_logs = compared(&[
        text(&log),
        "--machine",
        text(&machine),
        "--model-b",
        "closed-form",
    ]);
    for side in ["a", "b"] {
        of_results[side]["name"] = Value::Null;
        of_logs[side]["name"] = Value::Null;
    }
    assert_eq!(of_results, of_logs);
    assert_eq!(of_results["b"]["model"], "closed-form");
    assert!(
        !of_results["series"]["only_a"]
            .as_array()
            .unwrap()
            .is_empty()
    );

    let same = compared(&[text(&whole), text(&whole)]);
    let all = |list: &Value, key: &str| -> Vec<f64> {
        list.as_array()
            .unwrap()
            .iter()
            .map(|entry| entry[key].as_f64().unwrap_or(0.0))
            .collect()
    };
    assert!(all(&same["facts"], "difference").iter().all(|&d| d == 0.0));
    assert!(
        all(&same["series"]["columns"], "largest")
            .iter()
            .all(|&d| d == 0.0)
    );
    assert!(
        same["events"]
            .as_array()
            .unwrap()
            .iter()
            .all(|event| event["a"] == event["b"])
    );
}

#[test]
fn one_sided_events_come_first_in_the_text() {
    let machine = data("tiny_lift.toml");
    let (a, b) = (data("tiny.mcap"), data("tiny_lift.mcap"));
    let (code, printed, messages) =
        run(&["compare", text(&a), text(&b), "--machine", text(&machine)]);
    assert_eq!(code, 0, "{messages}");
    assert!(
        printed.contains("of different logs") && printed.contains(", in B: B from"),
        "{printed}"
    );
    let (code, _, messages) = run(&["compare", text(&a), text(&b)]);
    assert_eq!(code, 1);
    assert!(messages.contains("--machine"), "{messages}");
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("summary.json"), "{\"schema\": 1}").unwrap();
    let (code, _, messages) = run(&["compare", text(folder.path()), text(folder.path())]);
    assert_eq!(code, 1);
    assert!(
        messages.contains("expected a summary of schema") && messages.contains("found 1"),
        "{messages}"
    );
}

#[test]
fn folders_of_different_machine_files_never_have_the_same_inputs() {
    let folder = TempDir::new().unwrap();
    let machine = fs::read_to_string(data("tiny_lift.toml")).unwrap();
    fs::copy(data("tiny_lift.urdf"), folder.path().join("tiny_lift.urdf")).unwrap();
    let stiffer = machine.replace("tyre_stiffness = 8.0e5", "tyre_stiffness = 9.0e5");
    assert_ne!(machine, stiffer);
    let result = |name: &str, machine: &str| {
        let (file, out) = (
            folder.path().join(format!("{name}.toml")),
            folder.path().join(name),
        );
        fs::write(&file, machine).unwrap();
        let log = data("tiny_lift.mcap");
        let args = into("analyze", &log, &file, &out);
        let (code, _, messages) = run(&args);
        assert_eq!(code, 0, "{messages}");
        out
    };
    let (a, b) = (result("a", &machine), result("b", &stiffer));
    let (_, printed, _) = run(&["compare", text(&a), text(&b)]);
    assert!(
        printed.contains(
            "The machine files or their URDFs differ, and the output folders do not hold all of their parameters"
        ) && !printed.contains("are the same"),
        "{printed}"
    );
    let (_, printed, _) = run(&["compare", text(&a), text(&a)]);
    assert!(printed.contains("Their inputs are the same."), "{printed}");
}

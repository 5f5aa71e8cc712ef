//! Custody: hashes of everything, and an analysis that can be repeated bit for bit.

use std::fs;
use std::path::Path;

use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::support::{code_and_stderr, command, data, into, json, text, tipwatch};

fn sha256(path: &Path) -> String {
    let digest = Sha256::digest(fs::read(path).unwrap());
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A folder with a copy of a small log and its machine, and the results of their analysis.
fn analysed(more: &[&str]) -> TempDir {
    let folder = TempDir::new().unwrap();
    for ending in ["mcap", "toml", "urdf"] {
        let name = format!("tiny_lift.{ending}");
        fs::copy(data(&name), folder.path().join(name)).unwrap();
    }
    let arguments = [
        "analyze",
        "tiny_lift.mcap",
        "--machine",
        "tiny_lift.toml",
        "--out",
        "results",
    ];
    let mut run = command(&[&arguments[..], more].concat());
    let output = run.current_dir(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    folder
}

fn verify(folder: &Path) -> (i32, String) {
    code_and_stderr(&tipwatch(&["verify", text(&folder.join("results"))]))
}

#[test]
fn custody_has_every_hash_the_command_the_case_and_the_examiner() {
    let folder = analysed(&["--case", "7 <b>", "--examiner", "J. Doe"]);
    let results = folder.path().join("results");
    let custody = json(&results.join("custody.json"));
    assert_eq!(
        (&custody["case"], &custody["examiner"]),
        (&"7 <b>".into(), &"J. Doe".into())
    );
    let command: Vec<&str> = custody["command_line"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a.as_str().unwrap())
        .collect();
    assert_eq!(command[1..3], ["analyze", "tiny_lift.mcap"]);
    assert_eq!(
        custody["program"]["sha256"],
        sha256(Path::new(env!("CARGO_BIN_EXE_tipwatch")))
    );
    let inputs = custody["inputs"].as_array().unwrap();
    let named: Vec<&str> = inputs
        .iter()
        .map(|input| input["role"].as_str().unwrap())
        .collect();
    assert_eq!(named, ["log", "machine file", "urdf"]);
    for input in inputs {
        let path = folder.path().join(input["path"].as_str().unwrap());
        assert_eq!(input["sha256"], sha256(&path));
    }
    let outputs = custody["outputs"].as_array().unwrap();
    for output in outputs {
        let path = results.join(output["path"].as_str().unwrap());
        assert_eq!(output["sha256"], sha256(&path));
    }
    // every file but the record itself
    assert_eq!(outputs.len(), fs::read_dir(&results).unwrap().count() - 1);
    let provenance = &json(&results.join("summary.json"))["provenance"];
    assert_eq!(provenance["examiner"], "J. Doe");
    let report = fs::read_to_string(results.join("report.html")).unwrap();
    assert!(
        report.contains("J. Doe")
            && report.contains("7 &lt;b&gt;")
            && report.contains(custody["program"]["sha256"].as_str().unwrap())
    );
}

#[test]
fn verify_repeats_an_analysis_bit_for_bit_and_finds_an_altered_output() {
    let folder = analysed(&[
        "--case",
        "7",
        "--rate",
        "20",
        "--fail-on",
        "tip_over",
        "--pdf",
    ]);
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 0, "{messages}");
    assert_eq!(
        messages.matches("reproduced bit for bit").count(),
        7,
        "{messages}"
    );

    let summary = folder.path().join("results/summary.json");
    let text = fs::read_to_string(&summary).unwrap();
    fs::write(&summary, text.replacen("\"valid\":", "\"valid\": 1", 1)).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 6, "{messages}");
    assert!(
        messages.contains("altered since the analysis: summary.json"),
        "{messages}"
    );
}

#[test]
fn verify_says_what_is_not_reproduced() {
    let folder = analysed(&[]);
    let record = folder.path().join("results/custody.json");
    let mut custody = json(&record);
    // as if other results had been written then
    let summary = folder.path().join("results/summary.json");
    let mut altered = json(&summary);
    altered["machine"]["mass_kg"] = 1.0.into();
    fs::write(&summary, altered.to_string()).unwrap();
    for output in custody["outputs"].as_array_mut().unwrap() {
        if output["path"] == "summary.json" {
            output["sha256"] = sha256(&summary).into();
        }
    }
    fs::write(&record, custody.to_string()).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 6, "{messages}");
    let expected = "summary.json: NOT reproduced: differs in machine.mass_kg";
    assert!(messages.contains(expected), "{messages}");
    assert!(
        messages.contains("samples.parquet: reproduced bit for bit"),
        "{messages}"
    );
}

#[test]
fn verify_refuses_changed_inputs_and_another_program() {
    let folder = analysed(&[]);
    let machine = folder.path().join("tiny_lift.toml");
    let original = fs::read_to_string(&machine).unwrap();
    fs::write(&machine, format!("{original}\n# changed\n")).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 7, "{messages}");
    assert!(
        messages.contains("refused: machine file tiny_lift.toml: expected SHA-256"),
        "{messages}"
    );
    fs::write(&machine, original).unwrap();

    let log = folder.path().join("tiny_lift.mcap");
    fs::remove_file(&log).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 7, "{messages}");
    assert!(
        messages.contains("log tiny_lift.mcap: is missing"),
        "{messages}"
    );
    fs::copy(data("tiny_lift.mcap"), &log).unwrap();

    let record = folder.path().join("results/custody.json");
    let mut custody = json(&record);
    custody["program"]["sha256"] = "00".repeat(32).into();
    fs::write(&record, custody.to_string()).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 7, "{messages}");
    assert!(messages.contains("another build"), "{messages}");
    custody["tipwatch_version"] = "0.0.9".into();
    fs::write(&record, custody.to_string()).unwrap();
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 7, "{messages}");
    assert!(messages.contains("made by tipwatch 0.0.9"), "{messages}");

    let empty = TempDir::new().unwrap();
    let (code, messages) = code_and_stderr(&tipwatch(&["verify", text(empty.path())]));
    assert!(code == 1 && messages.contains("custody.json"), "{messages}");
}

#[test]
fn the_demo_and_each_of_several_logs_can_be_verified() {
    let folder = TempDir::new().unwrap();
    let demo = folder.path().join("results");
    assert!(tipwatch(&["demo", "--out", text(&demo)]).status.success());
    let (code, messages) = verify(folder.path());
    assert_eq!(code, 0, "{messages}");

    let (a, b) = (data("tiny.mcap"), folder.path().join("b.mcap"));
    fs::copy(data("tiny.mcap"), &b).unwrap();
    let (machine, out) = (data("tiny.toml"), folder.path().join("many"));
    let arguments = [
        "analyze",
        text(&a),
        text(&b),
        "--machine",
        text(&machine),
        "--out",
        text(&out),
    ];
    assert!(tipwatch(&arguments).status.success());
    let (code, messages) = code_and_stderr(&tipwatch(&["verify", text(&out.join("b"))]));
    assert_eq!(code, 0, "{messages}");
}

#[test]
fn a_recovered_log_names_its_origin() {
    let folder = TempDir::new().unwrap();
    let (torn, clean) = (
        folder.path().join("torn.mcap"),
        folder.path().join("clean.mcap"),
    );
    let whole = fs::read(data("tiny_lift.mcap")).unwrap();
    fs::write(&torn, &whole[..60_000]).unwrap();
    assert_eq!(
        tipwatch(&["recover", text(&torn), "-o", text(&clean)])
            .status
            .code(),
        Some(3)
    );
    let out = folder.path().join("results");
    let machine = data("tiny_lift.toml");
    let arguments = into("analyze", &clean, &machine, &out);
    assert!(tipwatch(&arguments).status.success());
    for document in ["custody.json", "summary.json"] {
        let document = json(&out.join(document));
        let origins = document
            .get("recovered_from")
            .unwrap_or(&document["provenance"]["recovered_from"]);
        assert_eq!(origins.as_array().unwrap().len(), 1);
        assert_eq!(origins[0]["files"][0]["sha256"], sha256(&torn));
        assert!(origins[0]["bytes_lost"].as_u64().unwrap() > 0);
    }
    assert!(
        fs::read_to_string(out.join("report.html"))
            .unwrap()
            .contains(&sha256(&torn))
    );
}

//! Clips cut out of a log at its events, and their analysis.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::support::{code_and_stderr, command, data, into, json, text, tipwatch};

/// Analyses a log of the fixtures with clips.
fn analysed(name: &str, more: &[&str]) -> (TempDir, Value) {
    let folder = TempDir::new().unwrap();
    let (log, machine) = (data(&format!("{name}.mcap")), data(&format!("{name}.toml")));
    let arguments = [
        "analyze",
        text(&log),
        "--machine",
        text(&machine),
        "--clips",
    ];
    let out = ["--out", text(folder.path())];
    let output = command(&[&arguments[..], &out, more].concat())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let summary = json(&folder.path().join("summary.json"));
    (folder, summary)
}

/// The messages of a file: topic, times, sequence number, payload.
fn messages(path: &Path) -> Vec<(String, u64, u64, u32, Vec<u8>)> {
    let bytes = fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap);
    let messages = messages.map(|m| {
        (
            m.channel.topic.clone(),
            m.log_time,
            m.publish_time,
            m.sequence,
            m.data.into_owned(),
        )
    });
    messages.collect()
}

#[test]
fn clips_are_listed_with_hashes_times_and_events() {
    let options = ["--clip-before", "0.5", "--clip-after", "0.25"];
    let (folder, summary) = analysed("tiny_lift", &options);
    let clips = summary["clips"].as_array().unwrap();
    assert!(!clips.is_empty());
    let log = messages(&data("tiny_lift.mcap"));
    let custody = json(&folder.path().join("custody.json"));
    let outputs: Vec<&str> = (custody["outputs"].as_array().unwrap().iter())
        .map(|file| file["path"].as_str().unwrap())
        .collect();
    for clip in clips {
        let name = clip["path"].as_str().unwrap();
        assert!(outputs.contains(&name), "{outputs:?}");
        let path = folder.path().join(name);
        let bytes = fs::read(&path).unwrap();
        let digest = Sha256::digest(&bytes);
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(clip["sha256"], digest.as_str());
        let time = |key: &str| clip[key].as_u64().unwrap();
        let span = time("start_log_ns")..=time("end_log_ns");
        let wanted: Vec<_> = log
            .iter()
            .filter(|m| span.contains(&m.1))
            .cloned()
            .collect();
        let found: Vec<_> = messages(&path)
            .into_iter()
            .filter(|m| span.contains(&m.1))
            .collect();
        assert!(found == wanted && !found.is_empty());
        assert_eq!(clip["messages"], found.len());
        assert!(!clip["events"].as_array().unwrap().is_empty());
    }
    // the analysis can be repeated, clips included
    let (code, error) = code_and_stderr(&tipwatch(&["verify", text(folder.path())]));
    assert_eq!(code, 0, "{error}");
}

/// Largest difference between the start of an event in a clip and that in the whole log (s): the smoother knows less of a clip.
const START_S: f64 = 0.02;
/// Largest difference of the worst value of an event in a clip, as a share.
const WORST: f64 = 0.01;

#[test]
fn analysis_of_a_clip_gives_the_same_event() {
    for name in ["swing_lift", "tip_over"] {
        let (folder, summary) = analysed(name, &["--clip-before", "1.5", "--clip-after", "1"]);
        let clip = &summary["clips"][0];
        let path: PathBuf = folder.path().join(clip["path"].as_str().unwrap());
        let out = TempDir::new().unwrap();
        let machine = data(&format!("{name}.toml"));
        let arguments = ["analyze", text(&path), "--machine", text(&machine)];
        let again = tipwatch(&[&arguments[..], &["--out", text(out.path())]].concat());
        assert_eq!(again.status.code(), Some(0), "{again:?}");
        let again = json(&out.path().join("summary.json"));
        // it says that it is a clip, and of what
        let origin = &again["provenance"]["clip_of"];
        assert_eq!(
            origin["file_0_sha256"],
            summary["provenance"]["log"][0]["sha256"]
        );
        assert!(summary["provenance"]["clip_of"].is_null());
        let kinds = summary["events"].as_object().unwrap();
        let kinds = kinds
            .keys()
            .filter(|kind| kind.starts_with("wheel") || kind.starts_with("tip"));
        for kind in kinds {
            let (whole, part) = (
                &summary["events"][kind]["worst"],
                &again["events"][kind]["worst"],
            );
            assert_eq!(whole["subject"], part["subject"], "{name} {kind}");
            let number = |event: &Value, key: &str| event[key].as_f64().unwrap();
            let late_s = (number(part, "start_ns") - number(whole, "start_ns")) * 1e-9;
            let (a, b) = (number(whole, "worst"), number(part, "worst"));
            println!("{name} {kind}: start {late_s:+.4} s, worst {a:.1}, in the clip {b:.1}");
            // a clip shows less of the noise, by which an onset is weighed
            let sigma_s = whole["start_sigma_s"].as_f64().unwrap_or(0.0);
            assert!(
                late_s.abs() < START_S.max(sigma_s),
                "{name} {kind}: {late_s} s, sigma {sigma_s} s"
            );
            assert!(
                (a - b).abs() < WORST * a.abs() + 5.0,
                "{name} {kind}: {a} {b}"
            );
        }
    }
}

#[test]
fn options_of_clips_are_checked_and_kinds_chosen() {
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let folder = TempDir::new().unwrap();
    let run = |more: &[&str]| {
        let arguments = into("analyze", &log, &machine, folder.path());
        code_and_stderr(&tipwatch(&[&arguments[..], more].concat()))
    };
    let (code, error) = run(&["--clip-before", "3"]);
    assert!(code == 2 && error.contains("--clips"), "{code} {error}");
    let (code, error) = run(&["--clips", "--clip-after=-1"]);
    assert!(
        code == 2 && error.contains("not negative"),
        "{code} {error}"
    );
    // no such event: no clip, and those of an earlier run are gone
    let clips = folder.path().join("clips");
    fs::create_dir_all(&clips).unwrap();
    for name in ["0001_tip_over.mcap", "mine.mcap"] {
        fs::write(clips.join(name), "").unwrap();
    }
    let (code, error) = run(&["--clips", "--clip-events", "input_gap"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(
        json(&folder.path().join("summary.json"))["clips"],
        Value::Array(Vec::new())
    );
    let left: Vec<_> = fs::read_dir(&clips)
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert_eq!(left, ["mine.mcap"]);
}

mod needs_python {
    use super::*;
    use crate::support::run_python;

    /// An independent reader finds the same messages, definitions and writers.
    #[test]
    #[ignore = "needs Python with the package mcap; TIPWATCH_PYTHON names the interpreter"]
    fn python_reads_the_same_messages() {
        let (folder, summary) = analysed("tiny_lift", &["--clip-before", "0.5"]);
        let clip = &summary["clips"][0];
        let path = folder.path().join(clip["path"].as_str().unwrap());
        let script = "import sys; from mcap.reader import make_reader\n\
            def read(path, start, end):\n\
            \x20   reader = make_reader(open(path, 'rb'), validate_crcs=True)\n\
            \x20   every = reader.iter_messages(start_time=start, end_time=end + 1)\n\
            \x20   return sorted((c.topic, s.name, s.encoding, s.data, c.message_encoding, m.log_time,\n\
            \x20       m.publish_time, m.sequence, m.data) for s, c, m in every)\n\
            start, end = int(sys.argv[3]), int(sys.argv[4])\n\
            log, clip = read(sys.argv[1], start, end), read(sys.argv[2], start, end)\n\
            assert log == clip and len(clip) > 100, (len(log), len(clip))\n\
            reader = make_reader(open(sys.argv[2], 'rb'))\n\
            assert 'tipwatch_clip_of' in [m.name for m in reader.iter_metadata()]\n";
        let time = |key: &str| clip[key].as_u64().unwrap().to_string();
        let (start, end) = (time("start_log_ns"), time("end_log_ns"));
        run_python(&[
            "-c",
            script,
            text(&data("tiny_lift.mcap")),
            text(&path),
            &start,
            &end,
        ]);
    }
}

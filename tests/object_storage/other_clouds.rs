//! The program with places of Google and Azure and of web servers, end to end.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use tipwatch_tests::data;

use super::clouds::{Cloud, Fault, Request, SECRET, Tells};

fn run(cloud: &Cloud, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
    let variables = cloud.variables.iter().map(|(name, value)| (name, value));
    command.arg("tipwatch").args(arguments).envs(variables);
    command
        .env("TIPWATCH_STORAGE_TIMEOUT", "5")
        .env("TIPWATCH_STORAGE_ATTEMPTS", "2");
    let output = command.output().unwrap();
    for text in [&output.stdout, &output.stderr] {
        let text = String::from_utf8_lossy(text);
        assert!(!text.contains(SECRET), "{text}");
    }
    output
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn log() -> Vec<u8> {
    std::fs::read(data("tiny_lift.mcap")).unwrap()
}

fn machine() -> String {
    data("tiny_lift.toml").to_str().unwrap().to_owned()
}

/// Samples and events of the log as a local file gives them.
fn of_local() -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let log = data("tiny_lift.mcap");
    let done = Command::new(env!("CARGO_BIN_EXE_programs"))
        .args([
            "tipwatch",
            "analyze",
            log.to_str().unwrap(),
            "--machine",
            &machine(),
            "--out",
        ])
        .arg(&out)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", told(&done));
    tables(|name| std::fs::read(out.join(name)).unwrap())
}

/// Samples and events as text: provenance may differ, numbers may not.
fn tables(read: impl Fn(&str) -> Vec<u8>) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let mut found = BTreeMap::new();
    for name in ["samples.parquet", "events.parquet"] {
        let path = folder.path().join(name);
        std::fs::write(&path, read(name)).unwrap();
        let table = tipwatch_analyze::tables::parquet::read(&path).unwrap();
        let columns = table.columns().iter().map(|column| format!("{column:?}"));
        let text: Vec<String> = columns.collect();
        found.insert(name.to_owned(), text.join("\n").into_bytes());
    }
    found
}

#[test]
fn logs_and_results_in_google_and_azure_are_those_of_files() {
    let local = of_local();
    for cloud in [Cloud::gcs("program"), Cloud::azure("program")] {
        cloud.objects().put("in/log.mcap", &log(), false);
        let (from, to) = (cloud.at("in/log.mcap"), cloud.at("out"));
        let done = run(
            &cloud,
            &["analyze", &from, "--machine", &machine(), "--out", &to],
        );
        assert!(done.status.success(), "{}: {}", cloud.place, told(&done));
        let there = tables(|name| cloud.objects().get(&format!("out/{name}")).unwrap().bytes);
        assert!(there == local, "{}", cloud.place);
        let record = cloud.objects().get("out/custody.json").unwrap().bytes;
        let record: serde_json::Value = serde_json::from_slice(&record).unwrap();
        assert!(record["inputs"][0]["e_tag"].is_string(), "{record}");
        // one record per log, put if absent, and the data set from them
        let records = cloud.at("records");
        let screen = [
            "screen",
            &from,
            "--machine",
            &machine(),
            "--records",
            &records,
        ];
        for _ in 0..2 {
            let done = run(&cloud, &screen);
            assert!(done.status.success(), "{}: {}", cloud.place, told(&done));
        }
        let gather = [
            "screen",
            &from,
            "--gather",
            &records,
            "--out",
            &cloud.at("fleet"),
            "--quiet",
        ];
        let done = run(&cloud, &gather);
        assert!(done.status.success(), "{}: {}", cloud.place, told(&done));
        let keys = cloud.objects().keys();
        let states = keys.iter().filter(|key| key.starts_with("records/state/"));
        assert_eq!(states.count(), 1, "{keys:?}");
        assert!(keys.contains(&"fleet/fleet.html".to_owned()), "{keys:?}");
    }
}

#[test]
fn results_that_cannot_be_sent_are_not_there() {
    for cloud in [Cloud::gcs("torn"), Cloud::azure("torn")] {
        cloud.objects().put("log.mcap", &log(), false);
        let is_summary =
            |request: &Request| request.method == "PUT" && request.path.ends_with("summary.json");
        cloud.server.inject(99, is_summary, Fault::Status(403));
        let (from, to) = (cloud.at("log.mcap"), cloud.at("out"));
        let done = run(
            &cloud,
            &["analyze", &from, "--machine", &machine(), "--out", &to],
        );
        assert_eq!(done.status.code(), Some(1), "{}", told(&done));
        assert!(told(&done).contains("permission denied"), "{}", told(&done));
        assert_eq!(cloud.objects().keys(), ["log.mcap"]);
    }
}

#[test]
fn a_log_that_is_replaced_while_it_is_read_gives_no_results() {
    let without_tag = Tells {
        e_tag: false,
        ..Tells::ALL
    };
    for cloud in [
        Cloud::gcs("replaced"),
        Cloud::azure("replaced"),
        Cloud::web(without_tag),
    ] {
        cloud.objects().put("log.mcap", &log(), false);
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        // by one of equal length, before the first part is sent
        let (objects, mut other) = (cloud.replacer(), log());
        let middle = other.len() / 2;
        other[middle] ^= 1;
        let has_range = |request: &Request| {
            let range = request.header("range").unwrap_or("bytes=-");
            request.method == "GET"
                && !range.starts_with("bytes=-")
                && request.path.ends_with("log.mcap")
        };
        // Azure reads the end by a range, too
        let first = usize::from(cloud.place.starts_with("az"));
        let seen = std::sync::atomic::AtomicUsize::new(0);
        let replace = move |request: &Request| {
            if has_range(request)
                && seen.fetch_add(1, std::sync::atomic::Ordering::Relaxed) == first
            {
                objects("log.mcap", &other);
            }
            false
        };
        cloud.server.inject(1, replace, Fault::Status(500));
        let from = cloud.at("log.mcap");
        let done = run(
            &cloud,
            &[
                "analyze",
                &from,
                "--machine",
                &machine(),
                "--out",
                out.to_str().unwrap(),
            ],
        );
        assert_eq!(
            done.status.code(),
            Some(1),
            "{}: {}",
            cloud.place,
            told(&done)
        );
        assert!(
            told(&done).contains("changed while it was read"),
            "{}",
            told(&done)
        );
        assert!(!Path::new(&out).join("summary.json").exists());
    }
}

#[test]
fn a_key_that_no_request_can_name_is_one_failed_row() {
    for cloud in [Cloud::gcs("odd-keys"), Cloud::azure("odd-keys")] {
        // of a path the first two would be one
        for key in ["in/a.mcap", "in//a.mcap", "in/b.txt", "in//b.txt"] {
            cloud.objects().put(key, &log(), false);
        }
        let out = tempfile::tempdir().unwrap();
        let out = out.path().join("fleet");
        let screen = [
            "screen",
            &cloud.at("in"),
            "--machine",
            &machine(),
            "--out",
            out.to_str().unwrap(),
        ];
        let done = run(&cloud, &screen);
        assert_eq!(done.status.code(), Some(1), "{}", told(&done));
        let records = std::fs::read_dir(out.join("state")).unwrap().flatten();
        let records = records.filter(|file| file.path().extension().is_some());
        let mut found: Vec<(String, String, Option<String>)> = records
            .map(|file| {
                let record: serde_json::Value =
                    serde_json::from_slice(&std::fs::read(file.path()).unwrap()).unwrap();
                let text = |value: &serde_json::Value| value.as_str().map(str::to_owned);
                let result = &record["result"];
                let status = text(&result["status"]).unwrap();
                (
                    text(&record["path"]).unwrap(),
                    status,
                    text(&result["kind"]),
                )
            })
            .collect();
        found.sort();
        let expected = [
            (
                cloud.at("in//a.mcap"),
                "failed".into(),
                Some("storage".into()),
            ),
            (cloud.at("in/a.mcap"), "analysed".into(), None),
        ];
        assert_eq!(found, expected, "{}", told(&done));
    }
}

#[test]
fn a_web_server_without_ranges_needs_an_option() {
    let cloud = Cloud::web(Tells {
        ranges: false,
        ..Tells::ALL
    });
    cloud.objects().put("log.mcap", &log(), false);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let from = format!("{}?token={SECRET}", cloud.at("log.mcap"));
    let arguments = ["analyze", &from, "--machine", &machine(), "--out", out];
    let done = run(&cloud, &arguments);
    assert_eq!(done.status.code(), Some(1));
    assert!(told(&done).contains("--fetch-whole"), "{}", told(&done));
    let done = run(&cloud, &[&arguments[..], &["--fetch-whole"]].concat());
    assert!(done.status.success(), "{}", told(&done));
    assert!(tables(|name| std::fs::read(Path::new(out).join(name)).unwrap()) == of_local());
}

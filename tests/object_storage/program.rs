//! The program with places of a bucket, end to end.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

use mcap::Compression;
use tipwatch_storage::{Folder, Location};
use tipwatch_tests::data;

use super::image_log::image_log;
use super::server::{Fault, SECRET, Seen, Server};
use super::{serve, upload};

fn run(server: &Server, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_programs"));
    command
        .arg("tipwatch")
        .args(arguments)
        .envs(server.variables());
    command
        .env("TIPWATCH_STORAGE_TIMEOUT", "5")
        .env("TIPWATCH_STORAGE_ATTEMPTS", "2");
    let output = command.output().unwrap();
    for text in [&output.stdout, &output.stderr] {
        assert!(!String::from_utf8_lossy(text).contains(SECRET));
    }
    output
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn folder(place: &str) -> Folder {
    Folder::open(&Location::parse(place).unwrap()).unwrap()
}

#[test]
fn a_log_of_a_bucket_gives_the_results_of_the_local_one_in_a_bucket() {
    let server = serve("program");
    let bytes = image_log(&data("tiny_lift.mcap"), Some(Compression::Zstd));
    let local = tempfile::tempdir().unwrap();
    let log = local.path().join("log.mcap");
    std::fs::write(&log, &bytes).unwrap();
    upload("program", "in/log.mcap", &bytes);
    let machine = data("tiny_lift.toml");
    let machine = machine.to_str().unwrap();
    let here = local.path().join("out");
    let here = here.to_str().unwrap();
    let done = run(
        &server,
        &[
            "analyze",
            log.to_str().unwrap(),
            "--machine",
            machine,
            "--out",
            here,
        ],
    );
    assert!(done.status.success(), "{}", text(&done.stderr));
    let remote = ["analyze", "s3://program/in/log.mcap", "--machine", machine];
    let done = run(
        &server,
        &[&remote[..], &["--out", "s3://program/out", "--verbose"]].concat(),
    );
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stderr).contains("transferred: s3://program/in/log.mcap: "));
    let out = folder("s3://program/out");
    let names: Vec<String> = out
        .list("**")
        .unwrap()
        .into_iter()
        .map(|entry| entry.key)
        .collect();
    let mut expected: Vec<String> = std::fs::read_dir(here)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    expected.sort();
    assert_eq!(names, expected);
    // the provenance differs, the numbers do not
    let fetched = local.path().join("fetched");
    std::fs::create_dir(&fetched).unwrap();
    for name in ["samples.parquet", "events.parquet"] {
        std::fs::write(fetched.join(name), out.get(name).unwrap()).unwrap();
        let table =
            |folder: &Path| tipwatch_analyze::tables::parquet::read(&folder.join(name)).unwrap();
        let (a, b) = (table(Path::new(here)), table(&fetched));
        assert_eq!(a.rows(), b.rows());
        assert!(
            a.columns()
                .iter()
                .zip(b.columns())
                .all(|(a, b)| a.is_same(b)),
            "{name}"
        );
    }
    let record: serde_json::Value =
        serde_json::from_slice(&out.get("custody.json").unwrap()).unwrap();
    let input = &record["inputs"][0];
    assert!(
        input["sha256"].is_null() && input["e_tag"].is_string(),
        "{input}"
    );
    let transfer = &record["transfers"][0];
    let (sent, all) = (
        transfer["bytes"].as_u64().unwrap(),
        transfer["file_bytes"].as_u64().unwrap(),
    );
    println!("{transfer}");
    assert!(sent * 20 < all, "{transfer}");
}

#[test]
fn results_that_cannot_be_sent_are_not_there() {
    let server = serve("refused");
    upload(
        "refused",
        "log.mcap",
        &std::fs::read(data("tiny_lift.mcap")).unwrap(),
    );
    let machine = data("tiny_lift.toml");
    let arguments = [
        "analyze",
        "s3://refused/log.mcap",
        "--machine",
        machine.to_str().unwrap(),
        "--out",
        "s3://refused/out",
    ];
    server.inject(
        99,
        |seen| seen.method != "GET" && seen.path.contains("summary.json"),
        Fault::Status(403),
    );
    let done = run(&server, &arguments);
    assert_eq!(done.status.code(), Some(1));
    let told = text(&done.stderr);
    assert!(
        told.contains("permission denied") && told.contains("s3://refused/out/summary.json"),
        "{told}"
    );
    server.heal();
    assert_eq!(folder("s3://refused/out").list("**").unwrap(), []);
}

#[test]
fn inspect_recover_check_machine_and_screen_take_places_of_a_bucket() {
    let server = serve("commands");
    let bytes = std::fs::read(data("tiny_lift.mcap")).unwrap();
    upload("commands", "2026/a.mcap", &bytes);
    // longer than the beginning and the end of a file that are read first: else it would be there as a whole
    let long = image_log(&data("tiny_lift.mcap"), Some(Compression::Lz4));
    let cut = &long[..long.len() * 3 / 4];
    assert!(cut.len() > 160_000);
    upload("commands", "2026/deep/cut.mcap", cut);
    let machine = data("tiny_lift.toml");
    let machine = machine.to_str().unwrap();
    let done = run(&server, &["inspect", "s3://commands/2026/a.mcap", "--json"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let found: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert!(found["transfers"][0]["requests"].as_u64().unwrap() >= 1);
    let check = [
        "check-machine",
        machine,
        "--log",
        "s3://commands/2026/a.mcap",
    ];
    assert_eq!(
        run(&server, &check).status.code(),
        run(
            &server,
            &[
                "check-machine",
                machine,
                "--log",
                data("tiny_lift.mcap").to_str().unwrap(),
            ]
        )
        .status
        .code()
    );
    let cut = "s3://commands/2026/deep/cut.mcap";
    let mended = "s3://commands/mended/log.mcap";
    let refused = run(&server, &["recover", cut, "--out", mended]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        text(&refused.stderr).contains("--fetch-whole"),
        "{}",
        text(&refused.stderr)
    );
    let recover = ["recover", cut, "--out", mended, "--fetch-whole"];
    assert_eq!(run(&server, &recover).status.code(), Some(3));
    let again = run(&server, &recover);
    assert!(
        text(&again.stderr).contains("already there"),
        "{}",
        text(&again.stderr)
    );
    assert!(run(&server, &["inspect", mended]).status.success());
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("fleet");
    let fleet = [
        "s3://commands/2026",
        "s3://commands/m*/*.mcap",
        "--machine",
        machine,
    ];
    let screen = [&["screen"], &fleet[..], &["--out", out.to_str().unwrap()]].concat();
    let done = run(&server, &screen);
    let told = text(&done.stderr);
    assert!(told.contains("Total: 3 logs, 1 failed"), "{told}");
}

#[test]
fn copies_in_a_bucket_are_one_log_and_other_bytes_of_the_same_length_are_not() {
    let server = serve("copies");
    // longer than the end of a file that is read first: else its bytes would be known
    let log = image_log(&data("tiny_lift.mcap"), Some(Compression::Lz4));
    let mut other = log.clone();
    // within an image
    let byte = other.len() / 2;
    other[byte] ^= 1;
    upload("copies", "a.mcap", &log);
    upload("copies", "deep/b.mcap", &log);
    upload("copies", "deep/c.mcap", &other);
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    let screen = [
        "screen",
        "s3://copies",
        "--machine",
        machine.to_str().unwrap(),
        "--out",
    ];
    server.take_seen();
    let done = run(&server, &[&screen[..], &[out.to_str().unwrap()]].concat());
    // its identity and its analysis read the log with the same requests
    let ranges = |seen: Seen| Some((seen.path, seen.range?));
    let ranges: Vec<_> = server.take_seen().into_iter().filter_map(ranges).collect();
    let distinct: BTreeSet<_> = ranges.iter().collect();
    assert!(ranges.len() > 3, "{ranges:?}");
    assert_eq!(distinct.len(), ranges.len(), "{ranges:?}");
    let totals = std::fs::read(out.join("screen.json")).unwrap();
    let totals: serde_json::Value = serde_json::from_slice(&totals).unwrap();
    let told = text(&done.stderr);
    assert_eq!(
        (totals["logs"].as_u64(), totals["copies"].as_u64()),
        (Some(2), Some(1)),
        "{totals:#} {told}"
    );
}

/// Logs outside the places that a run names are not reported as there, in a bucket as in a folder.
#[test]
fn logs_outside_the_named_places_of_a_bucket_are_told_and_stay() {
    let server = serve("places");
    upload(
        "places",
        "a/1.mcap",
        &std::fs::read(data("tiny.mcap")).unwrap(),
    );
    upload(
        "places",
        "b/2.mcap",
        &std::fs::read(data("tiny_lift.mcap")).unwrap(),
    );
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    let screen = |places: &[&str]| {
        let asked = [
            "--machine",
            machine.to_str().unwrap(),
            "--resume",
            "--prune",
        ];
        let out = ["--out", out.to_str().unwrap()];
        text(&run(&server, &[&["screen"], places, &asked, &out].concat()).stderr)
    };
    let told = screen(&["s3://places/a", "s3://places/b"]);
    assert!(!told.contains("out of reach"), "{told}");
    let told = screen(&["s3://places/a"]);
    assert!(
        told.contains("logs out of reach (in a folder that is not among those named, or is not there), which stay in the data set: 1, the first") && told.contains("Total: 2 logs"),
        "{told}"
    );
}

#[test]
fn logs_that_a_bucket_does_not_deliver_fail_by_storage_with_the_code_of_the_service() {
    let server = serve("undelivered");
    let bytes = std::fs::read(data("tiny_lift.mcap")).unwrap();
    let refusals = [
        ("gone", 404, "NoSuchKey", None),
        ("moved", 301, "PermanentRedirect", Some("eu-central-1")),
        ("expired", 400, "ExpiredToken", None),
        ("unknown", 403, "InvalidAccessKeyId", None),
        ("slow", 503, "SlowDown", None),
    ];
    for (name, status, code, region) in refusals {
        // each of them is listed
        upload("undelivered", &format!("{name}.mcap"), &bytes);
        let is_it = move |seen: &Seen| seen.path.contains(&format!("{name}.mcap"));
        server.inject(99, is_it, Fault::Refusal(status, code, region));
    }
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("fleet");
    let (out, machine) = (out.to_str().unwrap(), data("tiny_lift.toml"));
    let machine = ["--machine", machine.to_str().unwrap(), "--out", out];
    let done = run(
        &server,
        &[&["screen", "s3://undelivered"], &machine[..]].concat(),
    );
    assert_eq!(done.status.code(), Some(1), "{}", text(&done.stderr));
    let asked = [
        "query",
        out,
        "SELECT path, failure, reason FROM logs",
        "--json",
    ];
    let rows = run(&server, &asked).stdout;
    let rows: serde_json::Value = serde_json::from_slice(&rows).unwrap();
    for (name, status, code, region) in refusals {
        let mut found = rows.as_array().unwrap().iter();
        let row = found.find(|row| row["path"] == format!("s3://undelivered/{name}.mcap"));
        let row = row.unwrap();
        assert_eq!(row["failure"], "storage", "{row}");
        let reason = row["reason"].as_str().unwrap();
        assert!(reason.contains(&format!("{status} {code}")), "{row}");
        assert!(reason.contains(region.unwrap_or_default()), "{row}");
    }
}

#[test]
fn a_log_that_changes_while_it_is_read_fails_as_changed_and_is_read_by_the_next_run() {
    let server = serve("changing");
    // longer than what is read first: else nothing would be read after the change
    let log = image_log(&data("tiny_lift.mcap"), Some(Compression::Lz4));
    let other = image_log(&data("tiny.mcap"), Some(Compression::Lz4));
    upload("changing", "log.mcap", &log);
    let is_read = |seen: &Seen| seen.method == "GET" && seen.range.is_some();
    let object = server.folder().join("changing/log.mcap");
    // the first request is answered before the log is replaced
    server.inject(1, is_read, Fault::Short(usize::MAX));
    server.inject(1, is_read, Fault::Replace(object, other));
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("fleet");
    let (out, machine) = (out.to_str().unwrap(), data("tiny_lift.toml"));
    let mut found = Vec::new();
    for _ in 0..2 {
        let asked = [
            "screen",
            "s3://changing",
            "--machine",
            machine.to_str().unwrap(),
        ];
        let done = run(&server, &[&asked[..], &["--out", out, "--resume"]].concat());
        let sql = "SELECT failure FROM logs";
        let rows = run(&server, &["query", out, sql, "--json"]).stdout;
        let rows: serde_json::Value = serde_json::from_slice(&rows).unwrap();
        found.push((done.status.code(), rows[0]["failure"].clone()));
    }
    let expected = [
        (Some(1), "changed".into()),
        (Some(0), serde_json::Value::Null),
    ];
    assert_eq!(found, expected);
}

/// A place that the storage does not list costs no other place, and nothing below it is taken for deleted.
#[test]
fn a_place_that_is_not_listed_fails_alone_and_is_tried_again() {
    let server = serve("listing");
    for (key, log) in [("a/1.mcap", "tiny.mcap"), ("b/2.mcap", "tiny_lift.mcap")] {
        upload("listing", key, &std::fs::read(data(log)).unwrap());
    }
    let (folder, machine) = (tempfile::tempdir().unwrap(), data("tiny_lift.toml"));
    let screen = |out: &Path, places: &[&str]| {
        let asked = ["--machine", machine.to_str().unwrap(), "--resume"];
        let out = ["screen", "--prune", "--out", out.to_str().unwrap()];
        let asked = [&out, places, &asked].concat();
        run(&server, &asked).status.code()
    };
    let rows = |out: &Path| {
        let sql = "SELECT path, failure FROM logs ORDER BY path";
        let asked = ["query", out.to_str().unwrap(), sql, "--json"];
        let rows = run(&server, &asked).stdout;
        let rows: serde_json::Value = serde_json::from_slice(&rows).unwrap();
        let row = |row: &serde_json::Value| {
            let failure = row["failure"].as_str().map(ToOwned::to_owned);
            (row["path"].as_str().unwrap().to_owned(), failure)
        };
        rows.as_array().unwrap().iter().map(row).collect::<Vec<_>>()
    };
    let (a, b) = ("s3://listing/a/1.mcap", "s3://listing/b/2.mcap");
    let both = [(a.to_owned(), None), (b.to_owned(), None)];
    let refuse = || {
        let is_list =
            |seen: &Seen| seen.path.contains("list-type") && seen.path.contains("prefix=a");
        server.inject(99, is_list, Fault::Refusal(403, "AccessDenied", None));
    };
    let places = ["s3://listing/a", "s3://listing/a/", "s3://listing/a/*.mcap"];
    for (at, place) in places.into_iter().enumerate() {
        let out = folder.path().join(at.to_string());
        let places = [place, "s3://listing/b"];
        assert_eq!(screen(&out, &places), Some(0), "{place}");
        assert_eq!(rows(&out), both, "{place}");
        refuse();
        assert_eq!(screen(&out, &places), Some(1), "{place}");
        let mut expected = both.to_vec();
        expected.push((
            place.trim_end_matches('/').to_owned(),
            Some("storage".into()),
        ));
        expected.sort();
        assert_eq!(rows(&out), expected, "{place}");
        // alone, too
        assert_eq!(screen(&out, &[place]), Some(1), "{place}");
        server.heal();
        assert_eq!(screen(&out, &places), Some(0), "{place}");
        assert_eq!(rows(&out), both, "{place}");
    }
}

#[test]
fn secrets_of_urls_are_not_shown() {
    let server = serve("secrets");
    let address = format!(
        "http://me:{SECRET}@{}/secrets/log.mcap?X-Amz-Signature={SECRET}",
        server.address
    );
    for arguments in [
        &["inspect", &address][..],
        &[
            "analyze",
            &address,
            "--machine",
            "absent.toml",
            "--out",
            &format!("s3://x/y?token={SECRET}"),
        ],
        &["inspect", &format!("ftp://host/x?{SECRET}=1"), "--nothing"],
    ] {
        // `run` looks for it
        assert!(!run(&server, arguments).status.success());
    }
}

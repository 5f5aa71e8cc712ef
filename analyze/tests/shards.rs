//! A fleet split over processes: records, lost processes, late and repeated logs, versions.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Child;

use serde_json::Value as Json;
use tempfile::TempDir;

use super::screen::{files, fleet_logs, mixed_logs, result, screen, tables, texts};
use super::support::{code_and_stderr, command, data, json, stderr, text, tipwatch};

/// Starts a process that writes the records of a part.
fn part(logs: &Path, records: &Path, machine: &Path, shard: &[&str]) -> std::process::Command {
    let mut args = vec!["screen", text(logs), "--machine", text(machine), "-q"];
    args.extend(["--records", text(records), "--shard"]);
    args.extend(shard);
    command(&args)
}

fn gathered(records: &Path, out: &Path, more: &[&str]) -> (i32, String) {
    let mut args = vec!["screen", "--gather", text(records), "--out", text(out)];
    args.extend(more);
    code_and_stderr(&tipwatch(&args))
}

fn records(place: &Path) -> Vec<String> {
    let names = files(&place.join("state")).into_keys();
    names.filter(|name| name.ends_with(".json")).collect()
}

/// The one record of a log, by the end of its path.
fn record(place: &Path, log: &str) -> (PathBuf, Json) {
    let files = files(&place.join("state"));
    let records = files
        .values()
        .filter(|path| path.extension().is_some_and(|e| e == "json"));
    let mut found = records
        .map(|path| (path.clone(), json(path)))
        .filter(|(_, record)| record["path"].as_str().unwrap().ends_with(log));
    let first = found.next().unwrap();
    assert!(found.next().is_none(), "several records of {log}");
    first
}

#[test]
fn parts_named_by_engines_gather_to_the_data_set_of_one_run() {
    let logs = mixed_logs();
    let noisy = fleet_logs();
    for entry in fs::read_dir(noisy.path()).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, logs.path().join(path.file_name().unwrap())).unwrap();
    }
    let out = TempDir::new().unwrap();
    let at = |name: &str| out.path().join(name);
    let machine = data("tiny_lift.toml");
    let (code, _) = screen(logs.path(), &at("whole"), &["--machine", text(&machine)]);
    assert_eq!(code & 1, 1, "the photograph fails");

    // four engines share the logs: each variable counts from 0
    let variables: [&[(&str, &str)]; 4] = [
        &[("JOB_COMPLETION_INDEX", "0")],
        &[
            ("AWS_BATCH_JOB_ARRAY_INDEX", "1"),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "4"),
        ],
        &[
            ("SLURM_ARRAY_TASK_ID", "2"),
            ("SLURM_ARRAY_TASK_COUNT", "1"),
        ],
        &[("BATCH_TASK_INDEX", "3"), ("BATCH_TASK_COUNT", "4")],
    ];
    let start = |variables: &[(&str, &str)]| -> Child {
        let mut process = part(logs.path(), &at("records"), &machine, &["auto/4"]);
        process.envs(variables.iter().copied()).spawn().unwrap()
    };
    let mut processes: Vec<Child> = variables.iter().map(|v| start(v)).collect();
    for process in &mut processes {
        // a log that fails is a record, and no failure of the process
        assert_eq!(process.wait().unwrap().code(), Some(0));
    }
    let records_only: Vec<String> = files(&at("records")).into_keys().collect();
    assert!(
        records_only
            .iter()
            .all(|name| name.starts_with("state/") || name.starts_with("reports/")),
        "{records_only:?}"
    );
    // all parts once more, as an engine that is not sure does: nothing is written
    let before = result_with_state(&at("records"));
    for variables in variables {
        assert_eq!(start(variables).wait().unwrap().code(), Some(0));
    }
    assert!(before.keys().eq(result_with_state(&at("records")).keys()));

    let (gather_code, messages) = gathered(&at("records"), &at("gathered"), &[]);
    assert_eq!(gather_code, code, "{messages}");
    assert!(
        result(&at("gathered")) == result(&at("whole")),
        "the data set differs from a single run"
    );
    // in the place of the records itself, too
    let records = at("records");
    let args = ["screen", "--gather", "--out", text(&records)];
    assert_eq!(code_and_stderr(&tipwatch(&args)).0, code);
    assert!(result(&records) == result(&at("whole")));
}

/// All files but the lock, with their contents.
fn result_with_state(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let found = files(out).into_iter();
    let found = found.filter(|(name, _)| name != "state/lock");
    found
        .map(|(name, path)| (name, fs::read(path).unwrap()))
        .collect()
}

/// The marks of logs in progress, without files that a killed process left unfinished.
fn marks(place: &Path) -> BTreeMap<String, PathBuf> {
    let mut marks = files(&place.join("attempts"));
    marks.retain(|name, _| !name.starts_with('.'));
    marks
}

#[test]
fn a_log_that_takes_its_process_with_it_fails_and_the_others_do_not() {
    let logs = fleet_logs();
    let out = TempDir::new().unwrap();
    let (place, machine) = (out.path().join("records"), data("coverage.toml"));
    // a process that ends in the middle of a log leaves its mark: here each is killed at the first mark
    let wait_for_mark = |child: &mut Child| loop {
        let mark = marks(&place).into_keys().max();
        if mark.is_some() || child.try_wait().unwrap().is_some() {
            return mark;
        }
        std::thread::yield_now();
    };
    let mark = loop {
        let mut child = part(logs.path(), &place, &machine, &["1/1", "--jobs", "1"])
            .spawn()
            .unwrap();
        wait_for_mark(&mut child).expect("a mark of a log");
        child.kill().unwrap();
        child.wait().unwrap();
        // on a busy computer it may have come to another log meanwhile, or to the end of one
        if let Some(mark) = marks(&place).into_keys().max() {
            break mark;
        }
    };
    assert!(records(&place).len() < 12);
    let left = marks(&place);
    assert_eq!(left.len(), 1, "{left:?}");
    let lost = fs::read_to_string(&left[&mark]).unwrap();
    // two more processes are lost at the same log
    let (log, _) = mark.rsplit_once('.').unwrap();
    for number in [2, 3] {
        let again = place.join("attempts").join(format!("{log}.{number}"));
        fs::write(again, &lost).unwrap();
    }
    let ended = part(logs.path(), &place, &machine, &["1/1"])
        .output()
        .unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", stderr(&ended));
    assert_eq!(records(&place).len(), 12);
    let (_, failure) = record(
        &place,
        Path::new(&lost).file_name().unwrap().to_str().unwrap(),
    );
    assert_eq!(failure["result"]["status"], "failed");
    assert_eq!(failure["result"]["kind"], "worker_lost");
    let (code, _) = gathered(&place, &out.path().join("fleet"), &[text(logs.path())]);
    assert_eq!(code, 1);
    let totals = json(&out.path().join("fleet/screen.json"));
    assert_eq!(
        (&totals["logs"], &totals["failed"]),
        (&12.into(), &1.into())
    );
    // more attempts are allowed: the log is analysed, and its failure and its marks are gone
    let more = ["1/1", "--attempts", "5"];
    assert!(
        part(logs.path(), &place, &machine, &more)
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(record(&place, &lost).1["result"]["status"], "analysed");
    assert!(marks(&place).is_empty());
    let (code, messages) = gathered(&place, &out.path().join("fleet"), &[text(logs.path())]);
    assert_eq!((code, records(&place).len()), (0, 12), "{messages}");
}

#[test]
fn a_log_without_a_record_is_a_failure_until_its_record_comes() {
    let logs = fleet_logs();
    let out = TempDir::new().unwrap();
    let (place, fleet) = (out.path().join("records"), out.path().join("fleet"));
    let machine = data("coverage.toml");
    for shard in ["1/3", "3/3"] {
        assert!(
            part(logs.path(), &place, &machine, &[shard])
                .status()
                .unwrap()
                .success()
        );
    }
    let (code, messages) = gathered(&place, &fleet, &[text(logs.path())]);
    assert_eq!(code, 1, "{messages}");
    let failed = tables(&fleet, "logs");
    let failed: Vec<_> = failed
        .values()
        .flat_map(|table| texts(table, "failure"))
        .flatten()
        .collect();
    assert_eq!(failed, ["no_record"; 4]);
    // without the list of logs nobody can know that four are missing
    assert_eq!(gathered(&place, &fleet, &[]).0, 0);
    assert!(
        part(logs.path(), &place, &machine, &["2/3"])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(gathered(&place, &fleet, &[text(logs.path())]).0, 0);
    let whole = out.path().join("whole");
    screen(logs.path(), &whole, &["--machine", text(&machine)]);
    assert!(
        result(&fleet) == result(&whole),
        "a late record changes nothing else"
    );
}

/// Leaves a record as another version of the program would have written it.
fn leave_record(place: &Path, log: &str, version: &str, change: impl Fn(&mut Json)) {
    let (path, mut left) = record(place, log);
    left["tipwatch_version"] = version.into();
    let analysis = format!("{:0>16}", version.replace('.', ""));
    left["analysis_version"] = analysis.as_str().into();
    change(&mut left);
    let name = path.file_name().unwrap().to_str().unwrap();
    let old = json(&path)["analysis_version"]
        .as_str()
        .unwrap()
        .to_string();
    let name = name.replace(&old, &analysis);
    fs::write(path.with_file_name(name), left.to_string()).unwrap();
}

#[test]
fn a_new_version_replaces_the_rows_of_an_old_one() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let (place, fleet) = (out.path().join("records"), out.path().join("fleet"));
    let machine = data("tiny_lift.toml");
    assert!(
        part(logs.path(), &place, &machine, &["1/1"])
            .status()
            .unwrap()
            .success()
    );
    gathered(&place, &fleet, &[]);
    let before = result(&fleet);
    // older records, even if they were written later
    let late = |record: &mut Json| record["finished_ns"] = i64::MAX.into();
    leave_record(&place, "calm.mcap", "0.0.9", late);
    gathered(&place, &fleet, &[]);
    assert!(result(&fleet) == before, "an old version replaced a row");
    // a newer one, with another number; of the copies only one path has it
    let newer = |record: &mut Json| record["result"]["facts"]["rows"] = 7777.into();
    fs::remove_file(record_of_version(&place, "calm.mcap", "0.0.9")).unwrap();
    leave_record(&place, "calm.mcap", "0.10.0", newer);
    leave_record(&place, "lift_again.mcap", "0.10.0", newer);
    let (_, messages) = gathered(&place, &fleet, &[]);
    assert!(
        messages.contains("2 versions of the analysis"),
        "{messages}"
    );
    let rows: Vec<_> = tables(&fleet, "logs")
        .values()
        .flat_map(|table| {
            let whole = |column: &str| table.column(column).unwrap().optional_integers().unwrap();
            let versions = texts(table, "tipwatch_version");
            let rows = whole("rows").into_iter().zip(versions);
            let rows = rows.zip(whole("copies"));
            rows.map(|((rows, version), copies)| (version.unwrap(), rows, copies))
                .collect::<Vec<_>>()
        })
        .collect();
    let newest: Vec<_> = rows
        .iter()
        .filter(|(version, ..)| version == "0.10.0")
        .collect();
    assert_eq!(rows.len(), 4, "no row was doubled: {rows:?}");
    assert!(
        newest.len() == 2 && newest.iter().all(|(_, rows, _)| *rows == Some(7777)),
        "{rows:?}"
    );
    assert!(
        newest.iter().any(|(_, _, copies)| *copies == Some(1)),
        "{rows:?}"
    );
}

fn record_of_version(place: &Path, log: &str, version: &str) -> PathBuf {
    let records = files(&place.join("state")).into_values();
    let mut records = records.filter(|path| path.extension().is_some_and(|e| e == "json"));
    records
        .find(|path| {
            let record = json(path);
            record["path"].as_str().unwrap().ends_with(log) && record["tipwatch_version"] == version
        })
        .unwrap()
}

#[test]
fn a_damaged_record_is_written_again() {
    let logs = TempDir::new().unwrap();
    fs::copy(data("tiny.mcap"), logs.path().join("calm.mcap")).unwrap();
    fs::copy(data("tiny_lift.mcap"), logs.path().join("lift.mcap")).unwrap();
    let out = TempDir::new().unwrap();
    let (place, machine) = (out.path().join("records"), data("tiny_lift.toml"));
    assert!(
        part(logs.path(), &place, &machine, &["1/1"])
            .status()
            .unwrap()
            .success()
    );
    let (path, good) = record(&place, "calm.mcap");
    fs::write(&path, "{\"schema\": 3, \"path\"").unwrap();
    let (_, messages) = gathered(&place, &out.path().join("fleet"), &[text(logs.path())]);
    assert!(
        messages.contains("note:") && messages.contains("state/"),
        "{messages}"
    );
    assert_eq!(json(&out.path().join("fleet/screen.json"))["failed"], 1);
    // nobody names the log, but it does not vanish
    let _ = gathered(&place, &out.path().join("unnamed"), &[]);
    let totals = json(&out.path().join("unnamed/screen.json"));
    assert_eq!((&totals["logs"], &totals["failed"]), (&2.into(), &1.into()));
    assert!(
        part(logs.path(), &place, &machine, &["1/1"])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(json(&path)["result"], good["result"]);
}

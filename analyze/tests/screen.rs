//! Fleets of logs: what the data set contains, interruptions, messages.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;
use tipwatch_analyze::tables::cell;
use tipwatch_analyze::tables::parquet;
use tipwatch_analyze::tables::table::Table;

use super::support::{code_and_stderr, command, data, stderr, text, tipwatch};

/// Screens with these arguments into `out`; returns exit code and messages.
pub(super) fn screen(logs: &Path, out: &Path, more: &[&str]) -> (i32, String) {
    let mut args = vec!["screen", text(logs), "--out", text(out)];
    args.extend(more);
    code_and_stderr(&tipwatch(&args))
}

/// All Parquet files of a kind, by path within the folder.
pub(super) fn tables(out: &Path, kind: &str) -> BTreeMap<String, Table> {
    let read = |(name, path): (String, PathBuf)| (name, parquet::read(&path).unwrap());
    files(&out.join(kind)).into_iter().map(read).collect()
}

/// The files in a folder tree, by path within it.
pub(super) fn files(folder: &Path) -> BTreeMap<String, PathBuf> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        match path.is_dir() {
            true => found.extend(
                files(&path)
                    .into_iter()
                    .map(|(n, p)| (format!("{name}/{n}"), p)),
            ),
            false => {
                found.insert(name, path);
            }
        }
    }
    found
}

pub(super) fn texts(table: &Table, column: &str) -> Vec<Option<String>> {
    table.column(column).unwrap().texts().unwrap()
}

pub(super) fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// What must not depend on the course of a run: tables, page and totals to the byte, and the names of the
/// reports (their contents include the time of the analysis).
pub(super) fn result(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut result = files(out);
    result.retain(|name, _| !name.starts_with("state/"));
    let bytes = |name: &str, path: PathBuf| match name.starts_with("reports/") {
        true => Vec::new(),
        false => fs::read(path).unwrap(),
    };
    result
        .into_iter()
        .map(|(name, path)| (name.clone(), bytes(&name, path)))
        .collect()
}

/// A folder with logs of one machine: two good ones, a copy, a damaged one, and one that is not a log.
pub(super) fn mixed_logs() -> TempDir {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::copy(data("tiny.mcap"), at("calm.mcap")).unwrap();
    fs::copy(data("tiny_lift.mcap"), at("lift.mcap")).unwrap();
    fs::copy(data("tiny_lift.mcap"), at("lift_again.mcap")).unwrap();
    let bytes = fs::read(data("tiny_lift.mcap")).unwrap();
    fs::write(at("cut.mcap"), &bytes[..bytes.len() * 3 / 4]).unwrap();
    fs::write(at("photo.mcap"), b"\xff\xd8\xff\xe0 a photograph").unwrap();
    fs::write(at("list.txt"), "# two logs\ncalm.mcap\nmissing.mcap\n").unwrap();
    folder
}

#[test]
fn each_log_is_listed_once_with_the_reason_of_failure() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    let list = logs.path().join("list.txt");
    let (code, messages) = screen(
        logs.path(),
        &out,
        &[text(&list), "--machine", text(&machine)],
    );
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("photo.mcap") && messages.contains("missing.mcap"),
        "{messages}"
    );
    let totals = json(&out.join("screen.json"));
    let count = |key: &str| totals[key].as_u64().unwrap();
    assert_eq!(
        [
            count("logs"),
            count("analysed"),
            count("failed"),
            count("copies")
        ],
        [5, 3, 2, 1],
        "{totals}"
    );

    let tables = tables(&out, "logs");
    let names: Vec<&String> = tables.keys().collect();
    assert_eq!(names.len(), 3, "{names:?}");
    let unknown = "machine=__HIVE_DEFAULT_PARTITION__/day=__HIVE_DEFAULT_PARTITION__/logs.parquet";
    let missing = &tables[unknown];
    assert!(
        texts(missing, "reason")[0]
            .as_ref()
            .unwrap()
            .contains("No such file")
    );
    assert_eq!(texts(missing, "log_id"), [None]);
    let (place, good) = tables
        .iter()
        .find(|(name, _)| name.contains("/day=2"))
        .unwrap();
    assert!(
        place.starts_with("machine=") && good.rows() == 3,
        "{place}: {good:?}"
    );
    assert!(
        texts(good, "status")
            .iter()
            .all(|status| status.as_deref() == Some("analysed"))
    );

    let row = |name: &str| {
        let paths = texts(good, "path");
        paths
            .iter()
            .position(|path| path.as_ref().unwrap().ends_with(name))
            .unwrap()
    };
    let number = |column: &str, row: usize| {
        let numbers = good.column(column).unwrap().numbers().unwrap();
        Some(numbers[row]).filter(|number| !number.is_nan())
    };
    assert!(number("worst_margin", row("/lift.mcap")).unwrap() < 0.0);
    assert!(number("worst_margin", row("/calm.mcap")).unwrap() > 0.1);
    assert!(number("worst_margin_sigma", row("/calm.mcap")).unwrap() > 0.0);
    let lasts = number("covered_s", row("/lift.mcap")).unwrap();
    let mut margins = good.column("margin_s").unwrap().values();
    let Some(cell::Value::List(margins)) = margins.nth(row("/lift.mcap")) else {
        panic!("expected a list of margins");
    };
    let in_bins: f64 = (margins.iter())
        .map(|seconds| match seconds {
            cell::Value::Number(seconds) => *seconds,
            other => panic!("expected a number, found {other:?}"),
        })
        .sum();
    assert!((in_bins + number("unknown_s", row("/lift.mcap")).unwrap() - lasts).abs() < 1e-6);
    let exposed = number("exposed_s", row("/lift.mcap")).unwrap();
    let causes = tipwatch_analyze::policy::facts::EXPOSURE_CAUSES;
    let by_cause: f64 = causes
        .iter()
        .map(|cause| number(&format!("exposed_{cause}_s"), row("/lift.mcap")).unwrap())
        .sum();
    assert!(
        exposed > 0.1 && (by_cause - exposed).abs() < 1e-6,
        "{by_cause} of {exposed}"
    );

    // reports of those with findings, sharing one script; the page links to them and needs nothing else
    let reports = texts(good, "report");
    assert_eq!(reports[row("/calm.mcap")], None);
    let report = reports[row("/lift.mcap")].as_ref().unwrap();
    let page = fs::read_to_string(out.join(report)).unwrap();
    assert!(page.len() < 1_500_000 && page.contains("<script src=\"../plots.js\">"));
    assert!(fs::metadata(out.join("reports/plots.js")).unwrap().len() > 1_000_000);
    let fleet = fs::read_to_string(out.join("fleet.html")).unwrap();
    assert!(fleet.contains(report.as_str()) && fleet.contains("photo.mcap"));
    assert!(
        !fleet.contains("<script") && !fleet.contains("://"),
        "the page fetches something"
    );
    assert_eq!(
        fs::read_dir(logs.path()).unwrap().count(),
        6,
        "nothing beside the evidence"
    );
}

#[test]
fn copies_analysed_in_parallel_count_as_one_log() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    for i in 0..12 {
        let name = format!("copy_{i:02}.mcap");
        fs::copy(data("tiny_lift.mcap"), logs.path().join(name)).unwrap();
    }
    let (out, machine) = (out.path().join("fleet"), data("tiny_lift.toml"));
    let (code, messages) = screen(
        logs.path(),
        &out,
        &["--machine", text(&machine), "--jobs", "8"],
    );
    assert_eq!(code, 0, "{messages}");
    let totals = json(&out.join("screen.json"));
    assert_eq!(
        (&totals["logs"], &totals["copies"], &totals["failed"]),
        (&1.into(), &11.into(), &0.into())
    );
    assert_eq!(fs::read_dir(out.join("reports")).unwrap().count(), 2);
}

/// Twelve noisy logs of the same machine.
pub(super) fn fleet_logs() -> TempDir {
    let folder = TempDir::new().unwrap();
    for i in 0..12 {
        let name = format!("coverage_{i:02}.mcap");
        fs::copy(data(&name), folder.path().join(&name)).unwrap();
    }
    folder
}

#[test]
fn a_run_killed_repeatedly_gives_the_same_data_set() {
    let logs = fleet_logs();
    let out = TempDir::new().unwrap();
    let machine = data("coverage.toml");
    let machine = ["--machine", text(&machine)];
    let (whole, killed) = (out.path().join("whole"), out.path().join("killed"));
    assert_eq!(screen(logs.path(), &whole, &machine).0, 0);

    let records = || {
        let records = files(&killed.join("state")).into_keys();
        records.filter(|name| name.ends_with(".json")).count()
    };
    let mut amidst = 0;
    for _ in 0..6 {
        // each run makes some progress before it is killed
        let enough = records() + 1;
        let mut args = vec![
            "screen",
            text(logs.path()),
            "--out",
            text(&killed),
            "--resume",
            "-q",
        ];
        args.extend(machine);
        let mut child = command(&args).spawn().unwrap();
        while records() < enough && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let done = records();
        amidst += usize::from(done < 12);
        assert!(
            done == 12 || !killed.join("screen.json").exists(),
            "an incomplete data set must not look complete"
        );
    }
    assert!(amidst > 0, "no run was killed before its end");
    let mut more = vec!["--resume"];
    more.extend(machine);
    assert_eq!(screen(logs.path(), &killed, &more).0, 0);
    assert!(
        result(&killed) == result(&whole),
        "the data set differs from an uninterrupted run"
    );
}

#[test]
fn gathered_shards_equal_a_single_run() {
    let logs = fleet_logs();
    let out = TempDir::new().unwrap();
    let machine = data("coverage.toml");
    let machine = ["--machine", text(&machine)];
    let (whole, shared) = (out.path().join("whole"), out.path().join("shared"));
    assert_eq!(screen(logs.path(), &whole, &machine).0, 0);
    let mut children = Vec::new();
    for shard in ["1/3", "2/3", "3/3"] {
        let mut args = vec![
            "screen",
            text(logs.path()),
            "--out",
            text(&shared),
            "-q",
            "--shard",
            shard,
        ];
        args.extend(machine);
        children.push(command(&args).spawn().unwrap());
    }
    for mut child in children {
        assert_eq!(child.wait().unwrap().code(), Some(0));
    }
    assert!(!shared.join("fleet.html").exists());
    let gathered = command(&["screen", "--gather", "--out", text(&shared)])
        .output()
        .unwrap();
    assert_eq!(gathered.status.code(), Some(0), "{}", stderr(&gathered));
    assert!(
        result(&shared) == result(&whole),
        "the data set differs from a single run"
    );
}

#[test]
fn resume_analyses_only_new_logs() {
    let logs = TempDir::new().unwrap();
    let out = TempDir::new().unwrap();
    let out = out.path();
    for name in ["tiny.mcap", "tiny_lift.mcap"] {
        fs::copy(data(name), logs.path().join(name)).unwrap();
    }
    for name in ["tiny_lift.toml", "tiny_lift.urdf"] {
        fs::copy(data(name), logs.path().join(name)).unwrap();
    }
    let machine = logs.path().join("tiny_lift.toml");
    let again = |more: &[&str]| {
        let mut args = vec!["--machine", text(&machine)];
        args.extend(more);
        screen(logs.path(), out, &args)
    };
    assert!(again(&[]).1.contains("2 analysed, 0 failed, 0 unchanged"));
    let (code, messages) = again(&[]);
    assert_eq!(code, 1);
    assert!(messages.contains("--resume"), "{messages}");
    let before = result(out);
    assert!(
        again(&["--resume"])
            .1
            .contains("0 analysed, 0 failed, 2 unchanged")
    );
    assert!(result(out) == before);

    // the same content under another path; another content under the same path
    fs::copy(logs.path().join("tiny.mcap"), logs.path().join("copy.mcap")).unwrap();
    let (_, messages) = again(&["--resume"]);
    assert!(
        messages.contains("0 analysed, 0 failed, 3 unchanged")
            && messages.contains("Total: 2 logs"),
        "{messages}"
    );
    fs::copy(data("swing_lift.mcap"), logs.path().join("copy.mcap")).unwrap();
    let (_, messages) = again(&["--resume"]);
    assert!(
        messages.contains("1 analysed") && messages.contains("Total: 3 logs"),
        "{messages}"
    );

    // a missing report is written again; other options or another machine file need a new analysis
    fs::remove_dir_all(out.join("reports")).unwrap();
    assert!(!again(&["--resume"]).1.contains("0 analysed"));
    assert!(
        again(&["--resume", "--estimator", "causal"])
            .1
            .contains("3 analysed")
    );
    let changed = fs::read_to_string(&machine).unwrap() + "\n# another word\n";
    fs::write(&machine, changed).unwrap();
    let (_, messages) = again(&["--resume", "--estimator", "causal"]);
    assert!(
        messages.contains("3 analysed") && messages.contains("Total: 3 logs"),
        "{messages}"
    );
}

/// Users rely on the columns and their types.
#[test]
fn the_data_set_has_the_documented_columns() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let machine = data("tiny_lift.toml");
    screen(logs.path(), out.path(), &["--machine", text(&machine)]);
    let document = fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../book/src/reference/data-set.md"),
    )
    .unwrap();
    let section = document
        .split("# Fleet data set")
        .nth(1)
        .unwrap()
        .split("With polars")
        .next()
        .unwrap();
    for kind in ["logs", "events"] {
        let tables = tables(out.path(), kind);
        let schemas: Vec<_> = tables
            .values()
            .map(|table| {
                let columns = table.columns().iter();
                let typed = columns.map(|c| (c.name().to_string(), c.type_name()));
                typed.collect::<Vec<_>>()
            })
            .collect();
        assert!(
            schemas.windows(2).all(|pair| pair[0] == pair[1]),
            "{kind}: types differ"
        );
        for (name, _) in &schemas[0] {
            let pattern = match name.as_str() {
                name if name.starts_with("exposed_") && name != "exposed_s" => "exposed_<cause>_s",
                name if name.ends_with("_events") => "<kind>_events",
                name => name,
            };
            assert!(
                section.contains(&format!("`{pattern}`")),
                "{kind}: {name} is not documented"
            );
        }
    }
    let events = tables(out.path(), "events");
    let kinds: Vec<_> = events
        .values()
        .flat_map(|table| texts(table, "kind"))
        .flatten()
        .collect();
    assert!(kinds.contains(&"wheel_lift".to_string()), "{kinds:?}");
}

#[test]
fn a_violated_policy_exits_with_4() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    fs::copy(data("tiny.mcap"), logs.path().join("calm.mcap")).unwrap();
    fs::copy(data("tiny_lift.mcap"), logs.path().join("lift.mcap")).unwrap();
    let machine = data("tiny_lift.toml");
    let at = |name: &str| out.path().join(name);
    let policy = at("policy.toml");
    fs::write(
        &policy,
        "name = 'no lift'\n[[rule]]\nname = 'wheels stay down'\nevent = 'wheel_lift'\n\
         [[rule]]\nquantity = 'worst_margin_low'\nat_least = -10.0\n",
    )
    .unwrap();
    let asked = ["--machine", text(&machine), "--policy", text(&policy)];
    let (code, messages) = screen(logs.path(), &at("fleet"), &asked);
    assert_eq!(code, 4, "{messages}");
    let result = json(&at("fleet/policy.json"));
    assert_eq!(
        (result["passed"].as_bool(), result["logs_broken"].as_u64()),
        (Some(false), Some(1))
    );
    assert!(
        result["logs"][0]["path"]
            .as_str()
            .unwrap()
            .ends_with("lift.mcap")
    );
    assert_eq!(result["logs"][0]["broken"][0]["rule"], "wheels stay down");
    assert!(
        fs::read_to_string(at("fleet/fleet.html"))
            .unwrap()
            .contains("wheels stay down")
    );

    let analyze = |log: &str, policy: &Path, out: &Path| {
        let log = logs.path().join(log);
        let args = [
            "analyze",
            text(&log),
            "--machine",
            text(&machine),
            "--out",
            text(out),
            "--policy",
            text(policy),
        ];
        let output = command(&args).output().unwrap();
        (output.status.code(), stderr(&output))
    };
    let (code, messages) = analyze("lift.mcap", &policy, &at("one"));
    assert_eq!(code, Some(4), "{messages}");
    assert!(
        messages.contains("rule violated: wheels stay down"),
        "{messages}"
    );
    let judgement = json(&at("one/policy.json"));
    assert_eq!(judgement["rules"][1]["passed"], true);
    assert_eq!(analyze("calm.mcap", &policy, &at("two")).0, Some(0));

    for (mistake, parts) in [
        (
            "[[rule]]\nevent = 'wheel_lft'",
            ["rule 1", "wheel_lift", "wheel_lft"],
        ),
        (
            "[[rule]]\nquantity = 'worst_margin'",
            ["rule 1", "at_least", "neither"],
        ),
        (
            "[[rule]]\nevent = 'tip_over'\nunknown = 'pass'",
            ["rule 1", "unknown", "event"],
        ),
        (
            "[[rule]]\nlimit = 3",
            ["policy.toml", "unknown field", "limit"],
        ),
        ("name = 'empty'", ["policy.toml", "[[rule]]", "none"]),
    ] {
        fs::write(&policy, mistake).unwrap();
        let (code, messages) = analyze("calm.mcap", &policy, &at("three"));
        assert_eq!(code, Some(1), "{messages}");
        for part in parts {
            assert!(messages.contains(part), "\"{part}\" is not in: {messages}");
        }
    }
}

#[test]
fn a_fleet_file_assigns_machines_or_gives_the_reason() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let at = |name: &str| logs.path().join(name);
    for folder in ["a", "b", "both", "odd"] {
        fs::create_dir(at(folder)).unwrap();
        fs::copy(data("tiny.mcap"), at(folder).join(format!("{folder}.mcap"))).unwrap();
    }
    // different content: equal logs count once
    for folder in ["b", "both", "odd"] {
        with_metadata(&at(folder).join(format!("{folder}.mcap")), folder);
    }
    for (name, machine) in [("first.toml", "first"), ("second.toml", "second/2")] {
        let text = fs::read_to_string(data("tiny.toml")).unwrap();
        let old = text.lines().find(|line| line.starts_with("name")).unwrap();
        fs::write(
            out.path().join(name),
            text.replace(old, &format!("name = \"{machine}\"")),
        )
        .unwrap();
    }
    fs::copy(data("tiny.urdf"), out.path().join("tiny.urdf")).unwrap();
    let fleet = out.path().join("fleet.toml");
    fs::write(
        &fleet,
        "[[machine]]\nfile = 'first.toml'\npath = '**/a/*'\ntopic = '/joint_*'\n\
         [[machine]]\nfile = 'second.toml'\nmetadata = { record = 'session', key = 'vehicle', value = 'b*' }\n\
         [[machine]]\nfile = 'first.toml'\npath = '**/both/**'\n",
    )
    .unwrap();
    let result = out.path().join("result");
    let (code, messages) = screen(logs.path(), &result, &["--fleet", text(&fleet)]);
    assert_eq!(code, 1, "{messages}");
    let tables = tables(&result, "logs");
    let of = |machine: &str| {
        let found = tables.iter().find(|(name, table)| {
            name.starts_with(&format!("machine={machine}/")) && texts(table, "reason")[0].is_none()
        });
        found.map(|(_, table)| texts(table, "path")[0].clone().unwrap())
    };
    assert!(of("first").unwrap().ends_with("/a/a.mcap"));
    assert!(of("second%2F2").unwrap().ends_with("/b/b.mcap"));
    let failed: Vec<_> = tables
        .values()
        .flat_map(|table| texts(table, "reason"))
        .flatten()
        .collect();
    assert!(
        failed
            .iter()
            .any(|r| r.contains("for first.toml and second.toml")),
        "{failed:?}"
    );
    assert!(
        failed.iter().any(|r| r.contains("found neither")),
        "{failed:?}"
    );
}

/// Rewrites an MCAP file with a metadata record that names its vehicle.
fn with_metadata(path: &Path, vehicle: &str) {
    let bytes = fs::read(path).unwrap();
    let mut writer = mcap::Writer::new(File::create(path).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    let values = [("vehicle".to_string(), vehicle.to_string())];
    let metadata = mcap::records::Metadata {
        name: "session".into(),
        metadata: values.into_iter().collect(),
    };
    writer.write_metadata(&metadata).unwrap();
    let attachment = mcap::Attachment {
        log_time: 0,
        create_time: 0,
        name: "note".into(),
        media_type: "text/plain".into(),
        data: Cow::Borrowed(vehicle.as_bytes()),
    };
    writer.attach(&attachment).unwrap();
    writer.finish().unwrap();
}

#[test]
fn usage_errors_of_screen_exit_with_2() {
    for args in [
        vec!["screen", "--out", "o", "--machine", "m"],
        vec!["screen", "logs", "--out", "o"],
        vec![
            "screen",
            "logs",
            "--out",
            "o",
            "--machine",
            "m",
            "--shard",
            "4/3",
        ],
        vec![
            "screen",
            "logs",
            "--out",
            "o",
            "--machine",
            "m",
            "--fleet",
            "f",
        ],
        vec!["screen", "--out", "o", "--gather", "--jobs", "2"],
        vec![
            "screen",
            "logs",
            "--machine",
            "m",
            "--records",
            "r",
            "--out",
            "o",
        ],
        vec![
            "screen",
            "logs",
            "--machine",
            "m",
            "--out",
            "o",
            "--attempts",
            "2",
        ],
        vec![
            "screen",
            "logs",
            "--machine",
            "m",
            "--records",
            "r",
            "--shard",
            "auto/3",
        ],
        vec![
            "screen",
            "logs",
            "--out",
            "o",
            "--machine",
            "m",
            "--policy",
            "p",
            "--fail-on",
            "tip_over",
        ],
        vec!["compare", "one.mcap", "--machine", "m"],
    ] {
        assert_eq!(
            command(&args).output().unwrap().status.code(),
            Some(2),
            "{args:?}"
        );
    }
}

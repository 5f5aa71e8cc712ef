//! Fleets of logs: contents of the data set, interruptions, messages.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;
use tipwatch_analyze::tables::parquet;
use tipwatch_analyze::tables::table::{self, Table};

use super::support::{code_and_stderr, command, data, json, stderr, text, tipwatch};

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

/// Returns the outputs that must not depend on the course of a run: tables, page and totals to the byte, and the names of the
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
    assert_eq!(names.len(), 2, "a month, and what has no date: {names:?}");
    let failed = &tables["undated.parquet"];
    let missing = texts(failed, "path");
    let missing = missing
        .iter()
        .position(|path| path.as_ref().unwrap().ends_with("missing.mcap"))
        .unwrap();
    let reason = texts(failed, "reason")[missing].clone().unwrap();
    assert!(reason.contains("No such file"), "{reason}");
    assert_eq!(texts(failed, "log_id")[missing], None);
    let (place, good) = tables
        .iter()
        .find(|(name, _)| name.starts_with('2'))
        .unwrap();
    assert!(good.rows() == 3, "{place}: {good:?}");
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
    // no split can be worse than the stated one for every log: four wheels at rest keep a margin under any of them
    let any_split = |log: &str| number("margin_any_split", row(log)).unwrap();
    assert!((0.3..=1.0).contains(&any_split("/calm.mcap")));
    for log in ["/calm.mcap", "/lift.mcap"] {
        assert!(
            any_split(log) >= number("worst_margin", row(log)).unwrap(),
            "{log}"
        );
    }
    let lasts = number("covered_s", row("/lift.mcap")).unwrap();
    let mut margins = good.column("margin_s").unwrap().values();
    let Some(table::Value::List(margins)) = margins.nth(row("/lift.mcap")) else {
        panic!("expected a list of margins");
    };
    let in_bins: f64 = margins.sum().unwrap();
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
    assert!(page.len() < 150_000, "{}", page.len());
    let script = page.split_once("<script src=\"").unwrap().1;
    let script = out
        .join(report)
        .parent()
        .unwrap()
        .join(script.split('"').next().unwrap());
    let script = fs::read_to_string(script).unwrap();
    assert!(script.contains("window.unpacked") && !page.contains("window.unpacked = "));
    let fleet = fs::read_to_string(out.join("fleet.html")).unwrap();
    assert!(fleet.contains(report.as_str()) && fleet.contains("photo.mcap"));
    // the one address is the name of a namespace
    let addresses = fleet.replace("http://www.w3.org/2000/svg", "");
    assert!(!addresses.contains("://"), "the page fetches something");
    assert!(fleet.contains("default-src 'none'"));
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
    // one report, and the scripts beside it
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

/// Users rely on the columns and their types, which the reference page lists as they are declared.
#[test]
fn the_data_set_has_the_documented_columns() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let machine = data("tiny_lift.toml");
    screen(logs.path(), out.path(), &["--machine", text(&machine)]);
    for (kind, columns) in &*tipwatch_analyze::screen::TABLES {
        let tables = tables(out.path(), kind);
        assert!(!tables.is_empty());
        for (file, table) in tables {
            let found: Vec<&str> = table.columns().iter().map(table::Column::name).collect();
            let declared: Vec<&str> = columns.iter().map(|column| column.name).collect();
            assert_eq!(found, declared, "{kind}/{file}");
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
        let mut rows = tables.values().flat_map(|table| {
            let machines = texts(table, "machine").into_iter();
            let rest = texts(table, "reason").into_iter().zip(texts(table, "path"));
            machines.zip(rest)
        });
        let found =
            rows.find(|(name, (reason, _))| name.as_deref() == Some(machine) && reason.is_none());
        found.map(|(_, (_, path))| path.unwrap())
    };
    assert!(of("first").unwrap().ends_with("/a/a.mcap"));
    assert!(of("second/2").unwrap().ends_with("/b/b.mcap"));
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

/// One machine file of machines that are alike: each rule names its own.
#[test]
fn one_machine_file_of_several_machines_has_their_names() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let at = |name: &str| logs.path().join(name);
    for folder in ["a", "b", "both"] {
        fs::create_dir(at(folder)).unwrap();
        fs::copy(data("tiny.mcap"), at(folder).join("log.mcap")).unwrap();
        with_metadata(&at(folder).join("log.mcap"), folder);
    }
    let fleet = out.path().join("fleet.toml");
    let file = data("tiny.toml");
    let rule = |name: &str, path: &str| {
        let file = text(&file);
        format!("[[machine]]\nfile = '{file}'\nname = '{name}'\npath = '**/{path}/*'\n")
    };
    let rules = [
        ("fw-01", "a"),
        ("fw-02", "b"),
        ("fw-01", "both"),
        ("fw-02", "both"),
    ];
    let rules = rules.map(|(name, path)| rule(name, path)).concat();
    fs::write(&fleet, rules).unwrap();
    let result = out.path().join("result");
    let (code, messages) = screen(
        logs.path(),
        &result,
        &["--fleet", text(&fleet), "--reports", "all"],
    );
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("tiny.toml (fw-01)") && messages.contains("tiny.toml (fw-02)"),
        "{messages}"
    );
    let rows = ask(
        &result,
        "SELECT machine, report FROM logs WHERE status = 'analysed' ORDER BY path",
    );
    for (row, name) in [(0, "fw-01"), (1, "fw-02")] {
        assert_eq!(rows[row]["machine"], name, "{rows}");
        let report = result.join(rows[row]["report"].as_str().unwrap());
        assert!(fs::read_to_string(report).unwrap().contains(name), "{rows}");
    }
    fs::write(&fleet, rule(" ", "a")).unwrap();
    let (code, messages) = screen(
        logs.path(),
        &out.path().join("other"),
        &["--fleet", text(&fleet)],
    );
    assert!(
        code == 1 && messages.contains("expected a name"),
        "{messages}"
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
    for line in [
        "screen --out o --machine m",
        "screen logs --out o",
        "screen logs --out o --machine m --shard 4/3",
        "screen logs --out o --machine m --fleet f",
        "screen --out o --gather --jobs 2",
        "screen --out o --gather --prune",
        "screen --out o --gather records --prune",
        "screen logs --machine m --records r --out o",
        "screen logs --machine m --out o --attempts 2",
        "screen logs --machine m --records r --shard auto/3",
        "screen logs --out o --machine m --policy p --fail-on tip_over",
        "compare one.mcap --machine m",
        "query fleet SELECT_1 --csv --json",
        "query fleet",
    ] {
        let args: Vec<&str> = line.split(' ').collect();
        let code = command(&args).output().unwrap().status.code();
        assert_eq!(code, Some(2), "{line}");
    }
}

/// The rows of a query, as JSON.
fn ask(out: &Path, sql: &str) -> Value {
    let asked = command(&["query", text(out), sql, "--json"])
        .output()
        .unwrap();
    assert!(asked.status.success(), "{}", stderr(&asked));
    serde_json::from_slice(&asked.stdout).unwrap()
}

#[test]
fn a_data_set_answers_sql() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    screen(logs.path(), &out, &["--machine", text(&machine)]);
    let rows = ask(
        &out,
        "SELECT status, count(*) AS logs FROM logs GROUP BY status ORDER BY status",
    );
    assert_eq!(
        rows,
        serde_json::json!([{"status": "analysed", "logs": 3}, {"status": "failed", "logs": 1}])
    );
    let rows = ask(
        &out,
        "SELECT l.path, e.kind, l.day FROM events e JOIN logs l ON e.log_id = l.log_id \
         WHERE e.kind = 'wheel_lift' ORDER BY l.path",
    );
    let rows_of = |name: &str| {
        let rows = rows.as_array().unwrap().iter();
        let of = rows.filter(|row| row["path"].as_str().unwrap().ends_with(name));
        of.count()
    };
    // the log that is cut ends after the wheel has lifted
    assert_eq!(
        [rows_of("/lift.mcap"), rows_of("/cut.mcap")],
        [1, 1],
        "{rows}"
    );
    assert_eq!(rows[0]["day"].as_str().unwrap().len(), 10, "{rows}");
    for (since, logs) in [("2000-01-01", 3), ("2090-01-01", 0)] {
        let rows = ask(
            &out,
            &format!("SELECT count(*) AS logs FROM logs WHERE day >= '{since}'"),
        );
        assert_eq!(rows[0]["logs"], logs, "{since}");
    }

    // times are texts that people and programs read; the name of a table has no case
    let rows = ask(
        &out,
        "SELECT max(LOGS.day) - min(LOGS.day) AS span, CAST(1780000000500000 AS TIMESTAMP) AS at, \
         CAST(9223372036854775807 AS TIMESTAMP) AS far FROM LOGS",
    );
    let span = rows[0]["span"].as_str().unwrap();
    assert!(span.ends_with('d') || span == "0µs", "{rows}");
    assert_eq!(rows[0]["at"], "2026-05-28 20:26:40.500", "{rows}");
    assert_eq!(rows[0]["far"], i64::MAX, "{rows}");
    assert_eq!(
        ask(&out, "SHOW TABLES"),
        serde_json::json!([{"name": "comparisons"}, {"name": "events"}, {"name": "logs"}])
    );

    let run = |more: &[&str]| {
        let mut args = vec!["query", text(&out)];
        args.extend(more);
        command(&args).output().unwrap()
    };
    let csv = run(&[
        "SELECT path, worst_margin, wheels FROM logs ORDER BY path",
        "--csv",
    ]);
    let mut lines = csv::Reader::from_reader(&csv.stdout[..]);
    assert_eq!(
        lines.headers().unwrap(),
        vec!["path", "worst_margin", "wheels"]
    );
    let lines: Vec<_> = lines.records().map(Result::unwrap).collect();
    assert_eq!(lines.len(), 4);
    let wheels: Vec<String> = serde_json::from_str(&lines[0][2]).unwrap();
    assert_eq!(wheels.len(), 4);
    let file = out.join("answer.parquet");
    assert!(
        run(&["SELECT path FROM logs", "--parquet", text(&file)])
            .status
            .success()
    );
    assert_eq!(parquet::read(&file).unwrap().rows(), 4);
    let shown = run(&["SELECT path FROM logs", "--rows", "1"]);
    let shown = String::from_utf8(shown.stdout).unwrap();
    assert!(shown.contains("1 of 4 rows"), "{shown}");
    for (sql, part) in [
        ("", "expected \"SELECT"),
        ("SELEC path", "expected \"SELECT"),
        ("INSERT INTO logs VALUES (1)", "read with SELECT"),
        ("DELETE FROM logs", "read with SELECT"),
        ("DROP TABLE logs", "read with SELECT"),
        ("TRUNCATE logs", "read with SELECT"),
        ("UPDATE logs SET path = 'x'", "read with SELECT"),
        ("CREATE TABLE logs AS SELECT 1", "read with SELECT"),
        (
            "WITH a AS (SELECT 1) INSERT INTO logs SELECT * FROM a",
            "not",
        ),
        ("SELECT * FROM", "Expected: identifier"),
        ("SELECT FROM logs", "expected a column or *"),
        ("SELECT path FROM logs WHERE", "Expected: an expression"),
        (
            "SELECT path FROM logs; SELECT path FROM logs",
            "(and only one) statement",
        ),
        ("SELECT pth FROM logs", "logs has machine, machine_type, "),
        (
            "SELECT worst_margn FROM logs",
            "Did you mean \"worst_margin\"",
        ),
        ("SELECT l.pth FROM logs l", "logs has machine, "),
        (
            "SELECT path FROM logs WHERE kind = 'x'",
            "\"kind\" (logs has",
        ),
        ("SELECT path FROM logs ORDER BY pth", "(logs has machine, "),
        (
            "SELECT e.kind, l.pth FROM events e JOIN logs l ON e.log_id = l.log_id",
            "; events has ",
        ),
        ("SELECT * FROM machines", "logs, events and comparisons"),
        ("SELECT path FROM logs GROUP BY machine", "'path'"),
        ("SELECT nothing(path) FROM logs", "'nothing'"),
        (
            "SELECT machine, machine FROM logs",
            "found \"machine\" twice: AS",
        ),
        ("SELECT 1 AS a, 2 AS a", "found \"a\" twice: AS"),
        ("SELECT path FROM logs WHERE path > 1", "string"),
    ] {
        let failed = run(&[sql]);
        assert_eq!(failed.status.code(), Some(1), "{sql}");
        let told = stderr(&failed);
        assert!(told.contains(part), "{sql}: {told}");
        // one sentence: no plan and no tree of the parser
        assert_eq!(told.trim().lines().count(), 1, "{sql}: {told}");
    }
    let nothing = command(&["query", text(logs.path()), "SELECT * FROM logs"])
        .output()
        .unwrap();
    assert!(
        stderr(&nothing).contains("expected a data set"),
        "{}",
        stderr(&nothing)
    );
}

/// A file of an older version has fewer columns: missing ones are null, and the others stay.
#[test]
fn files_of_older_versions_answer_too() {
    use polars::prelude::{ParquetReader, ParquetWriter, SerReader};
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    screen(logs.path(), &out, &["--machine", text(&machine)]);
    let (name, path) = files(&out.join("logs")).pop_first().unwrap();
    let old = ParquetReader::new(File::open(&path).unwrap())
        .finish()
        .unwrap();
    let mut old = old.drop_many(["margin_any_split", "lifted_s", "worst_posture"]);
    let older = out.join("logs/1999-01.parquet");
    ParquetWriter::new(File::create(older).unwrap())
        .finish(&mut old)
        .unwrap();
    let rows = ask(
        &out,
        "SELECT count(*) AS logs, count(margin_any_split) AS known FROM logs WHERE status = 'analysed'",
    );
    assert_eq!(rows, serde_json::json!([{"logs": 6, "known": 3}]), "{name}");

    // and one of a newer version has more: what this one knows of it stays
    let mut newer = ParquetReader::new(File::open(&path).unwrap())
        .finish()
        .unwrap();
    let column = newer.column("path").unwrap().clone();
    newer
        .with_column(column.with_name("what_comes_later".into()))
        .unwrap();
    ParquetWriter::new(File::create(out.join("logs/2099-01.parquet")).unwrap())
        .finish(&mut newer)
        .unwrap();
    let rows = ask(
        &out,
        "SELECT count(*) AS logs, count(margin_any_split) AS known FROM logs WHERE status = 'analysed'",
    );
    assert_eq!(rows, serde_json::json!([{"logs": 9, "known": 6}]), "{name}");
    let all = ask(&out, "SELECT * FROM logs");
    assert_eq!(all.as_array().unwrap().len(), 10);
    assert!(all[0].get("what_comes_later").is_none(), "{all}");
}

#[test]
fn json_has_the_columns_in_the_order_of_the_query() {
    let (logs, out) = (mixed_logs(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let machine = data("tiny_lift.toml");
    screen(logs.path(), &out, &["--machine", text(&machine)]);
    let sql = "SELECT status, path, bytes FROM logs ORDER BY path LIMIT 1";
    let asked = tipwatch(&["query", text(&out), sql, "--json"]);
    let told = String::from_utf8(asked.stdout).unwrap();
    let place = |name: &str| told.find(&format!("\"{name}\"")).unwrap();
    assert!(
        place("status") < place("path") && place("path") < place("bytes"),
        "{told}"
    );
}

#[test]
fn only_tables_that_change_are_written_again() {
    let (logs, out) = (fleet_logs(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let machine = data("coverage.toml");
    let asked = ["--machine", text(&machine), "--resume"];
    screen(logs.path(), &out, &asked);
    let inodes = || {
        use std::os::unix::fs::MetadataExt;
        let of = |(name, path): (String, PathBuf)| (name, fs::metadata(path).unwrap().ino());
        files(&out.join("logs"))
            .into_iter()
            .map(of)
            .collect::<BTreeMap<_, _>>()
    };
    let before = inodes();
    fs::write(logs.path().join("photo.mcap"), "a photograph").unwrap();
    screen(logs.path(), &out, &asked);
    let after = inodes();
    let is_changed = |name: &&String| before.get(*name) != after.get(*name);
    let changed: Vec<&String> = after.keys().filter(is_changed).collect();
    assert_eq!(changed, ["undated.parquet"], "{after:?}");
}

#[test]
fn one_content_under_two_machines_is_a_conflict() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let at = |name: &str| logs.path().join(name);
    for (folder, number) in [("a", "0012"), ("b", "7")] {
        fs::create_dir(at(folder)).unwrap();
        let written = fs::read_to_string(data("tiny_lift.toml")).unwrap();
        let old = written
            .lines()
            .find(|line| line.starts_with("name"))
            .unwrap();
        let named = written.replace(old, &format!("name = \"{number}\""));
        fs::write(out.path().join(format!("{folder}.toml")), named).unwrap();
    }
    fs::copy(data("tiny_lift.urdf"), out.path().join("tiny_lift.urdf")).unwrap();
    let fleet = out.path().join("fleet.toml");
    fs::write(
        &fleet,
        "[[machine]]\nfile = 'a.toml'\npath = '**/a/*'\n[[machine]]\nfile = 'b.toml'\npath = '**/b/*'\n",
    )
    .unwrap();
    let result = out.path().join("result");
    let again = || screen(logs.path(), &result, &["--fleet", text(&fleet), "--resume"]);
    fs::copy(data("tiny_lift.mcap"), at("b/lift.mcap")).unwrap();
    assert_eq!(again().0, 0);
    let margin = ask(&result, "SELECT machine, worst_margin FROM logs");
    assert_eq!(margin[0]["machine"], "7");

    // a stray copy in the folder of another machine
    fs::copy(data("tiny_lift.mcap"), at("a/lift.mcap")).unwrap();
    let (code, messages) = again();
    assert_eq!(code, 1);
    assert!(messages.contains("b/lift.mcap (7)"), "{messages}");
    let rows = ask(
        &result,
        "SELECT machine, failure, reason FROM logs ORDER BY machine",
    );
    assert_eq!(rows.as_array().unwrap().len(), 2, "{rows}");
    assert_eq!(
        (&rows[0]["machine"], &rows[0]["failure"]),
        (&"0012".into(), &"machine".into())
    );
    for part in ["a/lift.mcap (0012)", "b/lift.mcap (7)"] {
        assert!(rows[1]["reason"].as_str().unwrap().contains(part), "{rows}");
    }

    // without it the row is what it was
    fs::remove_file(at("a/lift.mcap")).unwrap();
    let (code, messages) = again();
    assert_eq!(code, 0);
    assert!(
        messages.contains("counts for another machine"),
        "{messages}"
    );
    let gather = ["screen", "--gather", "--out", text(&result)];
    assert_eq!(code_and_stderr(&tipwatch(&gather)).0, 0);
    assert_eq!(
        ask(&result, "SELECT machine, worst_margin FROM logs"),
        margin
    );
}

#[test]
fn moved_logs_keep_one_row_and_deleted_ones_leave() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let at = |name: &str| logs.path().join(name);
    for name in ["tiny.mcap", "tiny_lift.mcap"] {
        fs::copy(data(name), at(name)).unwrap();
    }
    let machine = data("tiny_lift.toml");
    let again = |more: &[&str]| {
        let mut args = vec!["--machine", text(&machine), "--resume"];
        args.extend(more);
        screen(logs.path(), &out, &args)
    };
    again(&[]);
    fs::create_dir(at("archive")).unwrap();
    fs::rename(at("tiny.mcap"), at("archive/old.mcap")).unwrap();
    let (_, messages) = again(&[]);
    assert!(
        messages.contains("Total: 2 logs") && !messages.contains("no longer"),
        "{messages}"
    );
    let rows = ask(&out, "SELECT path, copies FROM logs ORDER BY path");
    assert!(
        rows[0]["path"]
            .as_str()
            .unwrap()
            .ends_with("archive/old.mcap"),
        "{rows}"
    );
    assert_eq!(rows[0]["copies"], 0);

    fs::remove_file(at("archive/old.mcap")).unwrap();
    let (_, messages) = again(&[]);
    assert!(
        messages.contains("Total: 2 logs")
            && messages.contains("logs that no longer exist and stay")
            && messages.contains("--prune"),
        "{messages}"
    );
    let (_, messages) = again(&["--prune"]);
    assert!(
        messages.contains("Total: 1 log,") && messages.contains("were removed"),
        "{messages}"
    );
    let (_, messages) = again(&[]);
    assert!(
        messages.contains("Total: 1 log,") && !messages.contains("no longer"),
        "{messages}"
    );
}

/// A deleted log that a manifest names fails each time, and does not stay for ever.
#[test]
fn a_deleted_log_of_a_manifest_fails_and_is_pruned() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let at = |name: &str| logs.path().join(name);
    fs::create_dir(at("archive")).unwrap();
    fs::copy(data("tiny.mcap"), at("kept.mcap")).unwrap();
    fs::copy(data("tiny_lift.mcap"), at("archive/old.mcap")).unwrap();
    fs::write(at("list.txt"), "kept.mcap\narchive/old.mcap\n").unwrap();
    let machine = data("tiny_lift.toml");
    let again = |more: &[&str]| {
        let mut args = vec!["--machine", text(&machine), "--resume"];
        args.extend(more);
        screen(&at("list.txt"), &out, &args)
    };
    assert_eq!(again(&[]).0, 0);
    // its folder is empty then, and the other log shows that it is no medium that is away
    fs::remove_file(at("archive/old.mcap")).unwrap();
    let (code, messages) = again(&[]);
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("failed: ")
            && messages.contains("logs that no longer exist and stay")
            && messages.contains(
                "logs that failed in this run and keep their earlier result: 1, the first"
            )
            && messages.contains("Total: 2 logs"),
        "{messages}"
    );
    let (code, messages) = again(&["--prune"]);
    assert_eq!(code, 1, "{messages}");
    assert!(
        messages.contains("were removed")
            && !messages.contains("earlier result")
            && messages.contains("Total: 1 log, 0 failed"),
        "{messages}"
    );
    fs::write(at("list.txt"), "kept.mcap\n").unwrap();
    let (code, messages) = again(&[]);
    assert_eq!(code, 0, "{messages}");
    assert!(messages.contains("Total: 1 log, 0 failed"), "{messages}");

    // all of them away is a medium that is not mounted
    fs::remove_file(at("kept.mcap")).unwrap();
    fs::rename(at("list.txt"), at("archive/list.txt")).unwrap();
    fs::write(at("archive/list.txt"), "../mount/kept.mcap\n").unwrap();
    fs::create_dir(at("mount")).unwrap();
    fs::copy(data("tiny.mcap"), at("mount/kept.mcap")).unwrap();
    let mounted = || {
        let args = ["--machine", text(&machine), "--resume", "--prune"];
        screen(&at("archive/list.txt"), &out, &args)
    };
    mounted();
    fs::remove_file(at("mount/kept.mcap")).unwrap();
    let (code, messages) = mounted();
    assert_eq!(code, 1, "{messages}");
    assert!(!messages.contains("were removed"), "{messages}");
}

/// A folder that is not there fails as a log of that name, once: what its path is then is seen again in every run.
#[test]
fn a_folder_that_was_away_fails_only_while_it_is() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let (here, away) = (logs.path().join("here"), logs.path().join("away"));
    for (folder, log) in [(&here, "tiny.mcap"), (&away, "tiny_lift.mcap")] {
        fs::create_dir(folder).unwrap();
        fs::copy(data(log), folder.join(log)).unwrap();
    }
    let machine = data("tiny_lift.toml");
    let again = |more: &[&str]| {
        let mut args = vec![text(&away), "--machine", text(&machine), "--resume"];
        args.extend(more);
        screen(&here, &out, &args)
    };
    assert_eq!(again(&[]).0, 0);
    let unmounted = logs.path().join("unmounted");
    fs::rename(&away, &unmounted).unwrap();
    let (code, messages) = again(&["--prune"]);
    assert_eq!(code, 1);
    assert!(
        messages.contains("Total: 3 logs, 1 failed") && messages.contains("out of reach"),
        "{messages}"
    );
    // as the empty folder of what is not mounted
    fs::create_dir(&away).unwrap();
    let (code, messages) = again(&["--prune"]);
    assert_eq!(code, 0, "{messages}");
    assert!(
        messages.contains("Total: 2 logs, 0 failed") && messages.contains("out of reach"),
        "{messages}"
    );
    fs::remove_dir(&away).unwrap();
    fs::rename(&unmounted, &away).unwrap();
    let (code, messages) = again(&["--prune"]);
    assert_eq!(code, 0, "{messages}");
    assert!(
        messages.contains("2 unchanged. Total: 2 logs, 0 failed") && !messages.contains("note"),
        "{messages}"
    );

    // a folder that is not named is not looked at
    fs::remove_file(away.join("tiny_lift.mcap")).unwrap();
    fs::copy(data("tiny.mcap"), away.join("copy.mcap")).unwrap();
    let args = ["--machine", text(&machine), "--resume", "--prune"];
    let (_, messages) = screen(&here, &out, &args);
    assert!(
        messages.contains("Total: 2 logs") && messages.contains("out of reach"),
        "{messages}"
    );
    let (_, messages) = again(&["--prune"]);
    assert!(
        messages.contains("Total: 1 log,") && messages.contains("were removed"),
        "{messages}"
    );
}

/// Before the recorder writes its metadata the files of a bag are logs, afterwards they are parts of one.
#[test]
fn a_bag_whose_metadata_came_later_counts_once() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    let bag = logs.path().join("bag");
    fs::create_dir(&bag).unwrap();
    fs::copy(data("tiny_lift.mcap"), bag.join("bag_0.mcap")).unwrap();
    let machine = data("tiny_lift.toml");
    let args = ["--machine", text(&machine), "--resume"];
    assert_eq!(screen(logs.path(), &out, &args).0, 0);
    let metadata = "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n    - bag_0.mcap\n";
    fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    let (code, messages) = screen(logs.path(), &out, &args);
    assert_eq!(code, 0, "{messages}");
    assert!(messages.contains("Total: 1 log,"), "{messages}");
    let rows = ask(&out, "SELECT path FROM logs");
    assert!(
        rows[0]["path"].as_str().unwrap().ends_with("/bag"),
        "{rows}"
    );
    assert_eq!(
        code_and_stderr(&tipwatch(&["screen", "--gather", "--out", text(&out)])).0,
        0
    );
    assert_eq!(ask(&out, "SELECT path FROM logs"), rows);
}

#[test]
fn a_report_that_somebody_removed_is_linked_nowhere() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    fs::copy(data("tiny_lift.mcap"), logs.path().join("lift.mcap")).unwrap();
    let machine = data("tiny_lift.toml");
    screen(logs.path(), &out, &["--machine", text(&machine)]);
    let linked = || ask(&out, "SELECT report FROM logs")[0]["report"].clone();
    fs::remove_file(out.join(linked().as_str().unwrap())).unwrap();
    let gather = ["screen", "--gather", "--out", text(&out)];
    assert_eq!(code_and_stderr(&tipwatch(&gather)).0, 0);
    assert_eq!(linked(), Value::Null);
    let page = fs::read_to_string(out.join("fleet.html")).unwrap();
    assert!(!page.contains("report.html\""));
    let args = ["--machine", text(&machine), "--resume"];
    screen(
        logs.path(),
        &out,
        &[&args[..], &["--reports", "none"]].concat(),
    );
    assert_eq!(linked(), Value::Null);
    screen(logs.path(), &out, &args);
    assert!(out.join(linked().as_str().unwrap()).is_file());
}

/// Events that are less probable than not are no findings; times and margins that their bands do not tell apart are not ordered.
#[test]
fn the_ranking_says_no_more_than_the_data_bear() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    fs::copy(data("tiny_lift.mcap"), logs.path().join("lift.mcap")).unwrap();
    let machine = data("tiny_lift.toml");
    screen(logs.path(), &out, &["--machine", text(&machine)]);
    let state = out.join("state");
    let records = files(&state);
    let (name, path) = records
        .iter()
        .find(|(name, _)| name.ends_with(".json"))
        .unwrap();
    let pattern = json(path);
    fs::remove_file(path).unwrap();
    let events = pattern["result"]["events"].as_array().unwrap();
    let lift = events
        .iter()
        .find(|event| event["kind"] == "wheel_lift")
        .unwrap();
    for (log, kind, certainty, duration_s) in [
        ("a", "wheel_lift", 0.99, 1.0),
        ("b", "wheel_lift", 0.99, 1.01),
        ("c", "wheel_lift", 0.99, 5.0),
        ("d", "tip_over", 0.4995, 9.0),
        ("e", "tip_over", 0.99, 0.5),
        ("f", "wheel_lift", 0.99, 0.2),
        ("g", "wheel_lift", 0.03, 60.0),
    ] {
        let mut record = pattern.clone();
        record["path"] = format!("/logs/{log}.mcap").into();
        record["log_id"] = log.repeat(64).into();
        let mut event = lift.clone();
        event["kind"] = kind.into();
        event["certainty"] = certainty.into();
        event["duration_s"] = duration_s.into();
        event["start_sigma_s"] = 0.01.into();
        let mut fault = event.clone();
        fault["kind"] = "input_fault".into();
        fault["subject"] = "imu".into();
        let mut events = vec![event, fault];
        if log == "f" {
            // long, and hardly believed
            let mut other = lift.clone();
            other["certainty"] = 0.03.into();
            other["start_ns"] = (lift["start_ns"].as_i64().unwrap() + 100_000_000_000).into();
            other["duration_s"] = 60.0.into();
            events.push(other);
        }
        record["result"]["events"] = events.into();
        record["result"]["facts"]["doubts"] = vec!["a load that nobody stated"].into();
        record["result"]["has_report"] = false.into();
        if log == "e" {
            // the loads before the fall do not lead to it
            record["result"]["facts"]["worst"]["margin"] = 0.104.into();
            record["result"]["facts"]["worst"]["sigma"] = 0.03.into();
        }
        record["result"]["facts"]["event_counts"]["tip_over"] =
            u64::from(kind == "tip_over").into();
        fs::write(state.join(format!("{log}{name}")), record.to_string()).unwrap();
    }
    let gather = ["screen", "--gather", "--out", text(&out)];
    assert_eq!(code_and_stderr(&tipwatch(&gather)).0, 0);
    let doubted = ask(&out, "SELECT doubted FROM logs")[0]["doubted"].clone();
    assert_eq!(
        doubted.to_string(),
        r#"["a load that nobody stated","imu"]"#
    );
    let page = fs::read_to_string(out.join("fleet.html")).unwrap();
    let of_the_fall = ask(&out, "SELECT doubted FROM logs WHERE path = '/logs/e.mcap'").to_string();
    assert!(
        of_the_fall.contains("what was found contradicts it"),
        "{of_the_fall}"
    );
    let ranking = page.split("class=\"ranking\"").nth(1).unwrap();
    let ranking = ranking.split("</table>").next().unwrap();
    let ranking = &ranking.replace("<td class=\"whole\">", "<td>");
    let contradicted = ranking.matches("10.4 % ± 6.0 %: contradicted by the finding");
    assert_eq!(contradicted.count(), 1, "{ranking}");
    assert_eq!(ranking.matches("contradicted").count(), 1, "{ranking}");
    let ranks = ranking.split("<tr>").filter_map(|row| {
        let cells: Vec<&str> = row.split("<td>").collect();
        let log = cells.get(3)?.split(".mcap</").next()?;
        let [rank, finding] = [1, 4].map(|cell| cells[cell].split("</td>").next().unwrap());
        Some((log.chars().next_back()?, rank, finding))
    });
    let ranks: Vec<(char, &str, &str)> = ranks.collect();
    let order: Vec<(char, &str)> = ranks.iter().map(|(log, rank, _)| (*log, *rank)).collect();
    assert_eq!(
        order,
        [
            ('e', "1"),
            ('c', "2"),
            ('b', "3 to 4"),
            ('a', "3 to 4"),
            ('f', "5"),
            ('d', "6 to 7"),
            ('g', "6 to 7")
        ]
    );
    let sql = "SELECT lifted_s, lift_certainty FROM logs WHERE path IN ('/logs/f.mcap', '/logs/g.mcap') ORDER BY path";
    let lifted = ask(&out, sql);
    assert_eq!(
        lifted,
        serde_json::json!([
            {"lifted_s": 0.2, "lift_certainty": 0.99},
            {"lifted_s": 0.0, "lift_certainty": 0.03}
        ])
    );
    let finding = ranks[5].2;
    assert!(
        finding.contains("not decided") && finding.contains("perhaps tip over"),
        "{finding}"
    );
}

/// The name of a file need be no text: its record, which tells it as well as a text can, is that of a file that exists.
#[cfg(unix)]
#[test]
fn logs_whose_name_is_no_text_are_not_gone() {
    use std::os::unix::ffi::OsStrExt;

    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let out = out.path().join("fleet");
    fs::copy(data("tiny.mcap"), logs.path().join("tiny.mcap")).unwrap();
    let name = std::ffi::OsStr::from_bytes(b"drive-\xff.mcap");
    fs::write(logs.path().join(name), "no log").unwrap();
    let machine = data("tiny_lift.toml");
    for more in [&[][..], &["--prune"], &["--prune"]] {
        let mut args = vec!["--machine", text(&machine), "--resume"];
        args.extend(more);
        let (_, messages) = screen(logs.path(), &out, &args);
        assert!(
            messages.contains("Total: 2 logs") && !messages.contains("no longer"),
            "{messages}"
        );
        let failed = "SELECT count(*) AS logs FROM logs WHERE status = 'failed'";
        assert_eq!(ask(&out, failed)[0]["logs"], 1);
    }
    fs::remove_file(logs.path().join(name)).unwrap();
    let args = ["--machine", text(&machine), "--resume", "--prune"];
    let (_, messages) = screen(logs.path(), &out, &args);
    assert!(
        messages.contains("Total: 1 log,") && messages.contains("were removed"),
        "{messages}"
    );
}

#[test]
fn reports_are_written_for_those_asked_for() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    for name in ["tiny.mcap", "tiny_lift.mcap"] {
        fs::copy(data(name), logs.path().join(name)).unwrap();
    }
    let machine = data("tiny_lift.toml");
    let out = out.path().join("fleet");
    let reports = |asked: &str| {
        screen(
            logs.path(),
            &out,
            &["--machine", text(&machine), "--resume", "--reports", asked],
        );
        ask(&out, "SELECT count(report) AS reports FROM logs")[0]["reports"].as_u64()
    };
    // one after the other into one folder: what is asked for later is written then
    assert_eq!(reports("none"), Some(0));
    assert_eq!(reports("events"), Some(1));
    assert_eq!(reports("all"), Some(2));
    assert_eq!(reports("none"), Some(2), "what is there stays");
}

#[test]
fn one_content_under_two_files_of_one_name_is_a_conflict() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let at = |name: &str| out.path().join(name);
    let written = fs::read_to_string(data("tiny_lift.toml")).unwrap();
    let changed = written.replace("min_load = 500.0", "min_load = 600.0");
    assert_ne!(written, changed);
    fs::copy(data("tiny_lift.urdf"), at("tiny_lift.urdf")).unwrap();
    for (name, machine) in [("a", &written), ("b", &changed)] {
        fs::create_dir(logs.path().join(name)).unwrap();
        fs::copy(
            data("tiny_lift.mcap"),
            logs.path().join(name).join("lift.mcap"),
        )
        .unwrap();
        fs::write(at(&format!("{name}.toml")), machine).unwrap();
    }
    let fleet = at("fleet.toml");
    fs::write(
        &fleet,
        "[[machine]]\nfile = 'a.toml'\npath = '**/a/*'\n[[machine]]\nfile = 'b.toml'\npath = '**/b/*'\n",
    )
    .unwrap();
    let result = at("result");
    let (code, messages) = screen(logs.path(), &result, &["--fleet", text(&fleet)]);
    assert_eq!(code, 1, "{messages}");
    let warned = messages
        .matches("machine files that differ have the same name")
        .count();
    assert!(warned == 1 && messages.contains("b.toml"), "{messages}");
    let rows = ask(&result, "SELECT failure, reason FROM logs");
    assert_eq!(rows.as_array().unwrap().len(), 2, "{rows}");
    for row in rows.as_array().unwrap() {
        assert_eq!(row["failure"], "machine", "{rows}");
        let reason = row["reason"].as_str().unwrap();
        for part in ["a/lift.mcap (", "b/lift.mcap (", "machine file "] {
            assert!(reason.contains(part), "{reason}");
        }
    }
    assert_eq!(reports_of(&result).len(), 2, "one for each");

    // whichever copy goes, the other one keeps its own report
    for (name, other) in [("a", "b"), ("b", "a")] {
        let gone = logs.path().join(other).join("lift.mcap");
        let kept = logs.path().join(name).join("lift.mcap");
        fs::rename(&gone, at("gone.mcap")).unwrap();
        let asked = ["--fleet", text(&fleet), "--resume", "--prune"];
        let (code, messages) = screen(logs.path(), &result, &asked);
        assert_eq!(code, 0, "{messages}");
        let rows = ask(
            &result,
            "SELECT path, report, machine_file_sha256 FROM logs",
        );
        assert_eq!(rows[0]["path"], text(&kept), "{rows}");
        let report = result.join(rows[0]["report"].as_str().unwrap());
        let summary = json(&report.with_file_name("summary.json"));
        assert_eq!(
            summary["provenance"]["machine_file"]["sha256"], rows[0]["machine_file_sha256"],
            "{summary}"
        );
        assert_eq!(reports_of(&result), [report.parent().unwrap()]);
        fs::rename(at("gone.mcap"), &gone).unwrap();
        screen(logs.path(), &result, &asked);
    }
}

/// Two machine files of one text in two folders, each with a URDF of its own beside it.
#[test]
fn one_content_under_one_text_with_two_urdfs_is_a_conflict() {
    let (logs, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let at = |name: &str| out.path().join(name);
    let urdf = fs::read_to_string(data("tiny_lift.urdf")).unwrap();
    let heavier = urdf.replacen("mass value='60.0'", "mass value='61.0'", 1);
    assert_ne!(urdf, heavier);
    for (name, urdf) in [("a", &urdf), ("b", &heavier)] {
        fs::create_dir(at(name)).unwrap();
        fs::copy(data("tiny_lift.toml"), at(name).join("machine.toml")).unwrap();
        fs::write(at(name).join("tiny_lift.urdf"), urdf).unwrap();
        fs::create_dir(logs.path().join(name)).unwrap();
        let log = logs.path().join(name).join("lift.mcap");
        fs::copy(data("tiny_lift.mcap"), log).unwrap();
    }
    let fleet = at("fleet.toml");
    fs::write(
        &fleet,
        "[[machine]]\nfile = 'a/machine.toml'\npath = '**/a/*'\n\
         [[machine]]\nfile = 'b/machine.toml'\npath = '**/b/*'\n",
    )
    .unwrap();
    let result = at("result");
    let (code, messages) = screen(logs.path(), &result, &["--fleet", text(&fleet)]);
    assert_eq!(code, 1, "{messages}");
    let named = |machine: &str| messages.contains(text(&at(machine).join("machine.toml")));
    assert!(named("a") && named("b"), "{messages}");
    let failures = |result: &Path| {
        let rows = ask(result, "SELECT failure FROM logs");
        let rows = rows.as_array().unwrap().iter();
        rows.map(|row| row["failure"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(failures(&result), ["machine", "machine"]);

    // from the records alone, too
    let gathered = at("gathered");
    let (code, messages) = code_and_stderr(&tipwatch(&[
        "screen",
        "--gather",
        text(&result),
        "--out",
        text(&gathered),
    ]));
    assert_eq!(code, 1, "{messages}");
    assert_eq!(failures(&gathered), ["machine", "machine"]);

    // with one URDF they are copies; the result with the other one is stale
    fs::write(at("b/tiny_lift.urdf"), &urdf).unwrap();
    let again = ["--fleet", text(&fleet), "--resume"];
    let (code, messages) = screen(logs.path(), &result, &again);
    assert_eq!(code, 0, "{messages}");
    assert_eq!(
        ask(&result, "SELECT status, copies FROM logs"),
        serde_json::json!([{"status": "analysed", "copies": 1}])
    );
}

/// Much of the page of a crane, whose wheels and feet all have their figures, is in the file beside it.
#[test]
fn reports_of_a_fleet_are_small() {
    for name in ["tip_over", "crane", "forklift", "second_paper"] {
        let out = TempDir::new().unwrap();
        let [log, machine] = ["mcap", "toml"].map(|kind| data(&format!("{name}.{kind}")));
        let more = ["--machine", text(&machine), "--reports", "all"];
        screen(&log, out.path(), &more);
        let reports = reports_of(out.path());
        assert_eq!(reports.len(), 1, "{name}");
        let page = fs::read(reports[0].join("report.html")).unwrap();
        // those of an hour with many events need room up to 150 kB
        assert!(page.len() < 140_000, "{name}: {}", page.len());
    }
}

/// The folders of reports.
fn reports_of(out: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(out.join("reports")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.is_dir()).collect()
}

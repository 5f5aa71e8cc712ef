//! The guided commissioning over shared memory, and its result at the start of a monitor.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;
use tipwatch_analyze::setup::commissioning::from_log;
use tipwatch_binding::{Commissioning, MachineFile, sha256};
use tipwatch_calibration::commissioning::Status;
use tipwatch_mechanics::machine::Proof;

use crate::support::offline::causal;
use crate::support::{World, data};

/// A copy of the fixture with its machine file changed.
fn machine(edit: impl Fn(String) -> String) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let read = |name: &str| fs::read_to_string(data(name)).unwrap();
    let path = folder.path().join("commissioning.toml");
    fs::write(&path, edit(read("commissioning.toml"))).unwrap();
    fs::copy(
        data("commissioning.urdf"),
        folder.path().join("commissioning.urdf"),
    )
    .unwrap();
    (folder, path)
}

/// Exit code, output and result of a guided commissioning.
struct Guided {
    code: i32,
    out: String,
    result: Commissioning,
}

/// Commissions by `program`, with the drive replayed and these lines as input.
fn guided(test: &str, mut program: Command, machine: &Path, input: &str) -> Guided {
    let world = World::new(test);
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("result.json");
    let mut child = program
        .args([
            "--commissioning",
            file.to_str().unwrap(),
            "--prefix",
            &world.prefix,
        ])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(input.as_bytes()).unwrap();
    drop(stdin);
    let options = ["--speed", "max", "--lossless", "--wait", "60"];
    let replay = world
        .replay_log(&data("commissioning.mcap"), machine, &options)
        .end();
    assert!(replay.status.success(), "{}", replay.err);
    let output = child.wait_with_output().unwrap();
    Guided {
        code: output.status.code().unwrap(),
        out: String::from_utf8(output.stdout).unwrap(),
        result: Commissioning::read(&file).unwrap(),
    }
}

fn live(machine: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tipwatch-live"));
    command.args(["check-machine", "--machine", machine.to_str().unwrap()]);
    command
}

#[test]
fn the_guide_proves_a_good_machine_and_its_result_binds_the_monitor() {
    let (folder, path) = machine(|text| format!("commissioning = \"result.json\"\n{text}"));
    // `tipwatch check-machine --live` runs the program beside it.
    let tipwatch = Path::new(env!("CARGO_BIN_EXE_tipwatch-live")).with_file_name("tipwatch");
    assert!(tipwatch.exists(), "build with --workspace");
    let mut command = Command::new(tipwatch);
    command.args(["check-machine", path.to_str().unwrap(), "--live"]);
    let found = guided("guide", command, &path, "y\ny\ny\ny\n");
    assert_eq!(found.code, 0, "{}", found.out);
    for said in ["Commissioning.", "commissioned", "proven", "circle left"] {
        assert!(found.out.contains(said), "{said}: {}", found.out);
    }
    let open = [Status::NotShown, Status::Contradicted]
        .map(|status| found.result.with_status(status).len());
    assert_eq!(open, [0, 0], "{}", found.out);
    assert!(found.result.source.starts_with("live session "));

    // The monitor says it, and refuses the result for a machine file that has changed since.
    fs::write(folder.path().join("result.json"), found.result.to_json()).unwrap();
    let world = World::new("bound");
    let monitor = world.monitor(&path, &[]);
    let replay = world.replay_log(
        &data("commissioning.mcap"),
        &path,
        &["--speed", "20", "--wait", "60"],
    );
    assert!(replay.end().status.success());
    let ended = monitor.end();
    assert!(
        ended.status.success() && ended.err.contains("monitor: commissioned at "),
        "{}",
        ended.err
    );

    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("min_load = 500.0", "min_load = 600.0")).unwrap();
    let refused = World::new("other").monitor(&path, &[]).end();
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        refused
            .err
            .contains("expected a commissioning of this machine file"),
        "{}",
        refused.err
    );
}

#[test]
fn the_guide_contradicts_a_wrong_machine_file_and_the_monitor_refuses_its_result() {
    let (folder, path) = machine(|text| {
        text.replace(
            "rpy = [0.0, 0.0, 0.0]",
            "rpy = [0.0, 0.0, 3.141592653589793]",
        )
    });
    let found = guided("wrong", live(&path), &path, "");
    assert_eq!(found.code, 12, "{}", found.out);
    assert!(found.out.contains("180 degrees about z"), "{}", found.out);
    let wrong = found.result.with_status(Status::Contradicted);
    assert!(
        wrong.iter().any(|item| item.key == "imu.mounting.forward"),
        "{}",
        found.out
    );
    let result = folder.path().join("result.json");
    fs::write(&result, found.result.to_json()).unwrap();
    let option = ["--commissioning", result.to_str().unwrap()];
    let refused = World::new("wrongm").monitor(&path, &option).end();
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        refused.err.contains("without contradictions"),
        "{}",
        refused.err
    );

    // A result that somebody improved is noticed.
    let text = found
        .result
        .to_json()
        .replace("\"contradicted\"", "\"proven\"");
    fs::write(&result, text).unwrap();
    let refused = World::new("sealed").monitor(&path, &option).end();
    assert!(
        refused.err.contains("was changed after the commissioning"),
        "{}",
        refused.err
    );
}

/// A commissioning whose drive has shown a joint in a part of its range proves it there, and not beyond, live as offline.
// requirement: TW-VERDICT-24, TW-VERDICT-28
#[test]
fn joint_is_proven_where_it_was_commissioned_live_as_offline() {
    let (folder, path) = machine(|text| format!("commissioning = \"result.json\"\n{text}"));
    let log = data("commissioning.mcap");
    let mut made = from_log(&log, &MachineFile::read(&path).unwrap())
        .unwrap()
        .file;
    let of_slew = (made.items.iter_mut()).filter(|item| item.key.starts_with("joint.slew."));
    let ranges: Vec<&mut [f64; 2]> = of_slew.filter_map(|item| item.range.as_mut()).collect();
    assert_eq!(ranges.len(), 2, "of sign and scale");
    for range in ranges {
        let [least, greatest] = *range;
        assert!(greatest - least > 0.2, "{least} {greatest}");
        *range = [least, 0.5 * (least + greatest)];
    }
    made.seal.clear();
    made.seal = sha256(made.to_json().as_bytes());
    fs::write(folder.path().join("result.json"), made.to_json()).unwrap();

    let offline = causal(&log, &path);
    let slew = offline.machine.joints().iter();
    let slew = slew.enumerate().find(|(_, it)| it.name == "slew");
    let slew = Proof::Joint(slew.unwrap().0);
    let world = World::new("part");
    let monitor = world.monitor(&path, &["--json", "--allow-untimed"]);
    let options = ["--speed", "max", "--lossless", "--wait", "60"];
    let replay = world.replay_log(&log, &path, &options).end();
    assert!(replay.status.success(), "{}", replay.err);
    let lines = monitor.end().out;
    let rows = lines.lines().map(serde_json::from_str::<serde_json::Value>);
    let rows: Vec<_> = (rows.map(Result::unwrap))
        .filter(|row| row["event"] == "row")
        .collect();
    let verdicts = &offline.rows.whole().verdicts.as_ref().unwrap().verdicts;
    assert_eq!(rows.len(), verdicts.len());
    let (mut open, mut proven) = (0, 0);
    for (row, verdict) in rows.iter().zip(verdicts) {
        let names = verdict.unproven.names(&offline.machine);
        assert_eq!(row["unproven"], serde_json::json!(names));
        assert_eq!(row["verdict"], verdict.level.name());
        let ways = row["proven_by"].as_array().unwrap().iter();
        let says_where =
            |way: &&serde_json::Value| way.as_str().unwrap().contains("it is commissioned at");
        let is_open = verdict.unproven.has(slew);
        assert!(!is_open || ways.clone().any(|way| says_where(&way)));
        open += usize::from(is_open);
        proven += usize::from(!is_open);
    }
    assert!(open > 10 && proven > 100, "{open} {proven}");
}

#[test]
fn a_monitor_without_a_commissioning_says_so() {
    let world = World::new("none");
    let monitor = world.monitor(&data("tiny_lift.toml"), &[]);
    let replay = world.replay("tiny_lift", &["--speed", "20", "--wait", "60"]);
    assert!(replay.end().status.success());
    let ended = monitor.end();
    assert!(ended.status.success());
    assert!(
        ended.err.starts_with("monitor: not commissioned: "),
        "{}",
        ended.err
    );
    assert!(
        MachineFile::read(&data("tiny_lift.toml"))
            .unwrap()
            .spec
            .commissioning
            .is_none()
    );
}

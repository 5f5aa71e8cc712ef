//! A rehearsal: monitor, recorder and replay of one log in one terminal, and the analysis of what was recorded.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use tipwatch_analyze::tables::parquet;
use tipwatch_live::wire::topics::EVENT_ROW;
use tipwatch_mechanics::verdict::Level;

use crate::support::offline::causal;
use crate::support::{LIMIT, Process, World, data};

/// The programs of a world that are running, by their arguments.
fn running(world: &World) -> Vec<String> {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let arguments = processes.filter_map(|process| {
        let bytes = fs::read(process.path().join("cmdline")).ok()?;
        Some(String::from_utf8_lossy(&bytes).replace('\0', " "))
    });
    arguments
        .filter(|text| text.contains(&world.prefix))
        .collect()
}

/// Waits until no program of a world runs any more.
fn wait_until_gone(world: &World) {
    let start = Instant::now();
    while !running(world).is_empty() {
        assert!(start.elapsed() < LIMIT, "{:?}", running(world));
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn rehearse(world: &World, out: &Path) -> Process {
    let (log, machine) = (data("tiny_lift.mcap"), data("tiny_lift.toml"));
    let arguments = [
        log.as_path(),
        Path::new("--machine"),
        &machine,
        Path::new("--out"),
        out,
    ];
    let arguments = arguments.map(|argument| argument.to_str().unwrap());
    world.start(&[&["rehearse"][..], &arguments].concat())
}

fn session_in(folder: &Path) -> PathBuf {
    let sessions: Vec<_> = fs::read_dir(folder).unwrap().flatten().collect();
    assert_eq!(sessions.len(), 1);
    sessions[0].path()
}

#[test]
fn the_live_demo_ends_with_the_report_of_what_it_recorded() {
    let world = World::new("demo");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let tipwatch = Path::new(env!("CARGO_BIN_EXE_tipwatch-live")).with_file_name("tipwatch");
    assert!(tipwatch.exists(), "build with --workspace");
    let arguments = [
        "demo",
        "--live",
        "--speed",
        "max",
        "--out",
        out.to_str().unwrap(),
    ];
    let ended = world.start_by(Command::new(tipwatch), &arguments).end();
    assert!(ended.status.success(), "{}", ended.err);
    let lines: Vec<&str> = ended.out.lines().collect();
    let (report, changes) = lines.split_last().unwrap();
    let report = report.strip_prefix("report: ").unwrap();
    assert_eq!(
        Path::new(report),
        out.join("report.html").canonicalize().unwrap()
    );
    // each line is another level than the one before
    let levels: Vec<&str> = changes
        .iter()
        .map(|line| {
            let (_, after) = line.split_once(" s  ").unwrap();
            after.split("  ").next().unwrap()
        })
        .collect();
    assert!(
        levels.windows(2).all(|pair| pair[0] != pair[1]),
        "{levels:?}"
    );
    let danger = |level: &&str| level.trim() == Level::Danger.name();
    assert!(levels.iter().any(danger), "{levels:?}");
    // the analysis is that of the recording, and nothing of the log was lost
    let analysis = causal(
        &session_in(&out.join("recording")),
        &out.join("input/demo.toml"),
    );
    let of_log = causal(&out.join("input/demo.mcap"), &out.join("input/demo.toml"));
    assert_eq!(analysis.rows.len(), of_log.rows.len());
    let events = parquet::read(&out.join("events.parquet")).unwrap();
    assert_eq!(events.rows(), analysis.events.len());
    wait_until_gone(&world);
}

#[test]
fn a_rehearsal_that_is_stopped_ends_all_its_programs_and_analyses_nothing() {
    for signal in ["-INT", "-TERM"] {
        let world = World::new("stop");
        let out = tempfile::tempdir().unwrap();
        let rehearsal = rehearse(&world, out.path());
        world.wait_for_verdict(|verdict| verdict.event == EVENT_ROW);
        // itself, monitor, recorder and replay
        assert_eq!(running(&world).len(), 4, "{:?}", running(&world));
        rehearsal.signal(signal);
        let ended = rehearsal.end();
        assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
        assert_eq!(running(&world), [""; 0]);
        // what was recorded until then is whole
        let session = session_in(&out.path().join("recording"));
        assert!(!causal(&session, &data("tiny_lift.toml")).rows.is_empty());
        assert!(!out.path().join("summary.json").exists());
    }
}

#[test]
fn a_rehearsal_that_is_killed_takes_its_programs_with_it() {
    let world = World::new("kill");
    let out = tempfile::tempdir().unwrap();
    let rehearsal = rehearse(&world, out.path());
    world.wait_for_verdict(|verdict| verdict.event == EVENT_ROW);
    rehearsal.kill();
    wait_until_gone(&world);
}

#[test]
fn a_rehearsal_whose_program_fails_ends() {
    let world = World::new("fail");
    let out = tempfile::tempdir().unwrap();
    // there is one already
    let monitor = world.monitor(&data("tiny_lift.toml"), &["--quiet", "--stay"]);
    world.wait_for_verdict(|_| true);
    let ended = rehearse(&world, out.path()).end();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.err);
    assert!(ended.err.contains("monitor has failed"), "{}", ended.err);
    drop(monitor);
    wait_until_gone(&world);
}

/// Tests of a rehearsal with a display.
mod needs_script {
    use super::*;

    #[test]
    #[ignore = "needs `script`, which gives the display a terminal"]
    fn the_display_is_gone_when_the_log_has_ended() {
        let world = World::new("shown");
        let out = tempfile::tempdir().unwrap();
        let command = format!(
            "{} rehearse {} --machine {} --out {} --speed 5 --prefix {}",
            env!("CARGO_BIN_EXE_tipwatch-live"),
            data("tiny_lift.mcap").display(),
            data("tiny_lift.toml").display(),
            out.path().display(),
            world.prefix
        );
        let mut script = Command::new("script");
        script.args(["-qec", &command, "/dev/null"]);
        let shown = script.stdin(std::process::Stdio::null()).output().unwrap();
        let text = String::from_utf8_lossy(&shown.stdout);
        assert!(shown.status.success(), "{text}");
        // the alternate screen is entered once, and left before the report is named
        let (entered, left) = ("\u{1b}[?1049h", "\u{1b}[?1049l");
        let place = |what: &str| {
            text.find(what)
                .unwrap_or_else(|| panic!("{what:?}: {text}"))
        };
        assert!(place(entered) < place(left) && place(left) < place("report: "));
        wait_until_gone(&world);
    }
}

//! All benchmarks with a peer in one run, and the table of their ratios by release.
//!
//! `cargo bench -p tipwatch-benchmarks --bench by_release -- [--short] [--check | --record RELEASE]` runs the benchmarks
//! of the other crates and reads the lines `figure NAME RATIO` that they print: how many times as fast as the peer, or
//! which share of a bare limit. Program and peer run in turns on the same input, so a ratio depends less on the computer
//! than a time does; other work on it still lowers most of them.
//!
//! `--check` compares with the last release, in as many attempts as it needs ([`Attempts`]). Exit codes: 0 no ratio fell
//! by a third, 1 one did, 3 one did where the processors were not free. `--record RELEASE` writes the column of that
//! release into `book/src/benchmarks.md`.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a benchmark prints its result"
)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use tipwatch_benchmarks::{Attempts, FIGURES, Judgement, Measured, Processors, Table, have_sha256};

/// Bench targets with a peer, in the order in which they run.
const BENCHES: [&str; 2] = ["figures", "evaluate"];
/// The bench whose ratios are comparable only on processors with instructions for SHA-256.
const HASHING_BENCH: &str = "whole_log";
const PAGE: &str = "book/src/benchmarks.md";
/// Exit code where the processors were not free.
const UNDECIDED: u8 = 3;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |name: &str| arguments.iter().any(|argument| argument == name);
    let record = arguments.iter().position(|argument| argument == "--record");
    let release = record.map(|at| arguments.get(at + 1).expect("--record RELEASE"));
    assert!(
        !(has("--check") && release.is_some()),
        "expected --check or --record, found both"
    );
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = root.join(PAGE);
    let text = std::fs::read_to_string(&page).expect("the page of the book");
    let mut table = Table::read(&text).expect("the table of releases");
    let is_short = has("--short");
    if has("--check") {
        return check(&table, &root, is_short);
    }
    let measured = measure(&root, is_short);
    println!("\n{}", measured.text());
    if let Some(release) = release {
        table.record(release, &measured);
        std::fs::write(&page, table.written_into(&text)).expect("the page is written");
    }
    ExitCode::SUCCESS
}

/// Measures until it is known whether a ratio fell.
fn check(table: &Table, root: &Path, is_short: bool) -> ExitCode {
    // a build would use the processors that are looked at
    build(root);
    let (mut processors, mut attempts) = (Processors::default(), Attempts::default());
    loop {
        let free_before = processors.free_share();
        let measured = measure(root, is_short);
        let free_share = processors.free_share().min(free_before);
        attempts.add(&measured, free_share);
        println!("\n{}", attempts.best().text());
        println!("{:60} {:.0} %", "free processors", 100.0 * free_share);
        match attempts.judge(table) {
            Judgement::Kept => return ExitCode::SUCCESS,
            Judgement::Again(fell) => tell("measured again", &fell),
            Judgement::Lost(fell) => {
                tell("error", &fell);
                return ExitCode::FAILURE;
            }
            Judgement::Undecided(fell) => {
                tell("the processors were not free, so nothing is known", &fell);
                return ExitCode::from(UNDECIDED);
            }
        }
    }
}

/// Writes each line after its label.
fn tell(what: &str, lines: &[String]) {
    for line in lines {
        eprintln!("{what}: {line}");
    }
}

/// The command that runs the benchmarks.
fn benches(root: &Path) -> Command {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(cargo);
    command.current_dir(root);
    command.args(["bench", "--workspace", "--locked"]);
    let hashing = have_sha256().then_some(HASHING_BENCH);
    for bench in BENCHES.into_iter().chain(hashing) {
        command.args(["--bench", bench]);
    }
    command
}

/// Builds them.
fn build(root: &Path) {
    let status = benches(root).arg("--no-run").status().expect("cargo runs");
    assert!(status.success(), "the benchmarks cannot be built: {status}");
}

/// Runs them and passes their output on.
fn measure(root: &Path, is_short: bool) -> Measured {
    let mut command = benches(root);
    if is_short {
        command.args(["--", "--short"]);
    }
    let mut child = command.stdout(Stdio::piped()).spawn().expect("cargo runs");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let mut measured = Measured::default();
    for line in output.lines() {
        let line = line.expect("text");
        println!("{line}");
        measured.take(&line).expect("a ratio");
    }
    let status = child.wait().expect("cargo ends");
    assert!(status.success(), "a benchmark failed: {status}");
    for figure in FIGURES {
        if figure.needs.is_none() && measured.get(figure.name).is_none() {
            panic!("no benchmark printed the figure {}", figure.name);
        }
    }
    measured
}

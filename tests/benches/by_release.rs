//! All benchmarks with a peer in one run, and the table of their ratios by release.
//!
//! `cargo bench -p tipwatch-tests --bench by_release -- [--short] [--check] [--record RELEASE]` runs the benchmarks of
//! the other crates and reads the lines `figure NAME RATIO` that they print: how many times as fast as the peer, or
//! which share of a bare limit. Program and peer run in turns on the same input, so the ratio hardly depends on the
//! computer and on what else it does.
//!
//! `--check` fails if a ratio is below two thirds of that of the last release. `--record RELEASE` writes the
//! column of that release into `book/src/benchmarks-by-release.md`.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a benchmark prints its result"
)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use tipwatch_tests::by_release::{FIGURES, Measured, Table};

/// Bench targets with a peer, in the order in which they run.
const BENCHES: [&str; 3] = ["figures", "evaluate", "whole_log"];
const PAGE: &str = "book/src/benchmarks-by-release.md";
/// A ratio below this share of the last release's is a failure.
const LEAST_SHARE: f64 = 2.0 / 3.0;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |name: &str| arguments.iter().any(|argument| argument == name);
    let release = arguments.iter().position(|argument| argument == "--record");
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = root.join(PAGE);
    let text = std::fs::read_to_string(&page).expect("the page of the book");
    let mut table = Table::read(&text).expect("the table of releases");
    let measured = measure(&root, has("--short"));
    println!("\n{}", measured.text());
    if has("--check") {
        let worse = table.worse(&measured, LEAST_SHARE);
        for line in &worse {
            eprintln!("error: {line}");
        }
        if !worse.is_empty() {
            return ExitCode::FAILURE;
        }
    }
    if let Some(at) = release {
        let release = arguments.get(at + 1).expect("--record RELEASE");
        table.record(release, &measured);
        std::fs::write(&page, table.written_into(&text)).expect("the page is written");
    }
    ExitCode::SUCCESS
}

/// Runs the benchmarks and passes their output on.
fn measure(root: &Path, is_short: bool) -> Measured {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(["bench", "--workspace", "--locked"]);
    for bench in BENCHES {
        command.args(["--bench", bench]);
    }
    if is_short {
        command.args(["--", "--short"]);
    }
    let mut child = command
        .current_dir(root)
        .stdout(Stdio::piped())
        .spawn()
        .expect("cargo runs");
    let output = BufReader::new(child.stdout.take().expect("piped"));
    let mut measured = Measured::default();
    for line in output.lines() {
        let line = line.expect("text");
        println!("{line}");
        measured.take(&line);
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

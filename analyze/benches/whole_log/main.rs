//! Whole analyses, timed as a user would time them: process start to the last file.
//!
//! `cargo bench -p tipwatch-analyze --bench whole_log -- [--short]`. Every round runs all programs in turn on the same
//! files in the page cache; figures are ratios of the best times, because others may use the machine.
//!
//! 1. A long log, the demo's repeated (an hour; with `--short` five minutes), beside the plain message stream of the
//!    `mcap` crate, which computes nothing.
//! 2. One log of the simulator beside the Python peer, which computes the loads alone: where `../shared` is there and
//!    the interpreter `TIPWATCH_PYTHON` (default `python3`) has what the peer needs.
//!
//! The lines that begin with `figure` are read by the table of releases (`tipwatch-benchmarks`, bench `by_release`).

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]

mod peer;
mod repeated;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Best times of several programs that take turns.
pub(crate) struct Turns<const N: usize> {
    best_s: [f64; N],
}

impl<const N: usize> Turns<N> {
    pub(crate) fn run(rounds: usize, programs: [&dyn Fn(); N]) -> Self {
        let mut best_s = [f64::INFINITY; N];
        for _ in 0..rounds {
            for (best_s, program) in best_s.iter_mut().zip(programs) {
                let start = Instant::now();
                program();
                *best_s = best_s.min(start.elapsed().as_secs_f64());
            }
        }
        Self { best_s }
    }

    pub(crate) fn best_s(&self, which: usize) -> f64 {
        self.best_s[which]
    }
}

fn main() {
    let is_short = std::env::args().any(|argument| argument == "--short");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let seconds = if is_short { 300.0 } else { 3600.0 };
    long_log(folder.path(), seconds, if is_short { 3 } else { 5 });
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    peer::measure(&shared, folder.path(), if is_short { 2 } else { 5 });
}

fn long_log(folder: &Path, seconds: f64, rounds: usize) {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("demo");
    let log = folder.join("long.mcap");
    repeated::write(&demo.join("demo.mcap"), seconds, &log);
    let machine = demo.join("demo.toml");
    let bytes = std::fs::metadata(&log).expect("the log").len();
    let turns = Turns::run(
        rounds,
        [
            &|| repeated::stream(&log),
            &|| analyse(&log, &machine, folder, "samples"),
            &|| analyse(&log, &machine, folder, "all"),
        ],
    );
    println!(
        "a log of {seconds:.0} s, {:.1} MB: message stream of the mcap crate {:.3} s, samples.parquet {:.3} s, all files {:.3} s",
        bytes as f64 * 1e-6,
        turns.best_s(0),
        turns.best_s(1),
        turns.best_s(2),
    );
    println!(
        "figure whole-log-samples-vs-stream {:.4}",
        turns.best_s(0) / turns.best_s(1)
    );
    println!(
        "figure whole-log-all-vs-stream {:.4}",
        turns.best_s(0) / turns.best_s(2)
    );
}

/// Runs `tipwatch analyze`.
pub(crate) fn analyse(log: &Path, machine: &Path, folder: &Path, outputs: &str) {
    let status = Command::new(env!("CARGO_BIN_EXE_tipwatch"))
        .args(["analyze", "--quiet", "--outputs", outputs, "--machine"])
        .args([machine, log])
        .arg("--out")
        .arg(folder.join("out"))
        .stdout(Stdio::null())
        .status()
        .expect("tipwatch runs");
    // What a log shows may set a code; a failure is 1.
    assert_ne!(status.code(), Some(1), "{} failed", log.display());
}

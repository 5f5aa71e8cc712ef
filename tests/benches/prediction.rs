//! Lead time and false alarms of the prediction beside the plain rate, and stops beside what was predicted: the tables of `book/src/concepts/prediction.md`.
//!
//! `tests/data/make_prediction.py LAB OUT` makes the logs; then
//!
//! ```text
//!     cargo bench -p tipwatch-tests --bench prediction -- OUT [--set NAME] [--each] [--keys 'horizon = 1.0']
//! ```
//! prints the tables of every set in OUT and of the repository's own logs (`--set own`). `--keys` replaces `[prediction]`
//! of all machine files.

#![allow(clippy::print_stdout, reason = "a benchmark prints its result")]
#![allow(clippy::unwrap_used, reason = "a benchmark that cannot continue fails")]

use std::path::{Path, PathBuf};

use clap::Parser;
use tipwatch_mechanics::machine::PredictionSpec;
use tipwatch_tests::data;
use tipwatch_tests::prediction::followed::Followed;
use tipwatch_tests::prediction::{stops, tables};

/// Logs of this repository with truth that is not smoothed. The settings were chosen while looking at them, too.
const OWN: [&str; 6] = [
    "tip_over",
    "swing_lift",
    "tiny_lift",
    "tiny",
    "hard_brake",
    "corner_brake",
];
/// The sets in the folder.
const SETS: [&str; 4] = ["tuning", "held_out", "stops", "shared"];

#[derive(Parser)]
struct Arguments {
    /// Folder of the sets.
    folder: Option<PathBuf>,
    /// Only this set.
    #[arg(long)]
    set: Option<String>,
    /// A line about each log.
    #[arg(long)]
    each: bool,
    /// Keys of `[prediction]`, separated by semicolons.
    #[arg(long)]
    keys: Option<String>,
    /// Passed by cargo.
    #[arg(long)]
    bench: bool,
}

fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    let mut logs: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|ending| ending == "mcap"))
        .filter(|path| path.with_extension("truth.parquet").exists())
        .collect();
    logs.sort();
    logs
}

fn main() {
    let arguments = Arguments::parse();
    let keys: Option<PredictionSpec> =
        (arguments.keys.as_ref()).map(|keys| toml::from_str(&keys.replace(';', "\n")).unwrap());
    let print = |set: &str, logs: &[PathBuf]| {
        if arguments.set.as_ref().is_some_and(|only| only != set) || logs.is_empty() {
            return;
        }
        let logs = logs.iter().map(|log| Followed::new(log, keys.as_ref()));
        let logs: Vec<Followed> = logs.collect();
        println!("{}", tables::of(set, &logs, arguments.each));
        println!("{}", stops::table(&logs));
        if arguments.each {
            for (log, stop) in logs
                .iter()
                .flat_map(|log| stops::stops(log).into_iter().map(move |stop| (log, stop)))
            {
                println!("{} {stop:?} {:?}", log.name, stops::score(log, &stop, log));
            }
        }
    };
    print("own", &OWN.map(|name| data(&format!("{name}.mcap"))));
    for set in SETS {
        let folder = arguments.folder.as_ref().map(|folder| folder.join(set));
        if let Some(folder) = folder.filter(|folder| folder.exists()) {
            print(set, &logs_in(&folder));
        }
    }
}

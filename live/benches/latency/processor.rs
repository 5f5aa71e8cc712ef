//! The share of a processor that another process takes, by thread.

use std::fs;
use std::path::PathBuf;

use tipwatch_live::system::clock::monotonic_ns;

/// Unit of the times in `/proc` (s).
const TICK_S: f64 = 0.01;

/// Processor times of a process up to some time.
pub(crate) struct ProcessorTime {
    process: u32,
    at_ns: i64,
    /// Each thread: its folder, its name, and its time (ticks).
    threads: Vec<(PathBuf, String, u64)>,
}

impl ProcessorTime {
    /// Those of this process up to now.
    pub(crate) fn of(process: u32) -> Self {
        let tasks = fs::read_dir(format!("/proc/{process}/task")).unwrap();
        // one that ends meanwhile has nothing to read
        let stats = tasks.filter_map(|task| {
            let folder = task.ok()?.path();
            let stat = fs::read_to_string(folder.join("stat")).ok()?;
            Some((folder, stat))
        });
        let threads = stats.map(|(folder, stat)| {
            // TID (NAME) STATE ..., of which user and system time are the fields 14 and 15
            let (name, fields) = stat.rsplit_once(')').unwrap();
            let (_, name) = name.split_once('(').unwrap();
            let times = fields.split_whitespace().skip(11).take(2);
            let ticks = times
                .map(|ticks| ticks.parse::<u64>().unwrap())
                .sum::<u64>();
            (folder, name.to_owned(), ticks)
        });
        Self {
            process,
            at_ns: monotonic_ns(),
            threads: threads.collect(),
        }
    }

    /// Prints the share since then.
    pub(crate) fn print_share(&self) {
        let now = Self::of(self.process);
        let elapsed_s = (now.at_ns - self.at_ns) as f64 * 1e-9;
        let percent = |ticks: u64| 100.0 * TICK_S * ticks as f64 / elapsed_s;
        let taken = now.threads.iter().map(|(folder, name, ticks)| {
            let before = self.threads.iter().find(|(other, ..)| other == folder);
            let before = before.map_or(0, |(_, _, ticks)| *ticks);
            (name, ticks.saturating_sub(before))
        });
        let taken: Vec<(&String, u64)> = taken.collect();
        let all = taken.iter().map(|(_, ticks)| ticks).sum();
        let threads = taken.iter();
        let threads = threads.map(|(name, ticks)| format!("{name} {:.2}", percent(*ticks)));
        println!(
            "{:.2} % of a processor in {elapsed_s:.1} s: {}",
            percent(all),
            threads.collect::<Vec<_>>().join(", ")
        );
    }
}

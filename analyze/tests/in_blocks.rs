//! The rows of a log are computed block by block: nothing holds the whole table, and nothing depends on where a block ends.

use tempfile::TempDir;
use tipwatch_analyze::analysis::run::{analyse, analyse_into};
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::output::{self, OutputOptions, Outputs, Sinks};
use tipwatch_analyze::policy::facts::LogFacts;
use tipwatch_analyze::report;
use tipwatch_binding::MachineFile;

use crate::support::data;

#[cfg(target_os = "linux")]
#[path = "../benches/whole_log/repeated.rs"]
#[allow(dead_code, reason = "shared with a benchmark")]
mod repeated;

#[test]
fn no_output_needs_the_whole_table() {
    let folder = TempDir::new().unwrap();
    for (name, outputs) in [("tip_over", Outputs::All), ("tiny_lift", Outputs::Samples)] {
        let file = MachineFile::read(&data(&format!("{name}.toml"))).unwrap();
        let out = folder.path().join(name);
        let (analysis, sinks) = analyse_into(
            &data(&format!("{name}.mcap")),
            &file,
            Options::default(),
            &mut |_| {},
            |prepared| {
                let options = OutputOptions {
                    outputs,
                    ..OutputOptions::default()
                };
                Sinks::begin(prepared, &out, options)
            },
        )
        .unwrap();
        let facts = LogFacts::of(
            &analysis,
            &report::findings(&analysis),
            report::doubts(&analysis),
        );
        assert!(facts.rows > 0 && facts.worst.is_some());
        let written = output::finish(&analysis, sinks, &out).unwrap();
        assert!(written.files.iter().all(|file| out.join(file).is_file()));
        assert!(!analysis.rows.is_whole(), "{name}");
    }
}

#[test]
fn limits_that_are_not_numbers_leave_no_row() {
    let file = MachineFile::read(&data("tip_over.toml")).unwrap();
    for (from_s, to_s) in [(Some(f64::NAN), None), (None, Some(f64::NAN))] {
        let options = Options {
            from_s,
            to_s,
            ..Options::default()
        };
        let error = analyse(&data("tip_over.mcap"), &file, options, &mut |_| {}).unwrap_err();
        assert!(error.to_string().contains("time range"), "{error}");
    }
}

#[test]
fn windows_and_blocks_have_the_bits_of_the_whole_table() {
    let file = MachineFile::read(&data("tip_over.toml")).unwrap();
    for rate_hz in [None, Some(730.0)] {
        let options = Options {
            rate_hz,
            from_s: Some(1.23),
            ..Options::default()
        };
        let whole = analyse(&data("tip_over.mcap"), &file, options, &mut |_| {}).unwrap();
        assert!(whole.rows.is_whole());
        let rows = whole.rows.len();
        for window in [0..rows.min(5), rows / 3..rows / 2, rows - 3..rows] {
            let found = whole.rows.window(window.clone());
            assert_eq!(found.times_ns, whole.rows.times_ns[window.clone()]);
            assert_eq!(found.reasons, whole.rows.reasons[window.clone()]);
            let columns = found.outcomes.columns.iter();
            for (found, whole) in columns.zip(&whole.rows.whole().outcomes.columns) {
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(found), bits(&whole[window.clone()]));
            }
        }
    }
}

#[cfg(target_os = "linux")]
mod needs_long {
    use super::*;
    use crate::support::{command, text};
    use std::path::Path;

    /// Largest memory (MB) of an analysis.
    fn peak_mb(log: &Path, machine: &Path, rate_hz: u64, out: &Path) -> u64 {
        let mut child = command(&[
            "analyze",
            text(log),
            "--machine",
            text(machine),
            "--rate",
            &rate_hz.to_string(),
            "--out",
            text(out),
        ])
        .env("RAYON_NUM_THREADS", "2")
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
        let status = format!("/proc/{}/status", child.id());
        let mut peak_kb = 0;
        while child.try_wait().unwrap().is_none() {
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let peak = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let peak = peak.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
            peak_kb = peak_kb.max(peak.unwrap_or(0_u64));
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        assert!(out.join("samples.parquet").is_file());
        peak_kb / 1024
    }

    #[test]
    #[ignore = "takes seconds without optimisation"]
    fn a_log_of_a_minute_needs_little_memory() {
        let folder = TempDir::new().unwrap();
        let log = folder.path().join("minute.mcap");
        repeated::write(&data("tip_over.mcap"), 60.0, &log);
        let out = folder.path().join("out");
        let peak = peak_mb(&log, &data("tip_over.toml"), 100, &out);
        assert!(peak < 110, "{peak} MB");
    }

    #[test]
    #[ignore = "takes minutes without optimisation"]
    fn memory_does_not_grow_with_the_table() {
        let folder = TempDir::new().unwrap();
        let log = folder.path().join("long.mcap");
        repeated::write(&data("tiny_lift.mcap"), 30.0, &log);
        let peak = |rate_hz: u64| {
            let out = folder.path().join(rate_hz.to_string());
            peak_mb(&log, &data("tiny_lift.toml"), rate_hz, &out)
        };
        let (few, many) = (peak(100), peak(5000));
        // 30 s; with their states, rows have more than 200 numbers of 8 bytes each
        let table_mb = (30 * 5000 * 200 * 8) >> 20;
        assert!(
            many < few + table_mb / 2,
            "{few} MB, then {many} MB; the table has {table_mb} MB"
        );
    }
}

//! Sizes of the files that an analysis writes, and the contents of the small ones.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::base::options::{DerivedRows, Precision};
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_analyze::output::{self, OutputOptions};
use tipwatch_analyze::tables::parquet;

use super::support::{analysed, data};

fn size(folder: &TempDir, name: &str) -> u64 {
    fs::metadata(folder.path().join(name)).unwrap().len()
}

fn written(analysis: &Analysis, options: OutputOptions) -> TempDir {
    let folder = TempDir::new().unwrap();
    output::write(analysis, folder.path(), options).unwrap();
    folder
}

/// An analysis whose events occur again and again, as in a long log.
fn with_many_events(count: usize) -> Analysis {
    let mut analysis = analysed(&data("tiny_lift.mcap"), &data("tiny_lift.toml"));
    let events = std::mem::take(&mut analysis.events);
    assert!(events.iter().any(|event| event.causes.is_some()));
    let repeated = (0..count).map(|i| {
        let (event, later_ns) = (
            &events[i % events.len()],
            60_000_000_000 * (i / events.len()) as i64,
        );
        Event {
            worst: event.worst + (i as f64).sin(),
            start_ns: event.start_ns + later_ns,
            end_ns: event.end_ns.map(|end_ns| end_ns + later_ns),
            ..event.clone()
        }
    });
    analysis.events = repeated.collect();
    analysis
}

#[test]
fn many_events_leave_summary_and_report_small() {
    let analysis = with_many_events(5000);
    let folder = written(&analysis, OutputOptions::default());
    assert!(size(&folder, "summary.json") < 300_000);
    let report = size(&folder, "report.html");
    assert!(report < 4_000_000, "{report}");

    // the summary has how many there are of each kind, and the worst; all of them are in the table
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let summary: Value = serde_json::from_slice(&read("summary.json")).unwrap();
    let table = parquet::read(&folder.path().join("events.parquet")).unwrap();
    assert_eq!(table.rows(), 5000);
    let kinds = table.column("kind").unwrap().texts().unwrap();
    let worst = table.column("worst").unwrap().numbers().unwrap();
    let of_kind = |kind: &str| -> Vec<f64> {
        let rows = kinds.iter().zip(&worst);
        rows.filter(|(found, _)| found.as_deref() == Some(kind))
            .map(|(_, worst)| *worst)
            .collect()
    };
    let groups = summary["events"].as_object().unwrap();
    assert!(groups.len() >= 2);
    for (kind, group) in groups {
        let all = of_kind(kind);
        assert_eq!(group["count"].as_u64(), Some(all.len() as u64), "{kind}");
        let is_light = [EventKind::WheelLight, EventKind::WheelLift].map(EventKind::name);
        if is_light.contains(&kind.as_str()) {
            let lowest = all.iter().copied().fold(f64::INFINITY, f64::min);
            assert_eq!(group["worst"]["worst"].as_f64(), Some(lowest), "{kind}");
        }
    }
    // the rest is counted, not dropped in silence
    let findings = summary["findings"].as_array().unwrap();
    let left_out = |finding: &&Value| finding.as_str().unwrap().contains("are in events.parquet");
    assert_eq!(findings.iter().filter(left_out).count(), 1, "incidents");
    assert_eq!(
        findings.len(),
        summary["evidence"].as_array().unwrap().len()
    );
}

#[test]
fn causes_of_all_events_are_in_their_table() {
    let analysis = analysed(&data("tiny_lift.mcap"), &data("tiny_lift.toml"));
    let folder = written(&analysis, OutputOptions::default());
    let table = parquet::read(&folder.path().join("events.parquet")).unwrap();
    let numbers = |name: &str| table.column(name).unwrap().numbers().unwrap();
    let (before, after) = (numbers("otf_before"), numbers("otf_at_onset"));
    let mut with_causes = 0;
    for (row, event) in analysis.events.iter().enumerate() {
        let Some(causes) = &event.causes else {
            continue;
        };
        with_causes += 1;
        assert_eq!(
            (before[row], after[row]),
            (causes.otf_before_n, causes.otf_n)
        );
        for share in &causes.shares {
            let taken = numbers(&format!("taken_by_{}", share.cause))[row];
            assert_eq!(taken, share.taken_n, "{}", share.cause);
        }
    }
    assert!(with_causes > 0);
}

/// Largest size of an hour at 100 Hz, by row: 90 MB for the samples, 40 MB for the derived log.
#[test]
fn a_row_of_samples_takes_little() {
    let analysis = analysed(&data("swing_lift.mcap"), &data("swing_lift.toml"));
    let rows = analysis.rows.len() as u64;
    let folder = written(&analysis, OutputOptions::default());
    // names, units and provenance are the same for every length of a log
    let fixed = 60_000;
    assert!(size(&folder, "samples.parquet") < fixed + 250 * rows);

    let full = OutputOptions {
        precision: Precision::Double,
        derived: DerivedRows::Full,
        ..OutputOptions::default()
    };
    let exact = written(&analysis, full);
    assert!(2 * size(&folder, "samples.parquet") < size(&exact, "samples.parquet") + 2 * fixed);
    let report = size(&folder, "report.html");
    assert!(2 * (size(&folder, "derived.mcap") - report) < size(&exact, "derived.mcap") - report);
}

#[test]
fn numbers_are_those_of_the_analysis_to_seven_digits_and_times_exact() {
    let analysis = analysed(&data("tiny_lift.mcap"), &data("tiny_lift.toml"));
    let folder = written(&analysis, OutputOptions::default());
    let exact = OutputOptions {
        precision: Precision::Double,
        ..OutputOptions::default()
    };
    let exact = written(&analysis, exact);
    let read = |folder: &Path| parquet::read(&folder.join("samples.parquet")).unwrap();
    let (found, exact) = (read(folder.path()), read(exact.path()));
    let times = found.column("time_ns").unwrap().integers().unwrap();
    assert_eq!(times, analysis.rows.times_ns);
    let mut compared = 0;
    for (found, exact) in found.columns().iter().zip(exact.columns()) {
        assert_eq!((found.name(), found.unit()), (exact.name(), exact.unit()));
        let (Some(numbers), Some(exact)) = (found.numbers(), exact.numbers()) else {
            assert!(found.is_same(exact), "{}", found.name());
            continue;
        };
        assert!(found.is_single());
        for (number, exact) in numbers.iter().zip(exact) {
            let rounded = f64::from(exact as f32);
            assert!(*number == rounded || number.is_nan() && exact.is_nan());
            compared += 1;
        }
    }
    assert!(compared > 10_000);
}

mod needs_python {
    use std::path::Path;

    use tempfile::TempDir;

    use crate::support::{data, run_python, stderr, text, tipwatch};

    #[test]
    #[ignore = "needs Python with polars, pyarrow and duckdb"]
    fn other_readers_find_the_same_samples() {
        let (short, exact) = (TempDir::new().unwrap(), TempDir::new().unwrap());
        let (log, machine) = (data("swing_lift.mcap"), data("swing_lift.toml"));
        for (out, more) in [(&short, &[][..]), (&exact, &["--precision", "64"])] {
            let arguments = ["analyze", text(&log), "--machine", text(&machine)];
            let out = ["--outputs", "samples", "--out", text(out.path())];
            let analysed = tipwatch(&[&arguments[..], &out, more].concat());
            assert_eq!(analysed.status.code(), Some(0), "{}", stderr(&analysed));
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers/samples.py");
        run_python(&[text(&script), text(short.path()), text(exact.path())]);
    }
}

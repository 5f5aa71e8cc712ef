//! `derived.mcap` read back: the numbers of the analysis, its sources and attachments.

use std::ops::ControlFlow;

use std::collections::BTreeSet;

use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{DerivedRows, Estimator, Options, Precision};
use tipwatch_analyze::output::{self, OutputOptions};
use tipwatch_binding::MachineFile;
use tipwatch_ingest::{FieldPath, Fields, Layout, Log};
use tipwatch_mechanics::Quantity;

use super::support::{analysed, data};

#[test]
fn derived_rows_equal_the_analysis_to_the_bit() {
    let analysis = analysed(&data("swing_lift.mcap"), &data("swing_lift.toml"));
    let folder = tempfile::tempdir().unwrap();
    let every_bit = OutputOptions {
        precision: Precision::Double,
        derived: DerivedRows::Full,
        ..OutputOptions::default()
    };
    output::write(&analysis, folder.path(), every_bit).unwrap();
    let path = folder.path().join("derived.mcap");

    let derived = Log::open(&path).unwrap();
    assert!(derived.losses().is_empty() && derived.losses().integrity.note().is_none());
    let rows = &analysis.rows;
    for (topic, field, quantity) in [
        ("/tipwatch/loads", "load_rr", Quantity::Load(3)),
        ("/tipwatch/loads", "load_fl_sigma", Quantity::LoadSigma(0)),
        ("/tipwatch/margins", "otf_rr", Quantity::Otf(3)),
        ("/tipwatch/indicators", "zmp_x", Quantity::ZmpX),
    ] {
        let topic = derived.topics().iter().find(|t| t.name == topic).unwrap();
        let paths: [FieldPath; 2] = [
            field.parse().unwrap(),
            "header.stamp.nanosec".parse().unwrap(),
        ];
        let definition = topic.definition.as_deref().unwrap();
        let layout = Layout::compile(definition, &topic.type_name, &paths).unwrap();
        let (mut fields, mut row) = (Fields::new(), 0);
        derived
            .read(&[topic.id], &mut |message| {
                layout.decode(message.data, &mut fields).unwrap();
                let expected = rows.whole().outcomes.column(quantity)[row];
                assert_eq!(
                    fields.number(0).to_bits(),
                    expected.to_bits(),
                    "{field}, row {row}"
                );
                assert_eq!(message.log_time_ns, rows.times_ns[row]);
                let nanosec = rows.times_ns[row].rem_euclid(1_000_000_000);
                assert_eq!(fields.number(1), nanosec as f64);
                row += 1;
                ControlFlow::Continue(())
            })
            .unwrap();
        assert_eq!(row, rows.len());
    }

    let levels = numbers(&derived, "/tipwatch/verdict", "level");
    let verdicts = &rows.whole().verdicts.as_ref().unwrap().verdicts;
    let expected: Vec<f64> = verdicts.iter().map(|v| f64::from(v.level as u8)).collect();
    assert!(
        levels == expected && levels.contains(&4.0),
        "expected a level of danger"
    );
    // a status for the stability and one for the inputs, ten times a second
    let statuses = numbers(&derived, "/diagnostics", "status[].level");
    assert!(statuses.len() > 120 && statuses.contains(&2.0) && statuses.contains(&0.0));

    let bytes = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let attached = |name: &str| {
        let index = summary.attachment_indexes.iter().find(|a| a.name == name);
        mcap::read::attachment(&bytes, index.unwrap())
            .unwrap()
            .data
            .into_owned()
    };
    assert_eq!(
        attached("machine.toml"),
        analysis.sources.machine_file.as_bytes()
    );
    let urdf = std::fs::read(data("swing_lift.urdf")).unwrap();
    assert_eq!(attached("machine.urdf"), urdf);
    let report = std::fs::read(folder.path().join("report.html")).unwrap();
    assert!(attached("report.html") == report);
}

#[test]
fn unknown_numbers_have_one_pattern_of_bits() {
    let machine = MachineFile::read(&data("tiny_lift.toml")).unwrap();
    let causal = Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    let analysis = analyse(&data("tiny_lift.mcap"), &machine, causal, &mut |_| {}).unwrap();
    for (precision, field_type) in [
        (Precision::Single, "float32 "),
        (Precision::Double, "float64 "),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let options = OutputOptions {
            precision,
            ..OutputOptions::default()
        };
        output::write(&analysis, folder.path(), options).unwrap();
        let derived = Log::open(&folder.path().join("derived.mcap")).unwrap();
        let mut unknown = 0;
        for name in ["/tipwatch/indicators", "/tipwatch/causes"] {
            let topic = derived.topics().iter().find(|t| t.name == name).unwrap();
            let lines = topic.definition.as_deref().unwrap().lines();
            let fields = lines.filter_map(|line| line.strip_prefix(field_type)?.split(' ').next());
            for field in fields {
                let numbers = numbers(&derived, name, field);
                for number in numbers.iter().filter(|number| number.is_nan()) {
                    unknown += 1;
                    assert_eq!(number.to_bits(), f64::NAN.to_bits(), "{field}");
                }
            }
        }
        assert!(unknown > 0, "{precision:?}");
    }
}

#[test]
fn rows_far_from_events_are_thinned_without_losing_extremes() {
    let analysis = analysed(&data("swing_lift.mcap"), &data("swing_lift.toml"));
    let folder = tempfile::tempdir().unwrap();
    output::write(&analysis, folder.path(), OutputOptions::default()).unwrap();
    let derived = Log::open(&folder.path().join("derived.mcap")).unwrap();
    let (times, written) = (
        times(&derived),
        numbers(&derived, "/tipwatch/margins", "otf_rr"),
    );
    let rows = &analysis.rows;
    assert!(
        times.len() < rows.len() / 2,
        "{} of {}",
        times.len(),
        rows.len()
    );

    let otf = rows.whole().outcomes.column(Quantity::Otf(3));
    let row_of = |time_ns: &i64| rows.times_ns.binary_search(time_ns).unwrap();
    for (time_ns, written) in times.iter().zip(&written) {
        assert_eq!(*written, f64::from(otf[row_of(time_ns)] as f32));
    }
    let kept: BTreeSet<i64> = times.into_iter().collect();
    // all rows around events
    let margin_ns = 300_000_000;
    let is_near = |time_ns: i64| {
        (analysis.events.iter()).any(|event| {
            let end_ns = event.end_ns.unwrap_or(event.start_ns);
            event.start_ns - margin_ns <= time_ns && time_ns <= end_ns + margin_ns
        })
    };
    let near: Vec<i64> = (rows.times_ns.iter().copied())
        .filter(|&time_ns| is_near(time_ns))
        .collect();
    assert!(near.len() > 100 && near.iter().all(|time_ns| kept.contains(time_ns)));
    // and elsewhere what bounds the curve in every two seconds
    let bin = |row: usize| rows.times_ns[row].div_euclid(2_000_000_000);
    for start in (0..rows.len()).filter(|&row| row == 0 || bin(row) != bin(row - 1)) {
        let of_bin = || (start..rows.len()).take_while(|&row| bin(row) == bin(start));
        let least = of_bin().min_by(|&a, &b| otf[a].total_cmp(&otf[b]));
        let largest = of_bin().max_by(|&a, &b| otf[a].total_cmp(&otf[b]));
        for row in [least, largest, of_bin().last()] {
            assert!(kept.contains(&rows.times_ns[row.unwrap()]));
        }
    }
    // no change of the verdict is lost
    let levels = |all: &[f64]| {
        let mut changes = all.to_vec();
        changes.dedup();
        changes
    };
    let verdicts = &rows.whole().verdicts.as_ref().unwrap().verdicts;
    let expected: Vec<f64> = verdicts.iter().map(|v| f64::from(v.level as u8)).collect();
    let found = numbers(&derived, "/tipwatch/verdict", "level");
    assert_eq!(levels(&found), levels(&expected));
}

/// Times of the rows.
fn times(log: &Log) -> Vec<i64> {
    let topic = log.topics().iter().find(|t| t.name == "/tipwatch/margins");
    let mut found = Vec::new();
    log.read(&[topic.unwrap().id], &mut |message| {
        found.push(message.log_time_ns);
        ControlFlow::Continue(())
    })
    .unwrap();
    found
}

/// A field of every message of a topic.
fn numbers(log: &Log, topic: &str, field: &str) -> Vec<f64> {
    let topic = log.topics().iter().find(|t| t.name == topic).unwrap();
    let paths: [FieldPath; 1] = [field.parse().unwrap()];
    let definition = topic.definition.as_deref().unwrap();
    let layout = Layout::compile(definition, &topic.type_name, &paths).unwrap();
    let (mut fields, mut found) = (Fields::new(), Vec::new());
    log.read(&[topic.id], &mut |message| {
        layout.decode(message.data, &mut fields).unwrap();
        match fields.numbers(0) {
            [] => found.push(fields.number(0)),
            several => found.extend(several),
        }
        ControlFlow::Continue(())
    })
    .unwrap();
    found
}

mod needs_python {
    use std::path::Path;

    use tempfile::TempDir;

    use crate::support::{data, run_python, stderr, text, tipwatch};

    #[test]
    #[ignore = "needs Python with mcap, mcap-ros2-support, polars and rerun-sdk"]
    fn other_readers_find_the_same_numbers() {
        let out = TempDir::new().unwrap();
        let (log, machine) = (data("swing_lift.mcap"), data("swing_lift.toml"));
        let arguments = ["analyze", text(&log), "--machine", text(&machine)];
        let analysed = tipwatch(&[&arguments[..], &["--out", text(out.path())]].concat());
        assert_eq!(analysed.status.code(), Some(0), "{}", stderr(&analysed));
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers/derived.py");
        run_python(&[text(&script), text(out.path())]);
    }
}

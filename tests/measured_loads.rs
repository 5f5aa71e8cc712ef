//! Measured wheel loads beside the computed ones: columns, comparison, contradictions, validation.

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::measured_loads::TOTAL;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{Estimator, Options, Precision};
use tipwatch_analyze::report;
use tipwatch_analyze::setup::validate::{page, text, validate};
use tipwatch_analyze::tables::samples::samples;
use tipwatch_analyze::tables::summary::Summary;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{LOADS, Truth, data, write_with_loads};

pub(crate) const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// Load cells of the four wheels, and one under the front axle made of nothing else.
pub(crate) fn cells(sigma: f64) -> String {
    let cell = |wheel: &&str| {
        format!(
            "[signals.wheels.{wheel}]\nload = {{ topic = \"{LOADS}\", field = \"{}\" }}\nsigma = {sigma:.1}\n",
            wheel.to_lowercase()
        )
    };
    WHEELS.iter().map(cell).collect()
}

/// A copy of a log with load cells that show the simulated loads, changed by `edit` at each time (s after the start).
pub(crate) fn with_loads(
    folder: &Path,
    log: &Path,
    edit: impl Fn(f64, [f64; 4]) -> [f64; 4],
) -> PathBuf {
    let path = folder.join(log.file_name().unwrap());
    let rows = Truth::of(log, &WHEELS).rows(5);
    let (start, end) = (rows[0].0, rows[rows.len() - 1].0);
    // where the truth is not smoothed, and the simulated machine comes to rest on its tyres
    let inside = start + 500_000_000..end - 500_000_000;
    let edited = rows
        .into_iter()
        .filter(|(time, _)| inside.contains(time))
        .map(|(time, loads)| (time, edit((time - start) as f64 * 1e-9, loads)));
    write_with_loads(log, &path, &edited.collect::<Vec<_>>());
    path
}

fn machine(name: &str, more: &str) -> MachineFile {
    let path = data(&format!("{name}.toml"));
    let text = std::fs::read_to_string(&path).unwrap() + "\n" + more;
    MachineFile::from_text(&path, &text).unwrap()
}

fn analysed(
    name: &str,
    more: &str,
    edit: impl Fn(f64, [f64; 4]) -> [f64; 4],
) -> (TempDir, Analysis) {
    let folder = tempfile::tempdir().unwrap();
    let log = with_loads(folder.path(), &data(&format!("{name}.mcap")), edit);
    let file = machine(name, more);
    let analysis = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
    (folder, analysis)
}

#[test]
fn measured_loads_change_nothing_that_is_computed() {
    let (_, with) = analysed("corner_brake", &cells(100.0), |_, loads| loads);
    let without = tipwatch_tests::analysed(&data("corner_brake.mcap"), Options::default());
    assert_eq!(with.rows.times_ns, without.rows.times_ns);
    assert_eq!(with.rows.reasons, without.rows.reasons);
    for (a, b) in with
        .rows
        .whole()
        .outcomes
        .columns
        .iter()
        .zip(&without.rows.whole().outcomes.columns)
    {
        assert!(a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn measured_and_residual_are_columns_and_the_summary_compares_them() {
    let more = cells(100.0)
        + "[[signals.load_sums]]\nname = \"Front axle\"\nwheels = [\"FL\", \"FR\"]\nload = { topic = \"/wheel_loads\", \
           field = \"fl\", scale = 2.0 }\n";
    // wheel FL shows 150 N too much
    let (_, analysis) = analysed("corner_brake", &more, |_, mut loads| {
        loads[0] += 150.0;
        loads
    });
    let (rows, loads) = (analysis.rows.whole(), &analysis.measured_loads);
    let table = samples(&analysis.machine, rows, Precision::Double, loads);
    let column = |name: &str| table.column(name).unwrap().numbers().unwrap();
    let (measured, residual, load) = (
        column("load_measured_fl"),
        column("load_residual_fl"),
        column("load_fl"),
    );
    let mut compared = 0;
    for row in 0..rows.len() {
        if measured[row].is_finite() && load[row].is_finite() {
            assert_eq!(residual[row], measured[row] - load[row]);
            compared += 1;
        }
    }
    assert!(compared > 550, "{compared}");
    assert_eq!(column("load_measured_front_axle").len(), rows.len());
    let summary =
        serde_json::to_value(Summary::of(&analysis, report::main_findings(&analysis))).unwrap();
    let sensors = summary["measured_loads"].as_array().unwrap();
    assert_eq!(sensors.len(), 5);
    let number = |sensor: usize, key: &str| sensors[sensor][key].as_f64().unwrap();
    assert_eq!(sensors[0]["sensor"], "fl");
    assert!((number(0, "bias_n") - 150.0).abs() < 40.0, "{}", sensors[0]);
    assert!(
        number(0, "rms_n") > 140.0 && number(1, "rms_n") < 60.0,
        "{summary}"
    );
    assert!(number(1, "inside_2_sigma") > 0.95, "{}", sensors[1]);
    assert!(
        analysis
            .notes
            .iter()
            .any(|note| note.starts_with("Measured load fl: measured minus computed +1"))
    );
}

#[test]
fn a_load_cell_that_lies_for_seconds_makes_those_rows_invalid() {
    let (_, analysis) = analysed("corner_brake", &cells(100.0), |t, mut loads| {
        if (2.0..4.5).contains(&t) {
            loads.iter_mut().for_each(|load| *load *= 1.25);
        }
        loads
    });
    // the cell and the total that it is part of, each in a span of its own
    let spans = &analysis.load_comparison.contradictions;
    let mut sensors: Vec<&str> = spans.iter().map(|span| span.sensor.as_str()).collect();
    sensors.sort_unstable();
    sensors.dedup();
    assert_eq!(sensors.len(), spans.len(), "{spans:?}");
    assert!(sensors.contains(&"total"), "{spans:?}");
    let seconds = |ns: i64| (ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
    for span in spans {
        assert!((seconds(span.start_ns) - 2.0).abs() < 0.2, "{span:?}");
        assert!((seconds(span.end_ns) - 4.5).abs() < 0.2, "{span:?}");
    }
    for (row, &time) in analysis.rows.times_ns.iter().enumerate() {
        let is_inside = spans
            .iter()
            .any(|span| (span.start_ns..=span.end_ns).contains(&time));
        let is_told = analysis.rows.reasons[row]
            .iter()
            .any(|r| r == Reason::Contradiction);
        assert_eq!(is_inside, is_told, "row {row}");
    }
    assert!(
        analysis
            .notes
            .iter()
            .any(|note| note.contains("measured and computed loads contradict"))
    );
}

/// Cells that are wrong from the third second on, each in its own way.
#[test]
fn wrong_load_cells_of_every_kind_are_found() {
    type Edit = fn([f64; 4]) -> [f64; 4];
    let wrong: [(&str, Edit); 5] = [
        ("offset", |[fl, fr, rl, rr]| [fl + 2500.0, fr, rl, rr]),
        ("scale of all", |loads| loads.map(|load| 1.4 * load)),
        ("sign", |[fl, fr, rl, rr]| [fl, -fr, rl, rr]),
        ("no load", |[fl, fr, _, rr]| [fl, fr, 0.0, rr]),
        ("front and rear swapped", |[fl, fr, rl, rr]| {
            [rl, rr, fl, fr]
        }),
    ];
    for (name, edit) in wrong {
        let (_, analysis) = analysed("corner_brake", &cells(100.0), |t, loads| match t {
            3.0.. => edit(loads),
            _ => loads,
        });
        let found = &analysis.load_comparison.contradictions;
        let first = found.iter().map(|span| span.start_ns).min();
        let first = first.unwrap_or_else(|| panic!("{name}: not found"));
        // It begins with the error, and is certain two seconds later.
        let start_s = (first - analysis.rows.times_ns[0]) as f64 * 1e-9;
        assert!((2.9..4.0).contains(&start_s), "{name}: {start_s}");
    }
}

/// While a wheel is off the ground, single loads are not compared; the total is.
#[test]
fn the_total_is_compared_while_a_wheel_is_off_the_ground() {
    let airborne = |analysis: &Analysis| {
        let otf = |wheel: usize| analysis.rows.whole().outcomes.column(Quantity::Otf(wheel));
        let off = |row: &usize| (0..WHEELS.len()).any(|wheel| otf(wheel)[*row] <= 0.0);
        (0..analysis.rows.len()).filter(off).collect::<Vec<usize>>()
    };
    let (_, good) = analysed("side_reach", &cells(100.0), |_, loads| loads);
    assert!(
        good.load_comparison.contradictions.is_empty(),
        "{:?}",
        good.load_comparison.contradictions
    );
    assert!(airborne(&good).len() > 100 && good.load_comparison.lifted > 100);
    let (_, wrong) = analysed("side_reach", &cells(100.0), |_, loads| {
        loads.map(|load| 1.4 * load)
    });
    let contradicted = |row: &&usize| wrong.rows.reasons[**row].has(Reason::Contradiction);
    let rows = airborne(&good);
    assert!(rows.iter().filter(contradicted).count() * 10 > rows.len() * 9);
    assert!(
        wrong
            .load_comparison
            .contradictions
            .iter()
            .any(|span| span.sensor == TOTAL)
    );
}

#[test]
fn uneven_ground_and_short_disturbances_contradict_nothing() {
    // a wheel on a bump: load goes from one diagonal to the other, and equilibrium stays
    let bump = |t: f64, [fl, fr, rl, rr]: [f64; 4]| {
        let shift = if t > 2.0 { 700.0 } else { 0.0 };
        [fl + shift, fr - shift, rl - shift, rr + shift]
    };
    let (_, analysis) = analysed("corner_brake", &cells(100.0), bump);
    assert!(analysis.load_comparison.contradictions.is_empty());
    let spike = |t: f64, loads: [f64; 4]| match (3.0..3.5).contains(&t) {
        true => loads.map(|load| 2.0 * load),
        false => loads,
    };
    let (_, analysis) = analysed("corner_brake", &cells(100.0), spike);
    assert!(analysis.load_comparison.contradictions.is_empty());
}

#[test]
fn a_bound_load_that_the_log_lacks_is_noted() {
    let file = machine("corner_brake", &cells(100.0));
    let analysis = analyse(
        &data("corner_brake.mcap"),
        &file,
        Options::default(),
        &mut |_| {},
    )
    .unwrap();
    assert!(analysis.measured_loads.is_empty());
    assert!(
        analysis
            .notes
            .iter()
            .any(|note| note.starts_with("Measured load fl is not compared"))
    );
    let found = validate(&file, &[data("corner_brake.mcap")], Estimator::Smoother).unwrap();
    assert!(!found.has_compared() && text(&found).contains("not decided"));
}

#[test]
fn validation_states_error_coverage_and_draws_them() {
    let folder = tempfile::tempdir().unwrap();
    let log = with_loads(folder.path(), &data("corner_brake.mcap"), |_, loads| loads);
    let file = machine("corner_brake", &cells(100.0));
    let found = validate(&file, &[log], Estimator::Smoother).unwrap();
    assert!(found.has_compared() && !found.is_contradicted());
    assert!(found.rms_share.unwrap() < 0.01, "{:?}", found.rms_share);
    let [one, two] = found.inside_sigma.map(Option::unwrap);
    assert!(two > 0.95 && one > 0.68, "{one} {two}");
    let (text, page) = (text(&found), page(&found));
    assert!(text.contains("all loads: root mean square"), "{text}");
    assert!(page.contains("plot-1") && page.contains("id=\"figures\""));
    assert!(page.contains("default-src 'none'"));
}

#[test]
fn what_is_wrong_with_a_load_sensor_is_said() {
    let said = |more: &str| {
        let file = machine("corner_brake", more);
        validate(&file, &[data("corner_brake.mcap")], Estimator::Smoother)
            .unwrap_err()
            .to_string()
    };
    let field = "load = { topic = \"/wheel_loads\", field = \"fl\" }\n";
    let message = said(&format!("[signals.wheels.XX]\n{field}"));
    assert!(
        message.contains("signals.wheels.XX") && message.contains("names of [wheels]"),
        "{message}"
    );
    let message = said(&format!("[signals.wheels.FL]\n{field}sigma = -1.0\n"));
    assert!(
        message.contains("signals.wheels.FL.sigma") && message.contains("-1"),
        "{message}"
    );
    let message = said(&format!(
        "[[signals.load_sums]]\nwheels = [\"FL\", \"FL\"]\n{field}"
    ));
    assert!(message.contains("each once"), "{message}");
    let message = said(&format!(
        "[[signals.load_sums]]\nwheels = []\nname = \"x\"\n{field}"
    ));
    assert!(
        message.contains("signals.load_sums 1") && message.contains("one or more names"),
        "{message}"
    );
    let twice = format!(
        "[signals.wheels.FL]\n{field}[[signals.load_sums]]\nname = \"fl\"\nwheels = [\"FR\"]\n{field}"
    );
    assert!(
        said(&twice).contains("a name of its own"),
        "{}",
        said(&twice)
    );
    let message = said("");
    assert!(message.contains("expected measured loads"), "{message}");
}

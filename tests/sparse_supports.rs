//! Sparse logs of a machine whose supports come and go: a crane that drives on its wheels and works on outriggers, with
//! one message of each topic in a second.

use std::sync::LazyLock;

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::base::options::{Options, QuasiStaticOption};
use tipwatch_analyze::base::rows::Rows;
use tipwatch_analyze::events::EventKind;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{Truth, analysed_with, data};

use crate::sparse::{every, thinned};

const SUPPORTS: [&str; 8] = ["FL", "FR", "RL", "RR", "OFL", "OFR", "ORL", "ORR"];
/// Times (s) in which it stands on its wheels and on its outriggers, without the transitions between.
const ON_WHEELS: [[f64; 2]; 2] = [[0.5, 8.5], [36.5, 41.0]];
const ON_FEET: [f64; 2] = [13.0, 31.5];
/// Bounds that the simulated motion keeps, on wheels and on outriggers.
const BOUNDS: &str = "[quasi_static]\nplatform_acceleration = 1.5\nplatform_rate = 0.1\n\
    platform_angular_acceleration = 0.5\njoint_acceleration = 0.5\njoint_acceleration_linear = 0.5\n\
    joint_rate = 0.5\njoint_rate_linear = 0.5\nhold = 3.0\n";

/// Bounds that its operator states for slow work on outriggers.
const SLOW: &str = "[quasi_static]\nplatform_acceleration = 0.1\nplatform_rate = 0.02\n\
    platform_angular_acceleration = 0.05\njoint_acceleration = 0.05\njoint_acceleration_linear = 0.05\n\
    joint_rate = 0.1\njoint_rate_linear = 0.1\nhold = 3.0\n";

/// The crane with one message of each topic in a second.
static AT_ONE_SECOND: LazyLock<Analysis> = LazyLock::new(|| crane(1.0, BOUNDS, None));

/// The crane's log with one message of each topic in `period_s`.
fn crane(period_s: f64, bounds: &str, option: Option<QuasiStaticOption>) -> Analysis {
    crane_with(&mut every(period_s, 0.0), bounds, option)
}

/// The crane's log with the messages that are kept.
fn crane_with(
    keep: &mut dyn FnMut(&str, f64) -> bool,
    bounds: &str,
    option: Option<QuasiStaticOption>,
) -> Analysis {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("crane.mcap");
    thinned(&data("crane.mcap"), &log, keep);
    let text = std::fs::read_to_string(data("crane.toml")).unwrap();
    // a switch tells for longer than its messages are apart
    let aged = |line: &str| match line.starts_with("set =") || line.starts_with("raised =") {
        true => line.replace(" }", ", max_age = 4.0 }"),
        false => line.to_owned(),
    };
    let text: Vec<String> = text.lines().map(aged).collect();
    let text = text.join("\n");
    let machine = folder.path().join("crane.toml");
    std::fs::write(&machine, text + "\n" + bounds).unwrap();
    std::fs::copy(data("crane.urdf"), folder.path().join("crane.urdf")).unwrap();
    let options = Options {
        quasi_static: option,
        ..Options::default()
    };
    let analysis = analysed_with(&log, &machine, options);
    // everything is computed while the log is there
    assert!(analysis.rows.whole().outcomes.columns.len() > 20);
    analysis
}

fn index(analysis: &Analysis, name: &str) -> usize {
    let mut wheels = analysis.machine.wheels().iter();
    wheels.position(|wheel| wheel.name == name).unwrap()
}

/// The supports on the ground at a time (s) far from the transitions.
fn on_ground(time_s: f64) -> Option<&'static [&'static str]> {
    let is_in = |[from, to]: [f64; 2]| (from..to).contains(&time_s);
    if ON_WHEELS.into_iter().any(is_in) {
        return Some(&SUPPORTS[..4]);
    }
    is_in(ON_FEET).then_some(&SUPPORTS[4..])
}

#[test]
fn val_static_rows_on_wheels_and_on_outriggers_carry_the_weight() {
    let analysis = &*AT_ONE_SECOND;
    let rows: &Rows = analysis.rows.whole();
    let weight = analysis.machine.mass() * analysis.machine.gravity();
    let (mut wheels, mut feet) = (0, 0);
    for row in 0..rows.len() {
        let Some(on) = on_ground(rows.seconds(row)) else {
            continue;
        };
        if !rows.reasons[row].is_empty() {
            continue;
        }
        assert_eq!(rows.value(Quantity::Static, row), 1.0, "row {row}");
        let mut total = 0.0;
        for name in SUPPORTS {
            let support = index(analysis, name);
            let load = rows.value(Quantity::Load(support), row);
            let band = [
                Quantity::OtfBetweenLeast(support),
                Quantity::OtfBetweenLargest(support),
            ]
            .map(|quantity| rows.value(quantity, row));
            if on.contains(&name) {
                total += load;
                let otf = rows.value(Quantity::Otf(support), row);
                assert!(
                    band[0] <= otf && otf <= band[1],
                    "{name} {row}: {otf} {band:?}"
                );
            } else {
                // a support that is off the ground has no load and no band
                assert!(
                    load.is_nan() && band.iter().all(|v| v.is_nan()),
                    "{name} {row}"
                );
            }
        }
        assert!(
            (total - weight).abs() < 0.02 * weight,
            "row {row}: {total} {weight}"
        );
        match on[0] {
            "FL" => wheels += 1,
            _ => feet += 1,
        }
    }
    assert!(wheels > 8 && feet > 12, "{wheels} {feet}");
}

#[test]
fn val_static_rows_at_the_stamps_of_load_cells_carry_what_these_measure() {
    let analysis = &*AT_ONE_SECOND;
    let truth = Truth::of(&data("crane.mcap"), &SUPPORTS);
    let rows: &Rows = analysis.rows.whole();
    let [from_s, to_s] = ON_FEET;
    let (mut measured, mut unloaded) = (0, 0);
    for row in 0..rows.len() {
        let at_s = rows.seconds(row);
        if !(from_s..to_s).contains(&at_s) || !rows.reasons[row].leave_loads() {
            continue;
        }
        assert_eq!(rows.value(Quantity::MeasuredTorques, row), 4.0, "{at_s} s");
        measured += 1;
        for (place, name) in SUPPORTS.iter().enumerate().skip(4) {
            let support = index(analysis, name);
            let load = rows.value(Quantity::Load(support), row);
            let sigma = rows.value(Quantity::LoadSigma(support), row);
            let error = load - truth.load(place, rows.times_ns[row]);
            assert!(
                error.abs() < 4.0 * sigma,
                "{name} {at_s} s: {error} {sigma}"
            );
        }
        // the ground has sunk under this foot; by the split rule it would carry 14 kN
        if (21.5..26.5).contains(&at_s) {
            let load = rows.value(Quantity::Load(index(analysis, "ORR")), row);
            assert!(load < 1000.0, "{at_s} s: {load}");
            unloaded += 1;
        }
    }
    assert!(measured > 12 && unloaded >= 4, "{measured} {unloaded}");
    assert_eq!(
        analysis.torques.rows_by_forces,
        (0..rows.len())
            .filter(|&row| rows.value(Quantity::MeasuredTorques, row) > 0.0)
            .count()
    );
}

/// A load that was measured between two rows is that of neither.
#[test]
fn static_rows_between_the_samples_of_load_cells_follow_the_split_rule() {
    let (mut cells, mut others) = (every(1.0, 0.5), every(1.0, 0.0));
    let mut keep = |topic: &str, at_s: f64| match topic {
        "/outriggers/force" => cells(topic, at_s),
        _ => others(topic, at_s),
    };
    let analysis = crane_with(&mut keep, BOUNDS, None);
    assert_eq!(analysis.torques.rows_by_forces, 0);
}

#[test]
fn val_the_band_covers_the_loads_on_the_wheels() {
    let analysis = &*AT_ONE_SECOND;
    let truth = Truth::of(&data("crane.mcap"), &SUPPORTS);
    let rows: &Rows = analysis.rows.whole();
    let (mut inside, mut all) = (0, 0);
    for row in 0..rows.len() - 1 {
        let [from_s, to_s] = [row, row + 1].map(|row| rows.seconds(row));
        let spans = ON_WHEELS.iter();
        if !spans
            .clone()
            .any(|[from, to]| *from <= from_s && to_s < *to)
        {
            continue;
        }
        for (wheel, name) in SUPPORTS[..4].iter().enumerate() {
            let support = index(analysis, name);
            let low = rows.value(Quantity::OtfBetweenLeast(support), row);
            let high = rows.value(Quantity::OtfBetweenLargest(support), row);
            for step in 0..=20 {
                let (a, b) = (rows.times_ns[row], rows.times_ns[row + 1]);
                let load = truth.load(wheel, a + (b - a) * step / 20);
                all += 1;
                inside += usize::from(low <= load && load <= high);
            }
        }
    }
    assert!(
        all > 600 && inside as f64 >= 0.99 * f64::from(all),
        "{inside} of {all}"
    );
}

#[test]
fn lifts_that_cannot_be_excluded_are_those_of_supports_on_the_ground() {
    for period_s in [1.0, 2.0] {
        let analysis = crane(period_s, SLOW, Some(QuasiStaticOption::Always));
        let between = analysis.coverage.between_rows.unwrap();
        assert!(between.static_rows > 10, "{between:?}");
        let length_s = analysis.rows.seconds(analysis.rows.len() - 1);
        let judged_s = between.lift_excluded_s + between.lift_not_excluded_s;
        // nothing is said about the transitions
        assert!(judged_s < length_s - 3.0, "{between:?} of {length_s} s");
        assert!(between.lift_excluded_s > 2.0, "{between:?}");
        assert!(between.lift_not_excluded_s > 2.0, "{between:?}");
        // the foot that sinks carries nothing for some seconds
        let mut open = (analysis.events.iter()).filter(|e| e.kind == EventKind::LiftNotExcluded);
        assert!(open.clone().any(|event| event.subject == "orr"));
        for event in open.by_ref() {
            let start_s = (event.start_ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
            if let Some(on) = on_ground(start_s) {
                let subject = event.subject.to_uppercase();
                assert!(on.contains(&subject.as_str()), "{subject} at {start_s} s");
            }
        }
        // rows while the weight passes from wheels to outriggers know nothing
        let rows = 0..analysis.rows.len();
        for row in rows.filter(|&row| (10.0..10.6).contains(&analysis.rows.seconds(row))) {
            assert!(analysis.rows.reasons[row].has(Reason::SupportsUnknown));
        }
    }
}

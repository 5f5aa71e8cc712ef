//! Payload mass estimated from the force of the lifting cylinder.

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{Truth, data, write_with_loads};

const TRUE_MASS_KG: f64 = 320.0;
const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];
const PAYLOAD: &str = "
[[payload]]
link = \"tool\"
mass = \"estimate\"
com = [0.405, -0.4313, -0.0134]
";
const FORCE: &str = "force = { topic = \"/actuators\", joint = \"lift_rod\" }";
const PRESSURE: &str = "pressure = { \
     piston = { topic = \"/lift_cylinder/piston_pressure\", field = \"fluid_pressure\" }, \
     rod = { topic = \"/lift_cylinder/rod_pressure\", field = \"fluid_pressure\" }, \
     piston_area = 50.265e-4, rod_area = 34.361e-4 }";

/// The machine file with text added to its lift linkage.
fn machine_file(binding: &str) -> String {
    let text = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
    let bound = format!("name = \"lift\"\n{binding}\n");
    text.replacen("name = \"lift\"\n", &bound, 1) + PAYLOAD
}

fn analysed(text: &str) -> anyhow::Result<Analysis> {
    let file = MachineFile::from_text(&data("lift_payload.toml"), text)?;
    let log = data("lift_payload.mcap");
    analyse(&log, &file, Options::default(), &mut |_| {})
}

#[test]
fn val_payload_is_estimated_from_force_or_pressures() {
    for binding in [FORCE, PRESSURE] {
        let analysis = analysed(&machine_file(binding)).unwrap();
        let [found] = &analysis.payloads[..] else {
            panic!("{:?}", analysis.payloads);
        };
        let (mass, sigma) = (found.mass_kg, found.sigma_kg);
        println!(
            "{mass:.1} kg, sigma {sigma:.1} kg, residual {:.0} N",
            found.residual_n
        );
        assert!((mass - TRUE_MASS_KG).abs() < 2.0 * sigma, "{mass} {sigma}");
        assert!((mass - TRUE_MASS_KG).abs() < 0.05 * TRUE_MASS_KG, "{mass}");
        assert!(sigma < 0.1 * TRUE_MASS_KG, "{sigma}");
        let share = Truth::of(&data("lift_payload.mcap"), &WHEELS).error_share(&analysis);
        assert!(share < 0.02, "without the payload it is 0.18: {share}");
        assert!(
            analysis
                .notes
                .iter()
                .any(|note| note.contains("was estimated"))
        );
    }
}

const SCALE: &str = "
[[payload]]
link = \"tool\"
mass = { signal = { topic = \"/wheel_loads\", field = \"fl\" } }
mass_sigma = 4.0
com = [0.405, -0.4313, -0.0134]
";

/// The log with the numbers of a loader's scale, where it has one at that time (s).
fn weighed(mass: impl Fn(f64) -> Option<f64>) -> anyhow::Result<Analysis> {
    weighed_in("", Options::default(), mass)
}

/// Returns the analysis of the log with these numbers of a loader's scale, the payload attached in this window.
fn weighed_in(
    window: &str,
    options: Options,
    mass: impl Fn(f64) -> Option<f64>,
) -> anyhow::Result<Analysis> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("lift_payload.mcap");
    let times = Truth::of(&data("lift_payload.mcap"), &WHEELS).rows(100);
    let start = times[0].0;
    let scale = times.iter().filter_map(|(time, _)| {
        let mass = mass((time - start) as f64 * 1e-9)?;
        Some((*time, [mass, 0.0, 0.0, 0.0]))
    });
    write_with_loads(
        &data("lift_payload.mcap"),
        &path,
        &scale.collect::<Vec<_>>(),
    );
    let text = std::fs::read_to_string(data("lift_payload.toml"))? + SCALE + window;
    let file = MachineFile::from_text(&data("lift_payload.toml"), &text)?;
    analyse(&path, &file, options, &mut |_| {})
}

#[test]
fn a_scale_tells_the_payload() {
    let analysis = weighed(|_| Some(TRUE_MASS_KG)).unwrap();
    let share = Truth::of(&data("lift_payload.mcap"), &WHEELS).error_share(&analysis);
    assert!(share < 0.02, "without the payload it is 0.18: {share}");
    // the same loads and bands as with the mass as a number
    let stated = SCALE.replace(
        "{ signal = { topic = \"/wheel_loads\", field = \"fl\" } }",
        "320.0",
    );
    let text = std::fs::read_to_string(data("lift_payload.toml")).unwrap() + &stated;
    let known = analysed(&text).unwrap();
    let mut compared = 0;
    for row in (0..analysis.rows.len()).filter(|&row| analysis.rows.is_valid(row)) {
        assert!(known.rows.is_valid(row));
        for wheel in 0..4 {
            for quantity in [Quantity::Load(wheel), Quantity::LoadSigma(wheel)] {
                let (a, b) = (
                    analysis.rows.whole().value(quantity, row),
                    known.rows.whole().value(quantity, row),
                );
                assert!(
                    (a - b).abs() < 1e-6 * b.abs(),
                    "{quantity:?} {row}: {a} {b}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}

/// Its window counts from the first row of the log, whichever part of it is asked for.
#[test]
fn a_part_of_a_log_has_the_payload_that_the_log_has_there() {
    let of = |from_s: Option<f64>, estimator: Estimator| {
        let options = Options {
            from_s,
            estimator,
            ..Options::default()
        };
        weighed_in("from = 3.0\nto = 5.0\n", options, |_| Some(TRUE_MASS_KG)).unwrap()
    };
    for estimator in [Estimator::Smoother, Estimator::Causal] {
        let (whole, part) = (of(None, estimator), of(Some(2.0), estimator));
        let masses = |analysis: &Analysis| {
            let notes = analysis.notes.iter();
            let notes = notes.filter(|note| note.starts_with("Mass of payload"));
            notes.cloned().collect::<Vec<_>>()
        };
        if estimator == Estimator::Causal {
            assert_eq!(masses(&whole).len(), 1);
            assert_eq!(masses(&whole), masses(&part));
        }
        let skipped = whole.rows.len() - part.rows.len();
        for row in 0..part.rows.len() {
            let [a, b] = [(&whole, row + skipped), (&part, row)].map(|(analysis, row)| {
                analysis
                    .rows
                    .whole()
                    .value(Quantity::Load(0), row)
                    .to_bits()
            });
            assert_eq!(a, b, "{row}");
        }
    }
}

#[test]
fn a_scale_that_falls_silent_leaves_the_loads_unknown() {
    let analysis = weighed(|time_s| (time_s < 2.9).then_some(TRUE_MASS_KG)).unwrap();
    let rows = &analysis.rows;
    for row in 0..rows.len() {
        // the last sample is of 2.8 s and holds for 2 s
        let after_s = rows.seconds(row) - 4.8;
        if after_s.abs() < 0.05 {
            continue;
        }
        let is_silent = after_s > 0.0;
        assert_eq!(
            rows.reasons[row].has(Reason::ToolWrenchGap),
            is_silent,
            "{row}"
        );
        if is_silent {
            assert!(rows.whole().value(Quantity::Load(0), row).is_nan());
        }
    }
    assert!(rows.seconds(rows.len() - 1) > 6.0);
    assert!(analysis.notes.iter().any(|note| note.contains("max_age")));
}

#[test]
fn a_signal_of_a_mass_needs_a_sigma_and_says_how_it_is_written() {
    let message = |mass: &str, more: &str| {
        let text = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
        let text = format!("{text}[[payload]]\nlink = \"tool\"\nmass = {mass}\n{more}");
        format!("{:#}", analysed(&text).unwrap_err())
    };
    let signal = "{ signal = { topic = \"/scale\", field = \"kg\" } }";
    let no_sigma = message(signal, "");
    assert!(no_sigma.contains("payload 1: mass_sigma"), "{no_sigma}");
    let misspelt = message("{ topic = \"/scale\", field = \"kg\" }", "mass_sigma = 1.0");
    assert!(
        misspelt.contains("payload[0].mass") && misspelt.contains("signal"),
        "{misspelt}"
    );
    let no_form = message("true", "");
    assert!(
        no_form.contains("payload[0].mass") && no_form.contains("\"estimate\""),
        "{no_form}"
    );
}

#[test]
fn what_is_missing_for_an_estimate_is_said() {
    let message = |text: &str| format!("{:#}", analysed(text).unwrap_err());
    let unbound = message(&machine_file(""));
    assert!(unbound.contains("expected force or pressure"), "{unbound}");
    let nowhere = message(&machine_file(&FORCE.replace("/actuators", "/nowhere")));
    assert!(
        nowhere.contains("/nowhere") && nowhere.contains("/actuators"),
        "{nowhere}"
    );
    let no_field = message(&machine_file(
        &PRESSURE.replace("fluid_pressure\" }, rod", "flow\" }, rod"),
    ));
    assert!(no_field.contains("flow"), "{no_field}");
    let no_joint = message(&machine_file(&FORCE.replace("lift_rod", "no_rod")));
    assert!(
        no_joint.contains("\"no_rod\"") && no_joint.contains("lift_rod"),
        "{no_joint}"
    );
}

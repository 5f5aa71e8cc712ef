//! Utilisation and verdict do not depend on when a recording begins.

use std::fs;

use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::MachineError;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::{LogFacts, Machine, MachineSpec};
use tipwatch_mechanics::verdict::Level;
use tipwatch_tests::{analysed, by, data};

/// Rear left of `tiny_lift` is in the air from 0.90 to 2.45 s.
const IN_THE_AIR_S: [f64; 2] = [1.3, 2.3];

#[test]
fn start_with_a_wheel_in_the_air_is_danger_with_the_same_utilisation() {
    for estimator in [Estimator::Smoother, Estimator::Causal] {
        let options = by(estimator);
        let whole = analysed(&data("tiny_lift.mcap"), options);
        let late = analysed(
            &data("tiny_lift.mcap"),
            Options {
                from_s: Some(IN_THE_AIR_S[0]),
                ..options
            },
        );
        let used = |analysis: &tipwatch_analyze::analysis::Analysis, row| {
            analysis.rows.whole().outcomes.column(Quantity::Utilisation)[row]
        };
        let verdicts = &late.rows.whole().verdicts.as_ref().unwrap().verdicts;
        let mut compared = 0;
        for row in 0..late.rows.len() {
            let same = whole.rows.at(late.rows.times_ns[row]);
            assert_eq!(used(&whole, same).to_bits(), used(&late, row).to_bits());
            let seconds = whole.rows.seconds(same);
            if seconds < IN_THE_AIR_S[1] && late.rows.is_valid(row) {
                assert_eq!(
                    verdicts[row].level,
                    Level::Danger,
                    "{seconds} s, {estimator:?}"
                );
                compared += 1;
            }
        }
        assert!(compared > 80, "{compared}");
    }
}

// requirement: TW-VERDICT-23
#[test]
fn time_to_lift_off_is_announced_only_from_notice_on() {
    for log in [
        "tiny_lift.mcap",
        "swing_lift.mcap",
        "tiny.mcap",
        "corner_brake.mcap",
    ] {
        let analysis = analysed(&data(log), Options::default());
        let verdicts = analysis.rows.whole().verdicts.as_ref().unwrap();
        for (verdict, time_s) in verdicts.verdicts.iter().zip(&verdicts.time_to_lift_off_s) {
            let may = matches!(
                verdict.level,
                Level::Notice | Level::Warning | Level::Danger
            );
            assert!(
                may || time_s.is_nan(),
                "{log}: {verdict:?} announces {time_s} s"
            );
        }
        let announced = verdicts
            .time_to_lift_off_s
            .iter()
            .any(|time_s| time_s.is_finite());
        assert!(announced || !log.contains("lift"), "{log}");
    }
}

/// The machine file of `tiny` with another limit instead of its reference posture, and more at its end.
fn machine_text(limit: &str, extra: &str) -> String {
    let text = fs::read_to_string(data("tiny.toml")).unwrap();
    let lines = text
        .lines()
        .map(|line| match line.starts_with("reference_posture") {
            true => limit,
            false => line,
        });
    lines.collect::<Vec<_>>().join("\n") + extra
}

fn checked(text: &str, joints: Option<&[String]>) -> Result<Machine, MachineError> {
    let urdf = fs::read_to_string(data("tiny.urdf")).unwrap();
    let facts = LogFacts {
        joint_names: joints,
        ..LogFacts::default()
    };
    MachineSpec::from_toml(text, "tiny.toml")?.check(&urdf, "tiny.urdf", facts)
}

#[test]
fn measured_rods_have_the_reference_of_measured_pivots() {
    let names = |of_linkages: [&str; 2]| -> Vec<String> {
        let others = ["slew", "extension", "steer_fl", "steer_fr"];
        others
            .iter()
            .chain(&of_linkages)
            .map(ToString::to_string)
            .collect()
    };
    // two angles fit each length of a rod
    let refused = checked(
        &machine_text("", ""),
        Some(&names(["lift_rod", "tilt_rod"])),
    );
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("pivot_near"), "{refused}");
    let mut text = machine_text("", "");
    for linkage in ["lift", "tilt"] {
        let name = format!("pivot = \"{linkage}\"\n");
        assert!(text.contains(&name));
        text = text.replace(&name, &format!("{name}pivot_near = 0.0\n"));
    }
    let loads = |joints: &[String]| {
        let mut machine = checked(&text, Some(joints)).unwrap();
        machine.set_reference_loads().unwrap();
        machine.reference().static_load.clone()
    };
    let [pivots, rods] = [["lift", "tilt"], ["lift_rod", "tilt_rod"]].map(|of| loads(&names(of)));
    for (pivot, rod) in pivots.iter().zip(&rods) {
        assert!((pivot - rod).abs() < 1e-3 * pivot, "{pivots:?} {rods:?}");
    }
}

#[test]
fn a_posture_in_which_a_wheel_carries_nothing_is_refused() {
    let mut heavy = checked(
        &machine_text("", "\n[[payload]]\nlink = \"tool\"\nmass = 8000.0\n"),
        None,
    )
    .unwrap();
    let error = heavy.set_reference_loads().unwrap_err().to_string();
    for expected in [
        "static load of wheel",
        "limits.reference_posture",
        "slew = 0.0000",
        "positive",
    ] {
        assert!(error.contains(expected), "{error}");
    }
    let unknown = machine_text("reference_posture = { boom = 0.1 }", "");
    let error = checked(&unknown, None).unwrap_err().to_string();
    assert!(error.contains("limits.reference_posture.boom"), "{error}");
}

#[test]
fn a_stated_posture_is_used() {
    let loads = |extra: &str| {
        let mut machine = checked(&machine_text(extra, ""), None).unwrap();
        machine.set_reference_loads().unwrap();
        (
            machine.reference().posture.is_stated,
            machine.reference().static_load.clone(),
        )
    };
    let (assumed, at_zero) = loads("");
    let (stated, turned) = loads("reference_posture = { slew = 1.5707963 }");
    assert!(!assumed && stated);
    // the arm over the right side instead of the front
    let right = |loads: &[f64]| loads[1] + loads[3];
    assert!(
        right(&turned) > right(&at_zero) + 1000.0,
        "{at_zero:?} {turned:?}"
    );
}

/// Live refuses such a machine; offline the loads are still of use, but nothing is safe.
#[test]
fn without_a_usable_posture_loads_are_known_and_utilisation_is_not() {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(data("tiny.urdf"), folder.path().join("tiny.urdf")).unwrap();
    let analysed_as = |name: &str, limit: &str, extra: &str| {
        let path = folder.path().join(name);
        fs::write(&path, machine_text(limit, extra)).unwrap();
        let file = MachineFile::read(&path).unwrap();
        analyse(&data("tiny.mcap"), &file, Options::default(), &mut |_| {})
    };
    // an arm that cannot stand at zero: its payload counts always
    let always = "\n[[payload]]\nlink = \"tool\"\nmass = 8000.0\n";
    let analysis = analysed_as("assumed.toml", "", always).unwrap();
    let is_noted = |note: &tipwatch_mechanics::machine::Note| {
        note.starts_with("Utilisation is unknown: static load of wheel")
    };
    assert!(analysis.notes.iter().any(is_noted), "{:?}", analysis.notes);
    let used = analysis.rows.whole().outcomes.column(Quantity::Utilisation);
    assert!(used.iter().all(|used| used.is_nan()));
    let verdicts = &analysis.rows.whole().verdicts.as_ref().unwrap().verdicts;
    let is_calm = |level: Level| level.sees_no_danger() || level == Level::Notice;
    assert!(!verdicts.iter().any(|verdict| is_calm(verdict.level)));
    // a stated posture that cannot serve is an error
    let stated = "reference_posture = { slew = 0.1 }";
    let error = analysed_as("stated.toml", stated, always)
        .unwrap_err()
        .to_string();
    assert!(error.contains("limits.reference_posture"), "{error}");
}

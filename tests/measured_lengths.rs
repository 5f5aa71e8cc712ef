//! Measured strokes of a cylinder against the angle of the joint that it turns.

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::Motion;
use tipwatch_mechanics::machine::Policy;
use tipwatch_tests::{LOADS, analysed as analysed_as_it_is, data, write_edited, write_with_loads};

const LOG: &str = "lift_payload";
/// The stroke of the lift cylinder stands in the first number of the added topic.
const ROD: &str =
    "\n[signals.joints.lift_rod]\nposition = { topic = \"/wheel_loads\", field = \"fl\" }\n";
/// Time from which a sensor is wrong (s).
const WRONG_FROM_S: f64 = 3.0;

/// An analysis with a measured stroke, changed by `edit`, which gets it and the first one, from [`WRONG_FROM_S`] on.
fn analysed(edit: impl Fn(f64, f64) -> f64) -> Analysis {
    let folder = TempDir::new().unwrap();
    let (from, to) = (data(&format!("{LOG}.mcap")), folder.path().join("log.mcap"));
    let known = analysed_as_it_is(&from, Options::default());
    let lift = known
        .machine
        .linkages()
        .iter()
        .find(|it| it.name == "lift")
        .unwrap();
    let mut strokes: Vec<(i64, f64)> = Vec::new();
    write_edited(&from, &to, &mut |topic, values| {
        if topic == "/joint_states" {
            let pivot = Motion::at_rest(values.get("position.lift"));
            strokes.push((values.stamp_ns, lift.solve(&pivot).rod.displacement));
        }
    });
    let (start_ns, first) = strokes[0];
    let wrong = strokes.iter().map(|&(time_ns, stroke)| {
        let time_s = (time_ns - start_ns) as f64 * 1e-9;
        let shown = if time_s < WRONG_FROM_S {
            stroke
        } else {
            edit(stroke, first)
        };
        (time_ns, [shown, 0.0, 0.0, 0.0])
    });
    write_with_loads(&from, &to, &wrong.collect::<Vec<_>>());
    let machine = data(&format!("{LOG}.toml"));
    let text = std::fs::read_to_string(&machine).unwrap() + ROD;
    let file = MachineFile::from_text(&machine, &text).unwrap();
    analyse(&to, &file, Options::default(), &mut |_| {}).unwrap()
}

fn reported(analysis: &Analysis) -> Vec<&Event> {
    let is_stroke = |event: &&Event| event.subject == "joint_states.lift_rod against lift";
    let faults = (analysis.events.iter()).filter(|event| event.kind == EventKind::InputFault);
    faults.filter(is_stroke).collect()
}

#[test]
fn a_stroke_that_fits_its_angle_contradicts_nothing() {
    assert!(LOADS.contains("wheel_loads"));
    let found = analysed(|stroke, _| stroke + 0.004);
    assert!(reported(&found).is_empty(), "{:?}", reported(&found));
}

#[test]
fn wrong_strokes_are_reported_and_change_no_load() {
    type Edit = fn(f64, f64) -> f64;
    let wrong: [(&str, Edit); 4] = [
        ("offset", |stroke, _| stroke + 0.05),
        ("scale", |stroke, _| 2.0 * stroke),
        ("sign", |stroke, _| -stroke),
        ("millimetres", |stroke, _| 1000.0 * stroke),
    ];
    let good = analysed(|stroke, _| stroke);
    for (name, edit) in wrong {
        let analysis = analysed(edit);
        let found = reported(&analysis);
        let event = found
            .first()
            .unwrap_or_else(|| panic!("{name}: not reported"));
        assert!(event.unit == "m" && event.fault.as_ref().unwrap().policy == Policy::Report);
        let start_s = (event.start_ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
        assert!((start_s - WRONG_FROM_S).abs() < 0.5, "{name}: {start_s}");
        assert_eq!(analysis.rows.reasons, good.rows.reasons, "{name}");
    }
}

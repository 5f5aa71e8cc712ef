//! Measured forces of the arm's cylinders against masses and motion: wrong sensors of several kinds are reported, a good
//! log reports nothing, and what is reported leaves the loads as they are.

use tempfile::TempDir;
use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{FaultKind, Policy};
use tipwatch_tests::{Values, data, write_edited};

/// The simulated load.
const PAYLOAD: &str = "
[[payload]]
link = \"tool\"
mass = 320.0
com = [0.405, -0.4313, -0.0134]
";
/// Time from which a sensor is wrong (s).
const WRONG_FROM_S: f64 = 3.0;

/// The machine file with the forces of both cylinders of the arm, and with `more`.
fn machine(more: &str) -> MachineFile {
    let mut text = std::fs::read_to_string(data("lift_payload.toml")).unwrap();
    for linkage in ["lift", "tilt"] {
        let bound = format!(
            "name = \"{linkage}\"\nforce = {{ topic = \"/actuators\", joint = \"{linkage}_rod\" }}\n"
        );
        text = text.replacen(&format!("name = \"{linkage}\"\n"), &bound, 1);
    }
    MachineFile::from_text(&data("lift_payload.toml"), &(text + more)).unwrap()
}

/// An analysis of the log with the forces changed by `edit` from [`WRONG_FROM_S`] on.
fn analysed(more: &str, mut edit: impl FnMut(&mut Values<'_>)) -> Analysis {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("lift_payload.mcap");
    write_edited(&data("lift_payload.mcap"), &log, &mut |topic, values| {
        if topic == "/actuators" && values.time_s >= WRONG_FROM_S {
            edit(values);
        }
    });
    analyse(&log, &machine(more), Options::default(), &mut |_| {}).unwrap()
}

fn reported(analysis: &Analysis) -> Vec<&Event> {
    let is_force = |event: &&Event| event.subject.ends_with("against masses and joints");
    let faults = (analysis.events.iter()).filter(|event| event.kind == EventKind::InputFault);
    faults.filter(is_force).collect()
}

#[test]
fn good_forces_contradict_nothing() {
    let found = analysed(PAYLOAD, |_| {});
    assert!(reported(&found).is_empty(), "{:?}", reported(&found));
}

#[test]
fn wrong_forces_are_reported_and_change_no_load() {
    type Edit = fn(&mut Values<'_>);
    fn both(values: &mut Values<'_>, change: fn(f64) -> f64) {
        for name in ["effort.lift_rod", "effort.tilt_rod"] {
            values.set(name, change(values.get(name)));
        }
    }
    let wrong: [(&str, Edit); 4] = [
        ("offset", |values| both(values, |force| force + 40e3)),
        ("scale", |values| both(values, |force| 2.0 * force)),
        ("sign", |values| both(values, |force| -force)),
        ("swapped", |values| {
            let [lift, tilt] = ["effort.lift_rod", "effort.tilt_rod"];
            let (of_lift, of_tilt) = (values.get(lift), values.get(tilt));
            values.set(lift, of_tilt);
            values.set(tilt, of_lift);
        }),
    ];
    let good = analysed(PAYLOAD, |_| {});
    for (name, edit) in wrong {
        let analysis = analysed(PAYLOAD, edit);
        let found = reported(&analysis);
        assert_eq!(found.len(), 2, "{name}: {found:?}");
        for event in found {
            let fault = event.fault.as_ref().unwrap();
            assert_eq!(fault.kind, FaultKind::Contradiction);
            assert_eq!(fault.policy, Policy::Report);
            let limit = fault.limit.unwrap();
            assert!(event.unit == "N" && event.worst.abs() > limit && limit > 2500.0);
            // It begins where the sensor begins to be wrong, and is certain two seconds later.
            let start_s = (event.start_ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
            assert!((start_s - WRONG_FROM_S).abs() < 0.3, "{name}: {start_s}");
        }
        assert_eq!(analysis.rows.reasons, good.rows.reasons, "{name}");
    }
}

/// Each force that stands still is found as soon as the arm's motion has changed the true one by more than the limit.
#[test]
fn forces_that_stand_still_are_reported() {
    let good = analysed(PAYLOAD, |_| {});
    for linkage in ["lift", "tilt"] {
        let name = format!("effort.{linkage}_rod");
        let mut kept = None;
        let mut largest_change = 0.0_f64;
        let analysis = analysed(PAYLOAD, |values| {
            let kept = *kept.get_or_insert(values.get(&name));
            largest_change = largest_change.max((values.get(&name) - kept).abs());
            values.set(&name, kept);
        });
        let mut found = reported(&analysis);
        found.retain(|event| event.fault.as_ref().unwrap().kind == FaultKind::Frozen);
        let [event] = found[..] else {
            panic!("{linkage}, changed by {largest_change} N: {found:?}");
        };
        assert!(event.subject.starts_with(&format!("actuator.{linkage}")));
        let start_s = (event.start_ns - analysis.rows.times_ns[0]) as f64 * 1e-9;
        assert!(start_s >= WRONG_FROM_S, "{linkage}: {start_s}");
        assert_eq!(analysis.rows.reasons, good.rows.reasons);
    }
}

#[test]
fn a_load_that_nobody_states_is_reported() {
    let found = analysed("", |_| {});
    assert!(
        reported(&found)
            .iter()
            .any(|event| event.subject.starts_with("actuator.lift"))
    );
}

/// A force that tells the mass of a payload is used up.
#[test]
fn a_force_that_determines_a_mass_is_not_compared() {
    let estimated = PAYLOAD.replace("320.0", "\"estimate\"");
    let found = analysed(&estimated, |_| {});
    assert!(
        !found.payloads.is_empty() && reported(&found).is_empty(),
        "{:?}",
        reported(&found)
    );
}

//! Wheel loads against the contact forces of a simulation that shares no formula with us.

use tipwatch_analyze::events::EventKind;
use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_tests::{Truth, analysed, beside, data};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

fn error(log: &std::path::Path, estimator: Estimator) -> f64 {
    let analysis = analysed(
        log,
        Options {
            estimator,
            ..Options::default()
        },
    );
    Truth::of(log, &WHEELS).error_share(&analysis)
}

#[test]
fn val_short_logs_of_the_repository() {
    for (name, smoother, causal) in [
        ("tiny.mcap", 0.007, 0.08),
        ("tiny_lift.mcap", 0.0075, 0.012),
    ] {
        let found = [
            error(&data(name), Estimator::Smoother),
            error(&data(name), Estimator::Causal),
        ];
        assert!(
            found[0] < smoother && found[1] < causal,
            "{name}: {found:?}"
        );
    }
}

#[test]
fn val_simulated_logs() {
    for (name, smoother, causal) in [
        ("sim/flat_arm_clean.mcap", 0.0035, 0.009),
        ("sim/drive_brake_clean.mcap", 0.0035, 0.011),
        ("sim/flat_arm.mcap", 0.0042, 0.009),
        ("sim/drive_brake.mcap", 0.0044, 0.011),
    ] {
        let Some(log) = beside(name) else { return };
        let found = [
            error(&log, Estimator::Smoother),
            error(&log, Estimator::Causal),
        ];
        assert!(
            found[0] < smoother && found[1] < causal,
            "{name}: {found:?}"
        );
    }
}

#[test]
fn val_the_lifted_wheel_is_found_when_it_lifted() {
    let analysis = analysed(&data("tiny_lift.mcap"), Options::default());
    let first_ns = analysis.rows.times_ns[0];
    let seconds = |ns: i64| (ns - first_ns) as f64 * 1e-9;
    // true: RL light 0.41 to 2.68 s, lifted 0.90 to 2.45 s
    for (kind, start, end) in [
        (EventKind::WheelLight, 0.41, 2.68),
        (EventKind::WheelLift, 0.90, 2.45),
    ] {
        let events: Vec<_> = analysis.events.iter().filter(|e| e.kind == kind).collect();
        let [event] = events[..] else {
            panic!("{kind:?}: {events:?}")
        };
        assert_eq!(event.subject, "rl");
        let found = (seconds(event.start_ns), seconds(event.end_ns.unwrap()));
        assert!(
            (found.0 - start).abs() < 0.15 && (found.1 - end).abs() < 0.15,
            "{kind:?}: {found:?}"
        );
    }
    let lift = analysis
        .events
        .iter()
        .find(|e| e.kind == EventKind::WheelLift)
        .unwrap();
    assert!((lift.lead_s.unwrap() - 0.49).abs() < 0.2, "{lift:?}");
    assert!(
        !analysis
            .events
            .iter()
            .any(|e| e.kind >= EventKind::EdgeTipping),
        "{:?}",
        analysis.events
    );
}

//! Wheel loads compared with contact forces from an independent simulator.

use tipwatch_analyze::base::options::{Estimator, Options};
use tipwatch_analyze::events::EventKind;
use tipwatch_mechanics::Quantity;
use tipwatch_tests::{Truth, analysed, analysed_with, by, data, write_edited};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// Load errors of the smoother and, after a start-up time (s), of the causal estimator.
fn errors(log: &std::path::Path, start_up_s: f64) -> [f64; 2] {
    let truth = Truth::of(log, &WHEELS);
    let analysis = |estimator| {
        let options = by(estimator);
        analysed(log, options)
    };
    [
        truth.error_share(&analysis(Estimator::Smoother)),
        truth.error_share_after(&analysis(Estimator::Causal), start_up_s),
    ]
}

#[track_caller]
fn assert_below(name: &str, found: [f64; 2], bounds: [f64; 2]) {
    eprintln!("{name}: smoother {:.5}, causal {:.5}", found[0], found[1]);
    assert!(
        found[0] < bounds[0] && found[1] < bounds[1],
        "{name}: {found:?}, expected below {bounds:?}"
    );
}

/// The bounds for driving are those of the README's accuracy table. `tiny` starts with the arm already moving, faster
/// than in any log of that table.
#[test]
fn val_errors_on_short_logs_are_as_documented() {
    for (name, start_up_s, bounds) in [
        ("corner_brake", 1.0, [0.00275, 0.00615]),
        ("tiny_lift", 0.5, [0.0052, 0.0088]),
        ("tiny", 1.5, [0.0050, 0.0125]),
    ] {
        assert_below(
            name,
            errors(&data(&format!("{name}.mcap")), start_up_s),
            bounds,
        );
    }
}

/// The first results of the demo agree with the simulator: the smallest load of the wheel, with a band that a reader can believe,
/// and when the wheel lifted and came down again.
#[test]
fn val_the_demo_tells_what_happened() {
    const RL: usize = 2;
    /// Times between which the wheel carried nothing (s after the first row).
    const IN_THE_AIR_S: [f64; 2] = [9.786, 13.404];
    let analysis = analysed(&data("../../analyze/demo/demo.mcap"), Options::default());
    let of = |kind| {
        let events = analysis.events.iter().filter(|it| it.subject == "rl");
        let first = events
            .filter(|it| it.kind == kind)
            .min_by_key(|it| it.start_ns);
        first.unwrap()
    };
    let worst_ns = of(EventKind::WheelLight).worst_ns;
    let times_ns = &analysis.rows.times_ns;
    let row = times_ns.iter().position(|&it| it == worst_ns).unwrap();
    let value = |quantity| analysis.rows.whole().outcomes.column(quantity)[row];
    let (load, band) = (
        value(Quantity::Load(RL)),
        2.0 * value(Quantity::LoadSigma(RL)),
    );
    let truth = Truth::smoothed_already(&data("demo.mcap"), &WHEELS).load(RL, worst_ns);
    eprintln!("{load:.0} ± {band:.0} N, in truth {truth:.0} N");
    assert!((load - truth).abs() < band);
    // it came close, and it is certain that it did not lift
    assert!(load > band, "{load} ± {band} N");
    assert!(
        band < 0.1 * analysis.machine.reference().static_load[RL],
        "{band} N"
    );
    let lift = of(EventKind::WheelLift);
    let ends = [
        (Some(lift.start_ns), lift.start_sigma_s),
        (lift.end_ns, lift.end_sigma_s),
    ];
    for ((at_ns, sigma_s), true_s) in ends.into_iter().zip(IN_THE_AIR_S) {
        let (at_s, band_s) = (
            (at_ns.unwrap() - times_ns[0]) as f64 * 1e-9,
            2.0 * sigma_s.unwrap(),
        );
        assert!((at_s - true_s).abs() < band_s, "{at_s} ± {band_s} s");
        assert!(band_s < 0.1, "{band_s} s");
    }
}

/// A constant bias of the accelerometer is found from the other sensors.
#[test]
fn val_accelerometer_bias_does_not_set_the_error() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bias, bound) in [
        ("corner_brake", [0.02, -0.03, 0.03], 0.0026),
        ("corner_brake", [-0.03, 0.02, -0.02], 0.0026),
        ("folded_arm", [0.02, 0.02, 0.03], 0.0020),
    ] {
        let (source, path) = (
            data(&format!("{name}.mcap")),
            folder.path().join("log.mcap"),
        );
        write_edited(&source, &path, &mut |topic, values| {
            if topic == "/imu/data" {
                for (axis, bias) in ["force.x", "force.y", "force.z"].into_iter().zip(bias) {
                    values.set(axis, values.get(axis) + bias);
                }
            }
        });
        let analysis = analysed_with(&path, &source.with_extension("toml"), Options::default());
        let error = Truth::of(&source, &WHEELS).error_share(&analysis);
        eprintln!("{name} with a bias of {bias:?}: {error:.5}");
        assert!(error < bound, "{name}: {error}");
        let is_told = |note: &tipwatch_mechanics::machine::Note| {
            note.starts_with("Bias of the accelerometer, estimated")
        };
        assert!(analysis.notes.iter().any(is_told), "{:?}", analysis.notes);
    }
}

/// Uneven ground twists the frame. No rigid-body model sees the resulting change of the loads, but the envelope must
/// contain it.
#[test]
fn val_envelope_contains_loads_of_bogies_on_ridges() {
    let log = data("bogie_drive.mcap");
    let truth = Truth::of(&log, &["FL", "FR", "ML", "MR", "RL", "RR"]);
    let share = truth.share_within_envelope(&analysed(&log, Options::default()), 20.0);
    assert!(share > 0.99, "{share}");
}

#[test]
fn val_wheel_lift_is_detected_at_the_right_time() {
    let analysis = analysed(&data("tiny_lift.mcap"), Options::default());
    let first_ns = analysis.rows.times_ns[0];
    let seconds = |ns: i64| (ns - first_ns) as f64 * 1e-9;
    // ground truth: RL is light from 0.41 to 2.68 s and in the air from 0.90 to 2.45 s
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

mod needs_shared {
    use super::{assert_below, errors};
    use tipwatch_tests::beside;

    /// The bounds are those of the README's accuracy table.
    #[test]
    #[ignore = "needs ../shared"]
    fn val_errors_on_simulated_logs_are_as_documented() {
        for (name, bounds) in [
            ("flat_arm_clean", [0.00315, 0.00425]),
            ("drive_brake_clean", [0.00185, 0.00275]),
            ("flat_arm", [0.00365, 0.00645]),
            ("drive_brake", [0.00275, 0.00615]),
        ] {
            let log = beside(&format!("sim/{name}.mcap"));
            assert_below(name, errors(&log, 0.5), bounds);
        }
    }
}

//! Samples that are wrong by themselves, as loggers really write them: joints set anew, saturated and frozen axes, outliers,
//! angles that wrap. Each is injected into the log `lift`, in which a wheel lifts at 6.1 s.

use std::path::Path;

use tempfile::TempDir;
use tipwatch_analyze::analysis::{Analysis, DEFAULT_MIN_VALID, Undecided, clock_offsets};
use tipwatch_analyze::base::options::Estimator;
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_binding::MachineFile;
use tipwatch_ingest::Log;
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::Level;
use tipwatch_tests::{Values, analysed_with, by, data, write_edited, write_edited_without};

const LIFT: &str = "lift.mcap";
const BOTH: [Estimator; 2] = [Estimator::Smoother, Estimator::Causal];

/// The log with changed messages.
fn with(estimator: Estimator, edit: &mut dyn FnMut(&str, &mut Values<'_>)) -> Analysis {
    let folder = TempDir::new().unwrap();
    let log = folder.path().join("changed.mcap");
    write_edited(&data(LIFT), &log, edit);
    analysed(&log, estimator)
}

fn analysed(log: &Path, estimator: Estimator) -> Analysis {
    let options = by(estimator);
    analysed_with(log, &data(LIFT).with_extension("toml"), options)
}

fn unchanged(estimator: Estimator) -> Analysis {
    analysed(&data(LIFT), estimator)
}

fn faults(analysis: &Analysis) -> Vec<&Event> {
    let is_fault = |event: &&Event| event.kind == EventKind::InputFault;
    analysis.events.iter().filter(is_fault).collect()
}

/// The fault of this kind and subject.
fn fault<'a>(analysis: &'a Analysis, kind: FaultKind, subject: &str) -> Option<&'a Event> {
    let is_it = |event: &&Event| {
        event.subject == subject && event.fault.as_ref().is_some_and(|it| it.kind == kind)
    };
    faults(analysis).into_iter().find(is_it)
}

fn seconds(analysis: &Analysis, time_ns: i64) -> f64 {
    (time_ns - analysis.rows.times_ns[0]) as f64 * 1e-9
}

/// Rows from one time to another (s).
fn rows(analysis: &Analysis, from_s: f64, to_s: f64) -> Vec<usize> {
    (0..analysis.rows.len())
        .filter(|&row| (from_s..=to_s).contains(&analysis.rows.seconds(row)))
        .collect()
}

/// Largest difference of the loads from those of the log without the fault, over the rows that both know (N).
fn largest_error(analysis: &Analysis, of: &Analysis) -> f64 {
    let loads = |analysis: &Analysis, row: usize| {
        let load = |wheel| analysis.rows.whole().outcomes.column(Quantity::Load(wheel))[row];
        [0, 1, 2, 3].map(load)
    };
    let valid = (0..analysis.rows.len()).filter(|&row| analysis.rows.reasons[row].leave_valid());
    let error = |row: usize| {
        let at = of.rows.at(analysis.rows.times_ns[row]);
        let pairs = loads(analysis, row).into_iter().zip(loads(of, at));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    valid.map(error).fold(0.0, f64::max)
}

fn is_doubted(analysis: &Analysis, row: usize) -> bool {
    analysis.rows.reasons[row].has(Reason::Contradiction)
}

/// Sets the slew anew.
fn set_anew(by: f64, span_s: [f64; 2]) -> impl FnMut(&str, &mut Values<'_>) {
    move |topic, values| {
        if topic == "/joint_states" && (span_s[0]..span_s[1]).contains(&values.time_s) {
            values.shift("position.slew", by);
        }
    }
}

#[test]
fn a_slew_that_is_set_anew_is_doubted_from_then_on() {
    for estimator in BOTH {
        let analysis = with(estimator, &mut set_anew(0.8, [5.5, 99.0]));
        let event = fault(&analysis, FaultKind::Contradiction, "joint_states.slew").unwrap();
        assert!((seconds(&analysis, event.start_ns) - 5.5).abs() < 0.02);
        assert!((event.worst - 0.8).abs() < 0.01, "{}", event.worst);
        assert_eq!(event.unit, "rad");
        // the rows keep their values: they are valid, and doubted
        let after = rows(&analysis, 6.4, 9.0);
        assert!(after.len() > 250);
        for row in after {
            assert!(analysis.rows.reasons[row].leave_valid());
            assert!(is_doubted(&analysis, row));
        }
        let before = rows(&analysis, 0.0, 5.4);
        assert!(before.iter().all(|&row| !is_doubted(&analysis, row)));
        assert!(matches!(
            analysis.undecided(DEFAULT_MIN_VALID),
            Some(Undecided::Doubted { .. })
        ));
        if let Some(verdicts) = &analysis.rows.whole().verdicts {
            for row in rows(&analysis, 6.4, 9.0) {
                let level = verdicts.verdicts[row].level;
                assert!(!matches!(level, Level::Safe | Level::Notice), "{level:?}");
            }
        }
    }
}

#[test]
fn a_slew_that_returns_is_believed_again() {
    for estimator in BOTH {
        let analysis = with(estimator, &mut set_anew(0.8, [5.5, 6.5]));
        let event = fault(&analysis, FaultKind::Contradiction, "joint_states.slew").unwrap();
        let end_s = seconds(&analysis, event.end_ns.unwrap());
        assert!((6.4..6.9).contains(&end_s), "{end_s}");
        let after = rows(&analysis, 7.0, 11.5);
        assert!(after.iter().all(|&row| !is_doubted(&analysis, row)));
    }
}

/// The arm goes on while the encoder shows no place: the next place is another one than before.
#[test]
fn a_slew_that_shows_no_place_for_a_second_is_believed_again() {
    for estimator in BOTH {
        let analysis = with(estimator, &mut |topic, values| {
            if topic == "/joint_states" && (5.0..6.0).contains(&values.time_s) {
                values.set("position.slew", 65_535.0);
            }
        });
        let after = rows(&analysis, 7.0, 11.5);
        assert!(after.iter().all(|&row| !is_doubted(&analysis, row)));
        // one that slips twice is no closer to where it was
        let mut first = set_anew(0.8, [5.5, 99.0]);
        let mut second = set_anew(0.8, [6.5, 99.0]);
        let analysis = with(estimator, &mut |topic, values| {
            first(topic, values);
            second(topic, values);
        });
        let after = rows(&analysis, 7.5, 9.0);
        assert!(after.iter().all(|&row| is_doubted(&analysis, row)));
    }
}

#[test]
fn the_lean_of_the_platform_decides_about_a_jump() {
    // the arm was off from the beginning, and is right from 2 s on, before it moves
    let analysis = with(Estimator::Smoother, &mut set_anew(0.8, [0.0, 1.9]));
    let event = fault(&analysis, FaultKind::Contradiction, "joint_states.slew").unwrap();
    let end_s = seconds(&analysis, event.end_ns.unwrap());
    let at_end = rows(&analysis, end_s + 0.1, 11.9);
    assert!(at_end.len() > 20, "{end_s}");
    assert!(at_end.iter().all(|&row| !is_doubted(&analysis, row)));
    // it was right until then, and is off from then on
    let analysis = with(Estimator::Smoother, &mut set_anew(0.8, [1.9, 99.0]));
    let event = fault(&analysis, FaultKind::Contradiction, "joint_states.slew").unwrap();
    assert_eq!(event.end_ns, None);
    let arm = "imu.angular_velocity against joint_states";
    assert!(fault(&analysis, FaultKind::Contradiction, arm).is_some());
}

#[test]
fn an_axis_at_the_end_of_its_range_is_saturated() {
    for estimator in BOTH {
        for (axis, limit) in [("force.y", 1.08), ("force.z", 9.75)] {
            let analysis = with(estimator, &mut |topic, values| {
                if topic == "/imu/data" {
                    values.set(axis, values.get(axis).min(limit));
                }
            });
            let found = fault(&analysis, FaultKind::Saturated, "imu.specific_force");
            let event = found.unwrap_or_else(|| panic!("{axis}: {:?}", faults(&analysis)));
            assert_eq!(event.worst, limit);
            assert_eq!(event.unit, "m/s^2");
            let invalid = (analysis.rows.reasons.iter()).filter(|it| it.has(Reason::ImuFault));
            assert!(invalid.count() > analysis.rows.len() / 4, "{axis}");
        }
    }
}

#[test]
fn one_axis_that_sticks_is_frozen() {
    for estimator in BOTH {
        for (axis, part) in [
            ("force.x", "imu.specific_force"),
            ("force.y", "imu.specific_force"),
            ("turning.x", "imu.angular_velocity"),
        ] {
            let mut held = None;
            let analysis = with(estimator, &mut |topic, values| {
                if topic == "/imu/data" && (5.0..8.0).contains(&values.time_s) {
                    let held = *held.get_or_insert_with(|| values.get(axis));
                    values.set(axis, held);
                }
            });
            let found = [FaultKind::Frozen, FaultKind::Saturated];
            let mut found = found
                .into_iter()
                .filter_map(|kind| fault(&analysis, kind, part));
            let event = found
                .next()
                .unwrap_or_else(|| panic!("{axis}: {:?}", faults(&analysis)));
            let end_s = seconds(&analysis, event.end_ns.unwrap());
            assert!((7.9..8.2).contains(&end_s), "{axis}: {end_s}");
            let start_s = seconds(&analysis, event.start_ns);
            assert!((start_s - 5.0).abs() < 0.05, "{axis}: {start_s}");
        }
    }
}

#[test]
fn a_joint_that_sticks_is_frozen() {
    for estimator in BOTH {
        for since_s in [2.2, 9.2] {
            let mut held = None;
            let names = ["position.slew", "velocity.slew"];
            let analysis = with(estimator, &mut |topic, values| {
                if topic == "/joint_states" && (since_s..since_s + 3.0).contains(&values.time_s) {
                    let held = *held.get_or_insert_with(|| names.map(|name| values.get(name)));
                    for (name, value) in names.into_iter().zip(held) {
                        values.set(name, value);
                    }
                }
            });
            let event = fault(&analysis, FaultKind::Frozen, "joint_states.slew");
            let event = event.unwrap_or_else(|| panic!("{since_s}: {:?}", faults(&analysis)));
            assert!((seconds(&analysis, event.start_ns) - since_s).abs() < 0.3);
        }
    }
}

#[test]
fn outliers_within_the_physical_range_are_left_out() {
    let signals: [(&str, &[&str], f64, &str); 4] = [
        (
            "/imu/data",
            &["force.x", "force.y", "force.z"],
            12.0,
            "imu.specific_force",
        ),
        (
            "/imu/data",
            &["turning.x", "turning.y"],
            1.0,
            "imu.angular_velocity",
        ),
        (
            "/joint_states",
            &["velocity.slew", "velocity.lift"],
            1.5,
            "joint_states.slew",
        ),
        (
            "/joint_states",
            &["position.slew"],
            0.08,
            "joint_states.slew",
        ),
    ];
    for estimator in BOTH {
        let clean = unchanged(estimator);
        for (topic, names, size, subject) in signals {
            let (mut count, mut hit) = (0_u32, 0);
            let analysis = with(estimator, &mut |of, values| {
                if of != topic {
                    return;
                }
                count += 1;
                if count.is_multiple_of(190) && values.time_s > 0.5 {
                    hit += 1;
                    for name in names {
                        values.shift(name, size);
                    }
                }
            });
            assert!(hit >= 5);
            let found = faults(&analysis);
            let samples = found.iter().filter(|event| event.subject == subject);
            let samples = samples.map(|event| event.fault.as_ref().unwrap().samples);
            assert_eq!(samples.sum::<u64>(), hit, "{subject}: {found:?}");
            let error = largest_error(&analysis, &clean);
            assert!(error < 40.0, "{estimator:?} {subject}: {error} N");
        }
    }
}

#[test]
fn angles_that_wrap_are_counted_on() {
    use std::f64::consts::{PI, TAU};
    for estimator in BOTH {
        let clean = unchanged(estimator);
        for start in [-PI, 0.0] {
            let analysis = with(estimator, &mut |topic, values| {
                if topic == "/joint_states" {
                    for wheel in ["fl", "fr", "rl", "rr"] {
                        let name = format!("position.wheel_{wheel}");
                        let angle = (values.get(&name) - start).rem_euclid(TAU) + start;
                        values.set(&name, angle);
                    }
                }
            });
            assert!(faults(&analysis).is_empty());
            let error = largest_error(&analysis, &clean);
            assert!(error < 1.0, "{estimator:?} {start}: {error} N");
        }
    }
}

#[test]
fn sound_samples_are_left_alone() {
    for estimator in BOTH {
        assert!(faults(&unchanged(estimator)).is_empty());
        // a sensor that does not resolve its noise
        let analysis = with(estimator, &mut |topic, values| {
            let steps: &[(&str, f64)] = match topic {
                "/imu/data" => &[
                    ("force.x", 0.08),
                    ("force.y", 0.08),
                    ("force.z", 0.08),
                    ("turning.x", 0.004),
                    ("turning.y", 0.004),
                    ("turning.z", 0.004),
                ],
                "/joint_states" => &[("position.slew", 0.002), ("position.lift", 0.002)],
                _ => return,
            };
            for (name, step) in steps {
                values.set(name, (values.get(name) / step).round() * step);
            }
        });
        assert!(faults(&analysis).is_empty(), "{:?}", faults(&analysis));
    }
}

/// The offsets between clocks are those of the analysis whoever asks for them, also where a driver fills velocities with zeros.
#[test]
fn velocities_that_are_filled_in_move_no_clock() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("changed.mcap");
    write_edited(&data(LIFT), &path, &mut |topic, values| {
        if topic == "/joint_states" {
            set_velocities(values, 0.0);
        }
    });
    let log = Log::open(&path).unwrap();
    let file = MachineFile::read(&data(LIFT).with_extension("toml")).unwrap();
    let alone = clock_offsets(&log, &file).unwrap();
    let analysis = analysed(&path, Estimator::Smoother);
    assert!(!alone.pairs.is_empty());
    assert_eq!(
        format!("{alone:?}"),
        format!("{:?}", analysis.clock.offsets)
    );
}

fn set_velocities(values: &mut Values<'_>, value: f64) {
    let names: Vec<String> = (values.names())
        .filter(|name| name.starts_with("velocity."))
        .map(str::to_owned)
        .collect();
    assert!(!names.is_empty());
    names.iter().for_each(|name| values.set(name, value));
}

/// A driver without velocities fills them with zeros, or says that they are unknown: both are the same log.
#[test]
fn velocities_that_are_always_zero_are_not_measured() {
    for estimator in BOTH {
        let velocities = |value: f64| {
            with(estimator, &mut |topic, values| {
                if topic == "/joint_states" {
                    set_velocities(values, value);
                }
            })
        };
        let (zeros, unknown) = (velocities(0.0), velocities(f64::NAN));
        let apart_n = largest_error(&zeros, &unknown);
        let mean_n = unknown.machine.mass() * unknown.machine.gravity() / 4.0;
        // live, the zeros before the first motion are those of a joint that rests
        let most = match estimator {
            Estimator::Smoother => 0.002,
            Estimator::Causal => 0.05,
        };
        assert!(
            apart_n < most * mean_n,
            "{estimator:?}: {apart_n} N of {mean_n} N"
        );
        let kinds = |analysis: &Analysis| -> Vec<(EventKind, String)> {
            let events = analysis.events.iter();
            events
                .map(|event| (event.kind, event.subject.clone()))
                .collect()
        };
        assert_eq!(kinds(&zeros), kinds(&unknown), "{estimator:?}");
    }
}

/// The coupling of an encoder slips, and its speed shows it as motion. The machine stands by then: its platform does not lean.
fn slips() -> impl FnMut(&str, &mut Values<'_>) {
    let mut start_ns = None;
    move |topic, values| {
        if topic != "/joint_states" {
            return;
        }
        let start_ns = *start_ns.get_or_insert(values.stamp_ns);
        let since_s = (values.stamp_ns - start_ns) as f64 * 1e-9;
        let share = ((since_s - 2.5) / 0.25).clamp(0.0, 1.0);
        let by = 20_f64.to_radians();
        let moved = by * share * share * (3.0 - 2.0 * share);
        let rate = by * 6.0 * share * (1.0 - share) / 0.25;
        values.set("position.slew", values.get("position.slew") + moved);
        values.set("velocity.slew", values.get("velocity.slew") + rate);
    }
}

/// The lifts that begin by then.
fn lifts_by_slip(analysis: &Analysis) -> impl Iterator<Item = &Event> {
    let until_ns = analysis.rows.times_ns[0] + 4_000_000_000;
    let lifts = analysis.events.iter();
    lifts.filter(move |it| it.kind == EventKind::WheelLift && it.start_ns < until_ns)
}

#[test]
fn a_lift_that_the_platform_does_not_show_is_unlikely() {
    let slipped = with(Estimator::Smoother, &mut slips());
    let lifts = lifts_by_slip(&slipped);
    let certainties: Vec<f64> = lifts.filter_map(|lift| lift.certainty).collect();
    assert!(!certainties.is_empty());
    assert!(certainties.iter().all(|p| *p < 0.5), "{certainties:?}");
}

/// The odometry that stands for a gyro knows nothing of a lean.
#[test]
fn without_a_gyro_no_lift_is_doubted_by_the_lean_of_the_platform() {
    let folder = TempDir::new().unwrap();
    let [log, machine] = ["changed.mcap", "changed.toml"].map(|name| folder.path().join(name));
    let mut slips = slips();
    write_edited_without(&data(LIFT), &log, "/imu/data", &mut |topic, values| {
        slips(topic, values);
        if topic == "/odom" {
            values.set("turning.x", 0.0);
            values.set("turning.y", 0.0);
        }
    });
    let text = std::fs::read_to_string(data("lift.toml")).unwrap();
    let text = text
        .replace("imu = \"/imu/data\"\n", "")
        .replace("lift.urdf", data("lift.urdf").to_str().unwrap());
    std::fs::write(&machine, text).unwrap();
    let analysis = analysed_with(&log, &machine, by(Estimator::Smoother));
    let lifts: Vec<&Event> = lifts_by_slip(&analysis).collect();
    assert!(!lifts.is_empty());
    let by_lean = |it: &&Event| {
        let mut doubts = it.doubt.iter().flat_map(|doubt| &doubt.subjects);
        doubts.any(|subject| subject.contains("lean"))
    };
    assert!(!lifts.iter().any(by_lean), "{lifts:?}");
}

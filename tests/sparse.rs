//! Sparse logs: static rows, the band between them, and what is said about lifts that no row shows.

use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::{Analysis, Undecided};
use tipwatch_analyze::base::options::{Estimator, Options, QuasiStaticOption};
use tipwatch_analyze::events::{Event, EventKind};
use tipwatch_mechanics::Quantity;
use tipwatch_mechanics::machine::Note;
use tipwatch_mechanics::state::Reason;
use tipwatch_tests::{Truth, analysed_with, data, write_edited};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// A copy of a log with the messages that are kept, by topic and time since the first message (s).
pub(crate) fn thinned(from: &Path, to: &Path, keep: &mut dyn FnMut(&str, f64) -> bool) {
    let bytes = std::fs::read(from).unwrap();
    let messages = || {
        mcap::MessageStream::new(&bytes)
            .unwrap()
            .map(Result::unwrap)
    };
    let first = messages().map(|message| message.log_time).min().unwrap();
    let mut writer = mcap::Writer::new(std::fs::File::create(to).unwrap()).unwrap();
    for message in messages() {
        if keep(
            &message.channel.topic,
            (message.log_time - first) as f64 * 1e-9,
        ) {
            writer.write(&message).unwrap();
        }
    }
    writer.finish().unwrap();
}

/// Keeps of each topic one message in `period_s`, the first of them `phase_s` after the start.
pub(crate) fn every(period_s: f64, phase_s: f64) -> impl FnMut(&str, f64) -> bool {
    let mut next: std::collections::HashMap<String, f64> = std::collections::HashMap::new();
    move |topic, t| {
        let next = next.entry(topic.into()).or_insert(phase_s);
        let is_due = t >= *next - 1e-6;
        if is_due {
            *next += period_s;
        }
        is_due
    }
}

/// A thinned fixture, and its machine file with more keys.
struct Sparse {
    _folder: tempfile::TempDir,
    log: PathBuf,
    machine: PathBuf,
}

impl Sparse {
    fn of(name: &str, keys: &str, keep: &mut dyn FnMut(&str, f64) -> bool) -> Self {
        Self::of_log(&data(&format!("{name}.mcap")), keys, keep)
    }

    fn of_log(from: &Path, keys: &str, keep: &mut dyn FnMut(&str, f64) -> bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("sparse.mcap");
        thinned(from, &log, keep);
        let machine = folder.path().join("machine.toml");
        let name = from.file_stem().unwrap().to_str().unwrap();
        let fixture = data(&format!("{name}.toml"));
        let text = std::fs::read_to_string(&fixture).unwrap() + "\n" + keys;
        std::fs::write(&machine, text).unwrap();
        let urdf = format!("{name}.urdf");
        std::fs::copy(data(&urdf), folder.path().join(&urdf)).unwrap();
        Self {
            _folder: folder,
            log,
            machine,
        }
    }

    fn analysed(&self) -> Analysis {
        self.with(None)
    }

    fn with(&self, quasi_static: Option<QuasiStaticOption>) -> Analysis {
        let options = Options {
            quasi_static,
            ..Options::default()
        };
        analysed_with(&self.log, &self.machine, options)
    }
}

/// Writes a copy of a fixture whose joints, or the one of this name, are measured at one of `messages` messages, and held until
/// the next.
fn with_held_values(name: &str, messages: usize, joint: Option<&str>, folder: &Path) -> PathBuf {
    let held = folder.join("held.mcap");
    let mut last: Vec<(String, f64)> = Vec::new();
    let mut count = 0;
    write_edited(
        &data(&format!("{name}.mcap")),
        &held,
        &mut |topic, values| {
            if topic != "/joint_states" {
                return;
            }
            if count % messages == 0 {
                let names: Vec<String> = values.names().map(str::to_owned).collect();
                last = names
                    .into_iter()
                    .map(|name| (name.clone(), values.get(&name)))
                    .collect();
            }
            count += 1;
            let is_held = |name: &str| {
                let of_joint = name.split_once('.').map(|(_, of_joint)| of_joint);
                joint.is_none() || joint == of_joint
            };
            let held = last.iter().filter(|(name, _)| is_held(name));
            held.for_each(|(name, value)| values.set(name, *value));
        },
    );
    held
}

/// Live, too, the repeats are no samples: the rows go on with the loads of a log without them, and no encoder has jumped. So it is
/// where only one joint of the message is held.
#[test]
fn causal_rows_go_on_between_the_measurements_of_held_values() {
    let (log, machine) = (data("swing_lift.mcap"), data("swing_lift.toml"));
    let causal = || Options {
        estimator: Estimator::Causal,
        ..Options::default()
    };
    let of_all = analysed_with(&log, &machine, causal());
    let slew = Some("slew");
    for (messages, joint, most) in [
        (10, None, 0.025),
        (20, None, 0.04),
        (10, slew, 0.025),
        (20, slew, 0.04),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let held = with_held_values("swing_lift", messages, joint, folder.path());
        let of_held = analysed_with(&held, &machine, causal());
        assert_eq!(of_held.rows.times_ns, of_all.rows.times_ns);
        assert_eq!(of_held.rows.reasons, of_all.rows.reasons);
        let rows = [&of_held, &of_all].map(|analysis| analysis.rows.whole());
        let (mut squares, mut weight) = (0.0, 0.0);
        for wheel in 0..WHEELS.len() {
            let [held, all] = rows.map(|rows| rows.outcomes.column(Quantity::Load(wheel)));
            let pairs = held.iter().zip(all).filter(|(_, all)| all.is_finite());
            for (held, all) in pairs {
                squares += (held - all).powi(2);
                weight += all / of_all.rows.len() as f64;
            }
        }
        let rms = (squares / (WHEELS.len() * of_all.rows.len()) as f64).sqrt();
        let share = rms / (weight / WHEELS.len() as f64);
        assert!(share < most, "{messages} {joint:?}: {share}");
    }
}

/// The encoder of the boom slips in a message in which the slew repeats its last value: rows after it are doubted as without the
/// repeats.
#[test]
fn an_encoder_that_slips_beside_a_held_joint_stays_doubted() {
    let doubted = |held: usize| {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("slipped.mcap");
        let (mut last, mut count) = (std::collections::BTreeMap::new(), 0);
        write_edited(&data("swing_lift.mcap"), &log, &mut |topic, values| {
            if topic != "/joint_states" {
                return;
            }
            let names: Vec<String> = values.names().map(str::to_owned).collect();
            for name in names {
                if name.ends_with(".slew") {
                    if count % held == 0 {
                        last.insert(name.clone(), values.get(&name));
                    }
                    values.set(&name, last[&name]);
                } else if name == "position.lift" && count >= 403 {
                    values.set(&name, values.get(&name) + 0.3);
                }
            }
            count += 1;
        });
        let causal = Options {
            estimator: Estimator::Causal,
            ..Options::default()
        };
        let analysis = analysed_with(&log, &data("swing_lift.toml"), causal);
        let reasons = &analysis.rows.reasons;
        (reasons.iter())
            .map(|reasons| reasons.have_doubt() || !reasons.leave_loads())
            .collect::<Vec<bool>>()
    };
    let (fresh, held) = (doubted(1), doubted(10));
    let slipped = fresh.iter().skip(400).position(|doubt| *doubt).unwrap() + 400;
    assert!(fresh[slipped..].iter().all(|doubt| *doubt), "{fresh:?}");
    assert!(held[slipped + 10..].iter().all(|doubt| *doubt), "{held:?}");
}

/// A logger that writes its rows faster than the joints are measured holds their values. Its log is that of the measurements: the
/// stairs of the repeats are no motion, which tipped a machine over that only lifted a wheel.
#[test]
fn held_values_are_the_log_of_their_measurements() {
    for (name, messages) in [("swing_lift", 20), ("swing_lift", 50), ("tip_over", 10)] {
        let folder = tempfile::tempdir().unwrap();
        let held = with_held_values(name, messages, None, folder.path());
        let mut count = 0;
        let measured = Sparse::of(name, "", &mut |topic, _| {
            let is_kept = topic != "/joint_states" || count % messages == 0;
            count += usize::from(topic == "/joint_states");
            is_kept
        });
        let of_held = analysed_with(&held, &measured.machine, Options::default());
        let of_measured = measured.analysed();
        let is_told = |note: &Note| note.contains("held until the next measurement");
        assert!(of_held.notes.iter().any(is_told) && !of_measured.notes.iter().any(is_told));
        assert_eq!(of_held.rows.times_ns, of_measured.rows.times_ns);
        let loads = |analysis: &Analysis| {
            let outcomes = &analysis.rows.whole().outcomes;
            let of_wheel = |wheel| outcomes.column(Quantity::Load(wheel)).iter();
            let bits = (0..WHEELS.len())
                .flat_map(of_wheel)
                .map(|load| load.to_bits());
            bits.collect::<Vec<_>>()
        };
        assert_eq!(loads(&of_held), loads(&of_measured));
    }
}

/// A driver that puts the last value of every encoder into its messages holds each joint at instants of its own. The joints are
/// divided by when they are measured; else no message repeats the one before, and the stairs are taken for motion.
#[test]
fn joints_of_one_message_that_are_held_one_by_one_are_the_motion_that_they_measure() {
    let messages = 10;
    let folder = tempfile::tempdir().unwrap();
    let held = folder.path().join("held.mcap");
    let mut last = std::collections::BTreeMap::new();
    let mut count = 0;
    write_edited(&data("swing_lift.mcap"), &held, &mut |topic, values| {
        if topic != "/joint_states" {
            return;
        }
        let names: Vec<String> = values.names().map(str::to_owned).collect();
        let of_joint = |name: &str| name.split_once('.').map(|(_, joint)| joint.to_owned());
        let mut joints: Vec<String> = names.iter().filter_map(|name| of_joint(name)).collect();
        joints.sort();
        joints.dedup();
        for name in names {
            let joint = joints
                .iter()
                .position(|joint| Some(joint.clone()) == of_joint(&name));
            if count == 0 || (count + 3 * joint.unwrap()) % messages == 0 {
                last.insert(name.clone(), values.get(&name));
            }
            values.set(&name, last[&name]);
        }
        count += 1;
    });
    let analysis = analysed_with(&held, &data("swing_lift.toml"), Options::default());
    let whole = analysed_with(
        &data("swing_lift.mcap"),
        &data("swing_lift.toml"),
        Options::default(),
    );
    assert_eq!(analysis.undecided(0.5), None);
    let lifts = |analysis: &Analysis| -> Vec<Event> {
        let lifts = analysis
            .events
            .iter()
            .filter(|event| event.kind == EventKind::WheelLift);
        lifts.cloned().collect()
    };
    let [of_held, of_whole] = [lifts(&analysis), lifts(&whole)].map(|mut lifts| {
        assert_eq!(lifts.len(), 1, "{lifts:?}");
        lifts.remove(0)
    });
    assert_eq!(of_held.subject, of_whole.subject);
    let apart_s = (of_held.start_ns - of_whole.start_ns) as f64 * 1e-9;
    let sigma_s = of_held.start_sigma_s.unwrap();
    assert!(
        apart_s.abs() < 2.0 * sigma_s && sigma_s < 0.2,
        "{apart_s} {sigma_s}"
    );
}

/// Bounds that the simulated motion of the fixture keeps.
const BOUNDS: &str = "[quasi_static]\nplatform_acceleration = 1.5\nplatform_rate = 0.3\n\
    platform_angular_acceleration = 1.5\njoint_acceleration = 2.0\njoint_acceleration_linear = 2.0\n\
    joint_rate = 2.0\njoint_rate_linear = 2.0\n";

/// Returns the number of true loads between valid rows that lie in the band of the row before, the number of all of them, and the
/// widest band (N).
fn covered(analysis: &Analysis, truth: &Truth) -> (usize, usize, f64) {
    let rows = &analysis.rows;
    let (mut inside, mut all, mut widest) = (0, 0, 0.0_f64);
    for row in 0..rows.len() - 1 {
        if !(rows.is_valid(row) && rows.is_valid(row + 1)) {
            continue;
        }
        let window = rows.window(row..row + 1);
        for (wheel, _) in WHEELS.iter().enumerate() {
            let low = window.value(Quantity::OtfBetweenLeast(wheel), 0);
            let high = window.value(Quantity::OtfBetweenLargest(wheel), 0);
            if !low.is_finite() {
                continue;
            }
            widest = widest.max(high - low);
            for step in 0..=50 {
                let (a, b) = (rows.times_ns[row], rows.times_ns[row + 1]);
                let at = a + (b - a) * step / 50;
                let loads: Vec<f64> = (0..4).map(|wheel| truth.load(wheel, at)).collect();
                // with a wheel in the air, loads are not OTF
                if loads.iter().any(|load| *load < 20.0) {
                    continue;
                }
                all += 1;
                inside += usize::from(low <= loads[wheel] && loads[wheel] <= high);
            }
        }
    }
    (inside, all, widest)
}

#[test]
fn val_the_band_covers_the_loads_between_rows() {
    for (name, period_s) in [("tiny_lift", 0.5), ("tiny_lift", 1.0), ("tiny", 1.0)] {
        let sparse = Sparse::of(name, "", &mut every(period_s, 0.0));
        let analysis = sparse.analysed();
        let truth = Truth::of(&data(&format!("{name}.mcap")), &WHEELS);
        let (inside, all, widest) = covered(&analysis, &truth);
        assert!(all > 250, "{name}: {all}");
        // a band as wide as the weight would say nothing
        let weight = analysis.machine.mass() * analysis.machine.gravity();
        assert!(widest < weight, "{name}: {widest}");
        assert!(
            inside as f64 >= 0.99 * all as f64,
            "{name}: {inside} of {all}"
        );
    }
}

fn covers(event: &Event, kind: EventKind, subject: &str, time_ns: i64) -> bool {
    let is_before_end = event.end_ns.is_none_or(|end| time_ns <= end);
    event.kind == kind && event.subject == subject && event.start_ns <= time_ns && is_before_end
}

#[test]
fn every_true_lift_between_rows_is_found_or_not_excluded() {
    let truth = Truth::of(&data("tiny_lift.mcap"), &WHEELS);
    for phase_s in [0.0, 0.3, 0.6, 0.9] {
        for period_s in [0.4, 1.0, 3.0] {
            let sparse = Sparse::of("tiny_lift", BOUNDS, &mut every(period_s, phase_s));
            let analysis = sparse.analysed();
            let (first, last) = (
                analysis.rows.times_ns[0],
                analysis.rows.times_ns[analysis.rows.len() - 1],
            );
            let lifted = truth
                .times_ns()
                .iter()
                .filter(|&&t| (first..last).contains(&t) && truth.load(2, t) <= 0.0);
            for &time_ns in lifted {
                let is_told = analysis.events.iter().any(|event| {
                    covers(event, EventKind::WheelLift, "rl", time_ns)
                        || covers(event, EventKind::LiftNotExcluded, "rl", time_ns)
                });
                assert!(
                    is_told,
                    "{period_s} {phase_s}: {time_ns} {:?}",
                    analysis.events
                );
            }
            assert!(analysis.undecided(0.0).is_some(), "{period_s} {phase_s}");
        }
    }
}

/// The log of a machine that stands still as in the first message of each topic.
fn still(name: &str, to: &Path) {
    let names = [
        "force.x",
        "force.y",
        "force.z",
        "attitude.x",
        "attitude.y",
        "attitude.z",
        "attitude.w",
    ];
    let mut first: std::collections::HashMap<(String, &str), f64> = Default::default();
    write_edited(&data(&format!("{name}.mcap")), to, &mut |topic, values| {
        if topic == "/imu/data" {
            for name in names {
                let value = *first
                    .entry((topic.into(), name))
                    .or_insert_with(|| values.get(name));
                values.set(name, value);
            }
            for name in ["turning.x", "turning.y", "turning.z"] {
                values.set(name, 0.0);
            }
        } else if topic == "/joint_states" {
            for joint in ["slew", "lift", "tilt", "extension"] {
                let name: &'static str = match joint {
                    "slew" => "position.slew",
                    "lift" => "position.lift",
                    "tilt" => "position.tilt",
                    _ => "position.extension",
                };
                let value = *first
                    .entry((topic.into(), name))
                    .or_insert_with(|| values.get(name));
                values.set(name, value);
                values.set(&format!("velocity.{joint}"), 0.0);
            }
        }
    });
}

#[test]
fn a_quiet_machine_is_declared_clear() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("tiny.mcap");
    still("tiny", &log);
    // a machine parked with its crane locked: its operator states how little it can move
    let parked = "[quasi_static]\nplatform_acceleration = 0.2\nplatform_rate = 0.05\n\
        platform_angular_acceleration = 0.1\njoint_acceleration = 0.1\n\
        joint_acceleration_linear = 0.1\njoint_rate = 0.1\njoint_rate_linear = 0.1\n";
    let sparse = Sparse::of_log(&log, parked, &mut every(1.0, 0.0));
    let analysis = sparse.analysed();
    let between = analysis.coverage.between_rows.unwrap();
    assert!(between.static_rows >= 2, "{between:?}");
    assert!(
        between.lift_excluded_s > 0.9,
        "{between:?} {:?}",
        analysis.notes
    );
    assert_eq!(
        between.lift_not_excluded_s, 0.0,
        "{between:?} {:?}",
        analysis.events
    );
    let is_open = |event: &Event| event.kind == EventKind::LiftNotExcluded;
    assert!(!analysis.events.iter().any(is_open));
    assert_eq!(analysis.undecided(0.5), None);
}

#[test]
fn nothing_is_decided_while_a_lift_cannot_be_excluded() {
    let sparse = Sparse::of("tiny_lift", "", &mut every(1.0, 0.0));
    let analysis = sparse.analysed();
    assert!(matches!(
        analysis.undecided(0.0),
        Some(Undecided::LiftNotExcluded { .. })
    ));
    let said: Vec<&Note> = analysis
        .notes
        .iter()
        .filter(|n| n.contains("static"))
        .collect();
    assert!(!said.is_empty(), "{:?}", analysis.notes);
}

#[test]
fn rows_of_a_burst_keep_their_bits() {
    let mut keep = |_: &str, t: f64| (t % 2.0) < 0.6;
    let sparse = Sparse::of("tiny_lift", BOUNDS, &mut keep);
    let found = sparse.with(Some(QuasiStaticOption::Always));
    let plain = sparse.with(Some(QuasiStaticOption::Never));
    let mut compared = 0;
    for row in 0..found.rows.len() {
        let time_ns = found.rows.times_ns[row];
        let one = found.rows.window(row..row + 1);
        if one.value(Quantity::Static, 0) != 0.0 {
            continue;
        }
        let other = plain.rows.at(time_ns);
        assert_eq!(plain.rows.times_ns[other], time_ns);
        let other = plain.rows.window(other..other + 1);
        // velocity-dependent indicators may use held odometry at the end of a burst; loads do not
        let of_loads = (0..4).flat_map(|wheel| {
            [
                Quantity::Load(wheel),
                Quantity::Otf(wheel),
                Quantity::LoadSigma(wheel),
                Quantity::OtfSigma(wheel),
            ]
        });
        for quantity in of_loads {
            let [a, b] = [&one, &other].map(|rows| rows.value(quantity, 0).to_bits());
            assert_eq!(a, b, "{quantity:?} at {time_ns}");
        }
        compared += 1;
    }
    assert!(compared > 50, "{compared}");
    assert!(found.coverage.computable_s > plain.coverage.computable_s);
}

#[test]
fn a_dense_log_is_not_static_by_itself() {
    let analysis = analysed_with(
        &data("tiny_lift.mcap"),
        &data("tiny_lift.toml"),
        Options::default(),
    );
    assert!(!analysis.rows.has(Quantity::Static));
    assert_eq!(analysis.coverage.between_rows, None);
}

#[test]
fn older_samples_than_stated_are_not_held() {
    let keys = "[quasi_static]\nhold = 0.5\n";
    let mut thin = every(1.0, 0.0);
    let mut keep = |topic: &str, t: f64| topic == "/joint_states" || thin(topic, t);
    let sparse = Sparse::of("tiny_lift", keys, &mut keep);
    let analysis = sparse.analysed();
    let (mut held, mut old) = (0, 0);
    for row in 0..analysis.rows.len() {
        let age_s = analysis.rows.seconds(row).rem_euclid(1.0);
        let reasons = analysis.rows.reasons[row];
        if (0.02..0.48).contains(&age_s) {
            held += usize::from(!reasons.has(Reason::ImuGap));
        } else if (0.52..0.98).contains(&age_s) {
            assert!(reasons.has(Reason::ImuGap), "{age_s}: {reasons:?}");
            let load = analysis
                .rows
                .window(row..row + 1)
                .value(Quantity::Load(0), 0);
            assert!(load.is_nan());
            old += 1;
        }
    }
    assert!(held > 50 && old > 50, "{held} {old}");
}

#[test]
fn the_standard_deviation_grows_with_the_age_of_what_is_held() {
    let mut thin = every(1.0, 0.0);
    let mut keep = |topic: &str, t: f64| topic == "/joint_states" || thin(topic, t);
    let sparse = Sparse::of("tiny_lift", BOUNDS, &mut keep);
    let analysis = sparse.analysed();
    let sigma_at = |seconds: f64| {
        let time_ns = analysis.rows.times_ns[0] + (seconds * 1e9) as i64;
        let row = analysis.rows.at(time_ns);
        let rows = analysis.rows.window(row..row + 1);
        [
            rows.value(Quantity::OtfSigma(2), 0),
            rows.value(Quantity::HeldAge, 0),
        ]
    };
    let ([fresh, _], [old, age]) = (sigma_at(1.0), sigma_at(1.5));
    assert!(
        old > 1.2 * fresh && (age - 0.5).abs() < 0.02,
        "{fresh} {old} {age}"
    );
}

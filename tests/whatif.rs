//! Replays of a log with a different suspension motion.

use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::compare::{Elsewhere, Side, compare};
use tipwatch_analyze::events::{Answer, Event, EventKind, ShownBy, Supposition};
use tipwatch_analyze::report;
use tipwatch_analyze::suspension::{
    Summary, Suppositions, SuspensionMode, WhatIf, WhatIfOptions, caveats, replies, suppose,
    supposing, what_if,
};
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::{Quantity, State};
use tipwatch_tests::data;

fn replayed(log: &str, text: Option<&str>, options: WhatIfOptions) -> Result<WhatIf, String> {
    let log = data(log);
    let machine = log.with_extension("toml");
    let file = match text {
        Some(text) => MachineFile::from_text(&machine, text).unwrap(),
        None => MachineFile::read(&machine).unwrap(),
    };
    what_if_of(&log, &file, Options::default(), options)
}

fn what_if_of(
    log: &Path,
    file: &MachineFile,
    scope: Options,
    options: WhatIfOptions,
) -> Result<WhatIf, String> {
    what_if(log, file, scope, options, &mut |_| {}).map_err(|e| format!("{e:#}"))
}

fn options(suspension: SuspensionMode) -> WhatIfOptions {
    WhatIfOptions {
        suspension,
        step_s: None,
    }
}

/// A log that begins in mid-fall does not show what the machine did before: no supposition about its fall has an answer.
#[test]
fn a_fall_that_is_under_way_when_the_rows_begin_is_left_open() {
    let log = data("tip_over.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let suppositions = Suppositions {
        payload_kg: Some(-300.0),
        ..Suppositions::default()
    };
    let part = Options {
        from_s: Some(4.9),
        ..Options::default()
    };
    let [recorded, supposed] = suppose(&log, &file, part, &suppositions).unwrap();
    let replies = replies(&recorded, &supposed, &suppositions);
    let is_fall = |(event, _): &(&Event, _)| event.kind == EventKind::TipOver;
    assert!(replies.iter().any(is_fall));
    for (event, reply) in replies {
        assert_eq!(reply.answer, Answer::Open, "{event:?}");
        assert_eq!(reply.probability, None, "{event:?}");
        assert!(reply.why_not.is_some(), "{event:?}");
    }
}

/// The platform stood as recorded, which says nothing against a heavier load: the more of it, the surer it tips.
#[test]
fn more_load_makes_tipping_no_less_likely() {
    let log = data("tip_over.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let tipping = [50.0, 150.0, 300.0].map(|payload_kg| {
        let suppositions = Suppositions {
            payload_kg: Some(payload_kg),
            ..Suppositions::default()
        };
        let [_, supposed] = suppose(&log, &file, Options::default(), &suppositions).unwrap();
        let mut tippings = supposed
            .events
            .iter()
            .filter(|event| event.kind == EventKind::EdgeTipping);
        tippings.find_map(|event| event.certainty).unwrap()
    });
    assert!(tipping.is_sorted() && tipping[0] > 0.9, "{tipping:?}");
}

/// A wheel that leaves the ground as the machine begins to tip does so about the edge: both are one question.
#[test]
fn a_wheel_that_lifts_by_tipping_is_answered_by_the_edge() {
    let log = data("tip_over.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let suppositions = Suppositions {
        level: true,
        ..Suppositions::default()
    };
    let [recorded, supposed] = suppose(&log, &file, Options::default(), &suppositions).unwrap();
    let replies = replies(&recorded, &supposed, &suppositions);
    let of = |kind: EventKind, subject: &str| {
        let mut all = replies.iter();
        let found = all.find(|(event, _)| event.kind == kind && event.subject == subject);
        found.map(|(_, reply)| reply).unwrap()
    };
    let (edge, wheel) = (
        of(EventKind::EdgeTipping, "left"),
        of(EventKind::WheelLift, "fr"),
    );
    assert_eq!(edge, wheel);
    let answered = |kind: EventKind| {
        let mut all = recorded.events.iter();
        all.rfind(|event| event.kind == kind)
            .map(|event| &event.counterfactuals)
    };
    assert_eq!(
        answered(EventKind::EdgeTipping),
        answered(EventKind::WheelLift)
    );
}

/// With the rods as recorded, a replay gives the loads of the analysis.
#[test]
fn a_replay_as_recorded_gives_the_recorded_loads() {
    let what_if = replayed("second_paper.mcap", None, options(SuspensionMode::Recorded)).unwrap();
    let analysis = &what_if.analysis;
    let weight = analysis.machine.mass() * analysis.machine.gravity();
    let mut compared = 0;
    for wheel in 0..4 {
        let loads = analysis.rows.whole().outcomes.column(Quantity::Load(wheel));
        for (row, (&known, &found)) in loads
            .iter()
            .zip(&what_if.comparison.moved.load[wheel])
            .enumerate()
        {
            if analysis.rows.is_valid(row) {
                assert!(
                    (known - found).abs() < 1e-9 * weight,
                    "row {row}: {known} {found}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 1000, "{compared}");
    assert!(!what_if.comparison.moved.is_controlled());
    // locking the rods changes the loads
    let apart = |row: usize| {
        (what_if.comparison.fixed.load[0][row] - what_if.comparison.moved.load[0][row]).abs()
    };
    assert!((0..analysis.rows.len()).map(apart).fold(0.0, f64::max) > 300.0);
}

/// The second paper's Figs. 8 to 11 on a similar manoeuvre with the arm folded: the spread of the loads falls by more than
/// the paper's 35 %, and the offset of the centre of mass is halved.
#[test]
fn val_control_halves_spread_and_offset_of_a_folded_arm() {
    let what_if = replayed("folded_arm.mcap", None, options(SuspensionMode::LookAhead)).unwrap();
    let summary = serde_json::to_value(Summary::of(&what_if)).unwrap();
    let of = |track: &str, key: &str| summary[track][key].as_f64().unwrap();
    let ratio = |key: &str| of("moved", key) / of("fixed", key);
    println!("{:#?}", summary["findings"]);
    assert!(ratio("mean_spread_n") < 0.65, "{}", ratio("mean_spread_n"));
    assert!(
        ratio("mean_com_offset_m") < 0.55,
        "{}",
        ratio("mean_com_offset_m")
    );
    assert!(what_if.comparison.gain_share().unwrap() > 0.85);
    limits_hold(&what_if);
    // the rods start at once: most of it in the first 4 s
    let begin = Options {
        to_s: Some(4.0),
        ..Options::default()
    };
    let log = data("folded_arm.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let look_ahead = options(SuspensionMode::LookAhead);
    let begun = what_if_of(&log, &file, begin, look_ahead).unwrap();
    let share = begun.comparison.gain_share().unwrap();
    println!("in the first 4 s: {share:.2}");
    assert!(share > 0.7, "{share}");
}

/// References and commands respect their limits, valves and pressures stay within range, and the rods follow.
fn limits_hold(what_if: &WhatIf) {
    let suspension = &what_if.comparison.suspension;
    let hydraulics = &suspension.hydraulics;
    let [least, greatest] = suspension.stroke;
    let known = |values: &[f64]| {
        values
            .iter()
            .copied()
            .filter(|v| v.is_finite())
            .collect::<Vec<_>>()
    };
    for rod in &what_if.comparison.moved.rods {
        let reference = known(&rod.reference);
        assert!(reference.len() > 100);
        assert!(reference.iter().all(|x| (least..=greatest).contains(x)));
        let rates = known(&rod.reference_velocity);
        assert!(
            rates
                .iter()
                .all(|v| v.abs() <= suspension.max_velocity + 1e-12)
        );
        let accelerations = known(&rod.commanded_acceleration);
        assert!(
            accelerations
                .iter()
                .all(|a| a.abs() <= suspension.max_acceleration + 1e-12)
        );
        assert!(known(&rod.opening).iter().all(|u| u.abs() <= 1.0));
        for pressures in [&rod.piston_pressure, &rod.rod_pressure] {
            let range = hydraulics.tank - 5e5..=hydraulics.relief + 5e5;
            assert!(known(pressures).iter().all(|p| range.contains(p)));
        }
        assert!(known(&rod.tracking_error()).iter().all(|e| e.abs() < 0.05));
        assert!(
            known(&rod.position)
                .iter()
                .all(|x| (least - 0.001..=greatest + 0.001).contains(x))
        );
    }
}

/// The machine drives, turns and brakes while its arm swings. In no mode does the control lift a wheel that locked rods hold
/// down, and neither the smallest load nor the largest spread gets worse, nor a stability angle below 0.25 rad.
#[test]
fn control_is_never_worse_than_locked_rods_on_a_swinging_drive() {
    let text = std::fs::read_to_string(data("swinging_drive.toml")).unwrap();
    let independent = format!("{text}\n[suspension.control]\nindependent = true\n");
    let literal = WhatIfOptions {
        suspension: SuspensionMode::Literal,
        step_s: Some(2.5),
    };
    for (options, text) in [
        (options(SuspensionMode::LookAhead), &text),
        (options(SuspensionMode::LookAhead), &independent),
        (literal, &text),
    ] {
        let what_if = replayed("swinging_drive.mcap", Some(text), options).unwrap();
        let comparison = &what_if.comparison;
        let (fixed, moved) = (&comparison.fixed, &comparison.moved);
        let mean = what_if.analysis.machine.mass() * what_if.analysis.machine.gravity() / 4.0;
        let (mut worst, mut lifted, mut sums) = (f64::INFINITY, 0, [0.0; 2]);
        for row in 0..fixed.spread.len() {
            let otf = |wheel: usize| [fixed.otf[wheel][row], moved.otf[wheel][row]];
            if (0..4).any(|wheel| otf(wheel).iter().any(|load| !load.is_finite())) {
                continue;
            }
            let holds = |wheel: usize| otf(wheel)[0] > 0.01 * mean;
            lifted += usize::from((0..4).any(|wheel| holds(wheel) && otf(wheel)[1] <= 0.0));
            let least = |i: usize| {
                (0..4)
                    .map(|wheel| otf(wheel)[i])
                    .fold(f64::INFINITY, f64::min)
            };
            worst = worst.min(least(1) - least(0).min(500.0));
            sums[0] += fixed.spread[row];
            sums[1] += moved.spread[row];
        }
        let known = |values: &[f64]| -> Vec<f64> {
            values.iter().copied().filter(|v| v.is_finite()).collect()
        };
        let largest = |values: &[f64]| known(values).into_iter().fold(f64::NEG_INFINITY, f64::max);
        let smallest = |values: &[f64]| known(values).into_iter().fold(f64::INFINITY, f64::min);
        let spread = [largest(&fixed.spread), largest(&moved.spread)];
        let angle = [
            smallest(&fixed.stability_angle),
            smallest(&moved.stability_angle),
        ];
        println!(
            "{options:?}: worst {worst:.0} N, {lifted} rows lifted, mean spread {:.3}, largest {spread:.0?}, angle {angle:.4?}",
            sums[1] / sums[0]
        );
        assert_eq!(lifted, 0, "{options:?}");
        assert!(worst > -0.02 * mean, "{options:?}: {worst}");
        assert!(spread[1] <= 1.01 * spread[0], "{options:?}: {spread:?}");
        assert!(
            angle[1] >= angle[0].min(0.25) - 2e-3,
            "{options:?}: {angle:?}"
        );
        assert!(sums[1] < sums[0], "{options:?}: {sums:?}");
    }
}

#[test]
fn the_one_step_problem_needs_a_long_step() {
    let refused = replayed("folded_arm.mcap", None, options(SuspensionMode::Literal)).unwrap_err();
    assert!(
        refused.contains("suspension.control.rate") && refused.contains("1.5 times"),
        "{refused}"
    );
    let long = WhatIfOptions {
        suspension: SuspensionMode::Literal,
        step_s: Some(1.7),
    };
    let what_if = replayed("folded_arm.mcap", None, long).unwrap();
    assert!(
        what_if.comparison.gain_share().unwrap() > 0.7,
        "{:?}",
        what_if.comparison.gain_share()
    );
    limits_hold(&what_if);
}

#[test]
fn a_machine_without_a_suspension_is_refused() {
    let error = replayed("hard_brake.mcap", None, options(SuspensionMode::LookAhead)).unwrap_err();
    assert!(error.contains("[suspension]"), "{error}");
    let text = std::fs::read_to_string(data("folded_arm.toml")).unwrap();
    let wrong = text.replace(
        "[suspension]",
        "[suspension.control]\nlook_ahead = -1.0\n[suspension]",
    );
    let error = replayed(
        "folded_arm.mcap",
        Some(&wrong),
        options(SuspensionMode::LookAhead),
    );
    assert!(error.unwrap_err().contains("suspension.control.look_ahead"));
}

#[test]
fn output_files_contain_both_motions_and_the_caveats() {
    let out = tempfile::tempdir().unwrap();
    let what_if = replayed("folded_arm.mcap", None, options(SuspensionMode::LookAhead)).unwrap();
    what_if.write(out.path()).unwrap();
    let read = |name: &str| std::fs::read_to_string(Path::new(out.path()).join(name)).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&read("summary.json")).unwrap();
    for track in ["fixed", "moved"] {
        assert!(summary[track]["rms_spread_n"].as_f64().unwrap() > 1000.0);
        assert!(summary[track]["least_load_n"]["rr"].as_f64().unwrap() > 1000.0);
    }
    assert_eq!(summary["caveats"].as_array().unwrap().len(), 5);
    assert!(summary["statuses"]["optimal"].as_u64().unwrap() > 300);
    let page = read("report.html");
    for told in [
        "Tracking error of suspension_right",
        "What a replay cannot show",
        "Pressures of suspension_left",
    ] {
        assert!(page.contains(told), "{told}");
    }
    // the page loads nothing from elsewhere
    assert!(!page.contains("<script src") && !page.contains("<link"));
    assert!(out.path().join("whatif.parquet").metadata().unwrap().len() > 10_000);
}

/// A log as recorded, and as supposed.
fn supposed(suppositions: &Suppositions) -> [Analysis; 2] {
    let file = MachineFile::read(&data("tiny_lift.toml")).unwrap();
    let log = data("tiny_lift.mcap");
    suppose(&log, &file, Options::default(), suppositions).unwrap()
}

fn lift(analysis: &Analysis) -> Option<&Event> {
    let mut events = analysis.events.iter();
    events.find(|event| event.kind == EventKind::WheelLift && event.subject == "rl")
}

/// The loads of a supposition rest on the same encoders, and their motion is that of the log.
#[test]
fn a_supposition_is_as_certain_as_the_signs_that_the_log_has_shown() {
    let file = MachineFile::read(&data("swing_lift.toml")).unwrap();
    let (log, heavier) = (
        data("swing_lift.mcap"),
        Suppositions {
            payload_kg: Some(5.0),
            ..Suppositions::default()
        },
    );
    let both = suppose(&log, &file, Options::default(), &heavier).unwrap();
    let signs = both.map(|analysis| {
        let mut events = analysis.events.iter();
        let lift = events.find(|event| event.kind == EventKind::WheelLift && event.subject == "rr");
        let untested = lift.unwrap().untested.iter();
        let signs = untested.map(|sign| (sign.joint.clone(), sign.reversed.to_bits()));
        signs.collect::<Vec<_>>()
    });
    assert!(!signs[0].is_empty() && signs[0] == signs[1], "{signs:?}");
}

/// The measured forces of supports change by the change of the loads by the split rule: rows under a supposition are those as
/// recorded where it changes nothing, and else those of the answers, the foot that carries nothing included.
#[test]
fn rows_as_supposed_follow_the_measured_forces() {
    let log = data("crane.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let with = |payload_kg, joints: &[(&str, f64)]| {
        let joints = joints.iter().map(|&(name, offset)| (name.into(), offset));
        let suppositions = Suppositions {
            payload_kg,
            joints: joints.collect(),
            ..Suppositions::default()
        };
        let sides = suppose(&log, &file, Options::default(), &suppositions).unwrap();
        let replies = replies(&sides[0], &sides[1], &suppositions);
        let (_, reply) = replies.first().unwrap();
        let reply = reply.clone();
        (sides, reply)
    };
    let least = |analysis: &Analysis| {
        let wheels = analysis.digest.wheels.iter();
        wheels
            .map(|wheel| wheel.least_otf_n.unwrap())
            .collect::<Vec<_>>()
    };
    let ([recorded, unchanged], reply) = with(None, &[("luff", 0.0)]);
    for (a, b) in least(&recorded).into_iter().zip(least(&unchanged)) {
        assert!((a - b).abs() < 1e-6 * a.abs().max(1e3), "{a} {b}");
    }
    assert_eq!(recorded.digest.valid_rows, unchanged.digest.valid_rows);
    let mut lifts = recorded.events.iter();
    let lift = lifts
        .find(|event| event.kind == EventKind::WheelLift)
        .unwrap();
    assert_eq!(reply.otf_n, reply.recorded_otf_n);
    let foot = recorded.machine.wheel_named(&lift.subject).unwrap();
    for more_kg in [-200.0, 300.0] {
        let ([_, supposed], reply) = with(Some(more_kg), &[]);
        assert_eq!(recorded.digest.valid_rows, supposed.digest.valid_rows);
        // no sensor showed what is supposed
        let mut events = supposed.events.iter();
        assert!(events.all(|event| event.measured_load_n.is_none()));
        let (answered, found) = (reply.otf_n.unwrap(), least(&supposed)[foot]);
        assert!(
            (answered - found).abs() < 0.002 * answered.abs(),
            "{more_kg} kg: {answered} {found}"
        );
    }
}

/// A crane works on its feet, of which no axle carries a share: another split changes nothing there, and that is told. Its lift
/// has one answer, with however many lifts of B.
#[test]
fn a_split_without_effect_is_told_and_a_lift_has_one_answer() {
    let split = Suppositions {
        split: Some(0.3),
        ..Suppositions::default()
    };
    let told = |name: &str| {
        let log = data(name);
        let file = MachineFile::read(&log.with_extension("toml")).unwrap();
        let [recorded, supposed] = suppose(&log, &file, Options::default(), &split).unwrap();
        let count = |of: &Suppositions| caveats(&recorded, &supposed, of).len();
        // what a speed changes is told of a speed alone
        let slower = Suppositions {
            speed: Some(0.5),
            ..Suppositions::default()
        };
        assert!(count(&slower) > count(&Suppositions::default()), "{name}");
        let sides = [(&recorded, "as recorded"), (&supposed, "as supposed")];
        let [a, b] = sides.map(|(analysis, name)| Side::of_analysis(analysis, name).unwrap());
        let mut comparison = compare(&a, &b);
        let answers = replies(&recorded, &supposed, &split);
        comparison.suppose(&recorded.rows, &answers);
        let pairs = comparison.events.iter();
        let answered = pairs.filter(|pair| pair.supposed.is_some()).count();
        assert_eq!(answered, answers.len(), "{name}");
        count(&split) - count(&Suppositions::default())
    };
    assert_eq!(told("crane.mcap"), 1);
    assert_eq!(told("tiny_lift.mcap"), 0);
}

/// A wheel that leaves the ground as the machine tips carries nothing, though held to the ground with all others it would: the
/// figures do not contradict the event.
#[test]
fn a_wheel_off_the_ground_has_no_load_beside_it() {
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../analyze/demo/demo.mcap");
    let file = MachineFile::read(&log.with_extension("toml")).unwrap();
    let heavier = Suppositions {
        payload_kg: Some(300.0),
        ..Suppositions::default()
    };
    let [recorded, supposed] = suppose(&log, &file, Options::default(), &heavier).unwrap();
    let sides = [(&recorded, "as recorded"), (&supposed, "as supposed")];
    let [a, b] = sides.map(|(analysis, name)| Side::of_analysis(analysis, name).unwrap());
    let found = compare(&a, &b);
    let lifts = found
        .events
        .iter()
        .filter(|pair| pair.kind == EventKind::WheelLift);
    let lifted: Vec<String> = lifts
        .filter(|pair| pair.b.is_some())
        .map(|pair| pair.subject.to_uppercase())
        .collect();
    assert!(lifted.contains(&"FL".to_owned()), "{lifted:?}");
    for wheel in lifted {
        let name = format!("least OTF, {wheel}");
        let fact = found
            .facts
            .iter()
            .find(|fact| fact.name.to_string() == name)
            .unwrap();
        let is_off = fact.b.map_or(fact.why_not.is_some(), |least| least <= 0.0);
        assert!(is_off, "{fact:?}");
    }
}

/// A tipping that only the loads show is judged where it is deepest, not where it begins.
#[test]
fn a_tipping_by_the_loads_is_judged_in_its_worst_row() {
    let file = MachineFile::read(&data("tip_over.toml")).unwrap();
    let heavier = Suppositions {
        payload_kg: Some(300.0),
        ..Suppositions::default()
    };
    let log = data("tip_over.mcap");
    let [_, heavier] = suppose(&log, &file, Options::default(), &heavier).unwrap();
    let later = heavier.events.iter().filter(|event| {
        event.shown_by == Some(ShownBy::Loads) && event.worst_ns - event.start_ns > 50_000_000
    });
    let later: Vec<[Option<i64>; 2]> = later
        .map(|event| [event.judged_ns, Some(event.worst_ns)])
        .collect();
    assert!(!later.is_empty(), "no tipping of several rows");
    assert!(
        later.iter().all(|[judged, worst]| judged == worst),
        "{later:?}"
    );
}

fn least_otf(analysis: &Analysis) -> f64 {
    let found = &analysis.digest.wheels[2];
    assert_eq!(analysis.machine.wheels()[2].name, "RL");
    found.least_otf_n.unwrap()
}

#[test]
fn a_supposition_is_the_counterfactual_of_the_lift() {
    let cases = [
        (
            Supposition::LevelGround,
            Suppositions {
                level: true,
                ..Suppositions::default()
            },
        ),
        (
            Supposition::HalfSpeed,
            Suppositions {
                speed: Some(0.5),
                ..Suppositions::default()
            },
        ),
    ];
    for (asked, suppositions) in cases {
        let [recorded, supposed] = supposed(&suppositions);
        let answers = &lift(&recorded).unwrap().counterfactuals;
        let answer = answers.iter().find(|it| it.supposed == asked).unwrap();
        let (answered, found) = (answer.reply.otf_n.unwrap(), least_otf(&supposed));
        assert!(
            (answered - found).abs() < 20.0,
            "{asked:?}: {answered} {found}"
        );
    }
}

/// Logs with a tip-over, with wheels, supports and an axle that swings, with measured forces, and the demo's.
fn logs_with_a_lift() -> Vec<PathBuf> {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../analyze/demo/demo.mcap");
    let logs = ["tip_over.mcap", "forklift.mcap", "crane.mcap"].map(data);
    logs.into_iter().chain([demo]).collect()
}

/// The table of the first page, the simulated values of the sliders and `tipwatch whatif` evaluate the same rows.
#[test]
fn the_same_question_has_one_answer() {
    let half = Suppositions {
        speed: Some(0.5),
        ..Suppositions::default()
    };
    let level = Suppositions {
        level: true,
        ..Suppositions::default()
    };
    let cases = [
        (Supposition::LevelGround, level, "Slope of the ground", 0.0),
        (Supposition::HalfSpeed, half, "Speed of ", 50.0),
    ];
    for log in logs_with_a_lift() {
        let file = MachineFile::read(&log.with_extension("toml")).unwrap();
        let mut compared = [0; 2];
        for (asked, suppositions, slider, at) in &cases {
            let [recorded, supposed] =
                suppose(&log, &file, Options::default(), suppositions).unwrap();
            let sides = [(&recorded, "as recorded"), (&supposed, "as supposed")];
            let [a, b] = sides.map(|(analysis, name)| Side::of_analysis(analysis, name).unwrap());
            let mut comparison = compare(&a, &b);
            comparison.suppose(&recorded.rows, &replies(&recorded, &supposed, suppositions));
            let comparison = serde_json::to_value(&comparison).unwrap();
            let answers = |event: &Event| {
                let mut answers = event.counterfactuals.clone().into_iter();
                answers.find(|it| it.supposed == *asked)
            };
            for event in &recorded.events {
                let Some(answer) = answers(event) else {
                    continue;
                };
                let expected = serde_json::to_value(&answer.reply).unwrap();
                let start_s = recorded.rows.seconds_at(event.start_ns);
                let mut pairs = comparison["events"].as_array().unwrap().iter();
                let pair = pairs.find(|pair| {
                    pair["kind"] == event.kind.name()
                        && pair["subject"] == event.subject.as_str()
                        && pair["a"]["start_s"].as_f64() == Some(start_s)
                });
                assert_eq!(pair.unwrap()["supposed"], expected, "{log:?} {asked:?}");
                compared[0] += 1;
            }
            let sliders = report::sliders(&recorded).unwrap();
            let mut same = sliders
                .changes
                .iter()
                .filter(|it| it.name.starts_with(slider));
            // level ground is no change on ground that was level
            let Some(slider) = same.next() else {
                continue;
            };
            let of_sliders = |it: &&Event| it.kind == sliders.kind && it.subject == sliders.subject;
            let answer = answers(recorded.events.iter().find(of_sliders).unwrap())
                .unwrap()
                .reply;
            let simulated = slider.simulated.iter().find(|it| it.at == *at).unwrap();
            assert_eq!(
                (
                    Some(simulated.otf_n),
                    simulated.sigma_n,
                    simulated.probability
                ),
                (answer.otf_n, answer.sigma_n, answer.probability),
                "{log:?} {asked:?}"
            );
            let logged = (sliders.logged.otf_n, sliders.logged.probability);
            assert_eq!(
                (Some(logged.0), logged.1),
                (answer.recorded_otf_n, answer.recorded_probability)
            );
            compared[1] += 1;
        }
        assert!(
            compared[0] >= 2 && compared[1] >= 1,
            "{log:?}: {compared:?}"
        );
    }
}

/// The load that the advice takes from the end of the arm can be supposed, and gives the same change.
#[test]
fn an_advised_load_can_be_supposed() {
    let mut compared = 0;
    for log in logs_with_a_lift() {
        let file = MachineFile::read(&log.with_extension("toml")).unwrap();
        let recorded = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
        let with = |payload_kg: f64| {
            let suppositions = Suppositions {
                payload_kg: Some(payload_kg),
                ..Suppositions::default()
            };
            let options = Options::default();
            let supposed = supposing(&log, &file, options, &suppositions, &recorded)?;
            anyhow::Ok(replies(&recorded, &supposed, &suppositions))
        };
        // more than the whole load
        let error = with(-1e5).unwrap_err().to_string();
        assert!(
            error.contains("--payload") && error.contains("weighs less"),
            "{error}"
        );
        let Some(advice) = &recorded.advice else {
            continue;
        };
        let mut lighter = advice.changes.iter().filter(|change| change.unit == "kg");
        let Some(change) = lighter.next() else {
            continue;
        };
        let replies = with(change.change).unwrap();
        let (_, reply) = replies
            .iter()
            .find(|(event, _)| event.subject == advice.wheel)
            .unwrap();
        assert!(
            (reply.otf_n.unwrap() - change.least_otf_n).abs() < 1e-6 * change.least_otf_n.abs(),
            "{log:?}: {reply:?} {change:?}"
        );
        assert!(change.chance.is_some(), "{change:?}");
        // and one standard deviation, that of the changed state
        let [sigma_n, advised_n] = [reply.sigma_n, change.otf_sigma_n].map(Option::unwrap);
        assert!(
            (sigma_n - advised_n).abs() < 1e-6 * sigma_n,
            "{log:?}: {sigma_n} {advised_n}"
        );
        compared += 1;
    }
    assert!(compared >= 2, "{compared}");
}

/// Brakes hard on level ground: the platform pitches, and the ground does not.
#[test]
fn level_ground_that_was_level_is_what_was_recorded() {
    let level = Suppositions {
        level: true,
        ..Suppositions::default()
    };
    let least = |analysis: &Analysis| -> Vec<[f64; 2]> {
        let wheels = analysis.digest.wheels.iter();
        wheels
            .map(|wheel| [wheel.least_otf_s.unwrap(), wheel.least_otf_n.unwrap()])
            .collect()
    };
    let log = data("hard_brake.mcap");
    let file = MachineFile::read(&data("hard_brake.toml")).unwrap();
    let [recorded, supposed] = suppose(&log, &file, Options::default(), &level).unwrap();
    assert_eq!(least(&recorded), least(&supposed));
    // with another supposition, too
    let both = Suppositions {
        speed: Some(0.5),
        ..level
    };
    let slower = Suppositions {
        level: false,
        ..both.clone()
    };
    let [_, both] = suppose(&log, &file, Options::default(), &both).unwrap();
    let [_, slower] = suppose(&log, &file, Options::default(), &slower).unwrap();
    assert_eq!(least(&both), least(&slower));
}

/// The slope of the ground is unknown where the mounting of the IMU is a guess: level ground is no answer.
#[test]
fn level_ground_is_open_where_the_log_does_not_tell_the_slope() {
    let path = data("side_reach.toml");
    let text = std::fs::read_to_string(&path).unwrap() + "\n[uncertainty]\nimu_rotation = 0.1\n";
    let file = MachineFile::from_text(&path, &text).unwrap();
    let log = data("side_reach.mcap");
    let analysis = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
    let answers = &lift(&analysis).unwrap().counterfactuals;
    let mut answers = answers.iter();
    let level = answers
        .find(|it| it.supposed == Supposition::LevelGround)
        .unwrap();
    assert_eq!(level.reply.otf_n, level.reply.recorded_otf_n);
    // 0.1 rad of slope are as much as 0.1 rad of the mounting
    let [sigma_n, recorded_n] =
        [level.reply.sigma_n, level.reply.recorded_sigma_n].map(Option::unwrap);
    assert!(sigma_n > 1.3 * recorded_n, "{sigma_n} {recorded_n}");
    assert_eq!(level.reply.answer, Answer::Open);
}

#[test]
fn the_slope_that_is_levelled_is_in_the_bands() {
    let [recorded, supposed] = supposed(&Suppositions {
        level: true,
        ..Suppositions::default()
    });
    assert!(least_otf(&supposed) > least_otf(&recorded) + 300.0);
    let noise = |analysis: &Analysis| {
        let mut state = State::zero(&analysis.machine);
        analysis.rows.state(analysis.rows.len() / 2, &mut state);
        state.noise.specific_force
    };
    assert!(noise(&supposed) > noise(&recorded));
    let lift = lift(&recorded).unwrap();
    for answer in &lift.counterfactuals {
        let recorded = answer.reply.recorded_probability.unwrap();
        assert!((0.5..1.0).contains(&recorded), "{answer:?}");
    }
}

#[test]
fn more_load_than_the_machine_can_hold_in_its_reference_posture_may_be_supposed() {
    for more_kg in [100.0, 300.0] {
        let [recorded, supposed] = supposed(&Suppositions {
            payload_kg: Some(more_kg),
            ..Suppositions::default()
        });
        assert!(least_otf(&supposed) < least_otf(&recorded) - more_kg);
        // limits stay those of the machine as recorded
        let loads = |analysis: &Analysis| analysis.machine.reference().static_load.clone();
        assert_eq!(loads(&supposed), loads(&recorded));
        // the mass is that of the machine with the load
        let sides = [(&recorded, "as recorded"), (&supposed, "as supposed")];
        let [a, b] = sides.map(|(analysis, name)| Side::of_analysis(analysis, name).unwrap());
        let facts = compare(&a, &b).facts;
        let mass = facts.iter().find(|fact| fact.unit == "kg").unwrap();
        assert!(
            (mass.difference.unwrap() - more_kg).abs() < 1e-9,
            "{mass:?}"
        );
    }
}

#[test]
fn a_supposed_offset_has_the_unit_of_its_joint() {
    let file = MachineFile::read(&data("tiny_lift.toml")).unwrap();
    let log = data("tiny_lift.mcap");
    let recorded = analyse(&log, &file, Options::default(), &mut |_| {}).unwrap();
    let in_words = |joint: &str| {
        let suppositions = Suppositions {
            joints: vec![(joint.into(), -0.3)],
            ..Suppositions::default()
        };
        suppositions.in_words(&recorded)
    };
    assert!(in_words("lift").ends_with(" rad"));
    assert!(in_words("extension").ends_with(" m"));
}

/// More load adds to the payload attached at the time, not to one that is carried later.
#[test]
fn a_payload_that_is_not_there_takes_no_share_of_more_load() {
    let path = data("tiny_lift.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let one = "\n[[payload]]\nlink = \"tool\"\nmass = 40.0\n";
    let later = format!("{one}to = 1e4\n{one}from = 1e4\n");
    let more = Suppositions {
        payload_kg: Some(30.0),
        ..Suppositions::default()
    };
    let least = [one, later.as_str()].map(|payloads| {
        let file = MachineFile::from_text(&path, &format!("{text}{payloads}")).unwrap();
        let log = data("tiny_lift.mcap");
        let [recorded, supposed] = suppose(&log, &file, Options::default(), &more).unwrap();
        let replies = replies(&recorded, &supposed, &more);
        let otf_n = replies.first().unwrap().1.otf_n.unwrap();
        [least_otf(&recorded), least_otf(&supposed), otf_n]
    });
    assert!(least[0][1] < least[0][0] - 30.0, "{least:?}");
    for (always, of_a_time) in least[0].iter().zip(least[1]) {
        assert!(
            (always - of_a_time).abs() < 1e-6 * always.abs(),
            "{least:?}"
        );
    }
}

#[test]
fn a_recorded_fall_is_not_the_fall_of_what_is_supposed() {
    let file = MachineFile::read(&data("tip_over.toml")).unwrap();
    let cases = [
        Suppositions {
            level: true,
            ..Suppositions::default()
        },
        Suppositions {
            speed: Some(3.0),
            ..Suppositions::default()
        },
        Suppositions {
            payload_kg: Some(300.0),
            ..Suppositions::default()
        },
    ];
    for suppositions in cases {
        let log = data("tip_over.mcap");
        let [recorded, supposed] = suppose(&log, &file, Options::default(), &suppositions).unwrap();
        let fall = |analysis: &Analysis| {
            let mut events = analysis.events.iter();
            let fall = events.find(|event| event.kind == EventKind::TipOver);
            fall.map(|event| event.start_ns)
        };
        let fell_ns = fall(&recorded).unwrap();
        assert_eq!(fall(&supposed), None, "{suppositions:?}");
        let mut events = supposed.events.iter();
        let later = events.find(|event| event.start_ns > fell_ns);
        assert!(later.is_none(), "{suppositions:?}: {later:?}");
        // not avoided either
        let sides = [(&recorded, "as recorded"), (&supposed, "as supposed")];
        let [a, b] = sides.map(|(analysis, name)| Side::of_analysis(analysis, name).unwrap());
        let pairs = compare(&a, &b).events;
        let fell = pairs
            .iter()
            .find(|pair| pair.kind == EventKind::TipOver)
            .unwrap();
        assert!(fell.elsewhere == Elsewhere::Open && fell.b.is_none());
        let facts = compare(&a, &b).facts;
        let count = facts
            .iter()
            .find(|fact| fact.name.to_string() == "tip over")
            .unwrap();
        assert!(
            count.a == Some(1.0) && count.b.is_none() && count.why_not.is_some(),
            "{count:?}"
        );
        // it is answered all the same, by the rows of the event
        let replies = replies(&recorded, &supposed, &suppositions);
        let mut of_fall = replies
            .iter()
            .filter(|(event, _)| event.kind == EventKind::TipOver);
        assert!(
            of_fall.any(|(_, reply)| reply.probability.is_some()),
            "{suppositions:?}"
        );
    }
}

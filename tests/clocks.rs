//! Offsets between topics are found from the physics, told, and taken out only where that is asked for.

use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::clock::TopicOffset;
use tipwatch_analyze::base::options::{ApplyClockOffsets, Estimator, Options};
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_binding::MachineFile;
use tipwatch_tests::{Truth, beside, data};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// The analysis of a log with this added to its machine file.
fn analysed_with(log: &Path, clock: &str, options: Options) -> Analysis {
    let path = log.with_extension("toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let file = MachineFile::from_text(&path, &format!("{text}\n{clock}\n")).unwrap();
    analyse(log, &file, options, &mut |_| {}).unwrap()
}

fn analysed(log: &Path, clock: &str) -> Analysis {
    analysed_with(log, clock, Options::default())
}

fn offset<'a>(analysis: &'a Analysis, topic: &str) -> &'a TopicOffset {
    let mut topics = analysis.clock.topics.iter();
    topics.find(|offset| offset.topic == topic).unwrap()
}

/// The offset of a topic and its standard deviation (ms).
fn found(analysis: &Analysis, topic: &str) -> (f64, f64) {
    let offset = offset(analysis, topic);
    let reason = offset.why_not.as_deref().unwrap_or("");
    let sigma = offset
        .sigma_s
        .unwrap_or_else(|| panic!("{topic}: {reason}"));
    (offset.offset_s.unwrap() * 1e3, sigma * 1e3)
}

/// All simulated logs that are there.
fn logs() -> Vec<PathBuf> {
    let shipped = [
        "hard_brake",
        "swing_lift",
        "tiny",
        "tiny_lift",
        "forwarder6",
        "lift_payload",
    ];
    let mut logs: Vec<PathBuf> = shipped
        .iter()
        .map(|name| data(&format!("{name}.mcap")))
        .collect();
    let others = [
        "flat_arm",
        "flat_arm_clean",
        "drive_brake",
        "drive_brake_clean",
    ];
    logs.extend(
        others
            .iter()
            .filter_map(|name| beside(&format!("sim/{name}.mcap"))),
    );
    logs
}

#[test]
fn sound_clocks_have_no_offset_within_their_standard_deviations() {
    let mut known = 0;
    for log in logs() {
        let analysis = analysed(&log, "");
        for topic in &analysis.clock.topics {
            let (Some(offset), Some(sigma)) = (topic.offset_s, topic.sigma_s) else {
                assert!(topic.why_not.as_ref().is_some_and(|why| why.len() > 10));
                continue;
            };
            known += 1;
            eprintln!(
                "{}: {} {:.1} +- {:.1} ms",
                log.display(),
                topic.topic,
                offset * 1e3,
                sigma * 1e3
            );
            assert!(
                offset.abs() <= 3.0 * sigma,
                "{}: {}: {offset} s, standard deviation {sigma} s",
                log.display(),
                topic.topic
            );
        }
        assert!(
            !analysis
                .notes
                .iter()
                .any(|note| note.contains("its stamps are")),
            "{:?}",
            analysis.notes
        );
    }
    // beside the reference of each log
    assert!(known > logs().len() + 3, "{known}");
}

#[test]
fn a_topic_that_is_40_ms_late_is_found_to_a_few_milliseconds() {
    let log = data("hard_brake.mcap");
    for topic in ["/odom", "/joint_states"] {
        let before = found(&analysed(&log, ""), topic);
        let late = analysed(
            &log,
            &format!("[clock]\noffset = {{ \"{topic}\" = 0.040 }}"),
        );
        let (ms, sigma) = found(&late, topic);
        eprintln!("{topic}: {ms:.2} +- {sigma:.2} ms, before {before:.2?} ms");
        assert!((ms + 40.0).abs() < 3.0, "{topic}: {ms} ms");
        assert!(
            (ms + 40.0).abs() < 3.0 * sigma,
            "{topic}: {ms} +- {sigma} ms"
        );
        assert!(
            (ms - before.0 + 40.0).abs() < 1.5,
            "{topic}: {ms}, {before:?} ms"
        );
        let note = late
            .notes
            .iter()
            .find(|note| note.contains("its stamps are"))
            .unwrap();
        assert!(
            note.starts_with(topic) && note.contains("late") && note.contains("not applied"),
            "{note}"
        );
        assert!(!offset(&late, topic).applied);
    }
    // an IMU that is late makes all others early
    let late = analysed(&log, "[clock]\noffset = { \"/imu/data\" = 0.040 }");
    for topic in ["/odom", "/joint_states"] {
        let (offset, _) = found(&late, topic);
        assert!((offset - 40.0).abs() < 3.0, "{topic}: {offset} ms");
    }
}

#[test]
fn joints_of_an_arm_are_found_late_by_how_the_platform_leans() {
    for name in ["sim/flat_arm.mcap", "sim/flat_arm_clean.mcap"] {
        let Some(log) = beside(name) else {
            return;
        };
        let (before, sigma) = found(&analysed(&log, ""), "/joint_states");
        let late = analysed(&log, "[clock]\noffset = { \"/joint_states\" = 0.040 }");
        let (offset, _) = found(&late, "/joint_states");
        eprintln!("{name}: {offset:.1} +- {sigma:.1} ms, before {before:.1} ms");
        assert!(
            (offset - before + 40.0).abs() < 5.0,
            "{name}: {before} ms, then {offset} ms"
        );
        assert!(
            (offset + 40.0).abs() < 3.0 * sigma && sigma < 20.0,
            "{name}: {offset} +- {sigma} ms"
        );
    }
}

#[test]
fn the_force_of_a_cylinder_is_found_late_by_what_it_carries() {
    let log = data("lift_payload.mcap");
    let text = std::fs::read_to_string(log.with_extension("toml")).unwrap();
    let name = "name = \"lift\"\n";
    let force = "force = { topic = \"/actuators\", joint = \"lift_rod\" }\n";
    let bound = text.replacen(name, &format!("{name}{force}"), 1);
    let analysed = |clock: &str| {
        let path = log.with_extension("toml");
        let file = MachineFile::from_text(&path, &format!("{bound}\n{clock}\n")).unwrap();
        analyse(&log, &file, Options::default(), &mut |_| {}).unwrap()
    };
    let late_s = |analysis: &Analysis| {
        let mut pairs = analysis.clock.pairs.iter();
        let pair = pairs.find(|pair| pair.topic == "/actuators").unwrap();
        eprintln!("{pair:?}");
        (pair.late_s.unwrap(), pair.sigma_s.unwrap())
    };
    let (before, sigma) = late_s(&analysed(""));
    assert!(before.abs() < 3.0 * sigma, "{before} +- {sigma} s");
    let (late, sigma) = late_s(&analysed("[clock]\noffset = { \"/actuators\" = 0.040 }"));
    assert!((late - 0.040).abs() < 3.0 * sigma, "{late} +- {sigma} s");
    assert!(
        (late - before - 0.040).abs() < 0.003,
        "{before} s, then {late} s"
    );
}

#[test]
fn offsets_are_taken_out_where_that_is_asked_for() {
    let log = data("hard_brake.mcap");
    let truth = Truth::of(&log, &WHEELS);
    let sound = truth.error_share(&analysed(&log, ""));
    let late = "[clock]\noffset = { \"/joint_states\" = 0.040, \"/imu/data\" = -0.030 }";
    for estimator in [Estimator::Smoother, Estimator::Causal] {
        let options = Options {
            estimator,
            apply_clock_offsets: ApplyClockOffsets::Estimated,
            ..Options::default()
        };
        let analysis = analysed_with(&log, late, options);
        assert!(offset(&analysis, "/joint_states").applied);
        let (joints, _) = found(&analysis, "/joint_states");
        assert!((joints + 70.0).abs() < 4.0, "{joints} ms");
        if estimator == Estimator::Smoother {
            let corrected = truth_after(&truth, &analysis, 0.030);
            assert!(corrected < 1.1 * sound, "{corrected} against {sound}");
        }
    }
}

/// The error of the loads, the rows' times shifted back by what the IMU was shifted by.
fn truth_after(truth: &Truth, analysis: &Analysis, seconds: f64) -> f64 {
    truth.error_share_shifted(analysis, (seconds * 1e9) as i64)
}

#[test]
fn a_machine_file_must_not_speak_of_topics_that_are_not_there() {
    let log = data("tiny.mcap");
    let path = log.with_extension("toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let error = |clock: &str| {
        let file = MachineFile::from_text(&path, &format!("{text}\n{clock}")).unwrap();
        let result = analyse(&log, &file, Options::default(), &mut |_| {});
        format!("{:#}", result.err().unwrap())
    };
    let unknown = error("[clock]\noffset = { \"/joints\" = 0.040 }");
    assert!(
        unknown.contains("clock.offset.\"/joints\"") && unknown.contains("/joint_states"),
        "{unknown}"
    );
    let infinite = error("[clock]\noffset = { \"/imu/data\" = inf }");
    assert!(
        infinite.contains("expected a number of seconds"),
        "{infinite}"
    );
}

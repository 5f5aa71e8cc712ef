//! Time offsets between topics are estimated from the physics, reported, and corrected only on request.

use std::path::{Path, PathBuf};

use tipwatch_analyze::analysis::Analysis;
use tipwatch_analyze::analysis::clock::TopicOffset;
use tipwatch_analyze::analysis::run::analyse;
use tipwatch_analyze::base::options::{ApplyClockOffsets, Estimator, Options};
use tipwatch_binding::MachineFile;
use tipwatch_tests::{Truth, data};

const WHEELS: [&str; 4] = ["FL", "FR", "RL", "RR"];

/// Analyses a log with some text added to its machine file.
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
    let mut topics = analysis.clock.offsets.topics.iter();
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

/// Fixtures without clock errors.
const SOUND: [&str; 7] = [
    "corner_brake",
    "hard_brake",
    "swing_lift",
    "tiny",
    "tiny_lift",
    "forwarder6",
    "lift_payload",
];

#[test]
fn sound_clocks_have_no_offset_beyond_three_sigma() {
    no_offset_in(&SOUND.map(|name| data(&format!("{name}.mcap"))));
}

fn no_offset_in(logs: &[PathBuf]) {
    let mut known = 0;
    for log in logs {
        let analysis = analysed(log, "");
        for topic in &analysis.clock.offsets.topics {
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
    // every log has a reference topic; a few more offsets must be known besides
    assert!(known > logs.len() + 3, "{known}");
}

#[test]
fn a_delay_of_40_ms_is_estimated_within_milliseconds() {
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
    // delaying the IMU makes all other topics appear early
    let late = analysed(&log, "[clock]\noffset = { \"/imu/data\" = 0.040 }");
    for topic in ["/odom", "/joint_states"] {
        let (offset, _) = found(&late, topic);
        assert!((offset - 40.0).abs() < 3.0, "{topic}: {offset} ms");
    }
}

#[test]
fn a_late_cylinder_force_is_detected_from_its_load() {
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
        let mut pairs = analysis.clock.offsets.pairs.iter();
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
fn offsets_are_corrected_only_on_request() {
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

/// The load error after shifting the row times back by the delay added to the IMU.
fn truth_after(truth: &Truth, analysis: &Analysis, seconds: f64) -> f64 {
    truth.error_share_shifted(analysis, (seconds * 1e9) as i64)
}

#[test]
fn offsets_of_missing_topics_are_refused() {
    let log = data("tiny.mcap");
    let path = log.with_extension("toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let error = |clock: &str| {
        let file = match MachineFile::from_text(&path, &format!("{text}\n{clock}")) {
            Ok(file) => file,
            Err(error) => return error.to_string(),
        };
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
        infinite.contains("clock.offset.\"/imu/data\": expected a finite number"),
        "{infinite}"
    );
}

mod needs_shared {
    use super::{analysed, found, no_offset_in};
    use tipwatch_tests::beside;

    #[test]
    #[ignore = "needs ../shared"]
    fn sound_clocks_of_longer_logs_have_no_offset() {
        let names = [
            "flat_arm",
            "flat_arm_clean",
            "drive_brake",
            "drive_brake_clean",
        ];
        no_offset_in(&names.map(|name| beside(&format!("sim/{name}.mcap"))));
    }

    #[test]
    #[ignore = "needs ../shared"]
    fn a_late_arm_is_detected_from_the_lean_of_the_platform() {
        for name in ["sim/flat_arm.mcap", "sim/flat_arm_clean.mcap"] {
            let log = beside(name);
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
}

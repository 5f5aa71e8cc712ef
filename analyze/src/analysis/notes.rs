//! Notes: information about how the results were obtained, for every reader.

use std::collections::BTreeMap;

use tipwatch_ingest::Losses;
use tipwatch_language::{say, word};
use tipwatch_mechanics::estimation::ShownNoise;
use tipwatch_mechanics::machine::{Machine, MountSource, Note};
use tipwatch_mechanics::state::Sensor;

use crate::base::number::short;
use crate::load::LoadedLog;

/// What is told beside the numbers of a finding.
pub(super) trait Notes {
    /// The notes, the most important first.
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note>;
}

/// The log that notes are about.
pub(super) struct NotedLog<'a> {
    pub(super) loaded: &'a LoadedLog,
    /// The machine that names the results.
    pub(super) machine: &'a Machine,
    /// Whether the log is analysed as recorded, without hypotheses.
    pub(super) is_recorded: bool,
    /// Time of the first row (ns).
    pub(super) start_ns: i64,
}

impl Notes for Note {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        vec![self.clone()]
    }
}

impl<N: Notes> Notes for Option<N> {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        self.as_ref()
            .map_or_else(Vec::new, |found| found.notes(log))
    }
}

/// Noise that differs from the stated one by less than this factor is not worth a note.
const NOTED_NOISE: f64 = 2.0;

/// The noises shown by the samples that are far from the stated ones.
impl Notes for Vec<ShownNoise> {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        let differs = |noise: &&ShownNoise| {
            let ratio = noise.ratio();
            ratio.is_finite() && !(1.0 / NOTED_NOISE..=NOTED_NOISE).contains(&ratio)
        };
        let told = self.iter().filter(differs).map(|noise| {
            say!(
                "{} {} {} (stated: {})",
                noise.key,
                short(noise.shown),
                noise.unit,
                short(noise.stated)
            )
        });
        let mut told: Vec<String> = told.collect();
        told.dedup();
        let text = (!told.is_empty()).then(|| {
            say!(
                "The samples show another noise than [estimator] states. Estimates and bands rest on what they show: {}.",
                told.join(", ")
            )
        });
        text.into_iter().map(Note::from).collect()
    }
}

/// The machine and its sensors: assumptions and substitutes.
pub(super) struct Assumptions;

impl Notes for Assumptions {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let loaded = log.loaded;
        let sensors = &loaded.matched.sensors;
        let without_imu = match (sensors.imu, sensors.odometry) {
            (true, _) => None,
            (false, true) => Some(word!(
                "The log has no IMU. Specific force and angular velocity are computed from the odometry."
            )),
            (false, false) => Some(word!(
                "The log has neither IMU nor odometry: wheel loads cannot be computed."
            )),
        };
        let mounting = match &loaded.machine.imu().source {
            source @ MountSource::Assumed { .. } => {
                Some(say!("Position and orientation of the IMU: {source}."))
            }
            _ => None,
        };
        let posture = reference_posture(&loaded.machine);
        let first = (without_imu.map(Note::from).into_iter())
            .chain(mounting.into_iter().chain(posture).map(Note::from));
        let last = (missing_wheel_joints(loaded).into_iter()).chain(loaded.notes.iter().cloned());
        first
            .chain(loaded.machine.notes().iter().cloned())
            .chain(last.map(Note::from))
            .collect()
    }
}

/// Messages that were not used.
pub(super) struct UnusedMessages;

impl Notes for UnusedMessages {
    fn notes(&self, log: &NotedLog<'_>) -> Vec<Note> {
        let signals = log.loaded.signals.iter();
        let unread = signals.filter(|signal| {
            signal.recording.stamps_ns.is_empty() && !matches!(signal.sensor, Sensor::Joints(_))
        });
        let unread = unread.map(|signal| say!("{}: no readable message.", signal.topic));
        let skipped = without_value(log.loaded).into_iter();
        skipped.chain(unread).map(Note::from).collect()
    }
}

/// Lost parts of the log, and those that were not read.
impl Notes for Losses {
    fn notes(&self, _: &NotedLog<'_>) -> Vec<Note> {
        let integrity = &self.integrity;
        let flagged =
            (integrity.note()).map(|note| say!("{note}; implausible values are flagged instead."));
        (self.notes.iter().cloned())
            .chain(skipped_chunks(integrity.chunks_passed_over))
            .chain(flagged)
            .map(Note::from)
            .collect()
    }
}

/// Messages that have none of the numbers of a signal: one note for all joints that share a topic.
fn without_value(loaded: &LoadedLog) -> Vec<String> {
    let mut skipped: BTreeMap<(&str, &str), [u64; 2]> = BTreeMap::new();
    for signal in loaded.signals.iter() {
        let count = signal.recording.reading.without_value;
        if count > 0 {
            let key = (signal.topic.as_str(), signal.name);
            let [least, most] = skipped.entry(key).or_insert([count; 2]);
            (*least, *most) = (count.min(*least), count.max(*most));
        }
    }
    let note = |((topic, name), [least, most]): ((&str, &str), [u64; 2])| {
        let count = match least == most {
            true => least.to_string(),
            false => say!("{least} to {most}"),
        };
        say!("{topic}: skipped {count} messages without any of the fields bound to {name}.")
    };
    skipped.into_iter().map(note).collect()
}

/// The assumed posture of the reference loads, where an arm makes a difference.
fn reference_posture(machine: &Machine) -> Option<String> {
    let posture = &machine.reference().posture;
    let has_arm = machine.joints().iter().any(|j| j.spins_wheel.is_none());
    (has_arm && !posture.is_stated).then(|| {
        say!(
            "Static loads, the reference of utilisation and load limits, are those of {}.",
            posture.source()
        )
    })
}

fn skipped_chunks(chunks: u64) -> Option<String> {
    (chunks > 0).then(|| {
        say!(
            "Skipped {chunks} chunks of the log that contain no used topic according to its index. They were not checked \
             for damage; tipwatch recover checks every byte."
        )
    })
}

fn missing_wheel_joints(loaded: &LoadedLog) -> Option<String> {
    let missing: Vec<_> = loaded
        .machine
        .joints()
        .iter()
        .filter(|j| !j.logged && j.constant.is_none())
        .map(|j| j.name.as_str())
        .collect();
    if missing.is_empty() {
        return None;
    }
    let source = if loaded.matched.sensors.odometry {
        word!("their velocities follow from odometry, assuming rolling without slip")
    } else {
        word!("they are assumed at rest, because there is no odometry either")
    };
    Some(say!(
        "Wheel joints missing from the joint states: {}; {source}.",
        missing.join(", ")
    ))
}

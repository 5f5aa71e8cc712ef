//! Commissions the machine of a log.

use std::path::Path;

use anyhow::Result;
use tipwatch_binding::{
    Commissioning, CommissioningSource, MachineFile, Urdf, commissioning_text, sha256,
};
use tipwatch_calibration::commissioning::{Answers, Assessment, Recording, Status, assess};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::state::Sensor;

use crate::base::file_hash::{FileHash, hash_log};
use crate::base::options::Estimator;
use crate::load::load;

/// Limits so many times as wide as the motion that has proven a joint leave room for wrong positions.
const WIDER: f64 = 2.0;

/// Evidence of a log, for people and as a file.
#[derive(Debug)]
pub struct LogCommissioning {
    /// The answers.
    pub assessment: Assessment,
    /// The answers as a file.
    pub file: Commissioning,
    /// The answers as text.
    pub text: String,
    /// Whether parts of the log were lost.
    pub has_losses: bool,
    /// The joints whose limits are far wider than the motion that has proven them, as a sentence.
    pub unused_limits: Option<String>,
}

/// Assesses the samples of a log.
///
/// # Errors
/// The machine file does not describe a machine, or the log does not fit it.
pub fn from_log(path: &Path, file: &MachineFile) -> Result<LogCommissioning> {
    let log = file.open_log(path)?;
    let loaded = load(&log, file, Estimator::Causal, &mut |_| {})?;
    let sensors = &loaded.matched.sensors;
    let mut recording = Recording::new(sensors);
    let mut used = vec![[f64::INFINITY, f64::NEG_INFINITY]; loaded.machine.joints().len()];
    loaded.for_each_arrival(|sample| {
        if let Sensor::Joints(stream) = sample.sensor {
            for (&joint, &position) in sensors.joints[stream].joints.iter().zip(sample.values) {
                used[joint] = widened(used[joint], loaded.machine.joints()[joint].limits, position);
            }
        }
        // A sample with a damaged stamp shows nothing; the others count.
        let _ = recording.push(sample);
    })?;
    let assessment = assess(&loaded.machine, sensors, &recording, &Answers::new());
    let hashes = hash_log(&log)?;
    let hashes: Vec<String> = hashes.iter().map(FileHash::identity).collect();
    let source = CommissioningSource {
        name: path.display().to_string(),
        sha256: match hashes.as_slice() {
            [one] => one.clone(),
            all => sha256(all.join("\n").as_bytes()),
        },
        tipwatch_version: env!("CARGO_PKG_VERSION").into(),
        made_at: jiff::Timestamp::now()
            .strftime("%Y-%m-%dT%H:%M:%SZ")
            .to_string(),
        recorded_from_ns: recording.first_ns(),
    };
    let urdf = Urdf {
        name: loaded.urdf.path.clone(),
        text: loaded.urdf_text.clone(),
    };
    let file = Commissioning::new(file, &urdf, source, &assessment);
    let proven = file.proven(&loaded.machine);
    Ok(LogCommissioning {
        file,
        text: commissioning_text(&assessment, &loaded.machine, &proven),
        unused_limits: unused_limits(&loaded.machine, &used, &assessment),
        has_losses: !loaded.losses.is_empty(),
        assessment,
    })
}

/// Least and largest position, with one more: one that is no number, or beyond the limits, is no motion.
fn widened([least, most]: [f64; 2], limits: Option<[f64; 2]>, position: f64) -> [f64; 2] {
    let is_within = |[from, to]: [f64; 2]| (from..=to).contains(&position);
    match limits.is_none_or(is_within) {
        true => [least.min(position), most.max(position)],
        false => [least, most],
    }
}

/// Names the joints of which the drive has proven the sign within a small part of their limits. `used`: least and largest position
/// of each joint.
fn unused_limits(machine: &Machine, used: &[[f64; 2]], assessment: &Assessment) -> Option<String> {
    let is_proven = |name: &str| {
        let key = format!("joint.{name}.sign");
        let mut items = assessment.items.iter();
        items.any(|item| item.key == key && item.status == Status::Proven)
    };
    let joints = machine.joints().iter().zip(used);
    let named = joints.filter_map(|(joint, [from, to])| {
        let [least, most] = joint.limits?;
        let is_wide = from <= to && most - least > WIDER * (to - from) && is_proven(&joint.name);
        is_wide.then(|| {
            let name = &joint.name;
            format!("{name} ({least:.2} to {most:.2}, moved from {from:.2} to {to:.2})")
        })
    });
    let named: Vec<String> = named.collect();
    (!named.is_empty()).then(|| {
        format!(
            "Limits in the URDF more than {WIDER} times as wide as the motion in this log: {}. A wrong position within them is not found \
             by its limits. If the machine does not go there, state how far it goes.",
            named.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_beyond_the_limits_is_no_motion() {
        let used = [0.2, 0.4];
        let limits = Some([-1.0, 1.0]);
        assert_eq!(widened(used, limits, 0.9), [0.2, 0.9]);
        for position in [3.0, -1.1, f64::NAN] {
            assert_eq!(widened(used, limits, position), used);
        }
        assert_eq!(widened(used, None, 3.0), [0.2, 3.0]);
        assert_eq!(widened(used, None, f64::NAN), used);
    }
}

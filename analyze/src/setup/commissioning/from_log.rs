//! Commissions the machine of a log.

use std::path::Path;

use anyhow::Result;
use tipwatch_binding::{Commissioning, CommissioningSource, MachineFile, Urdf, sha256};
use tipwatch_calibration::commissioning::{Answers, Assessment, Recording, assess};

use crate::base::file_hash::{FileHash, hash_log};
use crate::base::options::Estimator;
use crate::load::load;

/// What a log shows, for people and as a file.
#[derive(Debug)]
pub struct LogCommissioning {
    /// The answers.
    pub assessment: Assessment,
    /// The same as a file.
    pub file: Commissioning,
    /// Whether parts of the log were lost.
    pub has_losses: bool,
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
    loaded.for_each_arrival(|sample| {
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
    Ok(LogCommissioning {
        file: Commissioning::new(file, &urdf, source, &assessment),
        has_losses: !loaded.losses.is_empty(),
        assessment,
    })
}

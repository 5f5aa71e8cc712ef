//! Compares the logs.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::studies::measured_loads::UnstatedLoad;

use crate::analysis::MeasuredLog;
use crate::analysis::measured_loads::{LoadComparison, SensorStatistics};
use crate::base::number::known;
use crate::base::options::{Estimator, Options};

/// The comparison of some logs.
#[derive(Debug, Serialize)]
pub struct Validation {
    schema: u32,
    /// The machine file.
    pub machine_file: String,
    /// The logs.
    pub logs: Vec<LogValidation>,
    /// Root mean square of measured minus computed load over all sensors and logs.
    pub rms_n: Option<f64>,
    /// Root mean square difference as a share of the mean measured load.
    pub rms_share: Option<f64>,
    /// Share of all readings inside one and two standard deviations of computed and measured load together.
    pub inside_sigma: [Option<f64>; 2],
    /// Shares expected of a normal distribution inside one and two standard deviations.
    pub expected_inside: [f64; 2],
}

/// The comparison of a log.
#[derive(Debug, Serialize)]
pub struct LogValidation {
    /// Its path.
    pub log: String,
    /// Hashes of its files.
    pub sha256: Vec<String>,
    /// Statistics by load sensor.
    pub sensors: Vec<SensorStatistics>,
    /// Spans in which measured and computed loads contradict each other (s after the first row).
    pub contradictions: Vec<Contradicted>,
    /// Rows left out because a wheel is off the ground.
    pub rows_with_lifted_wheel: usize,
    /// Notes for the reader.
    pub notes: Vec<String>,
    /// Whether parts of the log were lost.
    pub has_losses: bool,
    /// The compared rows, for the page.
    #[serde(skip)]
    pub(super) comparison: LoadComparison,
    #[serde(skip)]
    pub(super) start_ns: i64,
}

/// A span in which loads contradict each other.
#[derive(Debug, Serialize)]
pub struct Contradicted {
    pub(super) sensor: String,
    pub(super) from_s: f64,
    pub(super) to_s: f64,
    pub(super) difference_n: f64,
    pub(super) sigma_n: f64,
    /// Unstated load that would explain the contradiction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) unstated: Option<UnstatedLoad>,
    #[serde(skip)]
    pub(super) explanation: String,
}

impl Validation {
    /// Whether any loads contradict each other.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        self.logs.iter().any(|log| !log.contradictions.is_empty())
    }

    /// Whether any load was compared.
    #[must_use]
    pub fn has_compared(&self) -> bool {
        self.rms_n.is_some()
    }
}

/// Compares computed with measured loads of each log. Static rows of a sparse log need the smoother.
///
/// # Errors
/// A log cannot be read or does not fit the machine, or the machine file binds no measured load.
pub fn validate(file: &MachineFile, logs: &[PathBuf], estimator: Estimator) -> Result<Validation> {
    let signals = &file.spec.signals;
    if signals.wheels.is_empty() && signals.load_sums.is_empty() {
        bail!(
            "{}: expected measured loads in [signals.wheels.NAME] or [[signals.load_sums]], found none",
            file.path.display()
        );
    }
    let logs: Vec<LogValidation> = logs
        .iter()
        .map(|log| of_log(file, log, estimator))
        .collect::<Result<_>>()?;
    let sensors = || logs.iter().flat_map(|log| &log.sensors);
    let mean = |value: &dyn Fn(&SensorStatistics) -> Option<f64>| {
        let weighted = sensors().filter_map(|s| Some((value(s)?, s.rows as f64)));
        let (sum, rows) = weighted.fold((0.0, 0.0), |(a, b), (v, rows)| (a + v * rows, b + rows));
        known(sum / rows)
    };
    let rms_n = mean(&|sensor| sensor.rms_n.map(|rms| rms * rms)).map(f64::sqrt);
    let mean_n = mean(&|sensor| sensor.mean_measured_n);
    Ok(Validation {
        schema: 1,
        machine_file: file.path.display().to_string(),
        rms_n,
        rms_share: rms_n.zip(mean_n).map(|(rms, mean)| rms / mean),
        inside_sigma: [mean(&|s| s.inside_1_sigma), mean(&|s| s.inside_2_sigma)],
        expected_inside: crate::analysis::measured_loads::EXPECTED,
        logs,
    })
}

fn of_log(file: &MachineFile, path: &Path, estimator: Estimator) -> Result<LogValidation> {
    let options = Options {
        estimator,
        ..Options::default()
    };
    let log = MeasuredLog::read(path, file, &options)?;
    let start_ns = log.rows.times_ns[0];
    let mut notes = log.notes.clone();
    notes.extend(log.loads.notes.iter().cloned());
    notes.extend((log.gross_inputs.iter()).map(|input| format!("{}.", input.headline)));
    let mut comparison = match log.gross_inputs.is_empty() {
        true => log.compare(),
        // nothing that is computed from them is worth a comparison
        false => LoadComparison::default(),
    };
    let seconds = |time_ns: i64| (time_ns - start_ns) as f64 * 1e-9;
    let contradictions = comparison.contradictions.iter().map(|span| Contradicted {
        sensor: span.sensor.clone(),
        from_s: seconds(span.start_ns),
        to_s: seconds(span.end_ns),
        difference_n: span.difference_n,
        sigma_n: span.sigma_n,
        unstated: span.unstated,
        explanation: span.explanation(),
    });
    Ok(LogValidation {
        log: path.display().to_string(),
        sha256: log
            .files
            .iter()
            .map(|file| file.hash_text().to_owned())
            .collect(),
        contradictions: contradictions.collect(),
        rows_with_lifted_wheel: comparison.lifted,
        notes,
        has_losses: !log.loaded.losses.is_empty(),
        sensors: std::mem::take(&mut comparison.sensors),
        comparison,
        start_ns,
    })
}

//! Collects the data, identifies, and writes the machine file.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tipwatch_binding::MachineFile;
use tipwatch_identification::{Data, HeldBack, Identification};
use tipwatch_mechanics::machine::Machine;

use super::{collect, weighings};
use crate::analysis::MeasuredLog;

/// What to identify from.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// The logs.
    pub logs: Vec<PathBuf>,
    /// Standard deviation of the slope of the logs' ground, where that is level (rad).
    pub level: Option<f64>,
}

/// The result, and what it rests on.
#[derive(Debug)]
pub struct Identified {
    /// The machine without identified parameters.
    pub machine: Machine,
    /// The identification.
    pub result: Identification,
    /// Logs and weighings, with the hashes of the files.
    pub from: Vec<String>,
    /// What a reader must know.
    pub notes: Vec<String>,
    /// Whether parts of a log were lost.
    pub has_losses: bool,
}

impl Identified {
    /// Whether the result predicts data that were held back no worse than before; `None` if none were held back.
    #[must_use]
    pub fn holds(&self) -> Option<bool> {
        self.result.held_back.as_ref().map(HeldBack::is_no_worse)
    }
}

/// Identifies the parameters of the machine of a machine file.
///
/// # Errors
/// A log cannot be read or does not fit the machine, or there is nothing to identify from.
pub fn identify(file: &MachineFile, request: &Request) -> Result<Identified> {
    // An earlier identification is the prior, not a correction of the signals.
    let mut plain = file.clone();
    plain.spec.identified = None;
    // One constant bias of the accelerometer is identified, not one that its estimator changes from row to row.
    let mut reading = plain.clone();
    reading.spec.uncertainty.accelerometer_bias = 0.0;
    let (mut notes, mut from, mut has_losses) = (Vec::new(), Vec::new(), false);
    let mut data = Data::default();
    let mut machine: Option<Machine> = None;
    for path in &request.logs {
        let log = MeasuredLog::read(path, &reading)?;
        let name = file_name(path);
        let known = log
            .loaded
            .machine
            .clone()
            .with_uncertainty(plain.spec.uncertainty);
        match &machine {
            None => machine = Some(known),
            Some(first) if joints(first) != joints(&known) => bail!(
                "{}: expected the joints of the first log ({}), found {}",
                path.display(),
                joints(first).join(", "),
                joints(&known).join(", ")
            ),
            Some(_) => {}
        }
        if let Some(input) = log.gross_inputs.first() {
            bail!(
                "{}: expected plausible inputs, found: {}",
                path.display(),
                input.headline
            );
        }
        notes.extend(log.loads.notes.iter().cloned());
        let unreadable = log
            .forces
            .iter()
            .filter_map(|force| force.series.as_ref().err());
        notes.extend(
            unreadable.map(|error| format!("{name}: a cylinder force is not used: {error}.")),
        );
        has_losses |= !log.loaded.losses.is_empty();
        collect::add(&log, &name, &plain.spec, request.level, &mut data);
        let files = log.files.iter();
        from.extend(files.map(|file| format!("{} sha256 {}", file.path, file.hash_text())));
    }
    let machine = match machine {
        Some(machine) => machine,
        None => plain.check_alone()?,
    };
    if let Some(weighed) = &file.spec.weighed {
        let before = data.sources.len();
        weighings::add(&machine, weighed, &mut data);
        let added = data.sources.len() - before;
        from.push(format!("{added} weighings of the machine file"));
    }
    let earlier = earlier(file, &machine)?;
    if earlier.is_some() {
        notes.push(
            "The machine file was identified before; that result is the prior. Data that it used must not be used again: \
             they would count twice."
                .into(),
        );
    }
    let result = tipwatch_identification::identify(&machine, earlier.as_ref(), &data)
        .with_context(|| format!("{}: nothing to identify from", file.path.display()))?;
    Ok(Identified {
        machine,
        result,
        from,
        notes,
        has_losses,
    })
}

/// The parameters of an earlier identification, of this machine.
fn earlier(
    file: &MachineFile,
    machine: &Machine,
) -> Result<Option<tipwatch_mechanics::machine::Identified>> {
    Ok(file.spec.identified_of(machine)?)
}

fn joints(machine: &Machine) -> Vec<&str> {
    machine
        .joints()
        .iter()
        .map(|joint| joint.name.as_str())
        .collect()
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

//! Writes a first machine file.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result};
use tipwatch_binding::bind;
use tipwatch_ingest::{Log, SensorKind};
use tipwatch_mechanics::MachineSpec;
use tipwatch_mechanics::machine::Outline;

use super::can::CanMessages;
use super::guesses::Guesses;
use super::imu::{self, ImuSection};
use super::render::rendered;
use super::signals::Topics;
use super::urdf::{Urdf, find_urdf};
use super::write_options::WriteOptions;
use crate::setup::inspect::Described;

/// Writes a first machine file to `out`, which must not exist; returns what is still missing, if anything.
///
/// # Errors
/// The log or the URDF cannot be read, or the file exists or cannot be written.
pub fn write(
    log: &Path,
    urdf: Option<&Path>,
    out: &Path,
    databases: &[Described],
    options: WriteOptions,
) -> Result<Option<String>> {
    let mut log = Log::open(log)?;
    let can = CanMessages::decode(&mut log, databases, out)?;
    let urdf = find_urdf(&log, urdf, out)?;
    let (body, missing) = machine_file(&log, urdf.as_ref(), can, out, options)?;
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(out)
        .with_context(|| {
            format!(
                "{}: expected a file that does not exist yet, in a writable folder",
                out.display()
            )
        })?;
    file.write_all(body.as_bytes())
        .with_context(|| format!("{}: cannot be written", out.display()))?;
    Ok(missing)
}

/// The text of the file, and what is still missing.
fn machine_file(
    log: &Log,
    urdf: Option<&Urdf>,
    can: CanMessages,
    out: &Path,
    options: WriteOptions,
) -> Result<(String, Option<String>)> {
    let topics = Topics::find(log, can)?;
    let outline = urdf.map(|urdf| Outline::read(&urdf.text, &urdf.name));
    let outline = outline.transpose()?;
    let mut guesses = outline.map(|outline| Guesses::of(outline, &topics, log));
    if let Some(guesses) = guesses.as_mut().filter(|_| options.freezes_passive) {
        guesses.freeze(&topics.joints());
    }
    let name = out.display().to_string();
    // the mounting of the IMU depends on the rest of the machine
    let without_imu = rendered(
        log,
        urdf,
        &topics,
        guesses.as_ref(),
        &ImuSection::default(),
        options,
        "",
    );
    let spec = MachineSpec::from_toml(&without_imu, &name)?;
    let outline = guesses.as_ref().map(|guesses| &guesses.outline);
    let imu = imu::section(log, &spec, urdf, &topics, outline)?;
    let whole = rendered(log, urdf, &topics, guesses.as_ref(), &imu, options, "");
    let spec = MachineSpec::from_toml(&whole, &name)?;
    let unbound = match urdf {
        None => {
            Some("a URDF; the log has none on /robot_description, so give one with --urdf".into())
        }
        Some(urdf) => bind(log, &spec, &urdf.text, &urdf.name)
            .err()
            .map(|error| error.to_string()),
    };
    let missing = match unbound {
        Some(missing) => Some(missing),
        None => motion_missing(log, &topics, &imu)?,
    };
    let verdict = match &missing {
        None if spec.unconfirmed.is_empty() => {
            "This file is complete enough to analyse the log.".to_owned()
        }
        None => format!(
            "This file is complete enough to analyse the log, with guesses that nobody has confirmed yet: {}.",
            spec.unconfirmed.join(", ")
        ),
        Some(missing) => {
            format!("This file is incomplete. Missing first: {missing}")
        }
    };
    Ok((
        rendered(
            log,
            urdf,
            &topics,
            guesses.as_ref(),
            &imu,
            options,
            &verdict,
        ),
        missing,
    ))
}

/// What is missing where neither an IMU nor odometry has values: wheel loads cannot be computed.
fn motion_missing(log: &Log, topics: &Topics, imu: &ImuSection) -> Result<Option<String>> {
    let has_odometry = match topics.odometry() {
        Some(topic) => imu::mean_of(log, topic, SensorKind::Odometry)?.is_some(),
        None => false,
    };
    Ok((!imu.has_samples && !has_odometry).then(|| {
        "a specific force; neither an IMU nor odometry has messages with values in this log, so wheel loads cannot be \
         computed. Bind other messages in [signals.imu]"
            .into()
    }))
}

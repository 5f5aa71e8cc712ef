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
use super::draft::{Draft, Stated};
use super::guesses::Guesses;
use super::imu::{self, ImuSection};
use super::of_sheet;
use super::render::rendered;
use super::signals::Topics;
use super::urdf::find_urdf;
use super::write_options::WriteOptions;
use crate::setup::inspect::Described;

/// Guesses a first machine file, to be written to `out`.
///
/// # Errors
/// The log or the URDF cannot be read.
pub fn draft(
    log: &Path,
    urdf: Option<&Path>,
    out: &Path,
    databases: &[Described],
    options: WriteOptions,
) -> Result<Draft> {
    let mut log = Log::open(log)?;
    let can = CanMessages::decode(&mut log, databases, out)?;
    let urdf = find_urdf(&log, urdf, out)?;
    let topics = Topics::find(&log, can)?;
    let outline = urdf
        .as_ref()
        .map(|urdf| Outline::read(&urdf.text, &urdf.name));
    let outline = outline.transpose()?;
    let mut guesses = outline.map(|outline| Guesses::of(outline, &topics, &log));
    if let Some(guesses) = guesses.as_mut().filter(|_| options.freezes_passive) {
        guesses.freeze(&topics.joints());
    }
    let mut draft = Draft {
        log,
        urdf,
        topics,
        guesses,
        imu: ImuSection::default(),
        options,
        stated: Stated::default(),
        of_sheet: None,
        out: out.into(),
    };
    // the mounting of the IMU depends on the rest of the machine
    let spec = spec(&draft)?;
    let outline = draft.guesses.as_ref().map(|guesses| &guesses.outline);
    draft.imu = imu::section(
        &draft.log,
        &spec,
        draft.urdf.as_ref(),
        &draft.topics,
        outline,
    )?;
    Ok(draft)
}

/// Writes a first machine file, which must not exist; returns its path and the missing inputs, if any.
///
/// # Errors
/// The log cannot be read, or the file exists or cannot be written.
pub fn write(draft: &Draft) -> Result<(&Path, Option<String>)> {
    let out = &draft.out;
    let (body, missing) = finished(draft)?;
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
    Ok((out, missing))
}

fn spec(draft: &Draft) -> Result<MachineSpec> {
    let text = text_of(draft, "");
    Ok(MachineSpec::from_toml(
        &text,
        &draft.out.display().to_string(),
    )?)
}

fn text_of(draft: &Draft, verdict: &str) -> String {
    let guesses = draft.guesses.as_ref();
    match &draft.of_sheet {
        Some(machine) => of_sheet::rendered(draft, machine, guesses, of_sheet::URDF),
        None => rendered(draft, guesses, verdict),
    }
}

/// Returns the text of the file, and the missing inputs.
///
/// # Errors
/// The log cannot be read.
pub fn finished(draft: &Draft) -> Result<(String, Option<String>)> {
    let spec = spec(draft)?;
    let unbound = match &draft.urdf {
        None => {
            Some("a URDF; the log has none on /robot_description, so give one with --urdf".into())
        }
        Some(urdf) => bind(&draft.log, &spec, &urdf.text, &urdf.name)
            .err()
            .map(|error| error.to_string()),
    };
    let missing = match unbound {
        Some(missing) => Some(missing),
        None => motion_missing(&draft.log, &draft.topics, &draft.imu)?,
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
    let body = text_of(draft, &verdict);
    Ok((body, missing))
}

/// Describes what is missing where neither an IMU nor odometry has values: wheel loads cannot be computed. `None` if one has.
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

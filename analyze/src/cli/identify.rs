//! `tipwatch identify`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::{Exit, Terminal};
use crate::base::stdout::to_stdout;
use crate::setup::identify::{IdentificationDocument, Request, identify, machine_file_text, text};

#[derive(Debug, Args)]
pub(super) struct IdentifyArgs {
    /// Logs with measured loads or cylinder forces. Weighings are in the machine file: [weighed].
    logs: Vec<PathBuf>,
    /// The machine file. Its standard deviations are the prior.
    #[arg(long)]
    machine: PathBuf,
    /// The URDF, for a machine file that names none; otherwise that of the log is used.
    #[arg(long)]
    urdf: Option<PathBuf>,
    /// Write the machine file with what was identified to this file.
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// The ground of the logs is level, with this standard deviation of its slope (degrees). The accelerometer at rest
    /// then tells its mounting and bias.
    #[arg(long, value_name = "DEGREES", value_parser = positive)]
    level: Option<f64>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err(format!("expected a positive number, found \"{text}\"")),
    }
}

pub(super) fn run(args: &IdentifyArgs, terminal: Terminal) -> Result<Exit> {
    let mut file = MachineFile::read(&args.machine)?;
    if let Some(urdf) = &args.urdf {
        file = file.with_urdf(urdf)?;
    }
    let found = identify(
        &file,
        &Request {
            logs: args.logs.clone(),
            level: args.level.map(f64::to_radians),
        },
    )?;
    match args.json {
        true => {
            let document = IdentificationDocument::of(&found);
            to_stdout(&format!("{}\n", serde_json::to_string_pretty(&document)?))?;
        }
        false => to_stdout(&text(&found))?,
    }
    let is_worse = (found.result.held_back.as_ref()).is_some_and(|held| !held.is_no_worse());
    if is_worse {
        terminal.verdict("not decided: the result does not hold on the data that were held back");
    }
    if let Some(path) = args.out.as_deref().filter(|_| !is_worse) {
        write(path, &file, &machine_file_text(&file, &found, folder(path)))?;
        terminal.print(&format!("machine file: {}", path.display()));
    }
    Ok(Exit {
        undecided: is_worse,
        lost: found.has_losses,
        ..Exit::DONE
    })
}

fn folder(path: &Path) -> &Path {
    path.parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// Writes the machine file, once it is known to be one.
fn write(path: &Path, before: &MachineFile, text: &str) -> Result<()> {
    let file = MachineFile::from_text(path, text)
        .with_context(|| format!("{}: the result is not a valid machine file", path.display()))?;
    if before.spec.urdf.is_some() {
        // without a log, joints may differ; with a URDF everything else is checked
        let checked = file.check_alone();
        ensure!(
            checked.is_ok(),
            "{}: the result does not describe a valid machine: {:?}",
            path.display(),
            checked.err()
        );
    }
    std::fs::write(path, text).with_context(|| format!("{}: cannot be written", path.display()))
}

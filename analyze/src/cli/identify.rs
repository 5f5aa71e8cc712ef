//! `tipwatch identify`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use super::exit::{Exit, Terminal};
use super::machine_file::InertiaArgs;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::print;
use crate::setup::identify::{
    IdentificationDocument, NoResult, Request, identify, text, write_machine_file,
};

#[derive(Debug, Args)]
pub(super) struct IdentifyArgs {
    /// Logs with measured loads or cylinder forces. Weighings are in the machine file: [weighed].
    logs: Vec<PathBuf>,
    /// The machine file. Its standard deviations are the prior.
    #[arg(long)]
    machine: PathBuf,
    #[command(flatten)]
    inertias: InertiaArgs,
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
    /// Widen the stated standard deviations of all scales and sensors by this factor. It is kept in the machine file.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    widen_sigmas: Option<f64>,
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

fn factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() && number >= 1.0 => Ok(number),
        _ => Err(format!("expected a factor of at least 1, found \"{text}\"")),
    }
}

pub(super) fn run(args: &IdentifyArgs, terminal: Terminal) -> Result<Exit> {
    if let Some(out) = &args.out {
        OutputPlace::require_local(out)?;
    }
    let file = (args.inertias).read_with_urdf(&args.machine, args.urdf.as_deref())?;
    let found = identify(
        &file,
        &Request {
            logs: args.logs.clone(),
            level: args.level.map(f64::to_radians),
            sigma_factor: args.widen_sigmas,
        },
    )?;
    let document = IdentificationDocument::of(&found);
    print(&document, args.json, |_| Ok(text(&found)))?;
    let refusal = found.refusal();
    if let Some(refusal) = &refusal {
        let kind = match refusal.is_undecided() {
            true => "not decided",
            false => "contradiction",
        };
        terminal.verdict(&format!("{kind}: {refusal}"));
    }
    if found.has_losses {
        terminal.verdict("lost: data of the logs was lost");
    }
    if let Some(path) = args.out.as_deref().filter(|_| refusal.is_none()) {
        write_machine_file(path, &file, &found)?;
        terminal.print(&format!("machine file: {}", path.display()));
    }
    Ok(Exit {
        undecided: refusal.as_ref().is_some_and(NoResult::is_undecided),
        broken: (refusal.as_ref()).is_some_and(|refusal| !refusal.is_undecided()),
        lost: found.has_losses,
        ..Exit::DONE
    })
}

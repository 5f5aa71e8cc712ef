//! `tipwatch chart`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{Exit, Terminal, Usage};
use super::machine_file::{InertiaArgs, MachineArg};
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::chart::{Request, chart, compare, csv, picture, sheet_points, text};

#[derive(Debug, Args)]
pub(super) struct ChartArgs {
    #[command(flatten)]
    machine: MachineArg,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// The URDF, for a machine file that names none.
    #[arg(long)]
    urdf: Option<PathBuf>,
    #[command(flatten)]
    request: Request,
    /// A maker's chart, as CSV: load_kg and reach_m, height_m or names of swept joints. Shows the computed load of each point
    /// beside it.
    #[arg(long, value_name = "FILE.csv")]
    compare: Option<PathBuf>,
    /// With --compare: exit code 4 if a computed load differs from the sheet's by more than this share.
    #[arg(long, value_name = "SHARE", requires = "compare")]
    tolerance: Option<f64>,
    /// Write the chart as CSV.
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write the chart, or the comparison, as a picture.
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

pub(super) fn run(args: &ChartArgs, terminal: Terminal) -> Result<Exit> {
    let request = &args.request;
    let shares = [Some(request.share), request.limit_share, args.tolerance];
    let is_wrong = |share: f64| !(share.is_finite() && share > 0.0);
    if shares.into_iter().flatten().any(is_wrong) {
        return Err(
            Usage("--share, --limit-share and --tolerance: expected positive numbers").into(),
        );
    }
    let mut payloads_kg = request.payloads_kg.iter();
    if payloads_kg.any(|mass| !(mass.is_finite() && *mass >= 0.0)) {
        return Err(Usage("--payload: expected masses that are not negative [kg]").into());
    }
    let file = (args.inertias).read_with_urdf(args.machine.path()?, args.urdf.as_deref())?;
    let machine = file.check_alone()?;
    let made = chart(&machine, request)?;
    let compared = match &args.compare {
        Some(path) => {
            let sheet = tipwatch_binding::read_text(path)
                .with_context(|| format!("{}: cannot be read", path.display()))?;
            let name = path.display().to_string();
            let points = sheet_points(&made, &sheet, &name)?;
            Some(compare(&made, points).with_context(|| name)?)
        }
        None => None,
    };
    to_stdout(&text(&made, compared.as_deref()))?;
    if let Some(path) = &args.csv {
        write(path, &csv(&made), terminal)?;
    }
    if let Some(path) = &args.picture {
        write(path, &picture(&made, compared.as_deref()), terminal)?;
    }
    let compared = compared.unwrap_or_default();
    let off = |share: f64| args.tolerance.is_some_and(|most| share.abs() > most);
    let mut differences = compared
        .iter()
        .map(|point| point.difference_share(request.share));
    Ok(Exit {
        // a point that cannot be computed is not within anything
        undecided: args.compare.is_some()
            && compared
                .iter()
                .all(|point| point.difference_share(request.share).is_none()),
        broken: args.tolerance.is_some() && differences.any(|share| share.is_none_or(off)),
        ..Exit::DONE
    })
}

fn write(path: &Path, content: &str, terminal: Terminal) -> Result<()> {
    let target = OutputPlace::file(path, false)?;
    std::fs::write(target.path(), content)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    target.publish("")?;
    terminal.print(&format!("wrote {}", path.display()));
    Ok(())
}

//! `tipwatch chart`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use super::exit::{Exit, Terminal, Usage};
use super::machine_file::{InertiaArgs, MachineArg};
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::setup::chart::{
    ReachFrom, Request, Sweep, chart, compare, csv, picture, sheet_points, text,
};

#[derive(Debug, Args)]
pub(super) struct ChartArgs {
    #[command(flatten)]
    machine: MachineArg,
    #[command(flatten)]
    inertias: InertiaArgs,
    /// The URDF, for a machine file that names none.
    #[arg(long)]
    urdf: Option<PathBuf>,
    /// Positions of a joint: JOINT=FROM:TO:NUMBER in rad or m, or in degrees, such as lift=-20deg:65deg:9; repeat it for
    /// other joints. Without it, every joint of the arm goes from limit to limit. A joint that is not swept stays as in the
    /// reference posture.
    #[arg(long = "sweep", value_name = "JOINT=FROM:TO:NUMBER")]
    sweeps: Vec<Sweep>,
    /// What the machine stands on: wheels, outriggers, or names of supports. Without it, its outriggers if it has some.
    #[arg(long, value_name = "SUPPORT", value_delimiter = ',')]
    on: Vec<String>,
    /// From where reach counts: tyres (the front of the front tyres), base (the origin of the base frame), or a joint's axis.
    #[arg(long, value_name = "PLACE", default_value = "tyres")]
    reach_from: ReachFrom,
    /// The link on which the load hangs; without it, the tool.
    #[arg(long)]
    link: Option<String>,
    /// Loads (kg) whose worst wheel is shown.
    #[arg(long, value_name = "KG", value_delimiter = ',')]
    payload: Vec<f64>,
    /// Limit of a wheel as a share of its static load; without it, min_load or min_load_share of the machine file.
    #[arg(long, value_name = "SHARE")]
    limit_share: Option<f64>,
    /// What the chart states of the tipping load: makers state a share, such as 0.75.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0)]
    share: f64,
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
    let shares = [Some(args.share), args.limit_share, args.tolerance];
    let is_wrong = |share: f64| !(share.is_finite() && share > 0.0);
    if shares.into_iter().flatten().any(is_wrong) {
        return Err(
            Usage("--share, --limit-share and --tolerance: expected positive numbers").into(),
        );
    }
    if args
        .payload
        .iter()
        .any(|mass| !(mass.is_finite() && *mass >= 0.0))
    {
        return Err(Usage("--payload: expected masses that are not negative [kg]").into());
    }
    let mut file = args.inertias.read(args.machine.path()?)?;
    if let Some(urdf) = &args.urdf {
        file = file.with_urdf(urdf)?;
    }
    let machine = file.check_alone()?;
    let request = Request {
        sweeps: args.sweeps.clone(),
        on: args.on.clone(),
        reach_from: args.reach_from.clone(),
        link: args.link.clone(),
        payloads_kg: args.payload.clone(),
        limit_share: args.limit_share,
        share: args.share,
    };
    let made = chart(&machine, &request)?;
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
        .map(|point| point.difference_share(args.share));
    Ok(Exit {
        // a point that cannot be computed is not within anything
        undecided: args.compare.is_some()
            && compared
                .iter()
                .all(|point| point.difference_share(args.share).is_none()),
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

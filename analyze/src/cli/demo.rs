//! `tipwatch demo`: analyses a small log that comes with the program, or sends it live through all programs first.
//!
//! A forwarder-like machine crawls onto a side slope, slews its loaded arm downhill and reaches out: it comes close, draws in,
//! and reaches out farther. The uphill rear wheel lifts, and comes down again when the arm is drawn in. Ground and tyres are
//! stated, so nothing of this depends on an assumed split of the load. Simulated with contact physics by
//! `tests/data/make_fixtures.py`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use tipwatch_binding::MachineFile;

use super::exit::{Ending, Exit, Terminal};
use super::live_program;
use super::options::CaseArgs;
use crate::analysis::{Analysis, DEFAULT_MIN_VALID, run};
use crate::base::options::Options;
use crate::base::output_place::OutputPlace;
use crate::base::stdout::to_stdout;
use crate::output::custody::{self, Files};
use crate::output::{self, OutputOptions};
use crate::report;

const FILES: [(&str, &[u8]); 3] = [
    ("demo.mcap", include_bytes!("../../demo/demo.mcap")),
    ("demo.toml", include_bytes!("../../demo/demo.toml")),
    ("demo.urdf", include_bytes!("../../demo/demo.urdf")),
];

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Output folder.
    #[arg(long, default_value = "tipwatch-demo")]
    out: PathBuf,
    /// Live: replay the log to a monitor and a recorder, with a display, and analyse what was recorded; runs `tipwatch-live
    /// rehearse`.
    #[arg(long)]
    live: bool,
    /// With --live: prefix of all files in shared memory, which keeps the demo apart from a machine.
    #[arg(
        long,
        value_name = "NAME",
        requires = "live",
        default_value = "tipwatch_demo_"
    )]
    prefix: String,
    /// With --live: speed relative to the recording, or "max".
    #[arg(long, value_name = "X", requires = "live", default_value = "1")]
    speed: String,
}

pub(super) fn run(args: &DemoArgs, terminal: Terminal) -> Result<Exit> {
    OutputPlace::require_local(&args.out)?;
    let out = &args.out;
    let input = out.join("input");
    let (log, machine) = unpack(&input)?;
    if args.live {
        let mut command = live_program::command("rehearse");
        command.arg(&log).arg("--machine").arg(&machine);
        command.arg("--out").arg(out);
        command.args(["--prefix", &args.prefix, "--speed", &args.speed]);
        return Err(live_program::run_instead(command));
    }
    let file = MachineFile::read(&machine)?;
    let mut analysis = run::analyse(&log, &file, Options::default(), &mut |_| {})?;
    CaseArgs::default().origin().note(&mut analysis);
    let written = output::write(&analysis, out, OutputOptions::default())?;
    let files = Files {
        log: &log,
        policy: None,
        written: &written,
        transfers: &[],
    };
    custody::write(&analysis.provenance, files, out)?;
    print_findings(&analysis, out)?;
    terminal.print("the demo's log and machine file are in its folder input/");
    Ok(Ending::of(&analysis, DEFAULT_MIN_VALID).tell(terminal))
}

/// Unpacks the demo's log and machine into `folder`; gives the paths of log and machine file.
///
/// # Errors
/// The folder cannot be written.
fn unpack(folder: &Path) -> Result<(PathBuf, PathBuf)> {
    fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be created", folder.display()))?;
    for (name, bytes) in FILES {
        let path = folder.join(name);
        fs::write(&path, bytes)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok((folder.join("demo.mcap"), folder.join("demo.toml")))
}

/// Prints what happened, the gravest finding, where the report is and how to go on.
fn print_findings(analysis: &Analysis, out: &Path) -> Result<()> {
    let mut lines = report::story(analysis);
    let findings = report::findings(analysis).into_iter().take(1);
    lines.extend(findings.map(|finding| format!("- {finding}")));
    lines.push(report::BANDS.into());
    let report = out.join("report.html");
    let report = report.canonicalize().unwrap_or(report);
    lines.push(format!("report: {}", report.display()));
    lines.push("next: tipwatch inspect YOUR.mcap --write-machine machine.toml\n".into());
    to_stdout(&lines.join("\n"))
}

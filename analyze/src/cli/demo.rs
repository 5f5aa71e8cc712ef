//! `tipwatch demo`: analyses a small log that comes with the program.
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
use super::options::CaseArgs;
use crate::analysis::{Analysis, DEFAULT_MIN_VALID, run};
use crate::base::options::Options;
use crate::base::output_place::OutputPlace;
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
}

pub(super) fn run(args: &DemoArgs, terminal: Terminal) -> Result<Exit> {
    OutputPlace::require_local(&args.out)?;
    let out = &args.out;
    let input = out.join("input");
    let mut analysis = analyse(&input)?;
    CaseArgs::default().origin().note(&mut analysis);
    let written = output::write(&analysis, out, OutputOptions::default())?;
    let files = Files {
        log: &input.join("demo.mcap"),
        policy: None,
        written: &written,
        transfers: &[],
    };
    custody::write(&analysis.provenance, files, out)?;
    print_findings(&analysis, out);
    terminal.print("the demo's log and machine file are in its folder input/");
    Ok(Ending::of(&analysis, DEFAULT_MIN_VALID).tell(terminal))
}

/// Unpacks the demo's log and machine into `folder` and analyses them.
///
/// # Errors
/// The folder cannot be written.
fn analyse(folder: &Path) -> Result<Analysis> {
    fs::create_dir_all(folder)
        .with_context(|| format!("{}: cannot be created", folder.display()))?;
    for (name, bytes) in FILES {
        let path = folder.join(name);
        fs::write(&path, bytes)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    let file = MachineFile::read(&folder.join("demo.toml"))?;
    run::analyse(
        &folder.join("demo.mcap"),
        &file,
        Options::default(),
        &mut |_| {},
    )
}

/// Prints what happened, the gravest finding, where the report is and how to go on.
#[expect(
    clippy::print_stdout,
    reason = "the findings are the output of the demo"
)]
fn print_findings(analysis: &Analysis, out: &Path) {
    for sentence in report::story(analysis) {
        println!("{sentence}");
    }
    for finding in report::findings(analysis).iter().take(1) {
        println!("- {finding}");
    }
    println!("{}", report::BANDS);
    let report = out.join("report.html");
    println!(
        "report: {}",
        report.canonicalize().unwrap_or(report).display()
    );
    println!("next: tipwatch inspect YOUR.mcap --write-machine machine.toml");
}

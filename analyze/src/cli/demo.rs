//! `tipwatch demo`: analyses a small log that comes with the program, or sends it live through all programs first.
//!
//! A forwarder-like machine crawls onto a side slope, slews its loaded arm downhill and reaches out: it comes close, draws in,
//! and reaches out farther. The uphill rear wheel lifts, and comes down again when the arm is drawn in. Ground and tyres are
//! stated, so nothing of this depends on an assumed split of the load. Simulated with contact physics by
//! `tests/data/make_fixtures.py`.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;
use tipwatch_language::word;

use super::exit::{Exit, Terminal};
use super::first_report;
use super::live_program;
use super::options::LanguageArgs;
use crate::base::files::write_atomically;
use crate::base::output_place::OutputPlace;

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
    #[command(flatten)]
    language: LanguageArgs,
}

pub(super) fn run(args: &DemoArgs, terminal: Terminal) -> Result<Exit> {
    OutputPlace::require_local(&args.out)?;
    args.language.choose();
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
    let next = "tipwatch inspect YOUR.mcap --write-machine machine.toml";
    let ending = first_report::write(&log, &file, out, next, terminal)?;
    terminal.print(word!(
        "the demo's log and machine file are in its folder input/"
    ));
    Ok(ending.tell(terminal))
}

/// Unpacks the demo's log and machine into `folder`; gives the paths of log and machine file.
///
/// # Errors
/// The folder cannot be written.
fn unpack(folder: &Path) -> Result<(PathBuf, PathBuf)> {
    for (name, bytes) in FILES {
        write_atomically(&folder.join(name), bytes)?;
    }
    Ok((folder.join("demo.mcap"), folder.join("demo.toml")))
}

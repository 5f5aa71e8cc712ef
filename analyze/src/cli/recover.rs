//! `tipwatch recover`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_ingest::{Log, recover};

use super::exit::{Exit, Terminal};

#[derive(Debug, Args)]
pub(super) struct RecoverArgs {
    /// The log.
    log: PathBuf,
    /// The new file; an existing one is never overwritten.
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &RecoverArgs, terminal: Terminal) -> Result<Exit> {
    let report = recover(&Log::open(&args.log)?, &args.out)?;
    terminal.print(&format!(
        "{} messages of {} topics written to {}",
        report.message_count(),
        report.messages.len(),
        args.out.display()
    ));
    if report.losses.is_empty() {
        return Ok(Exit::DONE);
    }
    for line in report.losses.lines() {
        terminal.print(&format!("lost: {line}"));
    }
    Ok(Exit::LOST)
}

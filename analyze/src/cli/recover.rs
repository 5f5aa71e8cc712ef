//! `tipwatch recover`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_ingest::{Log, recover_with};

use super::exit::{Exit, Terminal};
use crate::base::file_hash::hash_file;
use crate::base::recovered::RecoveredFrom;

#[derive(Debug, Args)]
pub(super) struct RecoverArgs {
    /// The log.
    log: PathBuf,
    /// The new file; an existing one is never overwritten.
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &RecoverArgs, terminal: Terminal) -> Result<Exit> {
    let log = Log::open(&args.log)?;
    let files = log.files().iter().map(|file| hash_file(file));
    let files = files.collect::<Result<Vec<_>>>()?;
    let origin = |losses: &_| Some(RecoveredFrom::new(files.clone(), losses).record());
    let report = recover_with(&log, &args.out, &origin)?;
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

//! `tipwatch recover`.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tipwatch_ingest::{Log, recover_with};

use super::exit::{Exit, Terminal};
use crate::base::file_hash::hash_log;
use crate::base::output_place::OutputPlace;
use crate::base::recovered::RecoveredFrom;
use crate::base::transfer_text;

#[derive(Debug, Args)]
pub(super) struct RecoverArgs {
    /// The log.
    log: PathBuf,
    /// The new file; an existing one is never overwritten.
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

pub(super) fn run(args: &RecoverArgs, terminal: Terminal) -> Result<Exit> {
    let target = OutputPlace::file(&args.out, true)?;
    let log = Log::open(&args.log)?;
    let files = hash_log(&log)?;
    let origin = |losses: &_| Some(RecoveredFrom::new(files.clone(), losses).record());
    let report = recover_with(&log, target.path(), &origin)?;
    target.publish("")?;
    transfer_text::lines(&log.transfers()).for_each(|line| terminal.print(&line));
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

//! Commands of the operator: `watch` and `acknowledge`.

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use super::arguments::ServiceArgs;
use crate::operator::watch;
use crate::operator::{acknowledge, acknowledge_signal};

#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    service: ServiceArgs,
}

#[derive(Debug, Args)]
pub(super) struct AcknowledgeArgs {
    #[command(flatten)]
    service: ServiceArgs,
    /// Trust this signal again as it is now, which is doubted since it failed visibly, instead of acknowledging the alarm: the name
    /// of a joint, or a name of the verdicts' "doubted".
    #[arg(long, value_name = "NAME")]
    signal: Option<String>,
}

pub(super) fn run_watch(args: &WatchArgs) -> Result<ExitCode> {
    watch(&args.service.address())?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn run_acknowledge(args: &AcknowledgeArgs) -> Result<ExitCode> {
    let address = args.service.address();
    let outcome = match &args.signal {
        Some(signal) => acknowledge_signal(&address, signal)?,
        None => acknowledge(&address)?.into(),
    };
    eprintln!("acknowledge: {outcome}");
    Ok(ExitCode::SUCCESS)
}

//! Commands of the operator: `watch` and `acknowledge`.

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use super::arguments::ServiceArgs;
use crate::operator::acknowledge;
use crate::operator::watch;

#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    service: ServiceArgs,
}

pub(super) fn run_watch(args: &WatchArgs) -> Result<ExitCode> {
    watch(&args.service.address())?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn run_acknowledge(args: &ServiceArgs) -> Result<ExitCode> {
    let outcome = acknowledge(&args.address())?;
    eprintln!("acknowledge: {outcome}");
    Ok(ExitCode::SUCCESS)
}

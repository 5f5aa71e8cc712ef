//! `tipwatch-live replay`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use clap::Args;

use super::arguments::{MachineArgs, ServiceArgs, seconds};
use super::exit::LOST;
use crate::node::LiveNode;
use crate::replay::{LogSamples, ReplayOptions, Speed, replay};
use crate::wire::session::PACES;

/// Default time for which a lossless replay waits for its reader (s).
const LOSSLESS_WAIT_S: f64 = 10.0;

#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// The log.
    log: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Speed relative to the recording, or "max".
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Wait for readers instead of overwriting samples that they have not read.
    #[arg(long)]
    lossless: bool,
    /// Number of readers to wait for before the first sample.
    #[arg(long, value_name = "N", default_value_t = 1)]
    readers: usize,
    /// How long to wait for them, in seconds. Default: 10 with --lossless, otherwise 0.
    #[arg(long, value_name = "S", value_parser = seconds)]
    wait: Option<Duration>,
}

pub(super) fn run_replay(args: &ReplayArgs) -> Result<ExitCode> {
    let file = args.machine.read()?;
    let mut log_samples = LogSamples::read(&args.log, &file, args.machine.urdf.as_deref())?;
    log_samples.set_identity();
    log_samples.session.pace = args.speed.pace();
    let node = LiveNode::new(&args.service.address(), "tipwatch-replay")?;
    let default_wait = if args.lossless { LOSSLESS_WAIT_S } else { 0.0 };
    let options = ReplayOptions {
        speed: args.speed,
        lossless: args.lossless,
        readers: args.readers,
        wait: args.wait.unwrap_or(Duration::from_secs_f64(default_wait)),
    };
    let counts = replay(&log_samples, &node, options)?;
    eprintln!(
        "replay: {} of {} samples sent{}",
        counts.sent,
        log_samples.session.total_samples,
        if counts.interrupted {
            ", stopped by a signal"
        } else {
            ""
        }
    );
    Ok(if log_samples.losses.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(LOST)
    })
}

pub(super) fn speed(text: &str) -> Result<Speed, String> {
    if text == "max" {
        return Ok(Speed::Max);
    }
    match text.parse() {
        Ok(factor) if PACES.contains(&factor) => Ok(Speed::Factor(factor)),
        _ => Err(format!(
            "expected a number from {} to {}, or \"max\"",
            PACES.start(),
            PACES.end()
        )),
    }
}

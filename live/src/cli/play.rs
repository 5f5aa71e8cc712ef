//! `tipwatch-live play`.

use std::net::IpAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;

use super::arguments::{domain, seconds};
use crate::bridge::{PlayOptions, play};

#[derive(Debug, Args)]
pub(super) struct PlayArgs {
    /// The log.
    log: PathBuf,
    /// Publish its topics in this DDS domain (default: $ROS_DOMAIN_ID, else 0); without it the frames of a CAN log go to standard output as candump text.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1)]
    dds: Option<Option<u16>>,
    /// Address of this computer on the network that DDS uses; may be given several times. Default: all networks.
    #[arg(long, value_name = "IP")]
    dds_address: Vec<IpAddr>,
    /// Speed relative to the recording.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    speed: f64,
    /// Time between the announcement of the topics and the first message, in seconds.
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    delay: Duration,
    /// Begin again at the end.
    #[arg(long = "loop")]
    repeats: bool,
}

pub(super) fn run_play(args: &PlayArgs) -> Result<ExitCode> {
    if !(args.speed.is_finite() && args.speed > 0.0) {
        bail!("--speed: expected a positive number, found {}", args.speed);
    }
    let sent = play(&PlayOptions {
        log: args.log.clone(),
        dds: domain(args.dds)?,
        addresses: args.dds_address.clone(),
        speed: args.speed,
        delay: args.delay,
        repeats: args.repeats,
    })?;
    eprintln!("play: {sent} messages sent");
    Ok(ExitCode::SUCCESS)
}

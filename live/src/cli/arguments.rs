//! Arguments of more than one command, and the values that they take.

use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, anyhow, bail};
use clap::Args;
use tipwatch_binding::MachineFile;
use tipwatch_can::CanId;

use crate::node::{LoopOptions, ServiceAddress, Wake};
use crate::system::realtime::RealTime;
use crate::wire::topics::DEFAULT_SERVICE;

/// Identifier of the verdict's CAN frame: a proprietary parameter group of SAE J1939.
pub(super) const DEFAULT_CAN_ID: &str = "18FF70E5";

#[derive(Debug, Args)]
pub(super) struct MachineArgs {
    /// The machine file.
    #[arg(long)]
    machine: PathBuf,
    /// The URDF, if the machine file names none.
    #[arg(long, value_name = "FILE")]
    pub(super) urdf: Option<PathBuf>,
    /// Replace inertias of the URDF that no body can have, with their uncertainty, instead of refusing them; the same as
    /// `accept_inertias = true` in the machine file. Every program of a session needs it.
    #[arg(long)]
    accept_inertias: bool,
}

impl MachineArgs {
    /// Reads the machine file.
    pub(super) fn read(&self) -> Result<MachineFile> {
        let file = MachineFile::read(&self.machine)?;
        Ok(match self.accept_inertias {
            true => file.accepting_inertias()?,
            false => file,
        })
    }

    /// Names the same machine file to another program.
    pub(super) fn pass_to(&self, command: &mut Command) {
        command.arg("--machine").arg(&self.machine);
        if self.accept_inertias {
            command.arg("--accept-inertias");
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct ServiceArgs {
    /// Name of the services in shared memory.
    #[arg(long, value_name = "NAME", default_value = DEFAULT_SERVICE)]
    service: String,
    /// Prefix of all files in shared memory. Programs with different prefixes do not see each other.
    #[arg(long, value_name = "NAME")]
    prefix: Option<String>,
}

impl ServiceArgs {
    pub(super) fn address(&self) -> ServiceAddress {
        ServiceAddress {
            service: self.service.clone(),
            prefix: self.prefix.clone(),
        }
    }

    /// Names the same services to another command.
    pub(super) fn pass_to(&self, command: &mut Command) {
        command.args(["--service", &self.service]);
        if let Some(prefix) = &self.prefix {
            command.args(["--prefix", prefix]);
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct LoopArgs {
    /// Wait for the next session when one has ended.
    #[arg(long)]
    stay: bool,
    /// How to wait for samples: "poll" (fastest, occupies a processor core), "event", or a sleep in microseconds.
    #[arg(long, default_value = "event")]
    wake: Wake,
    /// Lock all memory in RAM.
    #[arg(long)]
    lock_memory: bool,
    /// The processor core to run on.
    #[arg(long, value_name = "N")]
    core: Option<usize>,
    /// Real-time priority (SCHED_FIFO), 1 to 99. Not with --wake poll.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i32).range(1..=99))]
    priority: Option<i32>,
}

impl LoopArgs {
    pub(super) fn options(&self) -> LoopOptions {
        LoopOptions {
            wake: self.wake,
            stays: self.stay,
        }
    }

    pub(super) fn real_time(&self) -> Result<RealTime> {
        if self.priority.is_some() && self.wake == Wake::Poll {
            bail!(
                "--priority with --wake poll: the kernel throttles a busy-polling SCHED_FIFO thread for 50 ms of every second; expected --wake event or microseconds"
            );
        }
        Ok(RealTime {
            lock_memory: self.lock_memory,
            core: self.core,
            priority: self.priority,
        })
    }
}

/// The domain of DDS: as given, else `ROS_DOMAIN_ID`, else 0.
pub(super) fn domain(given: Option<Option<u16>>) -> Result<Option<u16>> {
    let domain = match given {
        None => return Ok(None),
        Some(Some(domain)) => domain,
        Some(None) => match std::env::var("ROS_DOMAIN_ID") {
            Ok(text) => text.trim().parse().map_err(|_| {
                anyhow!("ROS_DOMAIN_ID: expected a number from 0 to 232, found \"{text}\"")
            })?,
            Err(_) => 0,
        },
    };
    if domain > 232 {
        bail!("--dds: expected a domain from 0 to 232, found {domain}");
    }
    Ok(Some(domain))
}

pub(super) fn can_id(text: &str) -> Result<CanId, String> {
    let digits = text.trim_start_matches("0x");
    match u32::from_str_radix(digits, 16) {
        Ok(raw) if raw <= 0x7ff => Ok(CanId::standard(raw)),
        Ok(raw) if raw <= 0x1fff_ffff => Ok(CanId::extended(raw)),
        _ => Err("expected a hexadecimal identifier up to 1FFFFFFF".into()),
    }
}

pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let number = text
        .parse()
        .ok()
        .and_then(|number| Duration::try_from_secs_f64(number).ok());
    number.ok_or_else(|| "expected a non-negative number of seconds".into())
}

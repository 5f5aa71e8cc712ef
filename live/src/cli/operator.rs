//! Commands of the operator: `watch` and `acknowledge`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use tipwatch_binding::MachineFile;

use super::arguments::ServiceArgs;
use crate::node::ServiceAddress;
use crate::operator::watch;
use crate::operator::{acknowledge, acknowledge_signal};
use crate::wire::session::machine_hash;

/// Which of several machines.
#[derive(Debug, Args)]
struct OfMachine {
    /// The machine file: finds its monitor among several, whatever the name of its services.
    #[arg(long, value_name = "FILE", conflicts_with = "service")]
    machine: Option<PathBuf>,
    /// The URDF, if the machine file names none.
    #[arg(long, value_name = "FILE", requires = "machine")]
    urdf: Option<PathBuf>,
}

impl OfMachine {
    fn address(&self, service: &ServiceArgs, role: &str) -> Result<ServiceAddress> {
        let Some(path) = &self.machine else {
            return Ok(service.address());
        };
        let file = MachineFile::read(path)?;
        let urdf = file.urdf(self.urdf.as_deref(), None)?;
        service
            .address()
            .of_machine(machine_hash(&file, &urdf), role)
    }
}

#[derive(Debug, Args)]
pub(super) struct WatchArgs {
    #[command(flatten)]
    service: ServiceArgs,
    #[command(flatten)]
    of: OfMachine,
}

#[derive(Debug, Args)]
pub(super) struct AcknowledgeArgs {
    #[command(flatten)]
    service: ServiceArgs,
    #[command(flatten)]
    of: OfMachine,
    /// Trust this signal again as it is now, which is doubted since it failed visibly, instead of acknowledging the alarm: the name
    /// of a joint, or a name of the verdicts' "doubted".
    #[arg(long, value_name = "NAME")]
    signal: Option<String>,
}

pub(super) fn run_watch(args: &WatchArgs) -> Result<ExitCode> {
    watch(&args.of.address(&args.service, "tipwatch-watch")?)?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn run_acknowledge(args: &AcknowledgeArgs) -> Result<ExitCode> {
    let address = (args.of).address(&args.service, "tipwatch-acknowledge")?;
    let outcome = match &args.signal {
        Some(signal) => acknowledge_signal(&address, signal)?,
        None => acknowledge(&address)?.into(),
    };
    eprintln!("acknowledge: {outcome}");
    Ok(ExitCode::SUCCESS)
}

//! `tipwatch-live bridge`, and the two forms of the verdict that it sends.

use std::collections::BTreeMap;
use std::io::Write;
use std::net::IpAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, bail};
use clap::Args;
use tipwatch_can::CanId;
use tipwatch_ingest::Log;
use tipwatch_mechanics::verdict::Level;

use super::arguments::{DEFAULT_CAN_ID, MachineArgs, ServiceArgs, can_id, domain, seconds};
use super::exit::LOST;
use crate::bridge::input::CanInput;
use crate::bridge::output::{CommandRule, dbc, verdict_msg};
use crate::bridge::session::Stamps;
use crate::bridge::{BridgeOptions, OutputOptions, bridge};
use crate::node::{Housekeeping, LiveNode};

#[derive(Debug, Args)]
pub(super) struct BridgeArgs {
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Read topics of ROS 2 from this DDS domain (default: $ROS_DOMAIN_ID, else 0), and publish /diagnostics and /tipwatch/verdict there.
    #[arg(long, value_name = "DOMAIN", num_args = 0..=1)]
    dds: Option<Option<u16>>,
    /// Address of this computer on the network that DDS uses; may be given several times. Default: all networks.
    #[arg(long, value_name = "IP")]
    dds_address: Vec<IpAddr>,
    /// Read messages from standard input as a stream of MCAP, from a program that reads another network, such as Zenoh.
    #[arg(long)]
    mcap: bool,
    /// A log with the definitions of message types that are not built in.
    #[arg(long, value_name = "LOG")]
    definitions: Option<PathBuf>,
    /// Read the frames of a CAN interface; "-" for the text of candump -L on standard input. The frames are the topic
    /// of the interface's name, or of the name behind "=". May be given several times.
    #[arg(long, value_name = "IFACE[=TOPIC]")]
    can: Vec<CanInput>,
    /// Read frames of CAN FD too.
    #[arg(long)]
    can_fd: bool,
    /// What the stamps of the messages are.
    #[arg(long, default_value = "auto")]
    stamps: Stamps,
    /// Send the verdict as CAN frames to this interface; "-" for the text of candump on standard output. `tipwatch-live
    /// dbc` writes their DBC file.
    #[arg(long, value_name = "IFACE")]
    can_out: Option<String>,
    /// Identifier of those frames, hexadecimal; above 7FF it has 29 bits.
    #[arg(long, value_name = "ID", default_value = DEFAULT_CAN_ID, value_parser = can_id)]
    can_id: CanId,
    /// Publish nothing on DDS.
    #[arg(long)]
    no_verdicts: bool,
    /// Run the command of the --run at the same place when the level to act on reaches this one (notice, warning, danger
    /// or fault), and when it is left again.
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    on_level: Vec<Level>,
    /// The command, for sh -c. The environment tells it what happened: TIPWATCH_EVENT, TIPWATCH_LEVEL, TIPWATCH_WHEEL.
    #[arg(long, value_name = "COMMAND")]
    run: Vec<String>,
    /// After this time a command is killed, in seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    run_limit: Duration,
    /// How long to wait for the sensors of the machine file, in seconds.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds)]
    wait: Duration,
    /// Wait for ever.
    #[arg(long)]
    stay: bool,
}

#[derive(Debug, Args)]
pub(super) struct DbcArgs {
    /// Identifier of the frames, hexadecimal; above 7FF it has 29 bits.
    #[arg(long, value_name = "ID", default_value = DEFAULT_CAN_ID, value_parser = can_id)]
    can_id: CanId,
}

pub(super) fn run_bridge(args: &BridgeArgs) -> Result<ExitCode> {
    let file = args.machine.read()?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let mut can = args.can.clone();
    for input in &mut can {
        input.is_fd = args.can_fd;
    }
    if can.is_empty() && args.dds.is_none() && !args.mcap {
        bail!("bridge: expected at least one network, --dds, --can IFACE or --mcap, found none");
    }
    let of_stdin =
        can.iter().filter(|input| input.interface == "-").count() + usize::from(args.mcap);
    if of_stdin > 1 {
        bail!("bridge: expected one use of standard input, found {of_stdin}: --can - and --mcap");
    }
    if args.on_level.len() != args.run.len() {
        bail!(
            "bridge: expected one --run for every --on-level, found {} and {}",
            args.run.len(),
            args.on_level.len()
        );
    }
    let mut definitions = BTreeMap::new();
    if let Some(path) = &args.definitions {
        for topic in Log::open(path)?.topics() {
            let is_ros = topic.schema_encoding == "ros2msg";
            if let Some(definition) = topic.definition.clone().filter(|_| is_ros) {
                definitions.insert(topic.type_name.clone(), definition);
            }
        }
    }
    let rules = args.on_level.iter().zip(&args.run);
    let options = BridgeOptions {
        dds: domain(args.dds)?,
        addresses: args.dds_address.clone(),
        definitions,
        mcap: args.mcap,
        can,
        outputs: OutputOptions {
            publishes: !args.no_verdicts,
            can: args
                .can_out
                .clone()
                .map(|interface| (interface, args.can_id)),
            commands: rules
                .map(|(level, command)| CommandRule {
                    level: *level,
                    command: command.clone(),
                    limit: args.run_limit,
                })
                .collect(),
        },
        stamps: args.stamps,
        wait: (!args.stay).then_some(args.wait),
    };
    let address = args.service.address();
    let node = LiveNode::new(&address, "tipwatch-bridge")?;
    let housekeeping = Housekeeping::start(&address)?;
    let counts = bridge(&node, &address, &file, &urdf, &options, &housekeeping)?;
    let of = counts.of_messages;
    eprintln!(
        "bridge: {} sessions, {} messages, {} samples sent; messages: {} lost, {} repeated, {} of two publishers, {} \
         undecodable",
        counts.sessions,
        of.messages,
        of.sent,
        of.lost,
        of.repeated,
        of.of_two_publishers,
        of.undecodable
    );
    Ok(ExitCode::from(
        match of.lost + of.of_two_publishers + of.undecodable {
            0 => 0,
            _ => LOST,
        },
    ))
}

pub(super) fn print_dbc(args: &DbcArgs) -> Result<ExitCode> {
    std::io::stdout().write_all(dbc(args.can_id).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn print_msg(args: &MachineArgs) -> Result<ExitCode> {
    let mut file = args.read()?;
    if let Some(urdf) = &args.urdf {
        file = file.with_urdf(urdf)?;
    }
    let text = verdict_msg(&file.check_alone()?)?;
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn level(text: &str) -> Result<Level, String> {
    let can_be_reached = [Level::Notice, Level::Warning, Level::Danger, Level::Fault];
    let found = can_be_reached
        .into_iter()
        .find(|level| level.name() == text);
    found.ok_or_else(|| "expected notice, warning, danger or fault".into())
}

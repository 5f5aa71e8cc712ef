//! `tipwatch-live record`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Result;
use clap::Args;

use super::arguments::{MachineArgs, ServiceArgs, seconds};
use super::exit::{FAILED, LOST};
use crate::node::LiveNode;
use crate::record::{ClipOptions, RecordOptions, Trigger, record};
use crate::wire::fingerprint::Fingerprint;

#[derive(Debug, Args)]
pub(super) struct RecordArgs {
    /// The folder for the files. It is created if necessary.
    out: PathBuf,
    #[command(flatten)]
    machine: MachineArgs,
    #[command(flatten)]
    service: ServiceArgs,
    /// Length of a file, in seconds.
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds, conflicts_with = "on")]
    split: Duration,
    /// Limit on the size of all files, in megabytes: beyond it the oldest are removed.
    #[arg(long, value_name = "MB", value_parser = clap::value_parser!(u64).range(16..))]
    keep: Option<u64>,
    /// Wait for the next session when one has ended.
    #[arg(long)]
    stay: bool,
    #[command(flatten)]
    clips: ClipArgs,
}

/// The black box.
#[derive(Debug, Args)]
struct ClipArgs {
    /// Black box: keep the last seconds in memory and write a file, a clip, only around verdicts that meet one of these
    /// conditions.
    #[arg(long, value_enum, value_name = "CONDITION", value_delimiter = ',')]
    on: Vec<Trigger>,
    /// Time before the first trigger of a clip, in seconds.
    #[arg(long, value_name = "S", default_value = "30", value_parser = seconds, requires = "on")]
    before: Duration,
    /// Time after the last trigger of a clip, in seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds, requires = "on")]
    after: Duration,
    /// Longest clip, in seconds. A longer one goes on in the next file.
    #[arg(long, value_name = "S", default_value = "600", value_parser = a_second_or_more, requires = "on")]
    longest: Duration,
    /// Memory for the time before a trigger, in megabytes.
    #[arg(long, value_name = "MB", default_value = "64", value_parser = clap::value_parser!(u32).range(1..), requires = "on")]
    ring: u32,
}

impl ClipArgs {
    fn options(&self) -> Option<ClipOptions> {
        let mut on = self.on.clone();
        on.sort_unstable();
        on.dedup();
        (!on.is_empty()).then_some(ClipOptions {
            on,
            before: self.before,
            after: self.after,
            longest: self.longest,
            ring_bytes: (self.ring as usize) << 20,
        })
    }
}

pub(super) fn run_record(args: &RecordArgs) -> Result<ExitCode> {
    let file = args.machine.read()?;
    let urdf = file.urdf(args.machine.urdf.as_deref(), None)?;
    let node = LiveNode::new(&args.service.address(), "tipwatch-record")?;
    let options = RecordOptions {
        folder: args.out.clone(),
        split: args.split,
        keep_bytes: args.keep.map(|megabytes| megabytes << 20),
        stays: args.stay,
        fingerprint: Fingerprint::of_this_program(&file, &urdf, None)?,
        clips: args.clips.options(),
    };
    eprintln!("record: {}", options.fingerprint.statement());
    let counts = record(&node, &file, &urdf, &options)?;
    eprintln!(
        "record: {} samples, {} verdicts, {} commands in {}; not recorded: {} samples, {} verdicts; \
         refused: {} samples",
        counts.samples,
        counts.verdicts,
        counts.commands,
        args.out.display(),
        counts.samples_lost,
        counts.verdicts_lost,
        counts.samples_refused
    );
    if args.clips.options().is_some() {
        eprintln!(
            "record: {} clips, {} of them shorter than asked for",
            counts.clips, counts.short_clips
        );
    }
    if counts.samples_unannounced > 0 {
        eprintln!(
            "record: {} samples are of no announced session and were not recorded: a producer has to announce its session before the \
             first sample",
            counts.samples_unannounced
        );
    }
    // what was refused was told then
    let found_nothing = counts.sessions == 0 && counts.sessions_refused == 0;
    if found_nothing {
        eprintln!(
            "record: expected the announcement of a session in the services \"{}\", found none: nothing was recorded",
            args.service.address().service
        );
    }
    let is_complete = counts.samples_lost == 0
        && counts.verdicts_lost == 0
        && counts.short_clips == 0
        && counts.samples_unannounced == 0;
    Ok(match (found_nothing, is_complete) {
        // one that waits for session after session may find none until it is stopped
        (true, _) if !args.stay => ExitCode::from(FAILED),
        (_, true) => ExitCode::SUCCESS,
        (_, false) => ExitCode::from(LOST),
    })
}

fn a_second_or_more(text: &str) -> Result<Duration, String> {
    let duration = seconds(text)?;
    match duration >= Duration::from_secs(1) {
        true => Ok(duration),
        false => Err("expected one second or more".into()),
    }
}

//! The thread that follows the verdict, with all that shows it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::JoinHandle;

use anyhow::{Context, Result};
use tipwatch_can::CanId;

use super::dds::Participant;
use super::input::Teller;
use super::output::{
    CanSink, CanVerdict, CommandRule, Commands, DdsSink, Follower, VerdictSink, open_frames,
};
use crate::node::ServiceAddress;

/// Outputs of the verdict: messages on DDS, frames on a bus, and commands.
#[derive(Debug, Clone, Default)]
pub struct OutputOptions {
    /// Whether the verdict is published on DDS, if DDS is read.
    pub publishes: bool,
    /// The bus for its frames, and their identifier.
    pub can: Option<(String, CanId)>,
    /// Commands on levels.
    pub commands: Vec<CommandRule>,
}

/// The running thread.
#[derive(Debug)]
pub struct Outputs {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Outputs {
    /// Opens all outputs and starts the thread.
    ///
    /// # Errors
    /// An output cannot be opened.
    pub fn start(
        address: &ServiceAddress,
        options: &OutputOptions,
        participant: Option<&Participant>,
        teller: &Teller,
    ) -> Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let (options, participant) = (options.clone(), participant.cloned());
        let (address, teller) = (address.clone(), teller.clone());
        let (opened, is_open) = sync_channel(1);
        let thread = {
            let ends = Arc::clone(&ends);
            // ports of shared memory stay in the thread that created them
            std::thread::Builder::new()
                .name("verdicts".into())
                .spawn(move || {
                    let open = || -> Result<(Follower, Vec<Box<dyn VerdictSink>>)> {
                        let sinks = sinks(&options, participant.as_ref(), &teller)?;
                        Ok((Follower::new(&address)?, sinks))
                    };
                    match open() {
                        Ok((follower, sinks)) => {
                            let _ = opened.send(Ok(()));
                            follow(follower, sinks, &ends, &teller);
                        }
                        Err(error) => {
                            let _ = opened.send(Err(error));
                        }
                    }
                })?
        };
        let is_open = is_open.recv().context("the thread of the outputs")?;
        is_open?;
        Ok(Self {
            ends,
            thread: Some(thread),
        })
    }

    /// Ends the thread, after the commands that are due.
    pub fn end(mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn sinks(
    options: &OutputOptions,
    participant: Option<&Participant>,
    teller: &Teller,
) -> Result<Vec<Box<dyn VerdictSink>>> {
    let mut sinks: Vec<Box<dyn VerdictSink>> = Vec::new();
    // what acts on the machine comes first
    for rule in &options.commands {
        sinks.push(Box::new(Commands::start(rule.clone(), teller.clone())?));
    }
    if let Some((interface, id)) = &options.can {
        let bus = open_frames(interface)?;
        sinks.push(Box::new(CanSink::new(
            CanVerdict::new(*id),
            bus,
            teller.clone(),
        )));
    }
    if let Some(participant) = participant.filter(|_| options.publishes) {
        sinks.push(Box::new(DdsSink::new(participant, teller.clone())?));
    }
    Ok(sinks)
}

fn follow(
    mut follower: Follower,
    mut sinks: Vec<Box<dyn VerdictSink>>,
    ends: &AtomicBool,
    teller: &Teller,
) {
    while !ends.load(Ordering::Relaxed) {
        if let Err(error) = follower.step(&mut sinks) {
            teller.fault("follow", &format!("verdicts cannot be read: {error:#}"));
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
    }
    for sink in &mut sinks {
        sink.end();
    }
}

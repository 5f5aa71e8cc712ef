//! The bridge between networks and shared memory.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, Urdf};

use super::dds::{Participant, start_dds};
use super::input::{Arrivals, CanInput, HostClock, Intake, Teller, Wanted, start_can, start_mcap};
use super::outputs::{OutputOptions, Outputs};
use super::session::{Ending, FirstMessages, Incomplete, SessionCounts, SessionRun, Stamps};
use crate::node::{Housekeeping, LiveNode, ServiceAddress};
use crate::system::clock::monotonic_ns;
use crate::system::signals;

/// Longest wait for a message before signals and readers are looked after.
const TICK: Duration = Duration::from_millis(20);
/// Time that something may be missing before it is told.
const PATIENCE: Duration = Duration::from_secs(3);

/// Options of the bridge: its inputs, its outputs and the clock of the stamps.
#[derive(Debug, Clone)]
pub struct BridgeOptions {
    /// The domain of DDS, as `ROS_DOMAIN_ID`.
    pub dds: Option<u16>,
    /// Addresses of this computer whose networks DDS uses; empty for all.
    pub addresses: Vec<IpAddr>,
    /// Definitions of message types that are not built in, by type.
    pub definitions: BTreeMap<String, String>,
    /// Whether standard input is a stream of MCAP.
    pub mcap: bool,
    /// Buses.
    pub can: Vec<CanInput>,
    /// Outputs of the verdict.
    pub outputs: OutputOptions,
    /// Clock of the stamps.
    pub stamps: Stamps,
    /// Longest wait for messages to which the machine can be bound; `None` for no limit.
    pub wait: Option<Duration>,
}

/// Counts of the sessions and of their messages.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BridgeCounts {
    /// Sessions announced.
    pub sessions: u64,
    /// Messages and samples.
    pub of_messages: SessionCounts,
}

/// Runs until it is asked to stop, or no network is left.
///
/// # Errors
/// A network cannot be opened, or the machine cannot be bound to its messages in time.
pub fn bridge(
    node: &LiveNode,
    address: &ServiceAddress,
    file: &MachineFile,
    urdf: &Urdf,
    options: &BridgeOptions,
    housekeeping: &Housekeeping,
) -> Result<BridgeCounts> {
    let teller = Teller::default();
    let (intake, arrivals) = Intake::new(teller.clone());
    let clock = HostClock::default();
    for input in &options.can {
        start_can(input, &intake, &clock)?;
    }
    let wanted = Wanted::of(file);
    let participant = options
        .dds
        .map(|domain| Participant::join(domain, &options.addresses))
        .transpose()?;
    if let Some(participant) = &participant {
        let definitions = options.definitions.clone();
        start_dds(
            participant,
            wanted.clone(),
            definitions,
            intake.clone(),
            clock.clone(),
        )?;
    }
    if options.mcap {
        start_mcap(wanted.clone(), intake.clone())?;
    }
    drop(intake);
    let outputs = Outputs::start(address, &options.outputs, participant.as_ref(), &teller)?;
    let mut bridge = Bridge {
        node,
        file,
        urdf,
        options,
        housekeeping,
        wanted,
        arrivals,
        teller,
        clock,
        counts: BridgeCounts::default(),
    };
    let ran = bridge.run();
    let counts = bridge.counts;
    outputs.end();
    ran?;
    Ok(counts)
}

struct Bridge<'a> {
    node: &'a LiveNode,
    file: &'a MachineFile,
    urdf: &'a Urdf,
    options: &'a BridgeOptions,
    housekeeping: &'a Housekeeping,
    wanted: Wanted,
    arrivals: Arrivals,
    teller: Teller,
    clock: HostClock,
    counts: BridgeCounts,
}

impl Bridge<'_> {
    fn run(&mut self) -> Result<()> {
        loop {
            let Some(run) = self.begin()? else {
                return Ok(());
            };
            match self.follow(run)? {
                Ending::Interrupted | Ending::SourcesEnded => return Ok(()),
                Ending::Restart(why) => {
                    self.teller
                        .say(&format!("the session ends: {why}; the next one begins"));
                }
            }
        }
    }

    /// Collects the first messages and announces a session; `None` if the program is to end.
    fn begin(&mut self) -> Result<Option<SessionRun>> {
        self.clock.update();
        let start = Instant::now();
        let mut first = FirstMessages::default();
        let mut missing: Option<Incomplete> = None;
        let mut known = self.arrivals.lanes();
        loop {
            self.housekeeping.cycle_completed();
            let ended = match self.arrivals.next(TICK) {
                Ok(arrival) => {
                    if arrival.lane.0 >= known.len() {
                        known = self.arrivals.lanes();
                    }
                    first.take(arrival, &known);
                    false
                }
                Err(ended) => ended,
            };
            if signals::check().is_err() {
                return Ok(None);
            }
            let now_ns = monotonic_ns();
            if ended || first.is_due(&self.wanted, now_ns) {
                let lanes = self.arrivals.lanes();
                let (stamps, unix) = (self.options.stamps, self.clock.unix_ahead_ns());
                match first.bind(self.file, self.urdf, &lanes, stamps, unix, now_ns) {
                    Ok(assembly) => {
                        for note in &assembly.notes {
                            self.teller.say(note);
                        }
                        self.counts.sessions += 1;
                        let publishers = first.into_publishers();
                        let run = SessionRun::begin(
                            self.node,
                            assembly,
                            publishers,
                            lanes,
                            self.teller.clone(),
                        )?;
                        return Ok(Some(run));
                    }
                    Err(incomplete) => missing = Some(incomplete),
                }
            }
            let why = match &missing {
                Some(Incomplete(error)) => format!("{error:#}"),
                None => "no message of any topic that the machine file asks for".into(),
            };
            if ended {
                bail!("the input has ended before a session could begin: {why}");
            }
            if start.elapsed() > PATIENCE {
                self.teller.fault("waiting", &format!("waiting: {why}"));
            }
            if self.options.wait.is_some_and(|wait| start.elapsed() > wait) {
                bail!(
                    "expected every sensor of the machine file within {:.0} s, found: {why}",
                    start.elapsed().as_secs_f64()
                );
            }
        }
    }

    fn follow(&mut self, mut run: SessionRun) -> Result<Ending> {
        let mut maintained = Instant::now();
        let ending = loop {
            self.housekeeping.cycle_completed();
            match self.arrivals.next(TICK) {
                Ok(arrival) => {
                    if let Some(ending) = run.take(&arrival)? {
                        break ending;
                    }
                }
                Err(true) => break Ending::SourcesEnded,
                Err(false) => {}
            }
            if maintained.elapsed() >= TICK {
                maintained = Instant::now();
                if let Some(ending) = run.maintain()? {
                    break ending;
                }
                if let Some(by_s) = self.clock.was_set_by_s() {
                    break Ending::Restart(format!("this computer's clock was set by {by_s:.2} s"));
                }
                if signals::check().is_err() {
                    break Ending::Interrupted;
                }
            }
        };
        self.counts.of_messages.add(&run.end()?);
        Ok(ending)
    }
}

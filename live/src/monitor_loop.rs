//! The monitor's loop: from shared memory to shared memory.

use anyhow::Result;
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::verdict::{Conditions, InputFault, InputFaults, Level, Verdict};

use crate::clock::monotonic_ns;
use crate::guard::Counts;
use crate::identity::new_identity;
use crate::interrupt;
use crate::monitor::{HEARTBEAT_NS, Monitor, Progress, VALIDITY_NS};
use crate::node::{Bell, Joined, Receiver, Sender};
use crate::sample_reader::SampleReader;
use crate::session::{Session, machine_hash};
use crate::topics::{WireAcknowledge, WireMachine, WireSample, WireSession, WireVerdict};
use crate::wake::{Waiter, Wake};

/// How long a session may take to be announced (ns).
const START_UP_NS: i64 = 2_000_000_000;

/// How a monitor runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MonitorOptions {
    /// How it waits for samples.
    pub wake: Wake,
    /// Whether it waits for the next session when one is over.
    pub stays: bool,
}

/// The monitor's ends of the shared memory.
#[derive(Debug)]
pub struct MonitorLoop<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
    options: MonitorOptions,
    reader: SampleReader,
    acknowledgements: Receiver<WireAcknowledge>,
    machines: Sender<WireMachine>,
    waiter: Waiter,
    out: Out,
}

/// Where verdicts go.
#[derive(Debug)]
struct Out {
    verdicts: Sender<WireVerdict>,
    bell: Bell,
    failed: Option<anyhow::Error>,
}

/// What the loop tells beside the shared memory. Called in the loop: it must not wait.
pub trait Listener {
    /// A session begins.
    ///
    /// # Errors
    /// Ends the loop.
    fn session(&mut self, monitor: &Monitor, session: &Session) -> Result<()>;

    /// A verdict was sent.
    fn verdict(&mut self, verdict: &WireVerdict);

    /// A cycle is done.
    fn cycle(&mut self) {}

    /// Whether the loop is to go on.
    fn wants_more(&self) -> bool {
        true
    }
}

impl Out {
    /// Seals and sends; when.
    fn publish(&mut self, verdict: &mut WireVerdict, listener: &mut dyn Listener) -> i64 {
        let now_ns = monotonic_ns();
        verdict.valid_until_ns = now_ns.saturating_add(VALIDITY_NS);
        match self.verdicts.send_at(verdict, now_ns) {
            Ok(_) => self.bell.ring(),
            Err(error) => {
                self.failed.get_or_insert(error);
            }
        }
        listener.verdict(verdict);
        now_ns
    }
}

impl<'a> MonitorLoop<'a> {
    /// Opens all services.
    ///
    /// # Errors
    /// Another monitor has them, or another version of this program.
    pub fn new(
        joined: &Joined,
        file: &'a MachineFile,
        urdf: &'a Urdf,
        options: MonitorOptions,
    ) -> Result<Self> {
        let hash = machine_hash(file, urdf);
        let source = new_identity(hash);
        Ok(Self {
            file,
            urdf,
            options,
            acknowledgements: joined.receiver()?,
            machines: joined.sender(source, hash)?,
            waiter: Waiter::new::<WireSample>(joined, options.wake)?,
            out: Out {
                verdicts: joined.sender(source, hash)?,
                bell: joined.bell::<WireVerdict>()?,
                failed: None,
            },
            // The reader last: who sees it may rely on the rest.
            reader: SampleReader::new(joined)?,
        })
    }

    /// Runs until the session is over, or for ever if it stays; until a signal comes in any case.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn run(&mut self, listener: &mut dyn Listener) -> Result<Counts> {
        let mut active: Option<Monitor> = None;
        let mut idle = Idle::new(monotonic_ns());
        let mut counts = Counts::default();
        while interrupt::check().is_ok() && listener.wants_more() {
            if active.is_none() {
                self.look_for_session(&mut active, listener)?;
            }
            let ended = self.take_samples(&mut active, listener)?;
            while self.acknowledgements.receive(|_| ())?.is_some() {
                active.iter_mut().for_each(Monitor::acknowledge);
            }
            let now_ns = monotonic_ns();
            if let Some(monitor) = &mut active
                && !ended
                && !self.reader.has_producer()
            {
                monitor.note(InputFault::ProducerGone);
                counts = monitor.counts();
                self.look_for_session(&mut active, listener)?;
            }
            let out = &mut self.out;
            match &mut active {
                Some(monitor) => {
                    monitor.tick(now_ns, &mut |verdict| out.publish(verdict, listener));
                    counts = monitor.counts();
                }
                None => idle.tick(now_ns, &mut |verdict| out.publish(verdict, listener)),
            }
            if let Some(error) = self.out.failed.take() {
                return Err(error);
            }
            listener.cycle();
            if ended {
                if !self.options.stays {
                    break;
                }
                active = None;
                idle = Idle::new(now_ns);
            }
            self.machines.greet()?;
            self.waiter.wait();
        }
        Ok(counts)
    }

    /// Takes all samples that wait; whether the session is over.
    fn take_samples(
        &mut self,
        active: &mut Option<Monitor>,
        listener: &mut dyn Listener,
    ) -> Result<bool> {
        loop {
            let out = &mut self.out;
            let monitor = &mut *active;
            let taken = self.reader.sample(|wire| {
                let followed = monitor.as_mut().filter(|m| m.session() == wire.source);
                let Some(monitor) = followed else {
                    return Err(*wire);
                };
                let mut publish = |verdict: &mut WireVerdict| out.publish(verdict, listener);
                Ok(monitor.take(wire, monotonic_ns(), &mut publish))
            })?;
            match taken {
                None => return Ok(false),
                Some(Ok(Progress::Ended)) => return Ok(true),
                Some(Ok(Progress::Running)) => {}
                // a session is announced before its first sample
                Some(Err(foreign)) => {
                    self.look_for_session(active, listener)?;
                    let out = &mut self.out;
                    let mut publish = |verdict: &mut WireVerdict| out.publish(verdict, listener);
                    if let Some(monitor) = active
                        && monitor.take(&foreign, monotonic_ns(), &mut publish) == Progress::Ended
                    {
                        return Ok(true);
                    }
                }
            }
        }
    }

    /// Follows a session that was announced, if it is of this machine.
    fn look_for_session(
        &mut self,
        active: &mut Option<Monitor>,
        listener: &mut dyn Listener,
    ) -> Result<()> {
        let Some(wire) = self.reader.announced()? else {
            return Ok(());
        };
        match (self.begin(&wire, listener), &mut *active) {
            (Ok(mut monitor), before) => {
                if let Some(before) = before {
                    monitor.succeed(before);
                }
                *active = Some(monitor);
                Ok(())
            }
            // what runs goes on, and tells that something is wrong
            (Err(_), Some(monitor)) => {
                monitor.note(InputFault::WrongMachine);
                Ok(())
            }
            (Err(error), None) => Err(error),
        }
    }

    fn begin(&mut self, wire: &WireSession, listener: &mut dyn Listener) -> Result<Monitor> {
        let session = Session::try_from(wire)?;
        let (machine, sensors) = session.machine(self.file, self.urdf)?;
        self.machines
            .send(&mut WireMachine::new(&machine, session.id)?)?;
        let facts = session.facts(&machine);
        let monitor = Monitor::new(machine, &sensors, &facts, monotonic_ns());
        listener.session(&monitor, &session)?;
        self.reader.follow(wire)?;
        Ok(monitor)
    }
}

/// While there is no session: unknown, and soon a fault.
struct Idle {
    since_ns: i64,
    published_ns: i64,
    wire: WireVerdict,
}

impl Idle {
    fn new(now_ns: i64) -> Self {
        Self {
            since_ns: now_ns,
            published_ns: i64::MIN,
            wire: WireVerdict::unknown(),
        }
    }

    fn tick(&mut self, now_ns: i64, publish: &mut dyn FnMut(&mut WireVerdict) -> i64) {
        if now_ns.saturating_sub(self.published_ns) < HEARTBEAT_NS {
            return;
        }
        let mut conditions = Conditions::default();
        let mut level = Level::Unknown;
        if now_ns.saturating_sub(self.since_ns) > START_UP_NS {
            conditions.faults = InputFaults::from(InputFault::NeverReceived);
            level = Level::Fault;
        }
        let verdict = Verdict {
            level,
            latched_level: level,
        };
        self.wire
            .set_verdict(verdict, conditions, Counts::default());
        self.published_ns = publish(&mut self.wire);
    }
}

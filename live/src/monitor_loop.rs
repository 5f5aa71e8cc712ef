//! The monitor's loop: from shared memory to shared memory.

use anyhow::Result;
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::verdict::{Conditions, InputFault, InputFaults, Level, Verdict};

use crate::clock::Clock;
use crate::guard::Counts;
use crate::identity::new_identity;
use crate::interrupt;
use crate::monitor::{HEARTBEAT_NS, Monitor, Progress, VALIDITY_NS};
use crate::node::{Joined, Receiver, Sender, TopicNotifier};
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
    out: Out<'a>,
    idle: Idle,
    active: Option<Monitor>,
    counts: Counts,
}

/// Where verdicts go.
#[derive(Debug)]
struct Out<'a> {
    clock: &'a dyn Clock,
    verdicts: Sender<WireVerdict>,
    topic_notifier: TopicNotifier,
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

impl Out<'_> {
    /// Gives a message to the monitor, and publishes what comes of it.
    fn take(
        &mut self,
        monitor: &mut Monitor,
        wire: &WireSample,
        listener: &mut dyn Listener,
    ) -> Progress {
        let now_ns = self.clock.now_ns();
        monitor.take(wire, now_ns, &mut |verdict| self.publish(verdict, listener))
    }

    /// Seals and sends; when.
    fn publish(&mut self, verdict: &mut WireVerdict, listener: &mut dyn Listener) -> i64 {
        let now_ns = self.clock.now_ns();
        verdict.valid_until_ns = now_ns.saturating_add(VALIDITY_NS);
        match self.verdicts.send_at(verdict, now_ns) {
            Ok(_) => self.topic_notifier.ring(),
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
        clock: &'a dyn Clock,
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
                clock,
                verdicts: joined.sender(source, hash)?,
                topic_notifier: joined.topic_notifier::<WireVerdict>()?,
                failed: None,
            },
            idle: Idle::new(clock.now_ns()),
            active: None,
            counts: Counts::default(),
            // The reader last: who sees it may rely on the rest.
            reader: SampleReader::new(joined)?,
        })
    }

    /// Runs until the session is over, or for ever if it stays; until a signal comes in any case.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn run(&mut self, listener: &mut dyn Listener) -> Result<Counts> {
        while interrupt::check().is_ok()
            && listener.wants_more()
            && self.cycle(listener)? == Progress::Running
        {
            self.waiter.wait();
        }
        Ok(self.counts)
    }

    /// Deals with all that waits; whether more is to come.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn cycle(&mut self, listener: &mut dyn Listener) -> Result<Progress> {
        if self.active.is_none() {
            self.look_for_session(listener)?;
        }
        let progress = self.take_samples(listener)?;
        while self.acknowledgements.receive(|_| ())?.is_some() {
            self.active.iter_mut().for_each(Monitor::acknowledge);
        }
        let now_ns = self.out.clock.now_ns();
        if let Some(monitor) = &mut self.active
            && progress == Progress::Running
            && !self.reader.has_producer()
        {
            monitor.note(InputFault::ProducerGone);
            self.counts = monitor.counts();
            self.look_for_session(listener)?;
        }
        let mut publish = |verdict: &mut WireVerdict| self.out.publish(verdict, listener);
        match &mut self.active {
            Some(monitor) => {
                monitor.tick(now_ns, &mut publish);
                self.counts = monitor.counts();
            }
            None => self.idle.tick(now_ns, &mut publish),
        }
        if let Some(error) = self.out.failed.take() {
            return Err(error);
        }
        listener.cycle();
        if progress == Progress::Ended {
            if !self.options.stays {
                return Ok(Progress::Ended);
            }
            self.active = None;
            self.idle = Idle::new(now_ns);
        }
        self.machines.greet()?;
        Ok(Progress::Running)
    }

    /// Takes all samples that wait; whether the session goes on.
    fn take_samples(&mut self, listener: &mut dyn Listener) -> Result<Progress> {
        loop {
            let out = &mut self.out;
            let taken = self.reader.sample(|wire| {
                let followed = self.active.as_mut().filter(|m| m.session() == wire.source);
                // only one that is not followed is copied
                let Some(monitor) = followed else {
                    return Err(*wire);
                };
                Ok(out.take(monitor, wire, listener))
            })?;
            let progress = match taken {
                None => return Ok(Progress::Running),
                Some(Ok(progress)) => progress,
                // a session is announced before its first sample
                Some(Err(foreign)) => {
                    self.look_for_session(listener)?;
                    let out = &mut self.out;
                    let monitor = self.active.as_mut();
                    monitor.map_or(Progress::Running, |m| out.take(m, &foreign, listener))
                }
            };
            if progress == Progress::Ended {
                return Ok(Progress::Ended);
            }
        }
    }

    /// Follows a session that was announced, if it is of this machine.
    fn look_for_session(&mut self, listener: &mut dyn Listener) -> Result<()> {
        let Some(wire) = self.reader.announced()? else {
            return Ok(());
        };
        match (self.begin(&wire, listener), &mut self.active) {
            (Ok(mut monitor), before) => {
                if let Some(before) = before {
                    monitor.succeed(before);
                }
                self.active = Some(monitor);
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
        let monitor = Monitor::new(machine, &sensors, &facts, self.out.clock.now_ns());
        listener.session(&monitor, &session)?;
        self.reader.follow(wire)?;
        Ok(monitor)
    }
}

/// While there is no session: unknown, and soon a fault.
#[derive(Debug)]
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

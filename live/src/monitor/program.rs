//! The monitor between the services of the shared memory.

use anyhow::Result;
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::verdict::{
    Conditions, HeldProblems, InputFault, InputFaults, Level, Verdict,
};

use super::observer::Observer;
use super::session_monitor::Monitor;
use crate::node::{
    ExpiringSender, LiveNode, LoopOptions, Receiver, Sender, SessionFollower, SessionHost, Waiter,
};
use crate::safety_limits::{HEARTBEAT_NS, START_UP_NS};
use crate::system::clock::Clock;
use crate::system::signals;
use crate::wire::identity::new_identity;
use crate::wire::sample::SampleCounts;
use crate::wire::session::{Progress, machine_hash, open_session};
use crate::wire::topics::{WireAcknowledge, WireMachine, WireSample, WireSession, WireVerdict};

/// Follows sessions and publishes verdicts.
#[derive(Debug)]
pub struct MonitorProgram<'a> {
    options: LoopOptions,
    acknowledgements: Receiver<WireAcknowledge>,
    waiter: Waiter,
    outputs: Outputs<'a>,
    idle: Idle,
    counts: SampleCounts,
    follower: SessionFollower<Monitor>,
}

#[derive(Debug)]
struct Outputs<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
    machines: Sender<WireMachine>,
    verdicts: ExpiringSender<'a, WireVerdict>,
}

/// One cycle's view of the program: its outputs, and who observes them.
struct Cycle<'c, 'a> {
    outputs: &'c mut Outputs<'a>,
    observer: &'c mut dyn Observer,
}

impl Cycle<'_, '_> {
    fn publish(&mut self, verdict: &mut WireVerdict) -> i64 {
        let now_ns = self.outputs.verdicts.send(verdict);
        self.observer.verdict(verdict);
        now_ns
    }
}

impl SessionHost for Cycle<'_, '_> {
    type Session = Monitor;

    fn id(monitor: &Monitor) -> u64 {
        monitor.session()
    }

    fn begin(&mut self, announced: &WireSession) -> Result<Monitor> {
        let Outputs { file, urdf, .. } = *self.outputs;
        let (session, machine, sensors) = open_session(announced, file, urdf)?;
        let mut message = WireMachine::new(&machine, session.id)?;
        self.outputs.machines.send(&mut message)?;
        let now_ns = self.outputs.verdicts.now_ns();
        let monitor = Monitor::new(machine, &sensors, &session, now_ns);
        self.observer.session(&monitor, &session)?;
        Ok(monitor)
    }

    fn succeed(&mut self, next: &mut Monitor, before: Monitor) -> Result<()> {
        next.succeed(&before);
        Ok(())
    }

    fn reject(&mut self, running: &mut Monitor, _: &anyhow::Error) {
        running.note(InputFault::WrongMachine);
    }

    fn take(&mut self, monitor: &mut Monitor, sample: &WireSample) -> Result<Progress> {
        let now_ns = self.outputs.verdicts.now_ns();
        Ok(monitor.take(sample, now_ns, &mut |verdict| self.publish(verdict)))
    }
}

impl<'a> MonitorProgram<'a> {
    /// Opens all services.
    ///
    /// # Errors
    /// Another monitor has them, or another version of this program.
    pub fn new(
        node: &LiveNode,
        file: &'a MachineFile,
        urdf: &'a Urdf,
        clock: &'a dyn Clock,
        options: LoopOptions,
    ) -> Result<Self> {
        let hash = machine_hash(file, urdf);
        let source = new_identity(hash);
        Ok(Self {
            options,
            acknowledgements: node.receiver()?,
            waiter: Waiter::new::<WireSample>(node, options.wake)?,
            outputs: Outputs {
                file,
                urdf,
                machines: node.sender(source, hash)?,
                verdicts: ExpiringSender::new(node, source, hash, clock)?,
            },
            idle: Idle::new(clock.now_ns()),
            counts: SampleCounts::default(),
            follower: SessionFollower::new(node)?,
        })
    }

    /// Runs until the session is over, or forever with [`LoopOptions::stays`]; until a signal in any case.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn run(&mut self, observer: &mut dyn Observer) -> Result<SampleCounts> {
        while signals::check().is_ok()
            && observer.wants_more()
            && self.cycle(observer)? == Progress::Running
        {
            self.waiter.wait();
        }
        Ok(self.counts)
    }

    /// Handles everything that waits; returns whether more is to come.
    ///
    /// # Errors
    /// The first session is of another machine, or the shared memory fails.
    pub fn cycle(&mut self, observer: &mut dyn Observer) -> Result<Progress> {
        let follower = &mut self.follower;
        let mut cycle = Cycle {
            outputs: &mut self.outputs,
            observer,
        };
        if follower.active.is_none() {
            follower.look_for_session(&mut cycle)?;
        }
        let progress = follower.take_samples(&mut cycle)?;
        while self.acknowledgements.receive(|_| ())?.is_some() {
            follower.active.iter_mut().for_each(Monitor::acknowledge);
        }
        let now_ns = cycle.outputs.verdicts.now_ns();
        if progress == Progress::Running
            && !follower.has_producer()
            && let Some(monitor) = &mut follower.active
        {
            monitor.note(InputFault::ProducerGone);
            self.counts = monitor.counts();
            follower.look_for_session(&mut cycle)?;
        }
        match &mut follower.active {
            Some(monitor) => {
                monitor.tick(now_ns, &mut |verdict| cycle.publish(verdict));
                self.counts = monitor.counts();
            }
            None => self
                .idle
                .tick(now_ns, &mut |verdict| cycle.publish(verdict)),
        }
        cycle.outputs.verdicts.check()?;
        cycle.observer.cycle();
        if progress == Progress::Ended {
            if !self.options.stays {
                return Ok(Progress::Ended);
            }
            follower.active = None;
            self.idle = Idle::new(now_ns);
        }
        self.outputs.machines.update_connections()?;
        Ok(Progress::Running)
    }
}

/// Without a session the verdict is unknown, and after [`START_UP_NS`] a fault.
#[derive(Debug)]
struct Idle {
    since_ns: i64,
    published_ns: i64,
}

impl Idle {
    fn new(now_ns: i64) -> Self {
        Self {
            since_ns: now_ns,
            published_ns: i64::MIN,
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
            held: HeldProblems {
                faults: conditions.faults,
                ..HeldProblems::default()
            },
        };
        let mut message = WireVerdict::unknown();
        message.set_verdict(verdict, conditions, SampleCounts::default());
        self.published_ns = publish(&mut message);
    }
}

//! The control between the services of the shared memory.

use anyhow::{Context, Result};
use tipwatch_binding::{MachineFile, Urdf};

use super::session_control::Control;
use crate::alarm::{Acknowledged, AlarmSeen};
use crate::node::{
    ExpiringSender, Housekeeping, LiveNode, LoopOptions, Receiver, SessionFollower, SessionHost,
    Waiter,
};
use crate::safety_limits::HEARTBEAT_NS;
use crate::system::clock::Clock;
use crate::system::signals;
use crate::wire::identity::new_identity;
use crate::wire::opening::{Untimed, open_session};
use crate::wire::sample::SampleCounts;
use crate::wire::session::{Progress, machine_hash};
use crate::wire::topics::{WireAcknowledge, WireCommand, WireSample, WireSession, WireVerdict};

/// Follows sessions and publishes valve commands.
#[derive(Debug)]
pub struct ControlProgram<'a> {
    options: LoopOptions,
    verdicts: Receiver<WireVerdict>,
    acknowledgements: Receiver<WireAcknowledge>,
    waiter: Waiter,
    host: Host<'a>,
    /// Time of the last command that was sent without a session (ns).
    idle_ns: i64,
    counts: SampleCounts,
    follower: SessionFollower<Control>,
}

#[derive(Debug)]
struct Host<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
    commands: ExpiringSender<'a, WireCommand>,
    /// The commands that tell of a rod that does not obey.
    faults: AlarmSeen,
    /// The control of the session that was over last: the next one goes on from its rods.
    ended: Option<Box<Control>>,
}

impl Host<'_> {
    /// Sends a command and returns its publication time (ns).
    fn send(&mut self, command: &mut WireCommand) -> i64 {
        let (_, sequence) = self.commands.next();
        self.faults.publish_command(command, sequence);
        self.commands.send(command)
    }
}

impl SessionHost for Host<'_> {
    type Session = Control;

    fn id(control: &Control) -> u64 {
        control.session()
    }

    fn begin(&mut self, announced: &WireSession, _: Option<&Control>) -> Result<Control> {
        // valves never follow a clock that cannot be checked
        let (session, machine, sensors) =
            open_session(announced, self.file, self.urdf, Untimed::Refused)?;
        let mut control = Control::new(machine, &sensors, &session, self.commands.now_ns())
            .with_context(|| self.file.path.display().to_string())?;
        if let Some(ended) = self.ended.take() {
            control.succeed(&ended);
        }
        Ok(control)
    }

    fn succeed(&mut self, next: &mut Control, before: Control) -> Result<()> {
        next.succeed(&before);
        Ok(())
    }

    /// The control stays with the session before, and holds for want of samples.
    fn reject(&mut self, _: &mut Control, _: &anyhow::Error) {}

    fn take(&mut self, control: &mut Control, sample: &WireSample) -> Result<Progress> {
        let now_ns = self.commands.now_ns();
        control.take(sample, now_ns, &mut |command| self.send(command))
    }
}

impl<'a> ControlProgram<'a> {
    /// Opens all services.
    ///
    /// # Errors
    /// Another control has them, or another version of this program.
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
            verdicts: node.receiver()?,
            acknowledgements: node.receiver()?,
            waiter: Waiter::new::<WireSample>(node, options.wake)?,
            host: Host {
                file,
                urdf,
                commands: ExpiringSender::new(node, source, hash, clock)?,
                faults: AlarmSeen::new(source, hash),
                ended: None,
            },
            idle_ns: i64::MIN,
            counts: SampleCounts::default(),
            follower: SessionFollower::new(node)?,
        })
    }

    /// Runs until the session is over, or forever with [`LoopOptions::stays`]; until a signal in any case.
    ///
    /// # Errors
    /// The machine has no active suspension, the first session is of another machine, or the shared
    /// memory fails.
    pub fn run(&mut self, housekeeping: &Housekeeping) -> Result<SampleCounts> {
        while self.cycle(signals::check().is_err())? == Progress::Running {
            housekeeping.cycle_completed();
            self.waiter.wait();
        }
        Ok(self.counts)
    }

    /// Handles everything that waits; returns whether more is to come. Asked to end, it goes on until the
    /// valves are closed.
    ///
    /// # Errors
    /// The machine has no active suspension, the first session is of another machine, or the shared
    /// memory fails.
    pub fn cycle(&mut self, must_end: bool) -> Result<Progress> {
        let (follower, host) = (&mut self.follower, &mut self.host);
        if must_end {
            follower.active.iter_mut().for_each(Control::end);
        } else if follower.active.is_none() {
            follower.look_for_session(host)?;
        }
        // of all verdicts that wait the last one counts
        self.verdicts.receive_all(|verdict| {
            let controls = follower.active.iter_mut();
            controls.for_each(|control| control.verdict(verdict));
        })?;
        if follower.take_samples(host)? == Progress::Ended {
            follower.active.iter_mut().for_each(Control::end);
        } else if follower.has_lost_producer() {
            // a killed producer has not ended its session: the next one has another
            follower.look_for_session(host)?;
        }
        let (_, next) = host.commands.next();
        let is_of_a_fault =
            |by: &WireAcknowledge| host.faults.acknowledged(by, next) == Some(Acknowledged::Alarm);
        while let Some(counts) = self.acknowledgements.receive(is_of_a_fault)? {
            let counting = follower.active.iter_mut().filter(|_| counts);
            counting.for_each(Control::acknowledge);
        }
        let now_ns = host.commands.now_ns();
        match &mut follower.active {
            Some(control) => {
                control.tick(now_ns, &mut |command| host.send(command));
                self.counts = control.counts();
            }
            // whoever waits for a first command gets one
            None if now_ns.saturating_sub(self.idle_ns) >= HEARTBEAT_NS => {
                self.idle_ns = host.send(&mut WireCommand::closed());
            }
            None => {}
        }
        host.commands.check()?;
        let is_done = follower.active.as_ref().is_some_and(Control::is_done);
        if is_done {
            host.ended = follower.active.take().map(Box::new);
        }
        let is_last = is_done && !self.options.stays || must_end && follower.active.is_none();
        Ok(if is_last {
            Progress::Ended
        } else {
            Progress::Running
        })
    }
}

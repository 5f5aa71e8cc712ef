//! The control's loop: from shared memory to shared memory.

use anyhow::{Context, Result};
use tipwatch_binding::{MachineFile, Urdf};

use crate::clock::Clock;
use crate::control::Control;
use crate::guard::Counts;
use crate::identity::new_identity;
use crate::interrupt;
use crate::monitor::{HEARTBEAT_NS, Progress, VALIDITY_NS};
use crate::node::{Joined, Receiver, Sender, TopicNotifier};
use crate::sample_reader::SampleReader;
use crate::session::{Session, machine_hash};
use crate::topics::{WireAcknowledge, WireCommand, WireSample, WireSession, WireVerdict};
use crate::wake::{Waiter, Wake};
use crate::watch_over::WatchOver;

/// How a control runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControlOptions {
    /// How it waits for samples.
    pub wake: Wake,
    /// Whether it waits for the next session when one is over.
    pub stays: bool,
}

/// The control's ends of the shared memory.
#[derive(Debug)]
pub struct ControlLoop<'a> {
    file: &'a MachineFile,
    urdf: &'a Urdf,
    options: ControlOptions,
    verdicts: Receiver<WireVerdict>,
    acknowledgements: Receiver<WireAcknowledge>,
    waiter: Waiter,
    out: Out<'a>,
    /// When the last command was sent without a session (ns).
    idle_ns: i64,
    reader: SampleReader,
    active: Option<Control>,
    counts: Counts,
}

/// Where commands go.
#[derive(Debug)]
struct Out<'a> {
    clock: &'a dyn Clock,
    commands: Sender<WireCommand>,
    topic_notifier: TopicNotifier,
    failed: Option<anyhow::Error>,
}

impl Out<'_> {
    fn send(&mut self, command: &mut WireCommand) -> i64 {
        let now_ns = self.clock.now_ns();
        command.valid_until_ns = now_ns.saturating_add(VALIDITY_NS);
        match self.commands.send_at(command, now_ns) {
            Ok(_) => self.topic_notifier.ring(),
            Err(error) => {
                self.failed.get_or_insert(error);
            }
        }
        now_ns
    }
}

impl<'a> ControlLoop<'a> {
    /// Opens all services.
    ///
    /// # Errors
    /// Another control has them, or another version of this program.
    pub fn new(
        joined: &Joined,
        file: &'a MachineFile,
        urdf: &'a Urdf,
        clock: &'a dyn Clock,
        options: ControlOptions,
    ) -> Result<Self> {
        let hash = machine_hash(file, urdf);
        Ok(Self {
            file,
            urdf,
            options,
            verdicts: joined.receiver()?,
            acknowledgements: joined.receiver()?,
            waiter: Waiter::new::<WireSample>(joined, options.wake)?,
            out: Out {
                clock,
                commands: joined.sender(new_identity(hash), hash)?,
                topic_notifier: joined.topic_notifier::<WireCommand>()?,
                failed: None,
            },
            idle_ns: i64::MIN,
            // The reader last: who sees it may rely on the rest.
            reader: SampleReader::new(joined)?,
            active: None,
            counts: Counts::default(),
        })
    }

    /// Runs until the session is over, or for ever if it stays; until a signal comes in any case.
    ///
    /// # Errors
    /// The machine has no suspension that can be steered, the first session is of another machine, or the
    /// shared memory fails.
    pub fn run(&mut self, watch_over: &WatchOver) -> Result<Counts> {
        while self.cycle(interrupt::check().is_err())? == Progress::Running {
            watch_over.cycle_is_done();
            self.waiter.wait();
        }
        Ok(self.counts)
    }

    /// Deals with all that waits; whether more is to come. Told to end, it goes on until the valves are
    /// closed.
    ///
    /// # Errors
    /// As of [`Self::run`].
    pub fn cycle(&mut self, is_told_to_end: bool) -> Result<Progress> {
        if is_told_to_end {
            self.active.iter_mut().for_each(Control::end);
        } else if self.active.is_none() {
            self.look_for_session()?;
        }
        self.take_verdicts()?;
        if self.take_samples()? == Progress::Ended {
            self.active.iter_mut().for_each(Control::end);
        }
        self.take_acknowledgements()?;
        let now_ns = self.out.clock.now_ns();
        let out = &mut self.out;
        match &mut self.active {
            Some(control) => {
                control.tick(now_ns, &mut |command| out.send(command));
                self.counts = control.counts();
            }
            // nobody waits for a first command in vain
            None if now_ns.saturating_sub(self.idle_ns) >= HEARTBEAT_NS => {
                self.idle_ns = out.send(&mut WireCommand::closed());
            }
            None => {}
        }
        if let Some(error) = self.out.failed.take() {
            return Err(error);
        }
        let is_done = self.active.as_ref().is_some_and(Control::is_done);
        if is_done {
            self.active = None;
        }
        let is_last = is_done && !self.options.stays || is_told_to_end && self.active.is_none();
        Ok(if is_last {
            Progress::Ended
        } else {
            Progress::Running
        })
    }

    /// Takes all verdicts that wait: the last one counts.
    fn take_verdicts(&mut self) -> Result<()> {
        let active = &mut self.active;
        let mut take = |wire: &WireVerdict| {
            if let Some(control) = active {
                control.verdict(wire);
            }
        };
        while self.verdicts.receive(&mut take)?.is_some() {}
        Ok(())
    }

    fn take_acknowledgements(&mut self) -> Result<()> {
        while self.acknowledgements.receive(|_| ())?.is_some() {
            self.active.iter_mut().for_each(Control::acknowledge);
        }
        Ok(())
    }

    /// Takes all samples that wait; whether the session goes on.
    fn take_samples(&mut self) -> Result<Progress> {
        while let Some(wire) = self.reader.sample(|wire| *wire)? {
            let follows = |control: &Control| control.session() == wire.source;
            if !self.active.as_ref().is_some_and(follows) {
                // a session is announced before its first sample
                self.look_for_session()?;
            }
            let (now_ns, out) = (self.out.clock.now_ns(), &mut self.out);
            let mut send = |command: &mut WireCommand| out.send(command);
            if let Some(control) = &mut self.active
                && control.take(&wire, now_ns, &mut send)? == Progress::Ended
            {
                return Ok(Progress::Ended);
            }
        }
        // a producer that was killed has not ended its session: the next one has another
        if self.active.is_some() && !self.reader.has_producer() {
            self.look_for_session()?;
        }
        Ok(Progress::Running)
    }

    /// Follows a session that was announced. One of another machine is an error before the first; later the
    /// control stays with what it has, and holds for want of samples.
    fn look_for_session(&mut self) -> Result<()> {
        let Some(wire) = self.reader.announced()? else {
            return Ok(());
        };
        match (self.begin(&wire), &self.active) {
            (Ok(mut control), before) => {
                before.iter().for_each(|before| control.succeed(before));
                self.active = Some(control);
                self.reader.follow(&wire)
            }
            (Err(_), Some(_)) => Ok(()),
            (Err(error), None) => Err(error),
        }
    }

    fn begin(&self, wire: &WireSession) -> Result<Control> {
        let session = Session::try_from(wire)?;
        let (machine, sensors) = session.machine(self.file, self.urdf)?;
        let facts = session.facts(&machine);
        Control::new(machine, &sensors, &facts, self.out.clock.now_ns())
            .with_context(|| self.file.path.display().to_string())
    }
}

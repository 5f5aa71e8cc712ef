//! The recorder between the shared memory and its files.

use std::time::{Duration, Instant};

use anyhow::Result;
use tipwatch_binding::{MachineFile, Urdf};

use super::clip_list::adopt_all;
use super::repair::repair_all;
use super::session_recorder::{RecordOptions, RecordingPlace, SessionRecorder};
use super::writer::RecordCounts;
use crate::node::{LiveNode, Receiver, SessionFollower, SessionHost, pause};
use crate::system::signals;
use crate::system::supervisor::Supervisor;
use crate::wire::session::Progress;
use crate::wire::topics::{WireCommand, WireMachine, WireSample, WireSession, WireVerdict};

/// The wait between two looks at the shared memory.
const POLL_PERIOD: Duration = Duration::from_millis(2);
/// Samples taken before verdicts are: so the queue of neither overflows.
const SAMPLES_AT_ONCE: usize = 256;
/// Longest wait for the last verdicts of a session.
const LAST_VERDICTS: Duration = Duration::from_millis(500);
/// Time that a session may be without its producer before it is over: the end was sent before this recorder joined, or never.
const PRODUCER_GONE: Duration = Duration::from_secs(2);
/// Period at which the nodes of dead processes are removed.
const DEAD_NODE_CHECK: Duration = Duration::from_millis(500);

/// Records a session, or sessions until a signal comes.
///
/// # Errors
/// The first session is of another machine, the shared memory fails, or no file can be created.
pub fn record(
    node: &LiveNode,
    file: &MachineFile,
    urdf: &Urdf,
    options: &RecordOptions,
) -> Result<RecordCounts> {
    repair_all(&options.folder);
    if let Some(clips) = &options.clips {
        adopt_all(&options.folder);
        let conditions: Vec<_> = clips.on.iter().map(|trigger| trigger.name()).collect();
        eprintln!(
            "record: black box on {}: the last {} s of a session in memory, at most {} MiB",
            conditions.join(", "),
            clips.before.as_secs_f64(),
            clips.ring_bytes >> 20
        );
    }
    let mut recorder = Recorder {
        verdicts: node.receiver()?,
        commands: node.receiver()?,
        machines: node.receiver()?,
        machine: None,
        supervisor: Supervisor::from_environment(),
        host: Host {
            place: RecordingPlace {
                file,
                urdf,
                options,
            },
            total: RecordCounts::default(),
        },
        follower: SessionFollower::new(node)?,
        node,
        checked: Instant::now(),
    };
    let ran = recorder.run();
    let closed = recorder.close();
    ran.and(closed)?;
    let samples_unannounced = recorder.follower.unannounced();
    Ok(RecordCounts {
        samples_unannounced,
        ..recorder.host.total
    })
}

struct Recorder<'a> {
    node: &'a LiveNode,
    verdicts: Receiver<WireVerdict>,
    commands: Receiver<WireCommand>,
    machines: Receiver<WireMachine>,
    /// The monitor's last description of itself, perhaps sent before its session was followed here.
    machine: Option<WireMachine>,
    supervisor: Option<Supervisor>,
    host: Host<'a>,
    follower: SessionFollower<SessionRecorder>,
    checked: Instant,
}

struct Host<'a> {
    place: RecordingPlace<'a>,
    total: RecordCounts,
}

impl SessionHost for Host<'_> {
    type Session = SessionRecorder;

    fn id(session: &SessionRecorder) -> u64 {
        session.id()
    }

    fn begin(
        &mut self,
        announced: &WireSession,
        _: Option<&SessionRecorder>,
    ) -> Result<SessionRecorder> {
        SessionRecorder::begin(self.place, announced)
    }

    fn succeed(&mut self, _: &mut SessionRecorder, before: SessionRecorder) -> Result<()> {
        self.close(before)
    }

    fn refuse(&mut self, error: anyhow::Error) -> Result<()> {
        if !self.place.options.stays {
            return Err(error);
        }
        self.tell_refused(&error);
        Ok(())
    }

    fn reject(&mut self, _: &mut SessionRecorder, error: &anyhow::Error) {
        self.tell_refused(error);
    }

    fn take(&mut self, session: &mut SessionRecorder, sample: &WireSample) -> Result<Progress> {
        Ok(session.sample(sample))
    }
}

impl Host<'_> {
    fn tell_refused(&mut self, error: &anyhow::Error) {
        self.total.sessions_refused += 1;
        eprintln!("record: a session was not recorded: {error:#}");
    }

    /// Ends the files of a session.
    fn close(&mut self, session: SessionRecorder) -> Result<()> {
        self.total.sessions += 1;
        self.total.add(&session.close()?);
        Ok(())
    }
}

impl Recorder<'_> {
    fn run(&mut self) -> Result<()> {
        // the session that has ended, and when something of it last came
        let mut ended: Option<(u64, Instant)> = None;
        let mut gone: Option<Instant> = None;
        while signals::check().is_ok() {
            if self.follower.active.is_none() {
                self.follower.look_for_session(&mut self.host)?;
            }
            // what follows the end belongs to another session
            let is_over = ended.is_some() && !self.host.place.options.stays;
            let progress = match is_over {
                true => Progress::Running,
                false => self.take_samples()?,
            };
            self.take_machine()?;
            let outputs = self.take_verdicts()? + self.take_commands()?;
            let active = self.follower.active.as_ref().map(SessionRecorder::id);
            // a new session has taken the place of the one that ended
            ended = ended.filter(|(session, _)| active == Some(*session));
            if progress == Progress::Ended || (outputs > 0 && ended.is_some()) {
                ended = active.map(|session| (session, Instant::now()));
            }
            if self.has_lost_producer(&mut gone) && ended.is_none() && active.is_some() {
                eprintln!("record: the producer is gone without the end of its session");
                ended = active.map(|session| (session, Instant::now()));
            }
            let is_quiet = ended.is_some_and(|(_, at)| {
                at.elapsed() >= LAST_VERDICTS || (self.verdicts.writers() == 0 && outputs == 0)
            });
            if is_quiet {
                self.close()?;
                ended = None;
                if !self.host.place.options.stays {
                    return Ok(());
                }
            }
            if self.checked.elapsed() >= DEAD_NODE_CHECK {
                self.checked = Instant::now();
                self.node.remove_dead_nodes();
            }
            self.cycle_completed();
            if pause(POLL_PERIOD).is_err() {
                break;
            }
        }
        Ok(())
    }

    /// Tells the supervisor that the loop works: the first time with all services open.
    fn cycle_completed(&mut self) {
        self.supervisor
            .iter_mut()
            .for_each(Supervisor::cycle_completed);
    }

    /// Takes what the monitor says about itself.
    fn take_machine(&mut self) -> Result<()> {
        while let Some(machine) = self.machines.receive(|machine| *machine)? {
            self.machine = Some(machine);
        }
        if let (Some(machine), Some(session)) = (&self.machine, &mut self.follower.active) {
            session.machine(machine);
        }
        Ok(())
    }

    /// Whether the session's producer has been gone for long. The end of the session reaches only readers that joined
    /// before it was sent, and a producer that is killed sends none.
    fn has_lost_producer(&self, gone: &mut Option<Instant>) -> bool {
        if !self.follower.has_lost_producer() {
            *gone = None;
            return false;
        }
        gone.get_or_insert_with(Instant::now).elapsed() >= PRODUCER_GONE
    }

    fn take_samples(&mut self) -> Result<Progress> {
        for _ in 0..SAMPLES_AT_ONCE {
            match self.follower.take_sample(&mut self.host)? {
                None => break,
                Some(Progress::Ended) => return Ok(Progress::Ended),
                Some(Progress::Running) => {}
            }
            // a replay can wait, and then nothing is dropped
            while self
                .follower
                .active
                .as_ref()
                .is_some_and(SessionRecorder::must_wait)
                && signals::check().is_ok()
            {
                self.cycle_completed();
                std::thread::sleep(POLL_PERIOD);
            }
        }
        Ok(Progress::Running)
    }

    /// Takes all verdicts; returns how many were recorded.
    fn take_verdicts(&mut self) -> Result<usize> {
        let active = &mut self.follower.active;
        let mut take = |wire: &WireVerdict| active.as_mut().is_some_and(|s| s.verdict(wire));
        let mut count = 0;
        while let Some(is_recorded) = self.verdicts.receive(&mut take)? {
            count += usize::from(is_recorded);
        }
        Ok(count)
    }

    /// Takes all commands; returns how many were recorded.
    fn take_commands(&mut self) -> Result<usize> {
        let active = &mut self.follower.active;
        let mut take = |wire: &WireCommand| active.as_mut().is_some_and(|s| s.command(wire));
        let mut count = 0;
        while let Some(is_recorded) = self.commands.receive(&mut take)? {
            count += usize::from(is_recorded);
        }
        Ok(count)
    }

    fn close(&mut self) -> Result<()> {
        let active = self.follower.active.take();
        active.map_or(Ok(()), |session| self.host.close(session))
    }
}

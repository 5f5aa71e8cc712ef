//! The recorder: samples and verdicts of a session into MCAP files that replay, and that
//! `tipwatch analyze --estimator causal` reproduces.
//!
//! ```text
//!     shared memory -> this thread: what the monitor uses -> pending -> writer -> sync
//!                      checks, encodes                       64 MiB     8 ms      200 ms, at once after
//!                                                                                 an alarm
//! ```
//! Nobody waits for it: it is a reader with a queue of two seconds, and what it misses stands in the
//! file as a gap.

mod cdr;
mod encode;
mod pending;
mod retention;
mod segment;
mod sync;
mod topics;
mod writer;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use tipwatch_binding::{MachineFile, Urdf, monitor_topic};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::state::{Sensor, Sensors};

use crate::clock::{monotonic_ns, unix_ns};
use crate::command::Mode;
use crate::guard::Guard;
use crate::interrupt;
use crate::names::Names;
use crate::node::{Joined, Receiver, pause};
use crate::sample::Message;
use crate::sample_reader::SampleReader;
use crate::session::Session;
use crate::topics::{
    EVENT_ROW, Wire, WireCommand, WireMachine, WireSample, WireSession, WireVerdict,
};
use pending::{Encoded, Kind, Pending};
use retention::Retention;
use segment::{Channels, Preamble};
pub use writer::RecordCounts;
use writer::{FileWriter, Plan};

/// The wait between two looks at the shared memory.
const POLL_PERIOD: Duration = Duration::from_millis(2);
/// Samples taken before verdicts are: the queue of neither overflows.
const SAMPLES_AT_ONCE: usize = 256;
/// How long the last verdicts of a session may take.
const LAST_VERDICTS: Duration = Duration::from_millis(500);
/// How often dead processes are looked for.
const DEAD_CHECK_PERIOD: Duration = Duration::from_millis(500);

/// Where and how to record.
#[derive(Debug, Clone)]
pub struct RecordOptions {
    /// A folder of its own in this one for each session.
    pub folder: PathBuf,
    /// How long a file is.
    pub split: Duration,
    /// How many bytes all files may have; the oldest are removed.
    pub keep_bytes: Option<u64>,
    /// Whether to wait for the next session when one is over.
    pub stays: bool,
}

/// Records a session, or sessions until a signal comes.
///
/// # Errors
/// The first session is of another machine, the shared memory fails, or no file can be made.
pub fn record(
    joined: &Joined,
    file: &MachineFile,
    urdf: &Urdf,
    options: &RecordOptions,
) -> Result<RecordCounts> {
    let mut recorder = Recorder {
        verdicts: joined.receiver()?,
        commands: joined.receiver()?,
        reader: SampleReader::new(joined)?,
        joined,
        file,
        urdf,
        options,
        active: None,
        total: RecordCounts::default(),
        checked: Instant::now(),
    };
    let ran = recorder.run();
    let closed = recorder.close();
    ran.and(closed)?;
    Ok(recorder.total)
}

struct Recorder<'a> {
    joined: &'a Joined,
    reader: SampleReader,
    verdicts: Receiver<WireVerdict>,
    commands: Receiver<WireCommand>,
    file: &'a MachineFile,
    urdf: &'a Urdf,
    options: &'a RecordOptions,
    active: Option<Active>,
    total: RecordCounts,
    checked: Instant,
}

/// A session being recorded.
struct Active {
    session: Session,
    sensors: Vec<Sensor>,
    guard: Guard,
    names: Names,
    pending: Arc<Pending>,
    ends: Arc<AtomicBool>,
    thread: JoinHandle<Result<RecordCounts>>,
    last_log_ns: i64,
    /// From CLOCK_MONOTONIC to time of day (ns).
    unix_offset_ns: i64,
    lost: u64,
    /// Source and sequence number of the next verdict.
    next_verdict: Option<(u64, u64)>,
    levels: [u32; 2],
    /// Source and sequence number of the next command.
    next_command: Option<(u64, u64)>,
    /// What the last command does, and why.
    modes: [u32; 2],
}

impl Recorder<'_> {
    fn run(&mut self) -> Result<()> {
        let mut ended: Option<Instant> = None;
        while interrupt::check().is_ok() {
            if self.active.is_none() && ended.is_none() {
                self.look_for_session()?;
            }
            let is_over = self.take_samples()?;
            let verdicts = self.take_verdicts()? + self.take_commands()?;
            if is_over || (verdicts > 0 && ended.is_some()) {
                ended = Some(Instant::now());
            }
            let is_quiet = ended.is_some_and(|at| {
                at.elapsed() >= LAST_VERDICTS || (self.verdicts.writers() == 0 && verdicts == 0)
            });
            if is_quiet {
                self.close()?;
                ended = None;
                if !self.options.stays {
                    return Ok(());
                }
            }
            self.check_dead()?;
            if pause(POLL_PERIOD).is_err() {
                break;
            }
        }
        Ok(())
    }

    /// Takes samples; whether the session is over.
    fn take_samples(&mut self) -> Result<bool> {
        for _ in 0..SAMPLES_AT_ONCE {
            let active = &mut self.active;
            let taken = self.reader.sample(|wire| {
                let followed = active.as_mut().filter(|a| a.session.id == wire.source);
                followed.map_or(Err(*wire), |active| Ok(active.sample(wire)))
            })?;
            match taken {
                None => return Ok(false),
                Some(Ok(true)) => return Ok(true),
                Some(Ok(false)) => {}
                Some(Err(foreign)) => {
                    self.look_for_session()?;
                    if let Some(active) = &mut self.active
                        && active.sample(&foreign)
                    {
                        return Ok(true);
                    }
                }
            }
            // a replay can wait, and then nothing is dropped
            if let Some(active) = self.active.as_ref().filter(|a| a.session.wants_progress) {
                while active.pending.is_full() && interrupt::check().is_ok() {
                    std::thread::sleep(POLL_PERIOD);
                }
            }
        }
        Ok(false)
    }

    /// Takes all verdicts; how many were recorded.
    fn take_verdicts(&mut self) -> Result<usize> {
        let mut count = 0;
        let active = &mut self.active;
        while let Some(is_recorded) = self
            .verdicts
            .receive(|wire| active.as_mut().is_some_and(|active| active.verdict(wire)))?
        {
            count += usize::from(is_recorded);
        }
        Ok(count)
    }

    /// Takes all commands; how many were recorded.
    fn take_commands(&mut self) -> Result<usize> {
        let mut count = 0;
        let active = &mut self.active;
        while let Some(is_recorded) = self
            .commands
            .receive(|wire| active.as_mut().is_some_and(|active| active.command(wire)))?
        {
            count += usize::from(is_recorded);
        }
        Ok(count)
    }

    fn look_for_session(&mut self) -> Result<()> {
        let Some(wire) = self.reader.announced()? else {
            return Ok(());
        };
        match (self.begin(&wire), self.active.is_some()) {
            (Ok(active), _) => {
                self.close()?;
                self.active = Some(active);
                self.reader.follow(&wire)
            }
            (Err(error), false) => Err(error),
            (Err(error), true) => {
                eprintln!("record: a session was not recorded: {error:#}");
                Ok(())
            }
        }
    }

    fn begin(&mut self, wire: &WireSession) -> Result<Active> {
        let session = Session::try_from(wire)?;
        let (machine, sensors) = session.machine(self.file, self.urdf)?;
        let names = Names::try_from(&WireMachine::new(&machine, session.id)?)?;
        let facts = session.facts(&machine);
        let begun_ns = unix_ns();
        let folder = self.options.folder.join(folder_name(begun_ns, session.id));
        let plan = Plan {
            preamble: preamble(
                self.file, self.urdf, &session, &machine, &sensors, &names, begun_ns,
            ),
            split: self.options.split,
            retention: Retention::new(&self.options.folder, self.options.keep_bytes),
            folder: folder.clone(),
        };
        let pending = Arc::new(Pending::default());
        let ends = Arc::new(AtomicBool::new(false));
        let (begun, begins) = std::sync::mpsc::channel();
        let thread = {
            let (pending, ends) = (Arc::clone(&pending), Arc::clone(&ends));
            // the writer stays in the thread that made it
            std::thread::Builder::new().name("write".into()).spawn(
                move || match FileWriter::begin(plan, pending) {
                    Ok(writer) => {
                        let _ = begun.send(Ok(()));
                        writer.run(&ends)
                    }
                    Err(error) => {
                        let _ = begun.send(Err(error));
                        Ok(RecordCounts::default())
                    }
                },
            )?
        };
        begins
            .recv()
            .context("record: the writer has ended")?
            .with_context(|| format!("{}: cannot be recorded into", folder.display()))?;
        eprintln!("record: {}", folder.display());
        Ok(Active {
            guard: Guard::new(&facts, &sensors, monotonic_ns()),
            sensors: sensors.iter().collect(),
            session,
            names,
            pending,
            ends,
            thread,
            last_log_ns: 0,
            unix_offset_ns: unix_ns() - monotonic_ns(),
            lost: 0,
            next_verdict: None,
            levels: [0; 2],
            next_command: None,
            modes: [0; 2],
        })
    }

    /// Ends the files of the session, if there is one.
    fn close(&mut self) -> Result<()> {
        let Some(active) = self.active.take() else {
            return Ok(());
        };
        active.ends.store(true, Ordering::Release);
        let counts = active
            .thread
            .join()
            .map_err(|_| anyhow!("record: the writer has failed"))??;
        self.total.samples += counts.samples;
        self.total.verdicts += counts.verdicts;
        self.total.commands += counts.commands;
        self.total.samples_lost += counts.samples_lost;
        self.total.verdicts_lost += counts.verdicts_lost;
        self.total.samples_refused += active.guard.counts().refused;
        Ok(())
    }

    fn check_dead(&mut self) -> Result<()> {
        if self.checked.elapsed() >= DEAD_CHECK_PERIOD {
            self.checked = Instant::now();
            self.joined.forget_the_dead();
        }
        Ok(())
    }
}

impl Active {
    /// Takes a sample; whether the session is over.
    fn sample(&mut self, wire: &WireSample) -> bool {
        let admitted = self.guard.admit(wire, monotonic_ns());
        let lost = self.guard.counts().lost;
        if lost > self.lost {
            self.pending.note_dropped(lost - self.lost, 0);
            self.lost = lost;
        }
        let sample = match admitted {
            Ok(Message::Sample(sample)) => sample,
            Ok(Message::End) => return true,
            Err(_) => return false,
        };
        let Some(place) = self.sensors.iter().position(|s| *s == sample.sensor) else {
            return false;
        };
        let no_joints = Vec::new();
        let joints = match sample.sensor {
            Sensor::Joints(stream) => self.session.streams.get(stream).unwrap_or(&no_joints),
            _ => &no_joints,
        };
        let frame = self.session.imu_frame.as_deref().unwrap_or("");
        let data = encode::sample(&sample, joints, frame);
        self.push(Kind::Sample(place), wire.sequence, wire.published_ns, data);
        false
    }

    /// Takes a verdict; whether it tells anything.
    fn verdict(&mut self, wire: &WireVerdict) -> bool {
        if wire.session != self.session.id || !wire.is_whole() {
            return false;
        }
        if let Some((source, next)) = self.next_verdict
            && source == wire.source
            && wire.sequence > next
        {
            self.pending.note_dropped(0, wire.sequence - next);
        }
        self.next_verdict = Some((wire.source, wire.sequence.saturating_add(1)));
        let levels = [wire.level, wire.latched_level];
        let is_new = std::mem::replace(&mut self.levels, levels) != levels;
        // what repeats the row before tells nothing
        let tells = wire.event == EVENT_ROW || is_new;
        if tells {
            let data = encode::verdict(wire, &self.names);
            let kind = Kind::Verdict { is_new };
            self.push(kind, wire.sequence, wire.published_ns, data);
        }
        tells
    }

    /// Takes a command; whether it tells anything.
    fn command(&mut self, wire: &WireCommand) -> bool {
        if wire.session != self.session.id || !wire.is_whole() {
            return false;
        }
        if let Some((source, next)) = self.next_command
            && source == wire.source
            && wire.sequence > next
        {
            self.pending.note_dropped(0, wire.sequence - next);
        }
        self.next_command = Some((wire.source, wire.sequence.saturating_add(1)));
        let modes = [wire.mode, wire.reasons];
        let is_new = std::mem::replace(&mut self.modes, modes) != modes;
        let tells = wire.event == EVENT_ROW || is_new || wire.mode() == Mode::Ramp;
        if tells {
            let data = encode::command(wire);
            let (sequence, published_ns) = (wire.sequence, wire.published_ns);
            self.push(Kind::Command, sequence, published_ns, data);
        }
        tells
    }

    fn push(&mut self, kind: Kind, sequence: u64, published_ns: i64, data: Vec<u8>) {
        // When it was published, not when this program got to it; never in the future, and in the order in
        // which they came, whatever the time of day does.
        let publish_time_ns = published_ns.saturating_add(self.unix_offset_ns);
        let now_ns = monotonic_ns().saturating_add(self.unix_offset_ns);
        self.last_log_ns = publish_time_ns.min(now_ns).max(self.last_log_ns + 1);
        self.pending.push(Encoded {
            kind,
            sequence: sequence as u32,
            log_time_ns: self.last_log_ns,
            publish_time_ns,
            data,
        });
    }
}

fn preamble(
    file: &MachineFile,
    urdf: &Urdf,
    session: &Session,
    machine: &Machine,
    sensors: &Sensors,
    names: &Names,
    begun_ns: i64,
) -> Preamble {
    let mut topics: Vec<_> = sensors
        .iter()
        .map(|sensor| match sensor {
            Sensor::Joints(stream) => topics::joint_states(stream),
            Sensor::Imu => topics::imu(),
            Sensor::Odometry => topics::odometry(),
            Sensor::ToolWrench => topics::tool_wrench(),
            Sensor::Actuator(signal) => topics::actuator(actuator_topic(machine, sensors, signal)),
        })
        .collect();
    let channels = Channels {
        verdicts: topics.len(),
        commands: topics.len() + 1,
        gaps: topics.len() + 2,
    };
    topics.extend([topics::verdict(names), topics::command(), topics::gap()]);
    let metadata = BTreeMap::from([
        ("version".into(), env!("CARGO_PKG_VERSION").into()),
        ("session".into(), format!("{:016x}", session.id)),
        (
            "machine_hash".into(),
            format!("{:016x}", session.machine_hash),
        ),
        ("pace".into(), session.pace.to_string()),
        ("wheels".into(), names.wheels.join(" ")),
        ("edges".into(), names.edges.join(" ")),
    ]);
    let name = |path: &str| {
        let path = std::path::Path::new(path);
        path.file_name().map_or_else(
            || "machine".into(),
            |name| name.to_string_lossy().into_owned(),
        )
    };
    Preamble {
        topics,
        channels,
        attachments: [
            (name(&file.path.to_string_lossy()), file.text.clone()),
            (name(&urdf.name), urdf.text.clone()),
        ],
        metadata,
        begun_ns,
    }
}

/// Topic of a signal of an actuator's force.
fn actuator_topic(machine: &Machine, sensors: &Sensors, signal: usize) -> String {
    let signal = sensors.actuators[signal];
    let joint = &machine.contact().actuated_joints[signal.joint];
    let linkage = &machine.linkages()[joint.linkage].name;
    match (joint.signals.len(), signal.signal) {
        (1, _) => monitor_topic::force(linkage),
        (_, 0) => monitor_topic::piston_pressure(linkage),
        _ => monitor_topic::rod_pressure(linkage),
    }
}

/// The time of day as names of files have it, and the session.
fn folder_name(begun_ns: i64, session: u64) -> String {
    let time = jiff::Timestamp::from_nanosecond(begun_ns.into()).unwrap_or_default();
    format!("{}-{:08x}", time.strftime("%Y%m%dT%H%M%SZ"), session >> 32)
}

//! Records one session: checks and encodes what the files keep, and hands it to the writer.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::state::Sensor;

use super::clip_writer::{ClipOptions, ClipWriter};
use super::encode;
use super::folder;
use super::pending::{Encoded, Kind, Pending};
use super::preamble::preamble;
use super::retention::Retention;
use super::trigger::TriggerWatch;
use super::writer::{FileWriter, Plan, RecordCounts};
use crate::guard::{Admitted, Guard};
use crate::system::clock::{monotonic_ns, unix_ns};
use crate::wire::command::Mode;
use crate::wire::fingerprint::Fingerprint;
use crate::wire::names::Names;
use crate::wire::opening::{Untimed, open_session};
use crate::wire::session::{Progress, Session};
use crate::wire::topics::{
    EVENT_ROW, Wire, WireCommand, WireMachine, WireSample, WireSession, WireVerdict,
};

/// Options of a recorder.
#[derive(Debug, Clone)]
pub struct RecordOptions {
    /// Each session gets a folder of its own in this one.
    pub folder: PathBuf,
    /// Time that a file covers before the next one begins.
    pub split: Duration,
    /// Most bytes of all files together: the oldest files are removed beyond it; `None` for no limit.
    pub keep_bytes: Option<u64>,
    /// Whether to wait for the next session when one is over.
    pub stays: bool,
    /// Fingerprint of the recorder: its version, executable, options and files.
    pub fingerprint: Fingerprint,
    /// Keep clips around triggers only, instead of everything.
    pub clips: Option<ClipOptions>,
}

/// Machine and options, which are the same for all sessions of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecordingPlace<'a> {
    pub(super) file: &'a MachineFile,
    pub(super) urdf: &'a Urdf,
    pub(super) options: &'a RecordOptions,
}

/// Destination of the messages: files of the whole session, or clips.
enum Target {
    Files(Box<FileWriter>),
    Clips(Box<ClipWriter>),
}

impl Target {
    fn begin(
        plan: Plan,
        clips: Option<ClipOptions>,
        pace: f64,
        pending: Arc<Pending>,
    ) -> Result<Self> {
        Ok(match clips {
            None => Self::Files(FileWriter::begin(plan, pending)?.into()),
            Some(clips) => Self::Clips(ClipWriter::begin(plan, clips, pace, pending)?.into()),
        })
    }

    fn run(self, ends: &AtomicBool) -> Result<RecordCounts> {
        match self {
            Self::Files(writer) => writer.run(ends),
            Self::Clips(writer) => Ok(writer.run(ends)),
        }
    }
}

/// A session being recorded.
pub(super) struct SessionRecorder {
    session: Session,
    sensors: Vec<Sensor>,
    guard: Guard,
    names: Names,
    pending: Arc<Pending>,
    ends: Arc<AtomicBool>,
    thread: JoinHandle<Result<RecordCounts>>,
    last_log_ns: i64,
    /// The largest stamp of a sample (ns).
    last_stamp_ns: i64,
    triggers: TriggerWatch,
    /// Offset from CLOCK_MONOTONIC to the time of day (ns).
    unix_offset_ns: i64,
    lost: u64,
    /// Source and sequence number of the next verdict.
    next_verdict: Option<(u64, u64)>,
    levels: [u32; 2],
    /// Source and sequence number of the next command.
    next_command: Option<(u64, u64)>,
    /// Mode and reasons of the last command.
    modes: [u32; 2],
    /// The run of the monitor whose fingerprint was taken.
    program: Option<u64>,
    /// That fingerprint, until the next message gives it a time: the monitor may have published it long before.
    fingerprint: Option<Vec<u8>>,
}

impl SessionRecorder {
    pub(super) fn begin(place: RecordingPlace<'_>, announced: &WireSession) -> Result<Self> {
        let RecordingPlace {
            file,
            urdf,
            options,
        } = place;
        let (session, machine, sensors) = open_session(announced, file, urdf, Untimed::Allowed)?;
        let names = Names::try_from(&WireMachine::new(&machine, session.id)?)?;
        let begun_ns = unix_ns();
        let root = &options.folder;
        let folder = folder::create(root, begun_ns, session.id)
            .with_context(|| format!("{}: cannot record there", root.display()))?;
        let plan = Plan {
            preamble: preamble(file, urdf, &session, &machine, &sensors, &names, begun_ns)
                .by(&options.fingerprint),
            split: options.split,
            retention: Retention::new(&options.folder, options.keep_bytes),
            folder: folder.clone(),
        };
        let pending = Arc::new(Pending::default());
        let ends = Arc::new(AtomicBool::new(false));
        let (begun, begins) = std::sync::mpsc::channel();
        let thread = {
            let (pending, ends) = (Arc::clone(&pending), Arc::clone(&ends));
            let (clips, pace) = (options.clips.clone(), session.pace);
            // the writer stays in the thread that created it
            let write = move || match Target::begin(plan, clips, pace, pending) {
                Ok(target) => {
                    let _ = begun.send(Ok(()));
                    target.run(&ends)
                }
                Err(error) => {
                    let _ = begun.send(Err(error));
                    Ok(RecordCounts::default())
                }
            };
            std::thread::Builder::new()
                .name("write".into())
                .spawn(write)?
        };
        begins
            .recv()
            .context("record: the writer thread has ended")?
            .with_context(|| format!("{}: cannot record there", folder.display()))?;
        eprintln!("record: {}", folder.display());
        Ok(Self {
            guard: Guard::new(&session, &machine, &sensors, monotonic_ns()),
            sensors: sensors.all().collect(),
            session,
            names,
            pending,
            ends,
            thread,
            last_log_ns: 0,
            last_stamp_ns: i64::MIN,
            triggers: (options.clips.as_ref())
                .map_or_else(TriggerWatch::default, |clips| TriggerWatch::new(&clips.on)),
            unix_offset_ns: unix_ns() - monotonic_ns(),
            lost: 0,
            next_verdict: None,
            levels: [0; 2],
            next_command: None,
            modes: [0; 2],
            program: None,
            fingerprint: None,
        })
    }

    /// The session's identity.
    pub(super) fn id(&self) -> u64 {
        self.session.id
    }

    /// Whether a replay must wait for the writer.
    pub(super) fn must_wait(&self) -> bool {
        self.session.wants_progress && self.pending.is_full()
    }

    /// Ends the files.
    pub(super) fn close(self) -> Result<RecordCounts> {
        self.ends.store(true, Ordering::Release);
        let written = self.thread.join();
        let counts = written.map_err(|_| anyhow!("record: the writer thread has panicked"))??;
        Ok(RecordCounts {
            samples_refused: self.guard.counts().refused,
            ..counts
        })
    }

    /// Takes a sample.
    pub(super) fn sample(&mut self, wire: &WireSample) -> Progress {
        let admitted = self.guard.admit(wire, monotonic_ns());
        let lost = self.guard.counts().lost;
        if lost > self.lost {
            self.pending.note_dropped(lost - self.lost, 0);
            self.lost = lost;
        }
        let sample = match admitted {
            Ok(Admitted::Sample(admitted)) => *admitted.sample(),
            Ok(Admitted::End) => return Progress::Ended,
            Err(_) => return Progress::Running,
        };
        let Some(place) = self.sensors.iter().position(|s| *s == sample.sensor) else {
            return Progress::Running;
        };
        let no_joints = Vec::new();
        let joints = match sample.sensor {
            Sensor::Joints(stream) => self.session.streams.get(stream).unwrap_or(&no_joints),
            _ => &no_joints,
        };
        let frame = self.session.imu_frame.as_deref().unwrap_or("");
        let data = encode::sample(&sample, joints, frame);
        self.last_stamp_ns = self.last_stamp_ns.max(sample.stamp_ns);
        self.push(Kind::Sample(place), wire.sequence, wire.published_ns, data);
        Progress::Running
    }

    /// Takes what the monitor says about itself, once of each run of a monitor.
    pub(super) fn machine(&mut self, wire: &WireMachine) {
        let is_ours = wire.session == self.session.id && wire.is_whole();
        if is_ours && self.program != Some(wire.source) {
            self.program = Some(wire.source);
            self.fingerprint = Some(encode::program(wire));
        }
    }

    /// Takes a verdict; returns whether it was recorded.
    pub(super) fn verdict(&mut self, wire: &WireVerdict) -> bool {
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
        let trigger = self.triggers.take(wire);
        // a repetition of the last row is not recorded
        let is_recorded = wire.event == EVENT_ROW || is_new;
        if is_recorded {
            let data = encode::verdict(wire, &self.names);
            let kind = Kind::Verdict { is_new, trigger };
            self.push(kind, wire.sequence, wire.published_ns, data);
        }
        is_recorded
    }

    /// Takes a command; returns whether it was recorded.
    pub(super) fn command(&mut self, wire: &WireCommand) -> bool {
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
        let is_recorded = wire.event == EVENT_ROW || is_new || wire.mode() == Mode::Ramp;
        if is_recorded {
            let data = encode::command(wire);
            let (sequence, published_ns) = (wire.sequence, wire.published_ns);
            self.push(Kind::Command, sequence, published_ns, data);
        }
        is_recorded
    }

    fn push(&mut self, kind: Kind, sequence: u64, published_ns: i64, data: Vec<u8>) {
        self.push_one(kind, sequence, published_ns, data);
        if let Some(fingerprint) = self.fingerprint.take() {
            self.push_one(Kind::Program, 0, published_ns, fingerprint);
        }
    }

    fn push_one(&mut self, kind: Kind, sequence: u64, published_ns: i64, mut data: Vec<u8>) {
        // a black box keeps it for long
        data.shrink_to_fit();
        // publication time, not the time of recording; never in the future, and strictly increasing even if
        // the time of day is set back
        let publish_time_ns = published_ns.saturating_add(self.unix_offset_ns);
        let now_ns = monotonic_ns().saturating_add(self.unix_offset_ns);
        self.last_log_ns = publish_time_ns.min(now_ns).max(self.last_log_ns + 1);
        let session_ns = if self.session.pace > 0.0 {
            let host_ns = self.last_log_ns.saturating_sub(self.unix_offset_ns);
            (host_ns as f64 * self.session.pace) as i64
        } else {
            self.last_stamp_ns
        };
        self.pending.push(Encoded {
            kind,
            sequence: sequence as u32,
            session_ns,
            log_time_ns: self.last_log_ns,
            publish_time_ns,
            data,
        });
    }
}

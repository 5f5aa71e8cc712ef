//! Sinks of verdicts: topics of ROS 2, and a CAN bus.

use std::io::{self, Write};

use anyhow::{Context, Result};
use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame, ExtendedId, Id, Socket, StandardId};
use tipwatch_can::Frame;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::verdict::Level;

use super::can_frame::CanVerdict;
use super::diagnostics::diagnostics;
use super::follow::VerdictSink;
use super::view::View;
use crate::bridge::dds::{Participant, RawWriter};
use crate::bridge::input::Teller;
use crate::record::{verdict_message, verdict_topic};
use crate::system::clock::unix_ns;
use crate::wire::names::Names;
use crate::wire::topics::WireMachine;

/// Time between two frames, and between two diagnostics, while the level stays (ns).
const FRAME_PERIOD_NS: i64 = 50_000_000;
const DIAGNOSTICS_PERIOD_NS: i64 = 200_000_000;
const DEPTH: i32 = 32;

/// Time of the last message of a periodic output (ns), with its level and whether a verdict was current.
#[derive(Debug, Default)]
struct Pace {
    last: Option<(i64, Level, bool)>,
}

impl Pace {
    fn is_due(&mut self, view: &View<'_>, period_ns: i64) -> bool {
        let now = (view.now_ns, view.level(), view.verdict.is_some());
        let is_due = self.last.is_none_or(|(at, level, is_current)| {
            (level, is_current) != (now.1, now.2) || now.0.saturating_sub(at) >= period_ns
        });
        if is_due {
            self.last = Some(now);
        }
        is_due
    }
}

/// Publishes diagnostics and the verdict as it is.
#[derive(Debug)]
pub struct DdsSink {
    participant: Participant,
    diagnostics: RawWriter,
    verdict: Option<(RawWriter, Names)>,
    pace: Pace,
    /// Source and sequence number of the verdict published last.
    published: Option<(u64, u64)>,
    teller: Teller,
}

impl DdsSink {
    /// Opens the topics.
    ///
    /// # Errors
    /// They cannot be created.
    pub fn new(participant: &Participant, teller: Teller) -> Result<Self> {
        Ok(Self {
            diagnostics: participant.writer(
                "/diagnostics",
                "diagnostic_msgs/msg/DiagnosticArray",
                DEPTH,
            )?,
            participant: participant.clone(),
            verdict: None,
            pace: Pace::default(),
            published: None,
            teller,
        })
    }

    fn publish(&mut self, view: &View<'_>) -> Result<()> {
        if self.pace.is_due(view, DIAGNOSTICS_PERIOD_NS) {
            self.diagnostics.write(&diagnostics(view, unix_ns()))?;
        }
        let Some(verdict) = view.verdict.filter(|_| !view.names.wheels.is_empty()) else {
            return Ok(());
        };
        let identity = (verdict.source, verdict.sequence);
        if self.published == Some(identity) {
            return Ok(());
        }
        self.published = Some(identity);
        if self
            .verdict
            .as_ref()
            .is_none_or(|(_, names)| names != view.names)
        {
            let topic = verdict_topic(view.names);
            let writer = self
                .participant
                .writer(&topic.name, topic.type_name, DEPTH)?;
            self.verdict = Some((writer, view.names.clone()));
        }
        match &self.verdict {
            Some((writer, names)) => writer.write(&verdict_message(verdict, names)),
            None => Ok(()),
        }
    }
}

impl VerdictSink for DdsSink {
    fn show(&mut self, view: &View<'_>) {
        if let Err(error) = self.publish(view) {
            self.teller.fault("verdict", &format!("{error:#}"));
        }
    }
}

/// Takes frames; it must not wait.
pub trait FrameSink {
    /// Sends a frame.
    ///
    /// # Errors
    /// The bus does not take it.
    fn send(&mut self, frame: &Frame) -> io::Result<()>;
}

/// Sends the verdict as frames.
pub struct CanSink<S> {
    frames: CanVerdict,
    sink: S,
    pace: Pace,
    teller: Teller,
}

impl<S: FrameSink> CanSink<S> {
    /// Sends to this bus.
    pub fn new(frames: CanVerdict, sink: S, teller: Teller) -> Self {
        Self {
            frames,
            sink,
            pace: Pace::default(),
            teller,
        }
    }
}

impl<S: FrameSink> VerdictSink for CanSink<S> {
    fn show(&mut self, view: &View<'_>) {
        if !self.pace.is_due(view, FRAME_PERIOD_NS) {
            return;
        }
        let frame = self.frames.frame(view);
        if let Err(error) = self.sink.send(&frame) {
            let text = format!("the verdict's CAN frame cannot be sent: {error}");
            self.teller.fault("can out", &text);
        }
    }
}

impl FrameSink for Box<dyn FrameSink> {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        (**self).send(frame)
    }
}

/// Opens a bus: an interface, or `-` for candump text on standard output.
///
/// # Errors
/// The interface cannot be opened.
pub fn open_frames(interface: &str) -> Result<Box<dyn FrameSink>> {
    if interface == "-" {
        return Ok(Box::new(CandumpText(io::stdout())));
    }
    let socket = CanSocket::open(interface)
        .and_then(|socket| socket.set_nonblocking(true).map(|()| socket))
        .with_context(|| {
            format!("--can-out {interface}: expected a CAN interface that is up, found none that can be opened")
        })?;
    Ok(Box::new(Bus(socket)))
}

struct Bus(CanSocket);

impl FrameSink for Bus {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        let id = match frame.id.is_extended {
            true => ExtendedId::new(frame.id.raw).map(Id::Extended),
            false => StandardId::new(frame.id.raw as u16).map(Id::Standard),
        };
        let frame = id.and_then(|id| CanDataFrame::new(id, frame.data()));
        let frame = frame.ok_or_else(|| io::Error::other("an identifier or data out of range"))?;
        self.0.write_frame(&frame)
    }
}

/// The text of candump, with the time of this computer.
struct CandumpText<W>(W);

impl<W: Write> FrameSink for CandumpText<W> {
    fn send(&mut self, frame: &Frame) -> io::Result<()> {
        let now = unix_ns();
        let width = if frame.id.is_extended { 8 } else { 3 };
        let data: String = frame
            .data()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        writeln!(
            self.0,
            "({}.{:09}) can0 {:0width$X}#{data}",
            now / 1_000_000_000,
            now % 1_000_000_000,
            frame.id.raw
        )?;
        self.0.flush()
    }
}

/// The definition of the verdict message for a machine, as the text of its `.msg` file.
///
/// # Errors
/// A name is too long for the wire.
pub fn verdict_msg(machine: &Machine) -> Result<String> {
    let names = Names::try_from(&WireMachine::new(machine, 0)?)?;
    let definition = verdict_topic(&names).definition;
    // without the definitions of its parts
    let own = definition.split("\n====").next().unwrap_or_default();
    Ok(format!("{}\n", own.trim_end()))
}

//! Frames of CAN buses: from SocketCAN, or as candump text from standard input.

use std::io::{self, BufReader};

use anyhow::{Context, Result};
use socketcan::{CanAnyFrame, CanFdSocket, EmbeddedFrame, Frame as _, Socket};
use tipwatch_can::{CanId, CandumpStream, Frame, FrameKind, FrameSource};
use tipwatch_ingest::CanFrameType;

use super::host_clock::HostClock;
use super::queue::{Arrival, Intake, Lane, LaneId};
use crate::system::clock::monotonic_ns;

/// Source of CAN frames, and the name of their topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CanInput {
    /// The interface, such as `can0`; `-` for candump text on standard input.
    pub interface: String,
    /// The name of its topic in the machine file; `None` for that of the interface.
    pub topic: Option<String>,
    /// Whether frames of CAN FD are read too.
    pub is_fd: bool,
}

impl std::str::FromStr for CanInput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (interface, topic) = match text.split_once('=') {
            Some((interface, topic)) => (interface, Some(topic.to_owned())),
            None => (text, None),
        };
        if interface.is_empty() || topic.as_deref() == Some("") {
            return Err("expected an interface such as can0, or - for candump text on standard input, or can0=TOPIC".into());
        }
        Ok(Self {
            interface: interface.into(),
            topic,
            is_fd: false,
        })
    }
}

/// Starts a thread that reads frames into the queue.
///
/// # Errors
/// The interface cannot be opened.
pub fn start_can(input: &CanInput, intake: &Intake, clock: &HostClock) -> Result<()> {
    let (input, intake, clock) = (input.clone(), intake.clone(), clock.clone());
    let name = format!("can {}", input.interface);
    let thread = std::thread::Builder::new().name(name);
    if input.interface == "-" {
        thread.spawn(move || {
            let mut source = CandumpStream::new(BufReader::new(io::stdin()));
            let read = read_frames(&mut source, &input, &intake, &mut |frame| frame.time_ns);
            let (refused, reason) = source.refused();
            if refused > 0 {
                let reason = reason.unwrap_or("no line since then was wrong");
                intake.teller.say(&format!(
                    "standard input: {refused} lines were no frames: {reason}"
                ));
            }
            match read {
                Ok(()) => intake.teller.say("standard input has ended"),
                Err(error) => intake.teller.say(&format!("standard input: {error}")),
            }
        })?;
    } else {
        let mut source = SocketSource::open(&input.interface)?;
        thread.spawn(move || {
            let mut now = |_: &Frame| clock.unix_at(monotonic_ns());
            if let Err(error) = read_frames(&mut source, &input, &intake, &mut now) {
                intake.teller.say(&format!(
                    "{}: expected frames, found: {error}",
                    input.interface
                ));
            }
        })?;
    }
    Ok(())
}

/// Puts the frames of a source into the queue, until it ends or nobody reads them any more. `log_ns` gives the time
/// that a recorder would note.
///
/// # Errors
/// The source cannot be read.
pub fn read_frames(
    source: &mut dyn FrameSource,
    input: &CanInput,
    intake: &Intake,
    log_ns: &mut dyn FnMut(&Frame) -> i64,
) -> io::Result<()> {
    let frame_type = match input.is_fd {
        true => CanFrameType::Fd,
        false => CanFrameType::Classical,
    };
    let mut lanes: Vec<LaneId> = Vec::new();
    let mut frame = Frame::default();
    let mut data = Vec::new();
    while source.next_frame(&mut frame)? {
        let host_ns = monotonic_ns();
        while let Some(channel) = source.channels().get(lanes.len()) {
            lanes.push(intake.lane(&Lane {
                name: input.topic.clone().unwrap_or_else(|| channel.clone()),
                type_name: frame_type.name().into(),
                definition: frame_type.definition(),
                is_bus: true,
            }));
        }
        let Some(&lane) = lanes.get(frame.channel) else {
            continue;
        };
        if !frame_type.encode(&frame, &mut data) {
            let text = match input.is_fd {
                true => "remote frames carry no data and are left out",
                false => "frames of CAN FD are left out; expected --can-fd",
            };
            intake.teller.fault(
                &format!("fd {}", lane.0),
                &format!("{}: {text}", input.interface),
            );
            continue;
        }
        let arrival = Arrival {
            lane,
            host_ns,
            log_ns: log_ns(&frame),
            sent_ns: None,
            publisher: 0,
            sequence: None,
            missed: 0,
            data: data.clone(),
        };
        if !intake.offer(arrival) {
            break;
        }
    }
    Ok(())
}

/// A socket of the kernel.
struct SocketSource {
    socket: CanFdSocket,
    channels: [String; 1],
}

impl SocketSource {
    fn open(interface: &str) -> Result<Self> {
        let socket = CanFdSocket::open(interface).with_context(|| {
            format!(
                "--can {interface}: expected a CAN interface that is up (ip link set {interface} up type can bitrate \
                 ...), found none that can be opened"
            )
        })?;
        Ok(Self {
            socket,
            channels: [interface.to_owned()],
        })
    }
}

impl FrameSource for SocketSource {
    fn next_frame(&mut self, frame: &mut Frame) -> io::Result<bool> {
        let received = loop {
            match self.socket.read_frame() {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                received => break received?,
            }
        };
        let (is_extended, raw) = (received.is_extended(), received.raw_id());
        frame.id = match is_extended {
            true => CanId::extended(raw),
            false => CanId::standard(raw),
        };
        frame.channel = 0;
        frame.is_fd = matches!(received, CanAnyFrame::Fd(_));
        frame.kind = match received {
            CanAnyFrame::Error(_) => FrameKind::Error,
            CanAnyFrame::Remote(_) => FrameKind::Remote,
            _ => FrameKind::Data,
        };
        let is_data = frame.kind == FrameKind::Data;
        frame.set_data(if is_data { received.data() } else { &[] });
        Ok(true)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }
}

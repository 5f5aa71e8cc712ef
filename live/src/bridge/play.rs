//! Plays a log to the network, as `ros2 bag play` does: for a first try without a machine, and for tests.

use std::io::Write;
use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, bail};
use tipwatch_ingest::{Log, TopicId};

use super::dds::{Participant, RawWriter};
use crate::node::pause;

/// Messages that a reliable topic keeps for readers that lost some.
const DEPTH: i32 = 64;
/// Longest sleep before a signal is looked for.
const TICK: Duration = Duration::from_millis(20);

/// Options of playing a log.
#[derive(Debug, Clone)]
pub struct PlayOptions {
    /// The log.
    pub log: PathBuf,
    /// The DDS domain; `None` for candump text on standard output.
    pub dds: Option<u16>,
    /// Addresses of this computer whose networks DDS uses; empty for all.
    pub addresses: Vec<IpAddr>,
    /// Speed relative to the recording.
    pub speed: f64,
    /// Time between the announcement of the topics and the first message.
    pub delay: Duration,
    /// Whether the log begins again at its end.
    pub repeats: bool,
}

/// Plays it, and returns the number of messages sent.
///
/// # Errors
/// The log or the network cannot be used, or there is nothing to play.
pub fn play(options: &PlayOptions) -> Result<u64> {
    let log = Log::open(&options.log)?;
    let mut sent = 0;
    match options.dds {
        Some(domain) => {
            let participant = Participant::join(domain, &options.addresses)?;
            let writers = writers(&participant, &log, options)?;
            let _ = pause(options.delay);
            loop {
                let goes_on = publish(&log, &writers, options, &mut sent)?;
                if !goes_on || !options.repeats {
                    // what is on its way arrives
                    let _ = pause(Duration::from_millis(200));
                    return Ok(sent);
                }
            }
        }
        None => loop {
            let goes_on = print_frames(&log, options, &mut sent)?;
            if !goes_on || !options.repeats {
                return Ok(sent);
            }
        },
    }
}

fn writers(
    participant: &Participant,
    log: &Log,
    options: &PlayOptions,
) -> Result<Vec<(TopicId, RawWriter)>> {
    let mut writers = Vec::new();
    for topic in log.topics().iter().filter(|topic| topic.encoding == "cdr") {
        // CAN logs have topics without slash
        if topic.type_name.is_empty() || !topic.name.starts_with('/') {
            continue;
        }
        writers.push((
            topic.id,
            participant.writer(&topic.name, &topic.type_name, DEPTH)?,
        ));
    }
    if writers.is_empty() {
        bail!(
            "{}: expected topics of ROS 2 (CDR), found none; the frames of a CAN log are played without --dds",
            options.log.display()
        );
    }
    Ok(writers)
}

/// Schedule of a log that is played: gives the time at which a recorded message is due.
struct Pace {
    start: Instant,
    first_ns: Option<i64>,
    speed: f64,
}

impl Pace {
    fn new(speed: f64) -> Self {
        Self {
            start: Instant::now(),
            first_ns: None,
            speed,
        }
    }

    /// Waits; `false` if the program was asked to stop.
    fn wait_for(&mut self, log_ns: i64) -> bool {
        let first_ns = *self.first_ns.get_or_insert(log_ns);
        let since_s = log_ns.saturating_sub(first_ns) as f64 * 1e-9 / self.speed;
        let due = Duration::try_from_secs_f64(since_s).unwrap_or_default();
        loop {
            let left = due.saturating_sub(self.start.elapsed());
            if pause(left.min(TICK)).is_err() {
                return false;
            }
            if left <= TICK {
                return true;
            }
        }
    }
}

fn publish(
    log: &Log,
    writers: &[(TopicId, RawWriter)],
    options: &PlayOptions,
    sent: &mut u64,
) -> Result<bool> {
    let topics: Vec<TopicId> = writers.iter().map(|(topic, _)| *topic).collect();
    let mut pace = Pace::new(options.speed);
    let mut outcome = Ok(true);
    log.read(&topics, &mut |message| {
        if !pace.wait_for(message.log_time_ns) {
            outcome = Ok(false);
            return ControlFlow::Break(());
        }
        let writer = writers.iter().find(|(topic, _)| *topic == message.topic);
        if let Some((_, writer)) = writer {
            if let Err(error) = writer.write(message.data) {
                outcome = Err(error);
                return ControlFlow::Break(());
            }
            *sent += 1;
        }
        ControlFlow::Continue(())
    })?;
    outcome
}

fn print_frames(log: &Log, options: &PlayOptions, sent: &mut u64) -> Result<bool> {
    let buses: Vec<(TopicId, String)> = log
        .can_buses()
        .map(|bus| (bus.id, bus.name.trim_start_matches('/').replace('/', "_")))
        .collect();
    let [(bus, name)] = buses.as_slice() else {
        return Err(anyhow!(
            "{}: expected one bus of CAN frames, found {}; topics of ROS 2 are played with --dds",
            options.log.display(),
            buses.len()
        ));
    };
    let mut out = std::io::stdout();
    let mut pace = Pace::new(options.speed);
    let mut outcome = Ok(true);
    log.read_can_frames(*bus, &mut |frame| {
        if !matches!(outcome, Ok(true)) {
            return;
        }
        if !pace.wait_for(frame.time_ns) {
            outcome = Ok(false);
            return;
        }
        let width = if frame.id.is_extended { 8 } else { 3 };
        let kind = if frame.is_fd { "##0" } else { "#" };
        let data: String = frame
            .data()
            .iter()
            .map(|byte| format!("{byte:02X}"))
            .collect();
        let written = writeln!(
            out,
            "({}.{:09}) {name} {:0width$X}{kind}{data}",
            frame.time_ns / 1_000_000_000,
            frame.time_ns % 1_000_000_000,
            frame.id.raw
        );
        match written.and_then(|()| out.flush()) {
            Ok(()) => *sent += 1,
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => outcome = Ok(false),
            Err(error) => outcome = Err(error.into()),
        }
    })?;
    outcome
}

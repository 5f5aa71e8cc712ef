//! Sends the samples of a log, paced as recorded or as fast as possible.

use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};

use super::log::LogSamples;
use crate::node::Producer;
use crate::node::{LiveNode, pause};
use crate::system::clock::monotonic_ns;
use crate::system::signals::Interrupted;
use crate::wire::topics::{SAMPLE_QUEUE, WireSample, WireSession};

/// Period at which new readers are connected.
const CONNECT_PERIOD: Duration = Duration::from_millis(20);
/// Period at which the nodes of dead readers are removed.
const DEAD_NODE_CHECK: Duration = Duration::from_millis(200);
/// Longest stall of a reader before a lossless replay gives up.
const STALL_LIMIT: Duration = Duration::from_secs(30);
/// Longest wait of a lossy replay until the end has been read.
const END_LIMIT: Duration = Duration::from_secs(2);
/// Time between two checks of the readers' progress.
const RETRY_PERIOD: Duration = Duration::from_micros(50);
/// Time between the announcement and the first sample, in which readers prepare.
const START_DELAY: Duration = Duration::from_millis(250);
/// Most samples that a reader may lag behind in a lossless replay, before its queue overwrites any.
const MAX_BACKLOG: u64 = SAMPLE_QUEUE as u64 / 2;

/// Speed at which samples are sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// Relative to the log.
    Factor(f64),
    /// As fast as possible.
    Max,
}

impl Speed {
    /// Speed of the sensors' clock relative to real time; 0 if unrelated to real time.
    #[must_use]
    pub fn pace(self) -> f64 {
        match self {
            Self::Factor(factor) => factor,
            Self::Max => 0.0,
        }
    }
}

/// Options of a replay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplayOptions {
    /// Speed.
    pub speed: Speed,
    /// Whether to wait for readers instead of overwriting samples that they have not read.
    pub lossless: bool,
    /// Number of readers to wait for.
    pub readers: usize,
    /// Longest wait for the readers.
    pub wait: Duration,
}

/// Result of a replay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReplayCounts {
    /// Samples sent.
    pub sent: u64,
    /// Whether a signal of the operating system stopped the replay early.
    pub interrupted: bool,
}

/// Sends all samples, and the end of the session.
///
/// # Errors
/// A lossless replay has no reader, or loses it; the shared memory fails; a sample or a name is too long
/// for the wire.
pub fn replay(log: &LogSamples, node: &LiveNode, options: ReplayOptions) -> Result<ReplayCounts> {
    let session = &log.session;
    let mut replay = Replay {
        producer: Producer::new(node, session.id, session.machine_hash)?,
        node,
        options,
        counts: ReplayCounts::default(),
        connected: Instant::now(),
        checked: Instant::now(),
    };
    match replay.run(log) {
        Ok(()) => Ok(replay.counts),
        Err(Stop::Interrupted) => Ok(ReplayCounts {
            interrupted: true,
            ..replay.counts
        }),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// Reason for which a replay stops early.
enum Stop {
    Interrupted,
    Failed(anyhow::Error),
}

impl From<anyhow::Error> for Stop {
    fn from(error: anyhow::Error) -> Self {
        Self::Failed(error)
    }
}

impl From<Interrupted> for Stop {
    fn from(_: Interrupted) -> Self {
        Self::Interrupted
    }
}

struct Replay<'a> {
    producer: Producer,
    node: &'a LiveNode,
    options: ReplayOptions,
    counts: ReplayCounts,
    connected: Instant,
    /// Time at which dead nodes were last removed.
    checked: Instant,
}

impl Replay<'_> {
    fn run(&mut self, log: &LogSamples) -> Result<(), Stop> {
        // readers first: when the first sample is sent, and so what its stamp means, is announced
        self.wait_for_readers()?;
        let (start, start_ns) = (Instant::now() + START_DELAY, monotonic_ns());
        let mut session = WireSession::try_from(&log.session)?;
        session.clock_host_ns = start_ns.saturating_add(START_DELAY.as_nanos() as i64);
        self.producer.announce(&mut session)?;
        let mut first_ns = None;
        for (sample, log_time_ns) in log.samples() {
            let mut wire = WireSample::new(&sample, log_time_ns)?;
            if let Speed::Factor(factor) = self.options.speed {
                let first_ns = *first_ns.get_or_insert(log_time_ns);
                let since_s = log_time_ns.saturating_sub(first_ns) as f64 * 1e-9 / factor;
                self.wait_until(start + Duration::try_from_secs_f64(since_s).unwrap_or_default())?;
            }
            self.maintain()?;
            if self.options.lossless {
                self.wait_for_room(MAX_BACKLOG)?;
            }
            self.producer.send(&mut wire)?;
            self.counts.sent += 1;
        }
        self.end()
    }

    fn wait_for_readers(&mut self) -> Result<(), Stop> {
        let start = Instant::now();
        while self.producer.readers() < self.options.readers {
            if start.elapsed() >= self.options.wait {
                if !self.options.lossless {
                    break;
                }
                let seconds = self.options.wait.as_secs_f64();
                return Err(anyhow!(
                    "--lossless: expected {} within {seconds} s, found {}",
                    readers(self.options.readers),
                    match self.producer.readers() {
                        0 => "none".into(),
                        found => found.to_string(),
                    }
                )
                .into());
            }
            pause(Duration::from_millis(1))?;
        }
        Ok(self.producer.update_connections()?)
    }

    /// From time to time: connects new readers, stops a lossless replay that has lost its readers, and checks
    /// for a signal.
    fn maintain(&mut self) -> Result<(), Stop> {
        if self.connected.elapsed() < CONNECT_PERIOD {
            return Ok(());
        }
        self.connected = Instant::now();
        self.producer.update_connections()?;
        if self.options.lossless {
            self.check_reader()?;
        }
        Ok(pause(Duration::ZERO)?)
    }

    fn check_reader(&mut self) -> Result<()> {
        if self.checked.elapsed() >= DEAD_NODE_CHECK {
            self.checked = Instant::now();
            self.node.remove_dead_nodes();
        }
        if self.producer.readers() == 0 {
            return Err(anyhow!(
                "the reader has disappeared after {} samples",
                self.counts.sent
            ));
        }
        Ok(())
    }

    fn wait_until(&mut self, time: Instant) -> Result<(), Stop> {
        loop {
            let left = time.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            pause(left.min(CONNECT_PERIOD))?;
            self.maintain()?;
        }
    }

    /// Waits until no reader lags further behind than this.
    fn wait_for_room(&mut self, max: u64) -> Result<(), Stop> {
        let start = Instant::now();
        while self.producer.backlog()?.is_none_or(|backlog| backlog > max) {
            self.check_reader()?;
            // a reader that still waits for the session takes no samples
            self.producer.update_connections()?;
            if start.elapsed() >= STALL_LIMIT {
                let seconds = STALL_LIMIT.as_secs();
                return Err(anyhow!(
                    "sample {}: expected every reader to make progress within {seconds} s, found a stalled one",
                    self.counts.sent
                )
                .into());
            }
            pause(RETRY_PERIOD)?;
        }
        Ok(())
    }

    /// Sends the end and waits until it was read: the memory must live until then.
    fn end(&mut self) -> Result<(), Stop> {
        self.producer.send(&mut WireSample::end())?;
        let limit = if self.options.lossless {
            STALL_LIMIT
        } else {
            END_LIMIT
        };
        let start = Instant::now();
        while self.producer.readers() > 0 && self.producer.backlog()? != Some(0) {
            if start.elapsed() >= limit {
                break;
            }
            pause(Duration::from_millis(1))?;
            if self.checked.elapsed() >= DEAD_NODE_CHECK {
                self.checked = Instant::now();
                self.producer.update_connections()?;
                self.node.remove_dead_nodes();
            }
        }
        // a reader that ends looks dead between the end of its port and that of its node: only what it took tells
        if self.options.lossless {
            let (found, wanted) = (self.producer.read_by()?, self.options.readers.max(1));
            if found < wanted {
                let wanted = readers(wanted);
                return Err(anyhow!("expected {wanted} to take all samples, found {found}").into());
            }
        }
        Ok(())
    }
}

fn readers(count: usize) -> String {
    match count {
        1 => "a reader".into(),
        _ => format!("{count} readers"),
    }
}

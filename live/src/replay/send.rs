//! Replay: a log's samples into shared memory, as a machine would write them.

use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};

use super::log::Recording;
use crate::node::Producer;
use crate::node::{LiveNode, pause};
use crate::system::signals::Interrupted;
use crate::wire::topics::{SAMPLE_QUEUE, WireSample, WireSession};

/// How often new readers are looked for.
const GREETING_PERIOD: Duration = Duration::from_millis(20);
/// How often dead readers are looked for.
const DEAD_CHECK_PERIOD: Duration = Duration::from_millis(200);
/// How long a reader may hang before a lossless replay gives up.
const STALL_LIMIT: Duration = Duration::from_secs(30);
/// How long a lossy replay waits for the end to be read.
const END_LIMIT: Duration = Duration::from_secs(2);
/// The wait between two looks at the readers' progress.
const RETRY_PERIOD: Duration = Duration::from_micros(50);
/// How far a reader may be behind in a lossless replay: its queue overwrites what is further.
const MOST_BEHIND: u64 = SAMPLE_QUEUE as u64 / 2;

/// How fast samples are sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times as fast as recorded.
    Factor(f64),
    /// As fast as possible.
    Max,
}

impl Speed {
    /// How many times as fast as real time the sensors' clock runs; 0 where it has nothing to do with
    /// real time.
    #[must_use]
    pub fn pace(self) -> f64 {
        match self {
            Self::Factor(factor) => factor,
            Self::Max => 0.0,
        }
    }
}

/// How a replay goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplayOptions {
    /// How fast.
    pub speed: Speed,
    /// Whether to wait for readers rather than to overwrite what they have not read.
    pub lossless: bool,
    /// How many readers to wait for.
    pub readers: usize,
    /// How long to wait for them.
    pub wait: Duration,
}

/// What a replay did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReplayCounts {
    /// Samples sent.
    pub sent: u64,
    /// Whether a signal ended it early.
    pub interrupted: bool,
}

/// Sends all samples of `recording`, and the end.
///
/// # Errors
/// A lossless replay has no reader, or its reader goes or hangs; the shared memory fails; a sample or
/// a name is too long for the wire.
pub fn replay(
    recording: &Recording,
    joined: &LiveNode,
    options: ReplayOptions,
) -> Result<ReplayCounts> {
    let session = &recording.session;
    let mut replay = Replay {
        producer: Producer::new(joined, session.id, session.machine_hash)?,
        joined,
        options,
        counts: ReplayCounts::default(),
        greeted: Instant::now(),
        checked: Instant::now(),
    };
    match replay.run(recording) {
        Ok(()) => Ok(replay.counts),
        Err(Stop::Interrupted) => Ok(ReplayCounts {
            interrupted: true,
            ..replay.counts
        }),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// Why a replay ends early.
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
    joined: &'a LiveNode,
    options: ReplayOptions,
    counts: ReplayCounts,
    greeted: Instant,
    /// When dead readers were last looked for.
    checked: Instant,
}

impl Replay<'_> {
    fn run(&mut self, recording: &Recording) -> Result<(), Stop> {
        let mut session = WireSession::try_from(&recording.session)?;
        self.producer.announce(&mut session)?;
        self.wait_for_readers()?;
        let mut pace = None;
        for (sample, log_time_ns) in recording.samples() {
            let mut wire = WireSample::new(&sample, log_time_ns)?;
            if let Speed::Factor(factor) = self.options.speed {
                let (start, first_ns) = *pace.get_or_insert((Instant::now(), log_time_ns));
                let since_s = log_time_ns.saturating_sub(first_ns) as f64 * 1e-9 / factor;
                self.wait_until(start + Duration::try_from_secs_f64(since_s).unwrap_or_default())?;
            }
            self.keep_company()?;
            if self.options.lossless {
                self.wait_for_room(MOST_BEHIND)?;
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

    /// Now and then: gives late joiners the session, ends a lossless replay whose readers have gone, and
    /// looks for a signal.
    fn keep_company(&mut self) -> Result<(), Stop> {
        if self.greeted.elapsed() < GREETING_PERIOD {
            return Ok(());
        }
        self.greeted = Instant::now();
        self.producer.update_connections()?;
        if self.options.lossless {
            self.check_reader()?;
        }
        Ok(pause(Duration::ZERO)?)
    }

    fn check_reader(&mut self) -> Result<()> {
        if self.checked.elapsed() >= DEAD_CHECK_PERIOD {
            self.checked = Instant::now();
            self.joined.remove_dead_nodes();
        }
        if self.producer.readers() == 0 {
            return Err(anyhow!(
                "the reader has gone after {} samples",
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
            pause(left.min(GREETING_PERIOD))?;
            self.keep_company()?;
        }
    }

    /// Waits until every reader is no further behind than this.
    fn wait_for_room(&mut self, most: u64) -> Result<(), Stop> {
        let start = Instant::now();
        while self
            .producer
            .backlog()?
            .is_none_or(|backlog| backlog > most)
        {
            self.check_reader()?;
            // a reader that still waits for the session takes no samples
            self.producer.update_connections()?;
            if start.elapsed() >= STALL_LIMIT {
                let seconds = STALL_LIMIT.as_secs();
                return Err(anyhow!(
                    "sample {}: expected every reader to go on within {seconds} s, found one that does not",
                    self.counts.sent
                )
                .into());
            }
            pause(RETRY_PERIOD)?;
        }
        Ok(())
    }

    /// Sends the end and waits for readers to have read it, so that the memory lives until then.
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
            if self.checked.elapsed() >= DEAD_CHECK_PERIOD {
                self.checked = Instant::now();
                self.producer.update_connections()?;
                if self.joined.remove_dead_nodes() > 0
                    && self.producer.readers() == 0
                    && self.options.lossless
                {
                    return Err(anyhow!("the reader died before the end").into());
                }
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

//! Replay: a log's samples into shared memory, as a machine would write them.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::node::{Delivery, Interrupted, Writer};
use crate::recording::Recording;
use crate::topics::{WireSample, WireSession};

/// How often new readers are looked for.
const GREETING_PERIOD: Duration = Duration::from_millis(20);
/// How often dead readers are looked for while a queue is full.
const DEAD_CHECK_PERIOD: Duration = Duration::from_millis(200);
/// How long a reader may leave its queue full before a lossless replay gives up.
const STALL_LIMIT: Duration = Duration::from_secs(30);
/// How long a lossy replay tries to deliver the end.
const END_LIMIT: Duration = Duration::from_secs(2);
/// The wait between two attempts.
const RETRY_PERIOD: Duration = Duration::from_micros(50);

/// How fast samples are sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times as fast as recorded.
    Factor(f64),
    /// As fast as possible.
    Max,
}

/// How a replay goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReplayOptions {
    /// How fast.
    pub speed: Speed,
    /// Whether to wait for readers rather than to discard samples.
    pub lossless: bool,
    /// How long to wait for the first reader.
    pub wait: Duration,
}

/// What a replay did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReplayCounts {
    /// Samples sent.
    pub sent: u64,
    /// Of them those that found the queue of some reader full.
    pub discarded: u64,
    /// Whether a signal ended it early.
    pub interrupted: bool,
}

/// Sends all samples of `recording`, and the end.
///
/// # Errors
/// A lossless replay has no reader, or its reader goes or stalls; the shared memory fails; a sample or
/// a name is too long for the wire.
pub fn replay(
    recording: &Recording,
    writer: &Writer,
    options: ReplayOptions,
) -> Result<ReplayCounts> {
    let mut replay = Replay {
        writer,
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
    writer: &'a Writer,
    options: ReplayOptions,
    counts: ReplayCounts,
    greeted: Instant,
    /// When dead readers were last looked for.
    checked: Instant,
}

impl Replay<'_> {
    fn run(&mut self, recording: &Recording) -> Result<(), Stop> {
        self.writer
            .announce(&WireSession::try_from(&recording.session)?)?;
        self.wait_for_reader()?;
        let session = recording.session.id;
        let mut pace = None;
        for (sequence, (sample, log_time_ns)) in (0..).zip(recording.samples()) {
            let wire = WireSample::new(sequence, session, &sample, log_time_ns)?;
            if let Speed::Factor(factor) = self.options.speed {
                let (start, first_ns) = *pace.get_or_insert((Instant::now(), log_time_ns));
                let since_s = log_time_ns.saturating_sub(first_ns) as f64 * 1e-9 / factor;
                self.wait_until(start + Duration::try_from_secs_f64(since_s).unwrap_or_default())?;
            }
            self.keep_company()?;
            if self.options.lossless {
                self.deliver(&wire, STALL_LIMIT)?;
            } else if self.writer.send(&wire)? == Delivery::SomeQueueIsFull {
                self.counts.discarded += 1;
            }
            self.counts.sent += 1;
        }
        self.end(&WireSample::end(self.counts.sent, session))
    }

    fn wait_for_reader(&mut self) -> Result<(), Stop> {
        let start = Instant::now();
        while self.writer.readers() == 0 {
            if start.elapsed() >= self.options.wait {
                if !self.options.lossless {
                    break;
                }
                let seconds = self.options.wait.as_secs_f64();
                return Err(anyhow::anyhow!(
                    "--lossless: expected a reader within {seconds} s, found none"
                )
                .into());
            }
            self.writer.pause(Duration::from_millis(1))?;
        }
        Ok(self.writer.greet()?)
    }

    /// Now and then: gives late joiners the session, ends a lossless replay whose readers have gone, and
    /// looks for a signal.
    fn keep_company(&mut self) -> Result<(), Stop> {
        if self.greeted.elapsed() < GREETING_PERIOD {
            return Ok(());
        }
        self.greeted = Instant::now();
        self.writer.greet()?;
        if self.options.lossless {
            self.check_reader()?;
        }
        Ok(self.writer.pause(Duration::ZERO)?)
    }

    fn check_reader(&mut self) -> Result<()> {
        if self.checked.elapsed() >= DEAD_CHECK_PERIOD {
            self.checked = Instant::now();
            self.writer.forget_the_dead();
        }
        if self.writer.readers() == 0 {
            bail!("the reader has gone after {} samples", self.counts.sent);
        }
        Ok(())
    }

    fn wait_until(&mut self, time: Instant) -> Result<(), Stop> {
        loop {
            let left = time.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            self.writer.pause(left.min(GREETING_PERIOD))?;
            self.keep_company()?;
        }
    }

    /// Sends until every reader has it. A reader that had it already gets it again and drops it by its
    /// sequence number.
    fn deliver(&mut self, wire: &WireSample, limit: Duration) -> Result<(), Stop> {
        let start = Instant::now();
        while self.writer.send(wire)? == Delivery::SomeQueueIsFull {
            self.check_reader()?;
            // a reader that still waits for the session takes no samples
            self.writer.greet()?;
            if start.elapsed() >= limit {
                let seconds = limit.as_secs();
                return Err(anyhow::anyhow!(
                    "sample {}: expected a reader to make room within {seconds} s, found its queue full",
                    wire.sequence
                )
                .into());
            }
            self.writer.pause(RETRY_PERIOD)?;
        }
        Ok(())
    }

    /// Sends the end and waits for readers to leave, so that the memory lives until they have read it.
    fn end(&mut self, wire: &WireSample) -> Result<(), Stop> {
        if self.writer.readers() == 0 {
            self.writer.send(wire)?;
            return Ok(());
        }
        let limit = if self.options.lossless {
            STALL_LIMIT
        } else {
            END_LIMIT
        };
        match self.deliver(wire, limit) {
            // who has no room for the end, or has gone, learns from this process's end
            Err(Stop::Failed(_)) if !self.options.lossless => {
                self.counts.discarded += 1;
                return Ok(());
            }
            delivered => delivered?,
        }
        let start = Instant::now();
        while self.writer.readers() > 0 && start.elapsed() < limit {
            self.writer.pause(Duration::from_millis(1))?;
            if self.checked.elapsed() >= DEAD_CHECK_PERIOD {
                self.checked = Instant::now();
                self.writer.greet()?;
                if self.writer.forget_the_dead() > 0
                    && self.writer.readers() == 0
                    && self.options.lossless
                {
                    return Err(anyhow::anyhow!("the reader died before the end").into());
                }
            }
        }
        Ok(())
    }
}

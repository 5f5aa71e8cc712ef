//! The checks themselves: one guard for each session and reader.

use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::Finding;
use tipwatch_mechanics::machine::{FaultKind, Policy};
use tipwatch_mechanics::state::{Sample, SampleError, Sensors};
use tipwatch_mechanics::verdict::{Conditions, InputFault};

use super::delay::{ClockDrift, Delay};
use super::sensor_watch::{Age, SensorWatch};
use crate::safety_limits::{
    DEADLINE_NS, LOSS_WINDOW_NS, MAX_CLOCK_LEAD_NS, MAX_LOST_SAMPLES, PERSISTENT, START_UP_NS,
    UNTIMED_SILENCE_NS,
};
use crate::wire::sample::{Message, SampleCounts};
use crate::wire::session::{Session, StampClock};
use crate::wire::topics::{Wire, WireSample};

/// Checks the messages of one session.
#[derive(Debug, Clone)]
pub struct Guard {
    session: u64,
    machine_hash: u64,
    /// Offset of the sensors' clock, and its speed relative to real time; `None` where real time is not checked.
    clock: Option<(StampClock, f64)>,
    /// Drift of that clock since.
    drift: ClockDrift,
    /// The longest gap that the estimator bridges (ns).
    max_gap_ns: i64,
    started_ns: i64,
    /// Time at which the last sample was received (ns).
    received_ns: i64,
    /// Stamp of the last sample (ns).
    stamp_ns: Option<i64>,
    next_sequence: Option<u64>,
    /// Start of the current loss window (ns), and the samples lost since.
    loss_window: (i64, u64),
    torn: u32,
    foreign: u32,
    repeated: u32,
    has_imu: bool,
    watches: Vec<SensorWatch>,
    counts: SampleCounts,
    /// Problems found since the last row, which are reported with the next one.
    found: Conditions,
}

/// A message was not used. The counts say why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused;

/// Reason for which a message is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rejection {
    Bad,
    /// Seen before: counted separately.
    Repeated,
}

/// A message that passed every check.
#[derive(Debug, Clone, Copy)]
pub enum Admitted<'a> {
    /// A sample, for the estimator.
    Sample(AdmittedSample<'a>),
    /// The end of the session.
    End,
}

/// A sample that passed every check that needs no estimator.
#[derive(Debug, Clone, Copy)]
#[must_use]
pub struct AdmittedSample<'a> {
    sample: Sample<'a>,
    origin: Origin,
}

impl<'a> AdmittedSample<'a> {
    /// The sample.
    #[must_use]
    pub fn sample(&self) -> &Sample<'a> {
        &self.sample
    }
}

/// A sample that the estimator has taken, and whose values were judged.
#[derive(Debug, Clone, Copy)]
#[must_use]
pub struct AssessedSample(Origin);

/// Origin of an admitted sample: the watch of its sensor, and its times (ns).
#[derive(Debug, Clone, Copy)]
struct Origin {
    watch: usize,
    published_ns: i64,
    received_ns: i64,
    /// Whether the sample was measured too long before its publication to make its sensor fresh.
    is_stale: bool,
}

impl Guard {
    /// A guard that has seen nothing; `started_ns` is the current time.
    #[must_use]
    pub fn new(session: &Session, machine: &Machine, sensors: &Sensors, started_ns: i64) -> Self {
        let max_gap_ns = (machine.estimator().max_gap * 1e9) as i64;
        let watches = sensors
            .all()
            .map(|sensor| SensorWatch::new(sensor, sensors, max_gap_ns));
        Self {
            session: session.id,
            machine_hash: session.machine_hash,
            clock: (session.pace > 0.0).then_some((session.clock, session.pace)),
            drift: ClockDrift::since(started_ns.saturating_sub(session.clock.host_ns)),
            max_gap_ns,
            started_ns,
            received_ns: started_ns,
            stamp_ns: None,
            next_sequence: None,
            loss_window: (started_ns, 0),
            torn: 0,
            foreign: 0,
            repeated: 0,
            has_imu: sensors.imu,
            watches: watches.collect(),
            counts: SampleCounts::default(),
            found: Conditions::default(),
        }
    }

    /// Returns the counts of the samples so far.
    #[must_use]
    pub fn counts(&self) -> SampleCounts {
        self.counts
    }

    /// Whether real time is checked.
    #[must_use]
    pub fn is_timed(&self) -> bool {
        self.clock.is_some()
    }

    /// Whether a result of a sample was published too late.
    #[must_use]
    pub fn is_late(&self, sample_published_ns: i64, published_ns: i64) -> bool {
        self.is_timed() && published_ns.saturating_sub(sample_published_ns) > DEADLINE_NS
    }

    /// Adds a caution that only the program can find.
    pub fn caution(&mut self, fault: InputFault) {
        self.found.cautions.add(fault);
    }

    /// Adds a fault that only the reader of the shared memory can find.
    pub fn note(&mut self, fault: InputFault) {
        self.found.faults.add(fault);
    }

    /// Checks a message.
    ///
    /// # Errors
    /// It must not be used.
    pub fn admit<'a>(
        &mut self,
        wire: &'a WireSample,
        now_ns: i64,
    ) -> Result<Admitted<'a>, Refused> {
        self.check(wire, now_ns).map_err(|rejection| {
            match rejection {
                Rejection::Bad => self.counts.refused += 1,
                Rejection::Repeated => self.counts.repeated += 1,
            }
            Refused
        })
    }

    fn check<'a>(&mut self, wire: &'a WireSample, now_ns: i64) -> Result<Admitted<'a>, Rejection> {
        let message = Message::try_from(wire).ok().filter(|_| wire.is_whole());
        let Some(message) = message else {
            persists(&mut self.torn, &mut self.found, InputFault::Torn);
            return Err(Rejection::Bad);
        };
        self.torn = 0;
        if wire.source != self.session {
            persists(&mut self.foreign, &mut self.found, InputFault::WrongSource);
            return Err(Rejection::Bad);
        }
        self.foreign = 0;
        if wire.machine_hash != self.machine_hash {
            self.note(InputFault::WrongMachine);
            return Err(Rejection::Bad);
        }
        self.check_sequence(wire)?;
        Ok(match message {
            Message::Sample(sample) => Admitted::Sample(AdmittedSample {
                sample,
                origin: self.check_sample(&sample, wire.published_ns, now_ns)?,
            }),
            Message::End => Admitted::End,
        })
    }

    /// Counts what is missing before this message; rejects what was seen before.
    fn check_sequence(&mut self, wire: &WireSample) -> Result<(), Rejection> {
        match self.next_sequence {
            None => self.counts.before_joining = wire.sequence,
            Some(next) if wire.sequence < next => {
                persists(&mut self.repeated, &mut self.found, InputFault::Disordered);
                return Err(Rejection::Repeated);
            }
            Some(next) => self.count_lost(wire.sequence - next, wire.published_ns),
        }
        self.repeated = 0;
        self.next_sequence = Some(wire.sequence.saturating_add(1));
        Ok(())
    }

    fn count_lost(&mut self, lost: u64, published_ns: i64) {
        if lost == 0 {
            return;
        }
        self.counts.lost = self.counts.lost.saturating_add(lost);
        let (since, recent) = &mut self.loss_window;
        if published_ns.saturating_sub(*since) > LOSS_WINDOW_NS {
            (*since, *recent) = (published_ns, 0);
        }
        *recent = recent.saturating_add(lost);
        if *recent > MAX_LOST_SAMPLES {
            self.note(InputFault::Lost);
        }
    }

    fn check_sample(
        &mut self,
        sample: &Sample<'_>,
        published_ns: i64,
        now_ns: i64,
    ) -> Result<Origin, Rejection> {
        let known =
            |w: &SensorWatch| w.sensor == sample.sensor && w.value_count == sample.values.len();
        let Some(index) = self.watches.iter().position(known) else {
            self.note(InputFault::Torn);
            return Err(Rejection::Bad);
        };
        let watch = &mut self.watches[index];
        let is_ahead = published_ns > now_ns.saturating_add(MAX_CLOCK_LEAD_NS);
        let mut delay = Delay::InTime;
        let mut drifts = false;
        let mut jumps = !is_time(sample.stamp_ns) || is_ahead;
        if let Some((clock, pace)) = self.clock
            && !jumps
        {
            let measured_ns = clock.measured_ns(sample.stamp_ns, pace);
            let delay_ns = published_ns.saturating_sub(measured_ns);
            self.drift.begin(published_ns, delay_ns);
            let delay_ns = self.drift.without(delay_ns);
            delay = Delay::of(delay_ns, self.max_gap_ns);
            drifts = watch.drift.take(published_ns, delay_ns);
            if let Some(excess_ns) = watch.drift.excess_ns(delay_ns) {
                self.drift.take(published_ns, excess_ns);
            }
            jumps = delay == Delay::Ahead
                || watch.clock_jumps(sample.stamp_ns, published_ns, pace, self.max_gap_ns);
        }
        match delay {
            Delay::InTime | Delay::Ahead => {}
            Delay::Late => self.found.cautions.add(InputFault::Stale),
            Delay::Stale => self.found.faults.add(InputFault::Stale),
        }
        if drifts {
            self.found.cautions.add(InputFault::ClockJump);
        }
        if jumps {
            persists(&mut watch.jumped, &mut self.found, InputFault::ClockJump);
            return Err(Rejection::Bad);
        }
        watch.accept_clock(sample.stamp_ns, published_ns);
        self.received_ns = now_ns;
        self.stamp_ns = self.stamp_ns.max(Some(sample.stamp_ns));
        Ok(Origin {
            watch: index,
            published_ns,
            received_ns: now_ns,
            is_stale: delay == Delay::Stale,
        })
    }

    /// Judges an admitted sample by the estimator's result and its findings on the values. Only a good
    /// sample refreshes its sensor.
    pub fn assess(
        &mut self,
        admitted: AdmittedSample<'_>,
        result: Result<(), SampleError>,
        findings: &[Finding],
    ) -> AssessedSample {
        self.counts.refused += u64::from(result.is_err());
        let watch = &mut self.watches[admitted.origin.watch];
        match result {
            Ok(()) | Err(SampleError::NotFinite) => {
                let implausible = meaning(findings, self.has_imu);
                if implausible == Conditions::default() {
                    watch.implausible = 0;
                } else {
                    watch.implausible = watch.implausible.saturating_add(1);
                }
                if watch.implausible >= PERSISTENT {
                    self.found.faults.add_all(implausible.faults);
                    self.found.cautions.add_all(implausible.cautions);
                }
                let is_good = result.is_ok() && implausible.faults.is_empty();
                if is_good && !admitted.origin.is_stale {
                    watch.refresh(admitted.origin.published_ns);
                }
            }
            Err(SampleError::NotLater) => {
                persists(
                    &mut watch.disordered,
                    &mut self.found,
                    InputFault::Disordered,
                );
            }
            Err(SampleError::UnknownSensor) => self.note(InputFault::Torn),
        }
        AssessedSample(admitted.origin)
    }

    /// Everything found since the row before, for the row that this sample completes.
    ///
    /// Every sensor must have been fresh when the sample was published, and the sample itself must not be
    /// stale by now. Samples that wait behind it do not count.
    #[must_use]
    pub fn complete_row(&mut self, sample: AssessedSample) -> Conditions {
        let origin = sample.0;
        self.check_freshness(origin.published_ns);
        let age_ns = origin.received_ns.saturating_sub(origin.published_ns);
        let age = self.watches[origin.watch].age(age_ns);
        if self.is_timed() && age == Age::Stale {
            self.note(InputFault::Stale);
        }
        self.counts.rows += 1;
        // what lasts will be found again
        std::mem::take(&mut self.found)
    }

    /// Everything found since the last row, late and missing sensors included. The next row reports it
    /// again, except for the silence of an untimed session: the rows of one do not depend on the time of day.
    #[must_use]
    pub fn between_rows(&mut self, now_ns: i64) -> Conditions {
        self.check_freshness(now_ns);
        let mut found = self.found;
        if !self.is_timed() && self.silence_ns(now_ns) > 0 {
            found.faults.add(InputFault::Stale);
        }
        found
    }

    /// The time (ns) by the sensors' clock: the last stamp, and the silence since; `None` before the first sample.
    #[must_use]
    pub fn stamp_ns(&self, now_ns: i64) -> Option<i64> {
        let pace = self.clock.map_or(1.0, |(_, pace)| pace);
        let silence_ns = (self.silence_ns(now_ns) as f64 * pace) as i64;
        Some(self.stamp_ns?.saturating_add(silence_ns))
    }

    /// Converts a stamp to the time of its measurement (ns) by CLOCK_MONOTONIC; `None` where real time is not checked.
    #[must_use]
    pub fn measured_ns(&self, stamp_ns: i64) -> Option<i64> {
        let (clock, pace) = self.clock?;
        Some(clock.measured_ns(stamp_ns, pace))
    }

    /// For how long (ns) no sample has come. In an untimed session it counts from [`UNTIMED_SILENCE_NS`] on.
    fn silence_ns(&self, now_ns: i64) -> i64 {
        let silence_ns = now_ns.saturating_sub(self.received_ns);
        if self.is_timed() || silence_ns > UNTIMED_SILENCE_NS {
            silence_ns
        } else {
            0
        }
    }

    /// Finds sensors that are late, stale or have never delivered at this time.
    fn check_freshness(&mut self, now_ns: i64) {
        if !self.is_timed() {
            return;
        }
        for watch in &self.watches {
            let Some(published_ns) = watch.fresh_ns else {
                if watch.is_required() && now_ns.saturating_sub(self.started_ns) > START_UP_NS {
                    self.found.faults.add(InputFault::NeverReceived);
                }
                continue;
            };
            match watch.age(now_ns.saturating_sub(published_ns)) {
                Age::Fresh => {}
                Age::Late => self.found.cautions.add(InputFault::Stale),
                Age::Stale => self.found.faults.add(InputFault::Stale),
            }
        }
    }
}

/// Counts one more in a row; from the third on it is a fault.
fn persists(run: &mut u32, found: &mut Conditions, fault: InputFault) {
    *run = run.saturating_add(1);
    if *run >= PERSISTENT {
        found.faults.add(fault);
    }
}

/// Whether a stamp is set, and fits the 32-bit seconds of a log.
fn is_time(stamp_ns: i64) -> bool {
    stamp_ns != 0 && i32::try_from(stamp_ns.div_euclid(1_000_000_000)).is_ok()
}

/// Converts the findings on a sample: to faults where they invalidate rows, otherwise to cautions, unless the machine file wants
/// them reported offline only.
fn meaning(findings: &[Finding], has_imu: bool) -> Conditions {
    let mut conditions = Conditions::default();
    // A contradiction is a doubt on rows, which their reasons carry; an outlier is bridged.
    let is_fault =
        |finding: &&Finding| !matches!(finding.kind, FaultKind::Contradiction | FaultKind::Outlier);
    let faults = findings.iter().filter(is_fault);
    for finding in faults {
        let fault = InputFault::from(finding.kind);
        if finding.forbids_rows(has_imu) {
            conditions.faults.add(fault);
        } else if finding.policy != Policy::Report {
            conditions.cautions.add(fault);
        }
    }
    conditions
}

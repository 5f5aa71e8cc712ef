//! What every message must pass before it is used.
//!
//! Whether a sample is used depends on messages alone, not on when they are looked at: two readers of
//! one session agree on every sample. What depends on the time of day is whether what came is fresh.
//!
//! Only a sample that passed every check refreshes its sensor's clock.

use tipwatch_mechanics::estimation::plausibility::Finding;
use tipwatch_mechanics::machine::Policy;
use tipwatch_mechanics::state::{Sample, SampleError, Sensor, Sensors};
use tipwatch_mechanics::verdict::{Conditions, InputFault};

use crate::sample::Message;
use crate::topics::{Wire, WireSample};

/// How long a sensor may take for its first sample (ns).
const START_UP_NS: i64 = 2_000_000_000;
/// Bad messages of a kind in a row that are a fault; fewer are left out only.
const PERSISTENT: u32 = 3;
/// Samples lost within a second that are a fault; fewer widen the estimate's own uncertainty.
const MOST_LOST: u64 = 10;
const SECOND_NS: i64 = 1_000_000_000;
/// How far ahead of this computer's clock a message may be (ns).
const AHEAD_NS: i64 = 5_000_000;
/// A sensor is late after so many of its periods, and its input stale after so many.
const LATE_PERIODS: f64 = 3.0;
const STALE_PERIODS: f64 = 10.0;
/// But not before (ns).
const LATE_NS: f64 = 20_000_000.0;
const STALE_NS: f64 = 50_000_000.0;
/// How much of a new interval goes into a sensor's period.
const PERIOD_SHARE: f64 = 0.05;

/// What became of the samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Rows given.
    pub rows: u64,
    /// Samples of the session before the first that came.
    pub before_joining: u64,
    /// Samples that never came since then.
    pub lost: u64,
    /// Samples that came but could not be used.
    pub refused: u64,
    /// Samples that came again, and were not used again.
    pub repeated: u64,
}

/// A message was not used; why was counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused;

/// Checks the messages of one session.
#[derive(Debug, Clone)]
pub struct Guard {
    session: u64,
    machine_hash: u64,
    /// How many times as fast as real time the sensors' clock runs; `None` where that is unknown.
    pace: Option<f64>,
    max_gap_ns: i64,
    started_ns: i64,
    next_sequence: Option<u64>,
    lost_since: (i64, u64),
    torn: u32,
    foreign: u32,
    repeated: u32,
    has_imu: bool,
    watches: Vec<Watch>,
    counts: Counts,
    conditions: Conditions,
}

/// What is known of one sensor's samples.
#[derive(Debug, Clone)]
struct Watch {
    sensor: Sensor,
    value_count: usize,
    /// Whether rows need it.
    is_required: bool,
    /// Stamp and publication of the last sample that was admitted (ns): how its clock runs.
    clock_ns: Option<(i64, i64)>,
    /// Publication of the last sample that was good (ns).
    fresh_ns: Option<i64>,
    period_ns: Option<f64>,
    jumped: u32,
    jumped_since_ns: Option<i64>,
    disordered: u32,
    implausible: u32,
}

impl Guard {
    /// A guard that has seen nothing; `started_ns` is now.
    #[must_use]
    pub fn new(session: &SessionFacts, sensors: &Sensors, started_ns: i64) -> Self {
        let watches = sensors.iter().map(|sensor| Watch {
            sensor,
            value_count: sensors.value_count(sensor).unwrap_or(0),
            is_required: sensor != Sensor::Odometry || !sensors.imu,
            clock_ns: None,
            fresh_ns: None,
            period_ns: None,
            jumped: 0,
            jumped_since_ns: None,
            disordered: 0,
            implausible: 0,
        });
        Self {
            session: session.id,
            machine_hash: session.machine_hash,
            pace: (session.pace > 0.0).then_some(session.pace),
            max_gap_ns: session.max_gap_ns,
            started_ns,
            next_sequence: None,
            lost_since: (started_ns, 0),
            torn: 0,
            foreign: 0,
            repeated: 0,
            has_imu: sensors.imu,
            watches: watches.collect(),
            counts: Counts::default(),
            conditions: Conditions::default(),
        }
    }

    /// What became of the samples so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Whether real time is checked.
    #[must_use]
    pub fn is_timed(&self) -> bool {
        self.pace.is_some()
    }

    /// What was found wrong since the last [`Self::row_is_done`].
    #[must_use]
    pub fn conditions(&self) -> Conditions {
        self.conditions
    }

    /// A row has been judged by the conditions: what lasts will be found again.
    pub fn row_is_done(&mut self) {
        self.counts.rows += 1;
        self.conditions = Conditions::default();
    }

    /// Something that only the reader of the shared memory knows is wrong.
    pub fn note(&mut self, fault: InputFault) {
        self.conditions.faults.add(fault);
    }

    /// Checks a message.
    ///
    /// # Errors
    /// It is not to be used.
    pub fn admit<'a>(&mut self, wire: &'a WireSample, now_ns: i64) -> Result<Message<'a>, Refused> {
        let admitted = self.check(wire, now_ns);
        self.counts.refused += u64::from(admitted == Err(Some(Refused)));
        // `None` is a repetition, which has a count of its own
        admitted.map_err(|_| Refused)
    }

    fn check<'a>(
        &mut self,
        wire: &'a WireSample,
        now_ns: i64,
    ) -> Result<Message<'a>, Option<Refused>> {
        let message = Message::try_from(wire).ok().filter(|_| wire.is_whole());
        let Some(message) = message else {
            persists(&mut self.torn, &mut self.conditions, InputFault::Torn);
            return Err(Some(Refused));
        };
        self.torn = 0;
        if wire.source != self.session {
            let fault = InputFault::WrongSource;
            persists(&mut self.foreign, &mut self.conditions, fault);
            return Err(Some(Refused));
        }
        self.foreign = 0;
        if wire.machine_hash != self.machine_hash {
            self.note(InputFault::WrongMachine);
            return Err(Some(Refused));
        }
        self.take_sequence(wire)?;
        if let Message::Sample(sample) = &message {
            self.check_sample(sample, wire.published_ns, now_ns)
                .map_err(Some)?;
        }
        Ok(message)
    }

    /// Counts what is missing before this message; refuses what was seen before.
    fn take_sequence(&mut self, wire: &WireSample) -> Result<(), Option<Refused>> {
        match self.next_sequence {
            None => self.counts.before_joining = wire.sequence,
            Some(next) if wire.sequence < next => {
                self.counts.repeated += 1;
                let fault = InputFault::Disordered;
                persists(&mut self.repeated, &mut self.conditions, fault);
                return Err(None);
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
        let (since, recent) = &mut self.lost_since;
        if published_ns.saturating_sub(*since) > SECOND_NS {
            (*since, *recent) = (published_ns, 0);
        }
        *recent = recent.saturating_add(lost);
        if *recent > MOST_LOST {
            self.note(InputFault::Lost);
        }
    }

    fn check_sample(
        &mut self,
        sample: &Sample<'_>,
        published_ns: i64,
        now_ns: i64,
    ) -> Result<(), Refused> {
        let pace = self.pace;
        let max_gap_ns = self.max_gap_ns;
        let conditions = &mut self.conditions;
        let watch = self.watches.iter_mut().find(|w| w.sensor == sample.sensor);
        let Some(watch) = watch.filter(|w| w.value_count == sample.values.len()) else {
            conditions.faults.add(InputFault::Torn);
            return Err(Refused);
        };
        if !is_time(sample.stamp_ns) || published_ns > now_ns.saturating_add(AHEAD_NS) {
            persists(&mut watch.jumped, conditions, InputFault::ClockJump);
            return Err(Refused);
        }
        if let Some(pace) = pace
            && watch.clock_jumps(sample.stamp_ns, published_ns, pace, max_gap_ns)
        {
            persists(&mut watch.jumped, conditions, InputFault::ClockJump);
            return Err(Refused);
        }
        watch.jumped = 0;
        watch.jumped_since_ns = None;
        watch.clock_ns = Some((sample.stamp_ns, published_ns));
        Ok(())
    }

    /// What the estimator made of an admitted sample, and found implausible about it: a good one
    /// refreshes its sensor.
    pub fn estimated(
        &mut self,
        sample: &Sample<'_>,
        published_ns: i64,
        result: Result<(), SampleError>,
        findings: &[Finding],
    ) {
        self.counts.refused += u64::from(result.is_err());
        let Some(watch) = self.watches.iter_mut().find(|w| w.sensor == sample.sensor) else {
            return;
        };
        match result {
            Ok(()) | Err(SampleError::NotFinite) => {
                let found = implausible(findings, self.has_imu);
                if found == Conditions::default() {
                    watch.implausible = 0;
                } else {
                    watch.implausible = watch.implausible.saturating_add(1);
                }
                if watch.implausible >= PERSISTENT {
                    self.conditions.faults.add_all(found.faults);
                    self.conditions.cautions.add_all(found.cautions);
                }
                if result.is_ok() && found.faults.is_empty() {
                    watch.refresh(published_ns);
                }
            }
            Err(SampleError::NotLater) => {
                let fault = InputFault::Disordered;
                persists(&mut watch.disordered, &mut self.conditions, fault);
            }
            Err(SampleError::UnknownSensor) => self.conditions.faults.add(InputFault::Torn),
        }
    }

    /// Finds sensors that are late, stale or have never come, at this time of CLOCK_MONOTONIC.
    pub fn check_freshness(&mut self, now_ns: i64) {
        if self.pace.is_none() {
            return;
        }
        for watch in self.watches.iter().filter(|watch| watch.is_required) {
            let Some(published_ns) = watch.fresh_ns else {
                if now_ns.saturating_sub(self.started_ns) > START_UP_NS {
                    self.conditions.faults.add(InputFault::NeverReceived);
                }
                continue;
            };
            let age_ns = now_ns.saturating_sub(published_ns) as f64;
            let most_ns = self.max_gap_ns as f64;
            if age_ns > watch.after(STALE_PERIODS, STALE_NS, most_ns) {
                self.conditions.faults.add(InputFault::Stale);
            } else if age_ns > watch.after(LATE_PERIODS, LATE_NS, most_ns) {
                self.conditions.cautions.add(InputFault::Stale);
            }
        }
    }

    /// Checks what a row is made of: whether every sensor was fresh when its sample was published, and
    /// whether that sample is not too old itself by now. The samples that wait behind it do not count.
    pub fn check_row(&mut self, sample: &Sample<'_>, published_ns: i64, now_ns: i64) {
        self.check_freshness(published_ns);
        let most_ns = self.max_gap_ns as f64;
        let watch = self.watches.iter().find(|w| w.sensor == sample.sensor);
        let age_ns = now_ns.saturating_sub(published_ns) as f64;
        let is_old = |watch: &Watch| age_ns > watch.after(STALE_PERIODS, STALE_NS, most_ns);
        if self.pace.is_some() && watch.is_some_and(is_old) {
            self.conditions.faults.add(InputFault::Stale);
        }
    }
}

/// What of a session the guard goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionFacts {
    /// Its identity.
    pub id: u64,
    /// Hash of machine file and URDF.
    pub machine_hash: u64,
    /// How many times as fast as real time the sensors' clock runs; 0: it has nothing to do with it.
    pub pace: f64,
    /// The longest time between two samples that the estimator bridges (ns).
    pub max_gap_ns: i64,
}

impl Watch {
    /// So many of its periods (ns), within limits.
    fn after(&self, periods: f64, least_ns: f64, most_ns: f64) -> f64 {
        let known = self.period_ns.map(|period| periods * period);
        known
            .unwrap_or(most_ns)
            .clamp(least_ns.min(most_ns), most_ns)
    }

    fn refresh(&mut self, published_ns: i64) {
        self.disordered = 0;
        if let Some(before_ns) = self.fresh_ns {
            let interval_ns = published_ns.saturating_sub(before_ns) as f64;
            let period_ns = self.period_ns.get_or_insert(interval_ns);
            *period_ns += PERIOD_SHARE * (interval_ns - *period_ns);
        }
        self.fresh_ns = Some(published_ns);
    }

    /// Whether the sensor's clock and this computer's disagree on the time since the last good sample.
    /// A clock that stays set forward is believed after a second; one that stays set back never, for
    /// the estimator cannot go back.
    fn clock_jumps(
        &mut self,
        stamp_ns: i64,
        published_ns: i64,
        pace: f64,
        max_gap_ns: i64,
    ) -> bool {
        let Some((last_stamp_ns, last_published_ns)) = self.clock_ns else {
            return false;
        };
        let by_sensor = stamp_ns.saturating_sub(last_stamp_ns) as f64 / pace;
        let by_host = published_ns.saturating_sub(last_published_ns) as f64;
        if (by_sensor - by_host).abs() <= max_gap_ns as f64 {
            return false;
        }
        let since = *self.jumped_since_ns.get_or_insert(published_ns);
        let is_settled = published_ns.saturating_sub(since) >= SECOND_NS;
        !(is_settled && stamp_ns > last_stamp_ns)
    }
}

/// Counts one more in a row; it is a fault from the third on.
fn persists(run: &mut u32, conditions: &mut Conditions, fault: InputFault) {
    *run = run.saturating_add(1);
    if *run >= PERSISTENT {
        conditions.faults.add(fault);
    }
}

/// A stamp that is set, and that a log can hold: seconds of 32 bits.
fn is_time(stamp_ns: i64) -> bool {
    stamp_ns != 0 && i32::try_from(stamp_ns.div_euclid(SECOND_NS)).is_ok()
}

/// What a sample's findings mean: those that make rows worthless are faults, all others make them
/// doubtful, but for those that the machine file only wants reported offline.
fn implausible(findings: &[Finding], has_imu: bool) -> Conditions {
    let mut conditions = Conditions::default();
    for finding in findings {
        let fault = InputFault::from(finding.kind);
        if finding.forbids_rows(has_imu) {
            conditions.faults.add(fault);
        } else if finding.policy != Policy::Report {
            conditions.cautions.add(fault);
        }
    }
    conditions
}

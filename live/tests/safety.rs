//! Whatever is fed in, "safe" means that all checks passed within the window.
//!
//! The monitor is run with a clock of our own, over arbitrary bytes and over arbitrary sequences of
//! samples, of which some are damaged. What it must have seen before it says safe is counted here anew.

use proptest::prelude::*;
use tipwatch_live::monitor::Monitor;
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{EVENT_ROW, Head, Kind, Wire, WireSample, WireVerdict};

use crate::support::feed::{machine, samples};

const MS: i64 = 1_000_000;
/// The longest that anything may be old when it is called safe: the estimator's longest gap since its publication, and
/// the longest delay before it.
const OLDEST_NS: i64 = 350 * MS;

/// Treatment of the next sample.
#[derive(Debug, Clone)]
enum Act {
    Send,
    Lose(u8),
    Repeat,
    /// Bytes from this place on are overwritten.
    Overwrite(u16, Vec<u8>),
    /// Bytes from this place on are overwritten, and the checksum is made right again.
    Forge(u16, Vec<u8>),
    NotFinite(u8),
    /// The sensor's clock is off by so many milliseconds.
    Clock(i16),
    OtherSource,
    OtherMachine,
    /// Nothing comes for so many milliseconds.
    Silence(u16),
    /// From now on everything comes so many milliseconds later.
    Delay(u16),
    /// From now on the sensors' clock runs at this speed (per cent).
    Speed(u8),
}

fn act() -> impl Strategy<Value = Act> {
    let bytes = || proptest::collection::vec(any::<u8>(), 1..64);
    prop_oneof![
        60 => Just(Act::Send),
        2 => (1..30_u8).prop_map(Act::Lose),
        2 => Just(Act::Repeat),
        2 => (any::<u16>(), bytes()).prop_map(|(at, bytes)| Act::Overwrite(at, bytes)),
        2 => (any::<u16>(), bytes()).prop_map(|(at, bytes)| Act::Forge(at, bytes)),
        2 => any::<u8>().prop_map(Act::NotFinite),
        2 => any::<i16>().prop_map(Act::Clock),
        1 => Just(Act::OtherSource),
        1 => Just(Act::OtherMachine),
        2 => (0..600_u16).prop_map(Act::Silence),
        1 => (0..6000_u16).prop_map(Act::Delay),
        1 => (20..200_u8).prop_map(Act::Speed),
    ]
}

/// The monitor, and what it was given.
struct Bench {
    monitor: Monitor,
    samples: Vec<WireSample>,
    next: usize,
    sequence: u64,
    now_ns: i64,
    source: u64,
    hash: u64,
    /// Begin of the log in the monitor's time (ns).
    start_ns: i64,
    /// Delay of every sample from its measurement to its arrival (ns).
    delay_ns: i64,
    /// Speed of the sensors' clock, and how far it has gone wrong (ns).
    speed: f64,
    wrong_ns: f64,
    /// Measurement time of the last sample (ns).
    measured_ns: i64,
    /// Measurement time of the newest faultless sample of each kind (ns).
    good_ns: [Option<i64>; 6],
    good_rows: u32,
    safe: u32,
}

impl Bench {
    fn new() -> Self {
        let (file, urdf) = machine("forwarder6");
        let (recording, samples) = samples("forwarder6");
        let hash = machine_hash(&file, &urdf);
        let now_ns = 1_000_000 * MS;
        let session = Session {
            id: 77,
            clock: StampClock {
                stamp_ns: samples[0].log_time_ns,
                host_ns: now_ns,
            },
            ..recording.session
        };
        let (machine, sensors) = session.machine(&file, &urdf).unwrap();
        Self {
            monitor: Monitor::new(machine, &sensors, &session, now_ns),
            samples,
            next: 0,
            sequence: 0,
            now_ns,
            source: 77,
            hash,
            start_ns: now_ns,
            delay_ns: 0,
            speed: 1.0,
            wrong_ns: 0.0,
            measured_ns: now_ns,
            good_ns: [None; 6],
            good_rows: 0,
            safe: 0,
        }
    }

    /// Returns the time at which the next sample is due (ns).
    fn due_ns(&self) -> i64 {
        let at = self.next % self.samples.len();
        let laps = (self.next / self.samples.len()) as i64;
        let first_ns = self.samples[0].log_time_ns;
        let lap_ns = self.samples[self.samples.len() - 1].log_time_ns - first_ns + 5 * MS;
        self.start_ns + self.samples[at].log_time_ns - first_ns + laps * lap_ns + self.delay_ns
    }

    /// The next sample and its head; the log again from its start where it ends, later.
    fn sample(&mut self) -> (WireSample, Head) {
        let mut sample = self.samples[self.next % self.samples.len()];
        let due_ns = self.due_ns();
        let sent_ns = self.start_ns + sample.log_time_ns - self.samples[0].log_time_ns;
        sample.time_ns += due_ns - self.delay_ns - sent_ns;
        // nobody told the sample how wrong the clock is
        let passed_ns = (due_ns - self.now_ns).max(0);
        self.wrong_ns += (self.speed - 1.0) * passed_ns as f64;
        sample.time_ns += self.wrong_ns as i64;
        self.next += 1;
        self.measured_ns = due_ns - self.delay_ns;
        self.now_ns = self.now_ns.max(due_ns);
        let head = Head {
            sequence: self.sequence,
            source: self.source,
            machine_hash: self.hash,
            time_ns: sample.time_ns,
            published_ns: self.now_ns,
        };
        self.sequence += 1;
        (sample, head)
    }

    /// A faultless sample was measured.
    fn measured(&mut self, kind: u32) {
        let kind = (kind as usize).min(5);
        self.good_ns[kind] = Some(self.measured_ns);
    }

    fn act(&mut self, act: &Act) {
        match act {
            Act::Send => {
                let (mut sample, head) = self.sample();
                sample.seal(head);
                self.measured(sample.kind);
                self.give(&sample);
            }
            Act::Lose(count) => {
                for _ in 0..*count {
                    self.sample();
                }
            }
            Act::Repeat => {
                let (mut sample, head) = self.sample();
                self.sequence -= 1;
                let sequence = head.sequence.saturating_sub(1);
                sample.seal(Head { sequence, ..head });
                self.give(&sample);
            }
            Act::Overwrite(at, bytes) => {
                let (mut sample, head) = self.sample();
                sample.seal(head);
                overwrite(&mut sample, *at, bytes);
                self.give(&sample);
            }
            Act::Forge(at, bytes) => {
                let (mut sample, head) = self.sample();
                sample.seal(head);
                overwrite(&mut sample, *at, bytes);
                sample.seal(sample.head());
                // it may have stayed good: that is counted as if it had
                self.measured(sample.kind);
                self.give(&sample);
            }
            Act::NotFinite(at) => {
                let (mut sample, head) = self.sample();
                // a position or a component of what the IMU feels: each is needed
                let needed = match sample.kind {
                    1 => sample.value_count / 2,
                    _ => 6,
                };
                sample.values[usize::from(*at) % needed as usize] = f64::NAN;
                sample.seal(head);
                self.give(&sample);
            }
            Act::Clock(off_ms) => {
                let (mut sample, head) = self.sample();
                let time_ns = head.time_ns + i64::from(*off_ms) * MS;
                sample.seal(Head { time_ns, ..head });
                self.measured(sample.kind);
                self.give(&sample);
            }
            Act::OtherSource => {
                let (mut sample, head) = self.sample();
                let source = head.source ^ 1;
                sample.seal(Head { source, ..head });
                self.give(&sample);
            }
            Act::OtherMachine => {
                let (mut sample, head) = self.sample();
                sample.seal(head);
                sample.machine_hash ^= 1;
                sample.seal(sample.head());
                self.give(&sample);
            }
            Act::Silence(ms) => {
                let end = self.now_ns + i64::from(*ms) * MS;
                while self.now_ns < end {
                    self.now_ns += 10 * MS;
                    self.tick();
                }
                // what was measured meanwhile never comes
                while self.due_ns() < end {
                    self.next += 1;
                }
            }
            // a clock that is as wrong as everything is late cannot be told from a good one
            Act::Delay(ms) if self.wrong_ns == 0.0 => self.delay_ns = i64::from(*ms) * MS,
            Act::Speed(per_cent) if self.delay_ns == 0 => {
                self.speed = f64::from(*per_cent) / 100.0;
            }
            Act::Delay(_) | Act::Speed(_) => {}
        }
        self.tick();
    }

    fn give(&mut self, sample: &WireSample) {
        let now_ns = self.now_ns;
        let mut given = Vec::new();
        self.monitor.take(sample, now_ns, &mut |verdict| {
            given.push(*verdict);
            now_ns
        });
        given.iter().for_each(|verdict| self.check(verdict));
    }

    fn tick(&mut self) {
        let now_ns = self.now_ns;
        let mut given = Vec::new();
        self.monitor.tick(now_ns, &mut |verdict| {
            given.push(*verdict);
            now_ns
        });
        given.iter().for_each(|verdict| self.check(verdict));
    }

    fn check(&mut self, verdict: &WireVerdict) {
        let has_fault = verdict.faults != 0 || verdict.cautions != 0;
        if verdict.event == EVENT_ROW {
            let is_good = verdict.reasons == 0 && !has_fault && verdict.utilisation.is_finite();
            self.good_rows = if is_good { self.good_rows + 1 } else { 0 };
        }
        if !verdict.verdict().level.sees_no_danger() {
            return;
        }
        self.safe += 1;
        for kind in [Kind::Joints, Kind::Imu] {
            let age_ns = self.good_ns[kind as usize].map(|at| self.now_ns - at);
            assert!(
                age_ns.is_some_and(|age| age <= OLDEST_NS),
                "{kind:?} is {age_ns:?} old"
            );
        }
        assert!(self.good_rows >= 10, "{} good rows", self.good_rows);
        assert!(!has_fault);
        assert_eq!(verdict.reasons, 0);
        assert!(verdict.utilisation < 0.75);
        for wheel in 0..verdict.wheel_count as usize {
            assert!(verdict.load[wheel].is_finite() && verdict.load_sigma[wheel].is_finite());
        }
    }
}

#[allow(
    unsafe_code,
    reason = "any byte of a message may be anything: that is what is tested"
)]
fn overwrite(sample: &mut WireSample, at: u16, bytes: &[u8]) {
    let at = usize::from(at) % (size_of::<WireSample>() - bytes.len());
    // SAFETY: the bytes are within the message, all of whose bit patterns are values.
    unsafe {
        let start = std::ptr::from_mut(sample).cast::<u8>().add(at);
        std::ptr::copy_nonoverlapping(bytes.as_ptr(), start, bytes.len());
    }
}

// requirement: TW-VERDICT-02
#[test]
fn faultless_session_becomes_safe() {
    let mut bench = Bench::new();
    for _ in 0..600 {
        bench.act(&Act::Send);
    }
    assert!(bench.safe > 100, "safe {} times", bench.safe);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(96) })]

    // requirement: TW-VERDICT-25
    #[test]
    fn safe_means_that_everything_was_checked(acts in proptest::collection::vec(act(), 1..400)) {
        let mut bench = Bench::new();
        for _ in 0..250 {
            bench.act(&Act::Send);
        }
        prop_assert!(bench.safe > 0);
        for act in &acts {
            bench.act(act);
        }
    }

    // requirement: TW-VERDICT-25
    #[test]
    fn no_bytes_are_safe(bytes in proptest::collection::vec(any::<u8>(), size_of::<WireSample>()), seals: bool) {
        let mut bench = Bench::new();
        let mut sample = WireSample::blank();
        for (at, chunk) in bytes.chunks(32).enumerate() {
            overwrite(&mut sample, (at * 32) as u16, chunk);
        }
        if seals {
            sample.seal(sample.head());
        }
        for _ in 0..50 {
            bench.give(&sample);
            bench.now_ns += 10 * MS;
            bench.tick();
        }
        prop_assert_eq!(bench.safe, 0);
    }
}

//! Good sensors are never called faulty and never doubted, wherever in a motion the session and its monitor begin.
//!
//! `TIPWATCH_GOOD_HOURS=8 cargo test --workspace --test tests needs_long::hours_of_good -- --ignored --nocapture`

use std::collections::BTreeMap;

use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_live::monitor::Monitor;
use tipwatch_live::replay::LogSamples;
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{EVENT_ROW, WireSample, WireVerdict};
use tipwatch_mechanics::verdict::Level;

use crate::support::feed::{machine, samples};
use crate::support::seal;

/// Logs of the test data whose sensors are as their machine file says: arms that swing and lift wheels, drives over bumps,
/// through corners and onto the brakes.
const LOGS: [&str; 16] = [
    "bogie_bump",
    "bogie_drive",
    "commissioning",
    "commissioning_bogie",
    "corner_brake",
    "folded_arm",
    "forwarder6",
    "forwarder6_bump",
    "hard_brake",
    "lift",
    "second_paper",
    "side_reach",
    "swing_lift",
    "swinging_drive",
    "tiny",
    "tiny_lift",
];
/// Sessions of the short run.
const STARTS: usize = 71;
/// Beginning of a session by the clock of the monitor (ns).
const START_NS: i64 = 1_000_000_000_000;
const SESSION: u64 = 77;

/// A log and its machine.
struct Good {
    name: &'static str,
    file: MachineFile,
    urdf: Urdf,
    recording: LogSamples,
    samples: Vec<WireSample>,
}

impl Good {
    fn read(name: &'static str) -> Self {
        let (file, urdf) = machine(name);
        let (recording, samples) = samples(name);
        Self {
            name,
            file,
            urdf,
            recording,
            samples,
        }
    }

    /// A session and a monitor that begin with this sample, up to the end of the log.
    fn session_from(&self, first: usize) -> Tally {
        let samples = &self.samples[first..];
        let first_ns = samples[0].log_time_ns;
        let session = Session {
            id: SESSION,
            machine_hash: machine_hash(&self.file, &self.urdf),
            pace: 1.0,
            clock: StampClock {
                stamp_ns: first_ns,
                host_ns: START_NS,
            },
            ..self.recording.session.clone()
        };
        let (machine, sensors) = session.machine(&self.file, &self.urdf).unwrap();
        let mut monitor = Monitor::new(machine, &sensors, &session, START_NS);
        let mut tally = Tally::default();
        for (sequence, sample) in (0..).zip(samples) {
            let now_ns = START_NS + sample.log_time_ns - first_ns;
            let mut sample = *sample;
            seal(&mut sample, &session, sequence, now_ns);
            let mut publish = |verdict: &mut WireVerdict| {
                tally.take(verdict);
                now_ns
            };
            let _ = monitor.take(&sample, now_ns, &mut publish);
            monitor.tick(now_ns, &mut publish);
        }
        let last_ns = samples[samples.len() - 1].log_time_ns;
        tally.hours = (last_ns - first_ns) as f64 / 3.6e12;
        tally
    }
}

/// Tally of the verdicts of a session: rows, faults and doubts.
#[derive(Debug, Clone, Default)]
struct Tally {
    hours: f64,
    rows: usize,
    /// Verdicts that are a fault, that tell of one, and that doubt a signal.
    faults: usize,
    told: usize,
    doubts: usize,
    /// The first of them.
    first: Option<String>,
}

impl Tally {
    fn take(&mut self, verdict: &WireVerdict) {
        let it = verdict.verdict();
        let (is_fault, tells) = (it.level == Level::Fault, verdict.faults != 0);
        let doubts = verdict.doubted != 0 || verdict.row_reasons().have_doubt();
        self.rows += usize::from(verdict.event == EVENT_ROW);
        self.faults += usize::from(is_fault);
        self.told += usize::from(tells);
        self.doubts += usize::from(doubts);
        if is_fault || tells || doubts {
            self.first.get_or_insert_with(|| {
                let conditions = verdict.conditions();
                let reasons: Vec<_> = verdict.row_reasons().iter().collect();
                format!("row {}: {it:?} {conditions:?} {reasons:?}", verdict.rows)
            });
        }
    }

    fn add(&mut self, other: &Self) {
        self.hours += other.hours;
        self.rows += other.rows;
        self.faults += other.faults;
        self.told += other.told;
        self.doubts += other.doubts;
        self.first = self.first.take().or_else(|| other.first.clone());
    }
}

/// Sessions that begin in logs one after the other, each at another place, until `is_enough`: what each log's sessions say.
fn sessions(is_enough: impl Fn(usize, f64) -> bool) -> BTreeMap<&'static str, (usize, Tally)> {
    let logs = LOGS.map(Good::read);
    let mut all = BTreeMap::new();
    let (mut starts, mut hours) = (0, 0.0);
    while !is_enough(starts, hours) {
        let log = &logs[starts % logs.len()];
        // spread over the first nine tenths, and no two alike: the golden ratio
        let place = (starts as f64 * 0.618_033_988_749_894_9).fract() * 0.9;
        let tally = log.session_from((place * log.samples.len() as f64) as usize);
        hours += tally.hours;
        starts += 1;
        let (sessions, sum): &mut (usize, Tally) = all.entry(log.name).or_default();
        *sessions += 1;
        sum.add(&tally);
    }
    println!("log                  sessions    hours      rows  faults  told  doubts");
    for (name, (sessions, sum)) in &all {
        println!(
            "{name:20} {sessions:8} {:8.3} {:9} {:7} {:5} {:7}",
            sum.hours, sum.rows, sum.faults, sum.told, sum.doubts
        );
    }
    all
}

fn assert_good(all: &BTreeMap<&'static str, (usize, Tally)>) {
    for (name, (_, sum)) in all {
        assert!(sum.rows > 100, "{name}: {} rows", sum.rows);
        assert_eq!(sum.first, None, "{name}");
    }
}

// requirement: TW-VERDICT-25, TW-VERDICT-31
#[test]
fn sessions_that_begin_in_motion_have_no_fault() {
    assert_good(&sessions(|starts, _| starts == STARTS));
}

mod needs_long {
    use super::*;

    #[test]
    #[ignore = "takes many minutes; TIPWATCH_GOOD_HOURS sets the machine time, 8 by default"]
    fn hours_of_good_sessions_have_no_fault() {
        let most = std::env::var("TIPWATCH_GOOD_HOURS").ok();
        let most = most.and_then(|hours| hours.parse().ok()).unwrap_or(8.0);
        assert_good(&sessions(|_, hours| hours >= most));
    }
}

//! A session that a test sends itself: samples of a log, with whatever faults it wants.

use std::time::Duration;

use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_live::node::Producer;
use tipwatch_live::node::{LiveNode, Receiver};
use tipwatch_live::replay::LogSamples;
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::identity::new_identity;
use tipwatch_live::wire::session::{Session, StampClock, machine_hash};
use tipwatch_live::wire::topics::{EVENT_ROW, Head, Wire, WireSample, WireSession, WireVerdict};
use tipwatch_mechanics::verdict::{InputFault, Level};

use super::data;

/// Passage of time while a test sends a session.
pub trait Time {
    fn now_ns(&self) -> i64;

    /// Lets time go by until then.
    fn pass_until(&mut self, then_ns: i64);

    fn pass(&mut self, duration: Duration) {
        self.pass_until(self.now_ns() + duration.as_nanos() as i64);
    }

    /// Wakes who waits for samples.
    fn wake(&mut self) {}
}

/// Time that goes by itself.
pub struct RealTime;

impl Time for RealTime {
    fn now_ns(&self) -> i64 {
        monotonic_ns()
    }

    fn pass_until(&mut self, then_ns: i64) {
        let left = u64::try_from(then_ns - monotonic_ns()).unwrap_or(0);
        std::thread::sleep(Duration::from_nanos(left));
    }
}

/// A machine, its samples, and the producing end of a session of it.
pub struct Feed<T = RealTime> {
    pub time: T,
    pub samples: Vec<WireSample>,
    pub producer: Producer,
    pub verdicts: Receiver<WireVerdict>,
    pub next: usize,
    /// Number of samples that were never meant to be sent.
    left_out: usize,
    pub source: u64,
    pub hash: u64,
    /// Names of the joints of the first stream.
    joints: Vec<String>,
    start_ns: i64,
}

pub fn machine(name: &str) -> (MachineFile, Urdf) {
    let file = MachineFile::read(&data(&format!("{name}.toml"))).unwrap();
    let urdf = file.urdf(None, None).unwrap();
    (file, urdf)
}

/// All samples of a log, without heads.
pub fn samples(name: &str) -> (LogSamples, Vec<WireSample>) {
    let (file, _) = machine(name);
    let recording = LogSamples::read(&data(&format!("{name}.mcap")), &file, None).unwrap();
    let samples = recording
        .samples()
        .map(|(sample, log_time_ns)| WireSample::new(&sample, log_time_ns).unwrap())
        .collect();
    (recording, samples)
}

impl<T: Time> Feed<T> {
    /// Opens a session, and announces it.
    pub fn new(node: &LiveNode, name: &str, time: T) -> Self {
        Self::with(node, name, time, |_| ())
    }

    /// Opens and announces a session that `change` has changed.
    pub fn with(node: &LiveNode, name: &str, time: T, change: impl FnOnce(&mut Session)) -> Self {
        let (file, urdf) = machine(name);
        let (mut recording, samples) = samples(name);
        let hash = machine_hash(&file, &urdf);
        let source = new_identity(hash);
        recording.session.id = source;
        recording.session.pace = 1.0;
        recording.session.wants_progress = false;
        let start_ns = time.now_ns();
        recording.session.clock = StampClock {
            stamp_ns: samples[0].log_time_ns,
            host_ns: start_ns,
        };
        change(&mut recording.session);
        let verdicts = node.receiver().unwrap();
        let mut producer = Producer::new(node, source, hash).unwrap();
        let mut session = WireSession::try_from(&recording.session).unwrap();
        producer.announce(&mut session).unwrap();
        Self {
            time,
            samples,
            producer,
            verdicts,
            next: 0,
            left_out: 0,
            source,
            hash,
            joints: recording.session.streams.remove(0),
            start_ns,
        }
    }

    /// ServiceAddress of a joint's position in the samples of the first stream.
    pub fn place_of(&self, joint: &str) -> usize {
        self.joints.iter().position(|name| name == joint).unwrap()
    }

    /// Waits until the monitor has taken the session.
    pub fn wait_for_monitor(&mut self) {
        for _ in 0..20_000 {
            self.producer.update_connections().unwrap();
            if self.find(|v| v.session == self.source).is_some() {
                return;
            }
            self.time.pass(Duration::from_millis(1));
        }
        panic!("no monitor");
    }

    /// The first verdict that waits for which `is_it` holds.
    pub fn find(&self, is_it: impl Fn(&WireVerdict) -> bool) -> Option<WireVerdict> {
        while let Some(verdict) = self.verdicts.receive(|v| *v).unwrap() {
            assert!(verdict.is_whole());
            if is_it(&verdict) {
                return Some(verdict);
            }
        }
        None
    }

    /// Waits for a verdict for which `is_it` holds, but not longer than this.
    pub fn wait_for(
        &mut self,
        limit: Duration,
        is_it: impl Fn(&WireVerdict) -> bool,
    ) -> Option<WireVerdict> {
        let until_ns = self.time.now_ns() + limit.as_nanos() as i64;
        loop {
            let found = self.find(&is_it);
            if found.is_some() || self.time.now_ns() >= until_ns {
                return found;
            }
            self.time.pass(Duration::from_micros(200));
        }
    }

    /// The next sample of the log, with the head that it should have. Where the log ends it begins again,
    /// later.
    pub fn peek(&self) -> WireSample {
        let mut sample = self.samples[self.next % self.samples.len()];
        sample.time_ns += self.lap_ns();
        sample.seal(Head {
            sequence: (self.next - self.left_out) as u64,
            source: self.source,
            machine_hash: self.hash,
            time_ns: sample.time_ns,
            published_ns: self.time.now_ns(),
        });
        sample
    }

    /// Leaves the next sample out: what follows is numbered as if it had never been meant to come.
    pub fn leave_out(&mut self) {
        self.next += 1;
        self.left_out += 1;
    }

    /// Returns the delay of the next sample against its time in the log (ns), by the laps of the log so far.
    fn lap_ns(&self) -> i64 {
        let (first, last) = (&self.samples[0], &self.samples[self.samples.len() - 1]);
        let laps = (self.next / self.samples.len()) as i64;
        laps * (last.log_time_ns - first.log_time_ns + 3_000_000)
    }

    /// Waits until the next sample is due.
    pub fn wait(&mut self) {
        let sample = &self.samples[self.next % self.samples.len()];
        let since_ns = sample.log_time_ns - self.samples[0].log_time_ns + self.lap_ns();
        self.time.pass_until(self.start_ns + since_ns);
    }

    /// Sends samples as they are, at their pace.
    pub fn send(&mut self, count: usize) {
        (0..count).for_each(|_| self.inject(|_| ()));
    }

    /// Sends the next sample, changed.
    pub fn inject(&mut self, change: impl FnOnce(&mut WireSample)) {
        self.wait();
        let mut sample = self.peek();
        change(&mut sample);
        self.raw(&sample);
        self.next += 1;
    }

    /// Sends the next sample, changed and sealed again, so that its checksum is right.
    pub fn inject_sealed(&mut self, change: impl FnOnce(&mut WireSample)) {
        self.inject(|sample| {
            change(sample);
            sample.seal(sample.head());
        });
    }

    /// Sends samples; returns the verdicts on rows that came meanwhile.
    pub fn rows(&mut self, count: usize) -> Vec<WireVerdict> {
        let mut rows = Vec::new();
        let mut left = count;
        while left > 0 {
            let some = left.min(20);
            self.send(some);
            left -= some;
            let is_row = |v: &WireVerdict| v.session == self.source && v.event == EVENT_ROW;
            while let Some(verdict) = self.find(is_row) {
                rows.push(verdict);
            }
        }
        rows
    }

    /// Sends the end of the session.
    pub fn end(&mut self) {
        let mut end = WireSample::end();
        end.seal(Head {
            time_ns: 0,
            ..self.peek().head()
        });
        self.raw(&end);
        self.next += 1;
    }

    /// Sends a sample unchanged.
    pub fn raw(&mut self, sample: &WireSample) {
        self.producer.samples().send_raw(sample).unwrap();
        self.time.wake();
    }

    /// Sends samples until no danger is seen: after a second and ten good rows.
    pub fn run_in(&mut self) {
        let from_ns = self.time.now_ns();
        let mut last = None;
        while self.time.now_ns() - from_ns < 1_500_000_000 {
            self.send(1);
            while let Some(verdict) = self.find(|v| v.session == self.source) {
                last = Some(verdict);
                if verdict.verdict().level.sees_no_danger() {
                    return;
                }
            }
        }
        let last = last.unwrap();
        panic!(
            "never without danger: {:?} {:?} {:?}, utilisation {}, {} rows, {} refused, {} lost",
            last.verdict(),
            last.conditions(),
            last.row_reasons().iter().collect::<Vec<_>>(),
            last.utilisation,
            last.rows,
            last.refused,
            last.lost
        );
    }
}

/// Returns a predicate: whether a verdict reports this fault, at the level of a fault.
pub fn reports(fault: InputFault) -> impl Fn(&WireVerdict) -> bool {
    move |verdict| verdict.conditions().faults.has(fault) && verdict.level == Level::Fault as u32
}

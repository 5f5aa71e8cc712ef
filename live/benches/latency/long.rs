//! A thousand rows a second for long, beside a recorder and a neighbour that takes a whole processor.

use std::process::{Command, Stdio};
use std::time::Duration;

use tipwatch_live::node::Producer;
use tipwatch_live::node::Receiver;
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::session::StampClock;
use tipwatch_live::wire::topics::{EVENT_ROW, Wire, WireSession, WireVerdict};

use super::support::World;
use super::{Other, Steady, machine_name, report, support, wait_until};

const PERIOD_NS: i64 = 1_000_000;

/// Delays, losses and levels of the rows.
#[derive(Default)]
struct Rows {
    delays_ns: Vec<i64>,
    late: u64,
    lost: u64,
    refused: u64,
    levels: [u64; 6],
    next: Option<u64>,
    verdicts_lost: u64,
}

impl Rows {
    fn take(&mut self, verdict: &WireVerdict) {
        assert!(verdict.is_whole());
        if let Some(next) = self.next {
            self.verdicts_lost += verdict.sequence - next;
        }
        self.next = Some(verdict.sequence + 1);
        (self.lost, self.refused) = (verdict.lost, verdict.refused);
        if verdict.event == EVENT_ROW {
            let delay_ns = verdict.published_ns - verdict.sample_published_ns;
            self.late += u64::from(delay_ns > PERIOD_NS);
            self.levels[verdict.level as usize] += 1;
            self.delays_ns.push(delay_ns);
        }
    }
}

/// Runs for so many seconds, and prints.
pub(crate) fn run(seconds: u64) {
    let world = World::new("ll");
    let node = world.join();
    let verdicts: Receiver<WireVerdict> = node.receiver().unwrap();
    let machine = support::data(&format!("{}.toml", machine_name()));
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let folder = tempfile::tempdir().unwrap();
    let recorder = world.record(&machine, folder.path(), &[]);
    let neighbour = Other(
        Command::new("sh")
            .args(["-c", "while :; do :; done"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap(),
    );
    let mut steady = Steady::new(&machine_name(), monotonic_ns().unsigned_abs());
    steady.session.clock = StampClock {
        stamp_ns: steady.time_ns,
        host_ns: monotonic_ns(),
    };
    let mut producer = Producer::new(&node, steady.session.id, steady.hash).unwrap();
    producer
        .announce(&mut WireSession::try_from(&steady.session).unwrap())
        .unwrap();
    while producer.readers() < 2 {
        std::thread::sleep(Duration::from_millis(1));
    }
    let mut rows = Rows::default();
    let (mut late_sends, mut sent) = (0_u64, 0_u64);
    let mut due_ns = monotonic_ns();
    for tick in 0..seconds * 1000 {
        due_ns += PERIOD_NS;
        wait_until(due_ns);
        late_sends += u64::from(monotonic_ns() - due_ns > PERIOD_NS);
        if tick % 20 == 0 {
            producer.update_connections().unwrap();
        }
        for mut sample in steady.next(monotonic_ns()) {
            producer.send(&mut sample).unwrap();
            sent += 1;
        }
        while verdicts
            .receive(|verdict| rows.take(verdict))
            .unwrap()
            .is_some()
        {}
    }
    std::thread::sleep(Duration::from_millis(500));
    while verdicts
        .receive(|verdict| rows.take(verdict))
        .unwrap()
        .is_some()
    {}
    drop(neighbour);
    drop(monitor);
    recorder.signal("-TERM");
    let recorder = recorder.end();
    println!(
        "{sent} samples sent, {late_sends} of {} rows more than a period late",
        sent / 2
    );
    println!(
        "monitor: {} rows, {} samples lost, {} refused; {} verdicts lost on the way here",
        rows.delays_ns.len(),
        rows.lost,
        rows.refused,
        rows.verdicts_lost
    );
    println!(
        "verdicts more than a period after their sample: {}; rows unknown {}, safe {}, notice {}, warning {}, danger {}, fault {}",
        rows.late,
        rows.levels[0],
        rows.levels[1],
        rows.levels[2],
        rows.levels[3],
        rows.levels[4],
        rows.levels[5]
    );
    print!("{}", recorder.err);
    report(
        "sample to verdict, 1 kHz, recorder, busy neighbour",
        rows.delays_ns,
    );
}

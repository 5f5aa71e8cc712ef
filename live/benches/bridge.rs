//! Delay that the bridge adds to a message: `cargo bench -p tipwatch-live --bench bridge -- [seconds] [speed]`.
//!
//! This program publishes the topics of a simulated machine on DDS, with stamps of now. A bare subscriber beside it and
//! `tipwatch-live bridge` receive the same messages in the same run; of each message are compared
//!
//! 1. the time from publishing to the bare subscriber,
//! 2. the time from publishing to the sample in shared memory, as a reader of samples sees it,
//! 3. their difference: what the bridge adds.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    dead_code,
    reason = "a program for people, on the helpers of the tests"
)]

#[path = "../tests/support/mod.rs"]
mod support;

use std::collections::{BTreeMap, HashMap};
use std::ops::ControlFlow;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use support::{World, data};
use tipwatch_ingest::Log;
use tipwatch_live::bridge::dds::{Participant, start_dds};
use tipwatch_live::bridge::input::{HostClock, Intake, Teller, Wanted};
use tipwatch_live::system::clock::{monotonic_ns, unix_ns};
use tipwatch_live::wire::topics::{WireSample, WireSession};

/// Bytes of the stamp in a message with a header: seconds and nanoseconds behind the encapsulation.
const STAMP: std::ops::Range<usize> = 4..12;

fn main() {
    let mut numbers = std::env::args().filter_map(|argument| argument.parse::<f64>().ok());
    let seconds = numbers.next().unwrap_or(30.0);
    let speed = numbers.next().unwrap_or(1.0);
    let domain = 100 + (std::process::id() % 100) as u16;
    let world = World::new("addeddelay");
    let machine = data("tiny.toml");
    let bridge = world.start(&[
        "bridge",
        "--machine",
        machine.to_str().unwrap(),
        "--dds",
        &domain.to_string(),
        "--no-verdicts",
    ]);

    // the bare subscriber
    let (intake, arrivals) = Intake::new(Teller::default());
    let participant = Participant::join(domain, &[]).unwrap();
    let wanted = Wanted {
        names: ["/joint_states", "/imu/data", "/odom"]
            .map(str::to_owned)
            .into(),
        ..Wanted::default()
    };
    start_dds(
        &participant,
        wanted,
        BTreeMap::new(),
        intake,
        HostClock::default(),
    )
    .unwrap();
    let bare = std::thread::spawn(move || {
        let mut seen: HashMap<i64, i64> = HashMap::new();
        let mut quiet = Instant::now();
        while quiet.elapsed() < Duration::from_secs(5) || seen.is_empty() {
            if let Ok(arrival) = arrivals.next(Duration::from_millis(100)) {
                seen.insert(stamp_ns(&arrival.data), arrival.host_ns);
                quiet = Instant::now();
            }
        }
        seen
    });

    // the reader of samples
    let (ends, is_over) = channel::<()>();
    let address = world.address();
    let bridged = std::thread::spawn(move || {
        let node = tipwatch_live::node::LiveNode::new(&address, "reader").unwrap();
        let sessions = node.receiver::<WireSession>().unwrap();
        let samples = node.receiver::<WireSample>().unwrap();
        let listener = node.event_listener::<WireSample>().unwrap();
        let mut seen: HashMap<i64, i64> = HashMap::new();
        while is_over.try_recv().is_err() {
            listener.wait(Duration::from_millis(1));
            let _ = sessions.receive(|_| ());
            while let Some(stamp) = samples.receive(|sample| sample.time_ns).unwrap() {
                seen.entry(stamp).or_insert_with(monotonic_ns);
            }
        }
        seen
    });

    let sent = publish(domain, seconds, speed);
    std::thread::sleep(Duration::from_secs(1));
    ends.send(()).unwrap();
    let bridged = bridged.join().unwrap();
    bridge.signal("-INT");
    eprint!("{}", bridge.end().err);
    let bare = bare.join().unwrap();

    let (mut of_bare, mut of_bridge, mut added) = (Vec::new(), Vec::new(), Vec::new());
    for (stamp, sent_ns) in &sent {
        let (Some(bare), Some(bridged)) = (bare.get(stamp), bridged.get(stamp)) else {
            continue;
        };
        of_bare.push(bare - sent_ns);
        of_bridge.push(bridged - sent_ns);
        added.push(bridged - bare);
    }
    println!(
        "{} messages sent, {} at the bare subscriber, {} as samples",
        sent.len(),
        bare.len(),
        bridged.len()
    );
    report("published to bare subscriber", of_bare);
    report("published to sample", of_bridge);
    report("added by the bridge", added);
}

fn stamp_ns(message: &[u8]) -> i64 {
    let part = |at: usize| u32::from_le_bytes(message[at..at + 4].try_into().unwrap());
    i64::from(part(4)) * 1_000_000_000 + i64::from(part(8))
}

/// Publishes for so long; returns when each stamp was sent (ns).
fn publish(domain: u16, seconds: f64, speed: f64) -> Vec<(i64, i64)> {
    let log = Log::open(&data("tiny.mcap")).unwrap();
    let participant = Participant::join(domain, &[]).unwrap();
    let names = ["/joint_states", "/imu/data", "/odom"];
    let topics: Vec<_> = (log.topics().iter())
        .filter(|topic| names.contains(&topic.name.as_str()))
        .collect();
    let writers: Vec<_> = (topics.iter())
        .map(|topic| {
            participant
                .writer(&topic.name, &topic.type_name, 64)
                .unwrap()
        })
        .collect();
    let ids: Vec<_> = topics.iter().map(|topic| topic.id).collect();
    let mut messages = Vec::new();
    log.read(&ids, &mut |message| {
        let place = ids.iter().position(|id| *id == message.topic).unwrap();
        messages.push((message.log_time_ns, place, message.data.to_vec()));
        ControlFlow::Continue(())
    })
    .unwrap();
    let length_ns = messages.last().unwrap().0 - messages[0].0 + 10_000_000;
    std::thread::sleep(Duration::from_secs(3));
    let (start, first_ns) = (Instant::now(), messages[0].0);
    let mut sent = Vec::new();
    for round in 0.. {
        for (log_ns, place, data) in &mut messages {
            let since_ns = *log_ns - first_ns + round * length_ns;
            let due = Duration::from_secs_f64(since_ns as f64 * 1e-9 / speed);
            if due.as_secs_f64() > seconds {
                return sent;
            }
            std::thread::sleep(due.saturating_sub(start.elapsed()));
            let now = unix_ns();
            data[STAMP.start..STAMP.start + 4]
                .copy_from_slice(&((now / 1_000_000_000) as u32).to_le_bytes());
            data[STAMP.start + 4..STAMP.end]
                .copy_from_slice(&((now % 1_000_000_000) as u32).to_le_bytes());
            let sent_ns = monotonic_ns();
            writers[*place].write(data).unwrap();
            sent.push((now, sent_ns));
        }
    }
    sent
}

fn report(what: &str, mut times_ns: Vec<i64>) {
    times_ns.sort_unstable();
    let Some(last) = times_ns.len().checked_sub(1) else {
        println!("{what:30} nothing came");
        return;
    };
    let at = |share: f64| times_ns[(last as f64 * share).round() as usize] as f64 * 1e-3;
    println!(
        "{what:30} n {:7}  median {:9.1}  p99 {:9.1}  p99.9 {:9.1}  max {:9.1} us",
        last + 1,
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}

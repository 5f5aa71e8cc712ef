//! Many hours of machine time: memory, shared memory and counters do not drift.
//!
//! `TIPWATCH_LONG_HOURS=24 cargo test --workspace --test tests needs_long::day -- --ignored --nocapture`

use std::path::Path;
use std::time::{Duration, Instant};

use tipwatch_live::wire::topics::Kind;

use crate::support::feed::{Feed, RealTime};
use crate::support::killing::left_over;
use crate::support::{Ended, Process, World, data};

/// Samples that a reader may lag behind: less than its queue holds.
const MAX_BACKLOG: u64 = 500;
/// Measurements of the memory in a run.
const MEASUREMENTS: usize = 20;
/// Growth of a process's memory after the first quarter of a run that is no leak (kB): the lower quartile of the steps
/// between two measurements, times their number. A stall of a busy computer makes a process keep more once, and the ring
/// of the recorder fills by several stalls; a leak grows in every step.
const MAX_GROWTH_KB: i64 = 4096;
/// Most memory of a process at any time (kB): what may wait for the disk is bounded by 64 MiB.
const MAX_KB: i64 = 160 << 10;

/// Memory (kB), files and handles that monitor and recorder occupy.
#[derive(Debug, Clone, Copy)]
struct Occupied {
    monitor_kb: i64,
    recorder_kb: i64,
    files: usize,
    handles: usize,
}

impl Occupied {
    fn of(world: &World, monitor: &Process, recorder: &Process) -> Self {
        let folders = ["/dev/shm", "/tmp/iceoryx2/nodes", "/tmp/iceoryx2/services"];
        let entries =
            folders.map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten());
        let own = entries.into_iter().flatten().filter(|entry| {
            entry
                .file_name()
                .to_string_lossy()
                .starts_with(&world.prefix)
        });
        Self {
            monitor_kb: resident_kb(monitor.child.id()),
            recorder_kb: resident_kb(recorder.child.id()),
            files: own.count(),
            handles: handles(monitor.child.id()) + handles(recorder.child.id()),
        }
    }
}

fn resident_kb(process: u32) -> i64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status
        .lines()
        .find(|line| line.starts_with("VmRSS:"))
        .unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

fn handles(process: u32) -> usize {
    std::fs::read_dir(Path::new("/proc").join(process.to_string()).join("fd"))
        .unwrap()
        .count()
}

/// The number before these words in the line of the counts on standard error.
fn number(ended: &Ended, words: &str) -> u64 {
    let is_it = |line: &&str| line.contains(" rows; ") || line.contains(" commands in ");
    let line = ended
        .err
        .lines()
        .rfind(is_it)
        .unwrap_or_else(|| panic!("{}", ended.err));
    let (before, _) = line
        .split_once(words)
        .unwrap_or_else(|| panic!("{words}: {line}"));
    before.rsplit(' ').next().unwrap().parse().unwrap()
}

/// Samples and verdicts that the recorder tells it has not recorded.
fn not_recorded(ended: &Ended) -> (u64, u64) {
    let told = ended.err.lines().find_map(|line| {
        let (samples, verdicts) =
            (line.split_once("not recorded: ")?.1).split_once(" samples, ")?;
        Some((
            samples.parse().ok()?,
            verdicts.split_once(' ')?.0.parse().ok()?,
        ))
    });
    told.unwrap_or_default()
}

/// Runs a monitor and a black box for so many hours of the machine's time, as fast as they can. The black box may lose this
/// share of the samples, if it says so.
fn run(hours: f64, most_lost: f64) {
    let world = World::new("long");
    let folder = tempfile::tempdir().unwrap();
    let machine = data("tiny_lift.toml");
    let monitor = world.monitor(&machine, &["--quiet", "--allow-untimed"]);
    // the log is dangerous again and again: the black box always writes, and removes its oldest files
    let options = [
        "--on",
        "danger",
        "--longest",
        "60",
        "--keep",
        "16",
        // at fifty times real time 8 MiB are full before a disk that other tests use, too, has answered
        "--ring",
        "64",
    ];
    let recorder = world.record(&machine, folder.path(), &options);
    let node = world.join();
    let mut feed = Feed::with(&node, "tiny_lift", RealTime, |session| {
        session.pace = 0.0;
        session.wants_progress = true;
    });
    while feed.producer.readers() < 2 {
        std::thread::sleep(Duration::from_millis(1));
    }
    feed.producer.update_connections().unwrap();
    let start = Instant::now();
    let first_ns = feed.peek().log_time_ns;
    let (mut rows, mut sent) = (0_u64, 0_u64);
    let mut measured: Vec<Occupied> = Vec::new();
    loop {
        let sample = feed.peek();
        let elapsed_h = (sample.time_ns - first_ns) as f64 / 3.6e12;
        if elapsed_h >= hours {
            break;
        }
        if elapsed_h * MEASUREMENTS as f64 >= hours * measured.len() as f64 {
            measured.push(Occupied::of(&world, &monitor, &recorder));
        }
        rows += u64::from(sample.kind == Kind::Joints as u32 && sample.stream == 0);
        sent += 1;
        feed.raw(&sample);
        feed.next += 1;
        if sent.is_multiple_of(100) {
            feed.producer.update_connections().unwrap();
            while feed
                .producer
                .backlog_of(sent)
                .unwrap()
                .is_none_or(|backlog| backlog > MAX_BACKLOG)
            {
                feed.producer.update_connections().unwrap();
                std::thread::sleep(Duration::from_micros(100));
            }
        }
    }
    feed.end();
    while feed.producer.backlog_of(sent + 1).unwrap() != Some(0) && feed.producer.readers() > 0 {
        std::thread::sleep(Duration::from_millis(1));
    }
    let took_s = start.elapsed().as_secs_f64();
    let (monitor, recorder) = (monitor.end(), recorder.end());
    drop(feed);
    drop(node);
    println!("{hours} h of machine time in {took_s:.0} s: {sent} samples, {rows} rows");
    for occupied in &measured {
        println!("{occupied:?}");
    }
    // counters
    assert_eq!(number(&monitor, " rows; "), rows, "{}", monitor.err);
    for count in [" lost,", " refused,", " repeated,"] {
        assert_eq!(number(&monitor, count), 0, "{}", monitor.err);
    }
    // a disk that cannot keep up with many times real time loses some, and says how many
    let (lost_samples, lost_verdicts) = not_recorded(&recorder);
    println!("not recorded: {lost_samples} samples, {lost_verdicts} verdicts");
    let recorded = |words: &str| number(&recorder, words);
    assert_eq!(recorded(" verdicts, ") + lost_verdicts, rows);
    assert_eq!(recorded(" samples, ") + lost_samples, sent);
    assert!(
        lost_samples as f64 <= most_lost * sent as f64,
        "{lost_samples} of {sent} samples"
    );
    // memory, shared memory and handles
    let after = &measured[measured.len() / 4..];
    let (first, last) = (after[0], after[after.len() - 1]);
    for (process, of) in [
        ("monitor", (|o| o.monitor_kb) as fn(&Occupied) -> i64),
        ("recorder", |o| o.recorder_kb),
    ] {
        let mut steps: Vec<i64> = (after.windows(2))
            .map(|two| of(&two[1]) - of(&two[0]))
            .collect();
        steps.sort_unstable();
        let growth_kb = steps[steps.len() / 4] * steps.len() as i64;
        let most_kb = after.iter().map(of).max().unwrap();
        println!(
            "{process}: from {} to {} kB, without stalls {growth_kb} kB more",
            of(&first),
            of(&last)
        );
        assert!(growth_kb < MAX_GROWTH_KB, "{process}: {steps:?}");
        assert!(most_kb < MAX_KB, "{process}: {most_kb} kB");
    }
    assert!(
        last.files <= first.files,
        "files in shared memory: {first:?} {last:?}"
    );
    assert!(last.handles <= first.handles + 2, "{first:?} {last:?}");
    assert_eq!(left_over(&world).0, 0);
}

#[test]
fn a_quarter_of_an_hour_leaves_nothing_behind() {
    run(0.25, 0.0);
}

mod needs_long {
    use super::*;

    #[test]
    #[ignore = "takes hours; TIPWATCH_LONG_HOURS sets the machine time, 24 by default"]
    fn day_leaves_nothing_behind() {
        let hours = std::env::var("TIPWATCH_LONG_HOURS").ok();
        // half an hour and more at fifty times real time: a disk that others use, too, does not keep up all the time
        run(
            hours.and_then(|hours| hours.parse().ok()).unwrap_or(24.0),
            0.1,
        );
    }
}

//! Processes killed with SIGKILL at random times while the others go on.
//!
//! Used by a short test and by a long benchmark: `cargo bench -p tipwatch-live --bench crash`.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use iceoryx2::prelude::*;
use tipwatch_ingest::Log;
use tipwatch_live::node::{LiveNode, Receiver};
use tipwatch_live::system::clock::monotonic_ns;
use tipwatch_live::wire::topics::{EVENT_ROW, Wire, WireCommand, WireVerdict};
use tipwatch_mechanics::verdict::Level;

use super::feed::samples;
use super::producing::Producing;
use super::{World, data};

/// Pseudo-random numbers.
pub struct Random(u64);

impl Random {
    pub fn new() -> Self {
        Self(monotonic_ns().unsigned_abs() | 1)
    }

    /// From `low` to below `high`.
    pub fn between(&mut self, low: u64, high: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + self.0 % (high - low)
    }
}

/// Times of many kills (ms).
#[derive(Debug, Default)]
pub struct Times(pub Vec<f64>);

impl Times {
    pub fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().saturating_sub(1);
        let at = (last as f64 * share).round() as usize;
        sorted.get(at).copied().unwrap_or(f64::NAN)
    }

    pub fn print(&self, what: &str) {
        println!(
            "{what:52} n {:4}  median {:8.2}  p99 {:8.2}  max {:8.2} ms",
            self.0.len(),
            self.quantile(0.5),
            self.quantile(0.99),
            self.quantile(1.0)
        );
    }
}

/// A reader of verdicts that asserts that none is torn.
pub struct Reading(pub Receiver<WireVerdict>);

impl Reading {
    pub fn new(node: &LiveNode) -> Self {
        Self(node.receiver().unwrap())
    }

    /// The first verdict for which `is_it` holds; panics after a minute.
    pub fn wait_for(&self, what: &str, is_it: impl Fn(&WireVerdict) -> bool) -> WireVerdict {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(60) {
            let found = self.0.receive(|verdict| {
                assert!(verdict.is_whole(), "a torn verdict");
                is_it(verdict).then_some(*verdict)
            });
            match found.unwrap() {
                Some(Some(verdict)) => return verdict,
                Some(None) => {}
                None => std::thread::sleep(Duration::from_micros(200)),
            }
        }
        panic!("{what}: not seen");
    }

    pub fn drain(&self) {
        while self
            .0
            .receive(|verdict| assert!(verdict.is_whole()))
            .unwrap()
            .is_some()
        {}
    }
}

/// Dead nodes of a world that no other process could remove, and the number of its files.
pub fn left_over(world: &World) -> (usize, usize) {
    let node = world.join();
    for _ in 0..100 {
        node.remove_dead_nodes();
        if counted(world).0 == 0 {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(node);
    counted(world)
}

fn counted(world: &World) -> (usize, usize) {
    let mut config = Config::global_config().clone();
    config.global.prefix = FileName::new(world.prefix.as_bytes()).unwrap();
    let mut dead = 0;
    Node::<ipc::Service>::list(&config, |state| {
        dead += usize::from(matches!(state, NodeState::Dead(_)));
        CallbackProgression::Continue
    })
    .unwrap();
    let files = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let own = files.filter(|file| {
        file.file_name()
            .to_string_lossy()
            .starts_with(&world.prefix)
    });
    (dead, own.count())
}

/// Kills the monitor; returns the times from its start to its first row.
pub fn kill_monitors(world: &World, count: usize) -> Times {
    let producing = Producing::start(&world.address(), "forwarder6");
    let node = world.join();
    let reading = Reading::new(&node);
    let mut random = Random::new();
    let mut times = Times::default();
    let mut source = 0;
    for _ in 0..count {
        let started_ns = monotonic_ns();
        let monitor = world.monitor(&data("forwarder6.toml"), &["--quiet", "--stay"]);
        let row = reading.wait_for("a row of the new monitor", |verdict| {
            verdict.event == EVENT_ROW && verdict.source != source
        });
        source = row.source;
        times.0.push((row.published_ns - started_ns) as f64 * 1e-6);
        std::thread::sleep(Duration::from_millis(random.between(1, 60)));
        monitor.kill();
        reading.drain();
        node.remove_dead_nodes();
    }
    let slowest_ms = producing.shared.slowest_ns.load(Ordering::Relaxed) as f64 * 1e-6;
    println!("the producer's slowest send meanwhile: {slowest_ms:.3} ms");
    producing.end();
    times
}

/// Kills the control; returns the times from its start to its first command on a row.
pub fn kill_controls(world: &World, count: usize) -> Times {
    let producing = Producing::start(&world.address(), "second_paper");
    let node = world.join();
    let machine = data("second_paper.toml");
    let monitor = world.monitor(&machine, &["--quiet", "--stay"]);
    let reading = Reading::new(&node);
    let commands: Receiver<WireCommand> = node.receiver().unwrap();
    let mut random = Random::new();
    let mut times = Times::default();
    let mut source = 0;
    for _ in 0..count {
        let started_ns = monotonic_ns();
        let control = world.control(&machine, &["--stay"]);
        let row = wait_for_command(&commands, |command| {
            // a new one never begins with an open valve
            let is_first = command.source != source && command.rows <= 1;
            assert!(!is_first || command.opening == [0.0; 2], "{command:?}");
            command.event == EVENT_ROW && command.source != source
        });
        source = row.source;
        times.0.push((row.published_ns - started_ns) as f64 * 1e-6);
        std::thread::sleep(Duration::from_millis(random.between(1, 60)));
        control.kill();
        // the monitor goes on
        reading.drain();
        let from_ns = monotonic_ns();
        reading.wait_for("the next row", |verdict| {
            verdict.event == EVENT_ROW && verdict.published_ns > from_ns
        });
        node.remove_dead_nodes();
    }
    producing.end();
    drop(monitor);
    times
}

/// The first command for which `is_it` holds; panics after a minute.
pub fn wait_for_command(
    commands: &Receiver<WireCommand>,
    is_it: impl Fn(&WireCommand) -> bool,
) -> WireCommand {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        match commands.receive(|command| *command).unwrap() {
            Some(command) => {
                assert!(command.is_whole(), "a torn command");
                if is_it(&command) {
                    return command;
                }
            }
            None => std::thread::sleep(Duration::from_micros(200)),
        }
    }
    panic!("no such command");
}

/// Kills the screen; returns the times to the monitor's next row.
pub fn kill_screens(world: &World, count: usize) -> Times {
    let producing = Producing::start(&world.address(), "forwarder6");
    let node = world.join();
    let reading = Reading::new(&node);
    let monitor = world.monitor(&data("forwarder6.toml"), &["--quiet", "--stay"]);
    reading.wait_for("a row", |verdict| verdict.event == EVENT_ROW);
    let mut random = Random::new();
    let mut gaps = Times::default();
    for _ in 0..count {
        let program = env!("CARGO_BIN_EXE_tipwatch-live");
        let command = format!("exec {program} watch --prefix {}", world.prefix);
        let mut script = Command::new("script")
            .args(["-qefc", &command, "/dev/null"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(random.between(5, 120)));
        let children = Command::new("pgrep")
            .args(["-P", &script.id().to_string()])
            .output()
            .unwrap();
        for id in String::from_utf8_lossy(&children.stdout).split_whitespace() {
            let _ = Command::new("kill").args(["-9", id]).status();
        }
        let _ = script.kill();
        let _ = script.wait();
        // the monitor goes on: a row within a moment
        reading.drain();
        let from_ns = monotonic_ns();
        let row = reading.wait_for("the next row", |verdict| {
            verdict.event == EVENT_ROW && verdict.published_ns > from_ns
        });
        gaps.0.push((row.published_ns - from_ns) as f64 * 1e-6);
    }
    producing.end();
    drop(monitor);
    gaps
}

/// Kills the producer; times from the start of the next one to its first row.
pub fn kill_producers(world: &World, count: usize) -> Times {
    let node = world.join();
    let reading = Reading::new(&node);
    let monitor = world.monitor(&data("forwarder6.toml"), &["--quiet", "--stay"]);
    reading.wait_for("a monitor", |_| true);
    let mut random = Random::new();
    let mut times = Times::default();
    let mut session = 0;
    for _ in 0..count {
        let started_ns = monotonic_ns();
        let replay = world.replay("forwarder6", &["--wait", "60"]);
        let row = reading.wait_for("a row of the new session", |verdict| {
            verdict.event == EVENT_ROW && verdict.session != session
        });
        session = row.session;
        times.0.push((row.published_ns - started_ns) as f64 * 1e-6);
        std::thread::sleep(Duration::from_millis(random.between(1, 100)));
        replay.kill();
        reading.wait_for("a fault", |verdict| {
            verdict.session == session && verdict.level == Level::Fault as u32
        });
        reading.drain();
    }
    drop(monitor);
    times
}

/// Samples lost, times to start and holes in the files of killed recorders.
#[derive(Debug, Default)]
pub struct Recorded {
    /// From the last sample in the file to the last one sent before the kill.
    pub lost: Times,
    /// From the start of a recorder to its first sample.
    pub started: Times,
    /// Samples missing in the middle of a file.
    pub holes: u64,
}

/// Kills the recorder.
pub fn kill_recorders(world: &World, folder: &Path, count: usize) -> Recorded {
    let producing = Producing::start(&world.address(), "forwarder6");
    let node = world.join();
    let mut random = Random::new();
    let mut recorded = Recorded::default();
    let (_, samples) = samples("forwarder6");
    // by sample of a lap: when it is sent, from the lap's start
    let length_ns = samples[samples.len() - 1].log_time_ns - samples[0].log_time_ns + 3_000_000;
    let sent_ms = |sequence: u64| {
        let (lap, at) = (
            sequence / samples.len() as u64,
            sequence as usize % samples.len(),
        );
        let since_ns = samples[at].log_time_ns - samples[0].log_time_ns;
        (lap as i64 * length_ns + since_ns) as f64 * 1e-6
    };
    for kill in 0..count {
        let out = folder.join(kill.to_string());
        let started = Instant::now();
        let recorder = world.record(&data("forwarder6.toml"), &out, &[]);
        let file = loop {
            if let Some(file) = files(&out).into_iter().find(|file| size(file) > 60_000) {
                break file;
            }
            assert!(
                started.elapsed() < Duration::from_secs(60),
                "nothing recorded"
            );
            std::thread::sleep(Duration::from_millis(1));
        };
        recorded
            .started
            .0
            .push(started.elapsed().as_secs_f64() * 1e3);
        std::thread::sleep(Duration::from_millis(random.between(1, 150)));
        let sent = producing.sent();
        recorder.kill();
        let (first, last, holes) = sequences(&file);
        assert!(last > first);
        recorded.holes += holes;
        let lost_ms = sent_ms(sent.saturating_sub(1)) - sent_ms(last);
        recorded.lost.0.push(lost_ms.max(0.0));
        node.remove_dead_nodes();
        std::fs::remove_dir_all(&out).unwrap();
    }
    producing.end();
    recorded
}

fn size(file: &Path) -> u64 {
    file.metadata().map_or(0, |metadata| metadata.len())
}

/// The MCAP files of a recorder, over all sessions.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries(folder)
        .flat_map(|session| {
            entries(&session.path())
                .map(|file| file.path())
                .collect::<Vec<_>>()
        })
        .collect();
    files.sort();
    files
}

/// The first and the last number of the samples in a file, and how many between them are missing.
pub fn sequences(file: &Path) -> (u64, u64, u64) {
    known_sequences(file).expect("samples in the file")
}

/// Returns the same numbers as [`sequences`]; `None` of a file that has verdicts alone.
pub fn known_sequences(file: &Path) -> Option<(u64, u64, u64)> {
    let log = Log::open(file).unwrap();
    let topics: Vec<_> = log
        .topics()
        .iter()
        .filter(|topic| !topic.name.starts_with("/tipwatch"))
        .map(|topic| topic.id)
        .collect();
    let mut numbers = Vec::new();
    log.read(&topics, &mut |message| {
        numbers.push(u64::from(message.sequence));
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    numbers.sort_unstable();
    let (first, last) = (*numbers.first()?, *numbers.last()?);
    Some((first, last, last - first + 1 - numbers.len() as u64))
}

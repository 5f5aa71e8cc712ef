//! Tests of what identifies a result, and of what a supervisor is told: hashes of programs, options and files in every session,
//! readiness and the watchdog of systemd.

use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};
use tipwatch_binding::hex;
use tipwatch_live::node::{Housekeeping, Receiver};
use tipwatch_live::system::supervisor::Supervisor;
use tipwatch_live::wire::topics::{Wire, WireMachine, WireVerdict};
use tipwatch_mechanics::machine::Proof;

use crate::support::killing::files;
use crate::support::{Process, World, data};

const PROGRAM: &str = env!("CARGO_BIN_EXE_tipwatch-live");

fn hash(path: impl AsRef<Path>) -> [u8; 32] {
    Sha256::digest(std::fs::read(path).unwrap()).into()
}

// requirement: TW-EVIDENCE-01, TW-EVIDENCE-02
#[test]
fn sessions_carry_the_hashes_of_programs_options_and_files() {
    let (world, folder) = (World::new("hash"), tempfile::tempdir().unwrap());
    let machine = data("tiny_lift.toml");
    let node = world.join();
    let machines: Receiver<WireMachine> = node.receiver().unwrap();
    let monitor = world.monitor(&machine, &["--stay"]);
    let recorder = world.record(&machine, folder.path(), &["--split", "0.2", "--stay"]);
    let replay = world.replay(
        "tiny_lift",
        &["--speed", "4", "--readers", "2", "--wait", "60"],
    );
    let replay = replay.end();
    assert!(replay.status.success(), "{}", replay.err);
    let published = machines.receive(|machine| *machine).unwrap().unwrap();
    // the last verdicts
    std::thread::sleep(Duration::from_millis(700));
    monitor.signal("-TERM");
    recorder.signal("-TERM");
    let (monitor, recorder) = (monitor.end(), recorder.end());
    assert!(monitor.status.success(), "{}", monitor.err);
    assert!(recorder.status.success(), "{}", recorder.err);

    assert!(published.is_whole());
    assert_eq!(published.program_sha256, hash(PROGRAM));
    assert_eq!(published.machine_sha256, hash(&machine));
    assert_eq!(published.urdf_sha256, hash(data("tiny_lift.urdf")));
    assert_eq!(published.commissioning_sha256, [0; 32]);
    let end = published
        .options
        .iter()
        .position(|&byte| byte == 0)
        .unwrap();
    let options = &published.options[..end];
    assert_eq!(
        published.options_sha256,
        <[u8; 32]>::from(Sha256::digest(options))
    );
    let options: Vec<String> = serde_json::from_slice(options).unwrap();
    assert_eq!(
        (options[0].as_str(), options[2].as_str()),
        ("monitor", machine.to_str().unwrap())
    );
    for hash in [
        published.program_sha256,
        published.options_sha256,
        published.machine_sha256,
        published.urdf_sha256,
    ] {
        assert!(monitor.err.contains(&hex(&hash)), "{}", monitor.err);
    }
    assert!(
        recorder.err.contains(&hex(&hash(PROGRAM))),
        "{}",
        recorder.err
    );

    let mut files = files(folder.path());
    assert!(files.len() > 1, "{files:?}");
    files.sort_by_key(|file| file.metadata().unwrap().modified().unwrap());
    let mut is_known = false;
    for file in &files {
        let bytes = std::fs::read(file).unwrap();
        let messages = mcap::MessageStream::new(&bytes).unwrap();
        let programs: Vec<_> = messages
            .map(Result::unwrap)
            .filter(|message| message.channel.topic == "/tipwatch/program")
            .collect();
        // from the moment when the monitor follows the session, in every file
        assert!(!is_known || !programs.is_empty(), "{}", file.display());
        is_known |= !programs.is_empty();
        for program in programs {
            let text = String::from_utf8_lossy(&program.data).into_owned();
            for hash in [
                published.program_sha256,
                published.options_sha256,
                published.machine_sha256,
                published.urdf_sha256,
            ] {
                assert!(text.contains(&hex(&hash)), "{text}");
            }
            for proof in Proof::OTHERS {
                assert!(text.contains(&proof.way(|_| String::new())), "{text}");
            }
        }
        let metadata = recorder_metadata(&bytes);
        assert_eq!(metadata["recorder_program_sha256"], hex(&hash(PROGRAM)));
        assert_eq!(metadata["recorder_machine_sha256"], hex(&hash(&machine)));
        assert!(metadata["recorder_options"].starts_with("[\"record\""));
    }
    assert!(is_known, "no file tells what the monitor is");
}

fn recorder_metadata(bytes: &[u8]) -> std::collections::BTreeMap<String, String> {
    let records = mcap::read::LinearReader::new(bytes).unwrap();
    let found = records.filter_map(|record| match record.unwrap() {
        mcap::records::Record::Metadata(found) => Some(found.metadata),
        _ => None,
    });
    found.last().expect("metadata")
}

/// The socket of a supervisor.
struct Notified {
    socket: UnixDatagram,
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl Notified {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        let limit = Duration::from_millis(100);
        socket.set_read_timeout(Some(limit)).unwrap();
        Self {
            socket,
            path,
            _folder: folder,
        }
    }

    /// Starts the program as a service whose watchdog has this limit.
    fn start(&self, world: &World, arguments: &[&str]) -> Process {
        let mut command = Command::new(PROGRAM);
        command
            .env("NOTIFY_SOCKET", &self.path)
            .env("WATCHDOG_USEC", "400000");
        world.start_by(command, arguments)
    }

    /// The next state, within a tenth of a second.
    fn next(&self) -> Option<String> {
        let mut bytes = [0; 256];
        let count = self.socket.recv(&mut bytes).ok()?;
        Some(String::from_utf8(bytes[..count].to_vec()).unwrap())
    }

    /// Waits for this state; everything before it.
    fn wait_for(&self, state: &str) -> Vec<String> {
        let (start, mut before) = (Instant::now(), Vec::new());
        while start.elapsed() < Duration::from_secs(60) {
            match self.next() {
                Some(found) if found == state => return before,
                found => before.extend(found),
            }
        }
        panic!("no {state} after {before:?}");
    }

    /// All states until none comes for half a second.
    fn rest(&self) -> Vec<String> {
        let (mut last, mut found) = (Instant::now(), Vec::new());
        while last.elapsed() < Duration::from_millis(500) {
            if let Some(state) = self.next() {
                found.push(state);
                last = Instant::now();
            }
        }
        found
    }
}

// requirement: TW-EVIDENCE-03
#[test]
fn services_are_ready_when_they_are_open_and_tell_their_end() {
    let world = World::new("notify");
    let (machine, folder) = (data("tiny.toml"), tempfile::tempdir().unwrap());
    let machine = machine.to_str().unwrap();
    let state = world.state_folder.to_str().unwrap().to_string();
    let monitor_arguments = [
        "monitor",
        "--stay",
        "--quiet",
        "--state",
        &state,
        "--machine",
        machine,
    ];
    let of_monitor = Notified::new();
    let monitor = of_monitor.start(&world, &monitor_arguments);
    assert_eq!(of_monitor.wait_for("READY=1"), Vec::<String>::new());
    // what it told is true: its verdicts are there
    let verdicts = world.join().receiver::<WireVerdict>().unwrap();
    assert_eq!(verdicts.writers(), 1);
    // a second one never gets ready
    let of_second = Notified::new();
    let second = of_second.start(&world, &monitor_arguments).end();
    assert_eq!(second.status.code(), Some(1), "{}", second.err);
    assert!(!of_second.rest().contains(&"READY=1".into()));

    let of_recorder = Notified::new();
    let out = folder.path().to_str().unwrap();
    let recorder = of_recorder.start(&world, &["record", out, "--stay", "--machine", machine]);
    assert_eq!(of_recorder.wait_for("READY=1"), Vec::<String>::new());
    for (notified, program) in [(of_monitor, monitor), (of_recorder, recorder)] {
        for _ in 0..3 {
            notified.wait_for("WATCHDOG=1");
        }
        program.signal("-TERM");
        notified.wait_for("STOPPING=1");
        let ended = program.end();
        assert!(ended.status.success(), "{}", ended.err);
        assert_eq!(notified.rest(), Vec::<String>::new());
    }
}

// requirement: TW-EVIDENCE-03, TW-FAULT-23
#[test]
fn loop_that_hangs_does_not_serve_the_watchdog() {
    let world = World::new("hang");
    let notified = Notified::new();
    let limit = Some(Duration::from_millis(200));
    let supervisor = Supervisor::new(notified.path.to_str().unwrap(), limit);
    let housekeeping = Housekeeping::supervised(&world.address(), supervisor).unwrap();
    // a loop that has not completed a cycle is not ready, however long its thread beside it runs
    assert_eq!(notified.rest(), Vec::<String>::new());
    let start = Instant::now();
    while start.elapsed() < Duration::from_millis(900) {
        housekeeping.cycle_completed();
        std::thread::sleep(Duration::from_millis(5));
    }
    let told = notified.rest();
    assert_eq!(told[0], "READY=1");
    assert!(
        told.len() > 3 && told[1..].iter().all(|state| state == "WATCHDOG=1"),
        "{told:?}"
    );
    assert_eq!(notified.rest(), Vec::<String>::new());
    drop(housekeeping);
    assert_eq!(notified.rest(), ["STOPPING=1"]);
}

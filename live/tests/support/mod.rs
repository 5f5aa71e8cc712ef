//! The program's processes in isolated worlds.

#![allow(
    unreachable_pub,
    dead_code,
    reason = "several programs include this module, and none uses all of it"
)]

pub mod feed;
pub mod killing;
pub mod numbered;
pub mod obeying;
pub mod offline;
pub mod prioritise;
pub mod producing;
pub mod standing;
pub mod steered;
pub mod steered_clock;
pub mod world;

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tipwatch_live::wire::session::Session;
use tipwatch_live::wire::topics::{Head, Wire, WireSession, WireVerdict};

pub use world::{World, data};

/// Far longer than any test takes: it only prevents hangs.
pub const LIMIT: Duration = Duration::from_secs(240);

/// Seals a message of a session.
pub fn seal<T: Wire>(message: &mut T, session: &Session, sequence: u64, published_ns: i64) {
    message.seal(Head {
        sequence,
        source: session.id,
        machine_hash: session.machine_hash,
        time_ns: message.head().time_ns,
        published_ns,
    });
}

impl World {
    /// Waits until a producer exists. It is no reader of samples, because a replay would count it.
    pub fn wait_for_producer(&self) {
        let node = self.join();
        let sessions = node.receiver::<WireSession>().unwrap();
        let start = Instant::now();
        while sessions.writers() == 0 {
            assert!(start.elapsed() < LIMIT, "no producer");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits for such a verdict.
    pub fn wait_for_verdict(&self, is_it: impl Fn(&WireVerdict) -> bool) {
        killing::Reading::new(&self.join()).wait_for("a verdict", is_it);
    }

    /// Starts the program.
    pub fn start(&self, arguments: &[&str]) -> Process {
        self.start_by(Command::new(env!("CARGO_BIN_EXE_tipwatch-live")), arguments)
    }

    /// Starts the program through another one, which receives its arguments.
    pub fn start_by(&self, mut command: Command, arguments: &[&str]) -> Process {
        let child = command
            .args(arguments)
            .args(["--prefix", &self.prefix])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Process::watch(child)
    }

    pub fn monitor(&self, machine: &Path, more: &[&str]) -> Process {
        let mut arguments = vec!["monitor", "--machine", machine.to_str().unwrap()];
        arguments.extend(["--state", self.state_folder.to_str().unwrap()]);
        arguments.extend(more);
        self.start(&arguments)
    }

    pub fn control(&self, machine: &Path, more: &[&str]) -> Process {
        let mut arguments = vec!["control", "--machine", machine.to_str().unwrap()];
        arguments.extend(more);
        self.start(&arguments)
    }

    pub fn record(&self, machine: &Path, folder: &Path, more: &[&str]) -> Process {
        let mut arguments = vec!["record", folder.to_str().unwrap(), "--machine"];
        arguments.push(machine.to_str().unwrap());
        arguments.extend(more);
        self.start(&arguments)
    }

    /// Replays `name.mcap` with `name.toml` of the test data.
    pub fn replay(&self, name: &str, more: &[&str]) -> Process {
        let (log, machine) = (data(&format!("{name}.mcap")), data(&format!("{name}.toml")));
        self.replay_log(&log, &machine, more)
    }

    pub fn replay_log(&self, log: &Path, machine: &Path, more: &[&str]) -> Process {
        let mut arguments = vec!["replay", log.to_str().unwrap(), "--machine"];
        arguments.push(machine.to_str().unwrap());
        arguments.extend(more);
        self.start(&arguments)
    }
}

type Text = std::thread::JoinHandle<String>;

/// A process that is killed when the test ends, however it ends.
pub struct Process {
    pub child: Child,
    out: Option<Text>,
    err: Option<Text>,
}

pub struct Ended {
    pub status: ExitStatus,
    pub out: String,
    pub err: String,
}

impl Process {
    fn watch(mut child: Child) -> Self {
        let out = reader_of(child.stdout.take().unwrap());
        let err = reader_of(child.stderr.take().unwrap());
        Self {
            child,
            out: Some(out),
            err: Some(err),
        }
    }

    /// Sends a signal, like "-STOP".
    pub fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let sent = Command::new("kill").args([name, &id]).status().unwrap();
        assert!(sent.success());
    }

    /// Kills it: SIGKILL.
    pub fn kill(mut self) -> Ended {
        self.child.kill().unwrap();
        self.end()
    }

    pub fn end(mut self) -> Ended {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if start.elapsed() > LIMIT {
                self.child.kill().unwrap();
                break self.child.wait().unwrap();
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let text = |thread: Option<Text>| thread.unwrap().join().unwrap();
        Ended {
            status,
            out: text(self.out.take()),
            err: text(self.err.take()),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn reader_of(mut pipe: impl Read + Send + 'static) -> Text {
    std::thread::spawn(move || {
        let mut text = String::new();
        pipe.read_to_string(&mut text).unwrap();
        text
    })
}

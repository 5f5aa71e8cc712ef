//! Worlds of their own in shared memory, and the program as processes in them.

#![allow(
    unreachable_pub,
    dead_code,
    reason = "several programs have this module, and none uses all of it"
)]

pub mod favour;
pub mod feed;
pub mod killing;
pub mod numbered;
pub mod producing;
pub mod steered;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tipwatch_live::node::{LiveNode, ServiceAddress};

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data");
/// Far beyond what any test takes: only so that none hangs.
const LIMIT: Duration = Duration::from_secs(240);

pub fn data(name: &str) -> PathBuf {
    Path::new(DATA).join(name)
}

/// A world of its own in shared memory.
pub struct World {
    pub prefix: String,
}

impl World {
    pub fn new(test: &str) -> Self {
        Self {
            prefix: format!("tw{}{test}_", std::process::id()),
        }
    }

    pub fn address(&self) -> ServiceAddress {
        ServiceAddress {
            service: "tipwatch".into(),
            prefix: Some(self.prefix.clone()),
        }
    }

    pub fn join(&self) -> LiveNode {
        LiveNode::new(&self.address(), "test").unwrap()
    }

    /// Starts the program.
    pub fn start(&self, arguments: &[&str]) -> Process {
        self.start_by(Command::new(env!("CARGO_BIN_EXE_tipwatch-live")), arguments)
    }

    /// Starts the program by another one, which is given its arguments.
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

impl Drop for World {
    fn drop(&mut self) {
        // What killed processes leave, and one small file of each prefix.
        let folders = ["/dev/shm", "/tmp/iceoryx2"];
        let listed = folders.map(std::fs::read_dir).into_iter().flatten();
        for entry in listed.flatten().flatten() {
            if entry
                .file_name()
                .to_string_lossy()
                .starts_with(&self.prefix)
            {
                let _ = std::fs::remove_file(entry.path());
            }
        }
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

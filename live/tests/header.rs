//! The C header and the C client in the repository.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use tipwatch_live::node::{EventNotifier, Sender};
use tipwatch_live::wire::c_header::c_header;
use tipwatch_live::wire::topics::{Topic, Wire, WireSample, WireSession, WireVerdict};

use crate::support::{World, data};

const LIVE: &str = env!("CARGO_MANIFEST_DIR");

fn file(name: &str) -> PathBuf {
    Path::new(LIVE).join(name)
}

#[test]
fn header_is_current() {
    let committed = std::fs::read_to_string(file("include/tipwatch_live.h")).unwrap();
    assert!(
        committed == c_header(),
        "run: tipwatch-live header > live/include/tipwatch_live.h"
    );
}

/// A compiler, the language and its standard.
type Compiler = (&'static str, &'static str, &'static str);
const C: Compiler = ("cc", "c", "-std=c11");
const CPP: Compiler = ("c++", "c++", "-std=c++11");

fn compile(source: &Path, (compiler, language, standard): Compiler, more: &[&str]) {
    let include = file("include");
    let compiled = Command::new(compiler)
        .args([standard, "-O1", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(include)
        .args(["-x", language])
        .arg(source)
        .args(more)
        .output()
        .unwrap_or_else(|error| panic!("{compiler}: {error}"));
    let messages = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{messages}");
}

/// The header's static assertions check the sizes of all messages.
fn assert_sizes(compiler: Compiler) {
    let header = file("include/tipwatch_live.h");
    compile(&header, compiler, &["-fsyntax-only"]);
}

/// Compiles a program into a folder.
fn program(source: &str, compiler: Compiler, folder: &Path) -> PathBuf {
    let program = folder.join("program");
    compile(
        &file(source),
        compiler,
        &["-o", program.to_str().unwrap(), "-lm"],
    );
    program
}

fn assert_checks(compiler: Compiler) {
    let folder = tempfile::tempdir().unwrap();
    let checks = program("tests/c/checks.c", compiler, folder.path());
    let ran = Command::new(checks).output().unwrap();
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
}

/// The example, in front of a monitor: this test is its transport.
fn assert_client(test: &str, compiler: Compiler) {
    let folder = tempfile::tempdir().unwrap();
    let client = program("examples/client.c", compiler, folder.path());
    let world = World::new(test);
    let monitor = world.monitor(&data("tiny.toml"), &["--quiet"]);
    let node = world.join();
    let mut client = Command::new(client)
        .args([data("tiny.toml"), data("tiny.urdf")])
        .arg("4")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let mut to = client.stdin.take().unwrap();
        let (world, is_over) = (&world, &is_over);
        scope.spawn(move || {
            // the ends of a service stay in their thread
            let node = world.join();
            let verdicts = node.receiver::<WireVerdict>().unwrap();
            while !is_over.load(Ordering::Relaxed) {
                while let Some(verdict) = verdicts.receive(|v| *v).unwrap() {
                    // it ends before the monitor
                    let _ = to.write_all(&frame(&verdict));
                }
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        });
        let from = client.stdout.take().unwrap();
        let bridge = Bridge {
            sessions: node.sender(0, 0).unwrap(),
            samples: node.sender(0, 0).unwrap(),
            notifier: node.event_notifier::<WireSample>().unwrap(),
        };
        bridge.carry(from);
        // the monitor reads the end of the session
        std::thread::sleep(std::time::Duration::from_millis(300));
        is_over.store(true, Ordering::Relaxed);
    });
    let said = said(client);
    let monitor = monitor.end();
    assert!(monitor.status.success(), "{}", monitor.err);
    let counts = "0 lost, 0 refused, 0 repeated";
    assert!(monitor.err.contains(counts), "{}", monitor.err);
    assert!(said.contains("assumed\n"), "{said}");
    assert!(said.contains(" 0 lost, 0 refused\n"), "{said}");
}

fn said(mut client: Child) -> String {
    let mut said = String::new();
    let mut err = client.stderr.take().unwrap();
    err.read_to_string(&mut said).unwrap();
    assert!(client.wait().unwrap().success(), "{said}");
    said
}

/// The wire, for messages that come as bytes.
struct Bridge {
    sessions: Sender<WireSession>,
    samples: Sender<WireSample>,
    notifier: EventNotifier,
}

impl Bridge {
    fn carry(&self, mut from: ChildStdout) {
        let (mut service, mut size) = ([0; 16], [0; 8]);
        while from.read_exact(&mut service).is_ok() {
            from.read_exact(&mut size).unwrap();
            let mut bytes = vec![0; u64::from_ne_bytes(size) as usize];
            from.read_exact(&mut bytes).unwrap();
            let end = service.iter().position(|&byte| byte == 0).unwrap();
            let service = std::str::from_utf8(&service[..end]).unwrap();
            match (service, bytes.len()) {
                (WireSample::SUFFIX, 0) => self.notifier.notify(),
                (WireSample::SUFFIX, _) => self.samples.send_raw(&message(&bytes)).unwrap(),
                (WireSession::SUFFIX, _) => self.sessions.send_raw(&message(&bytes)).unwrap(),
                other => panic!("{other:?}"),
            }
            self.sessions.update_connections().unwrap();
        }
    }
}

#[allow(unsafe_code, reason = "a message is its bytes")]
fn message<T: Wire>(bytes: &[u8]) -> T {
    assert_eq!(bytes.len(), size_of::<T>());
    // SAFETY: the size is right, and every pattern of bits is a message: its fields are numbers.
    let message: T = unsafe { std::ptr::read_unaligned(bytes.as_ptr().cast()) };
    assert!(message.is_whole());
    message
}

#[allow(unsafe_code, reason = "a message is its bytes")]
fn frame(verdict: &WireVerdict) -> Vec<u8> {
    let size = size_of::<WireVerdict>();
    // SAFETY: a message has no padding.
    let bytes = unsafe { std::slice::from_raw_parts(std::ptr::from_ref(verdict).cast(), size) };
    let mut frame = WireVerdict::SUFFIX.as_bytes().to_vec();
    frame.resize(16, 0);
    frame.extend((size as u64).to_ne_bytes());
    frame.extend::<&[u8]>(bytes);
    frame
}

#[test]
fn c_compiler_agrees_with_the_sizes() {
    assert_sizes(C);
}

#[test]
fn c_client_checks_messages() {
    assert_checks(C);
}

#[test]
fn monitor_understands_a_client_in_c() {
    assert_client("c", C);
}

mod needs_cpp {
    use super::*;

    #[test]
    #[ignore = "needs a C++ compiler"]
    fn cpp_compiler_agrees_with_the_sizes() {
        assert_sizes(CPP);
    }

    #[test]
    #[ignore = "needs a C++ compiler"]
    fn cpp_client_checks_messages() {
        assert_checks(CPP);
    }

    #[test]
    #[ignore = "needs a C++ compiler"]
    fn monitor_understands_a_client_in_cpp() {
        assert_client("cpp", CPP);
    }
}

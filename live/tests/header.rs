//! The C headers, the C client and its library.

use std::path::{Path, PathBuf};
use std::process::Command;

use tipwatch_live::wire::c_header::c_header;

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
pub(crate) type Compiler = (&'static str, &'static str, &'static str);
pub(crate) const C: Compiler = ("cc", "c", "-std=c11");
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
    let folder = folder.to_str().unwrap();
    compile(
        &file(source),
        compiler,
        &[
            "-o",
            program.to_str().unwrap(),
            "-x",
            "none",
            "-L",
            folder,
            "-Wl,-rpath",
            &format!("-Wl,{folder}"),
            "-Wl,--as-needed",
            "-ltipwatch_client",
            "-pthread",
            "-lm",
        ],
    );
    program
}

/// Puts the library into a folder under the names by which compilers and programs look for it.
fn put_library(folder: &Path) {
    // cargo builds it beside the tests, which depend on it
    let tests = std::env::current_exe().unwrap();
    let built = tests.with_file_name("libtipwatch_client.so");
    for name in ["libtipwatch_client.so", "libtipwatch_client.so.0"] {
        std::os::unix::fs::symlink(&built, folder.join(name)).unwrap();
    }
}

/// A folder with the library and a program that is linked with it.
pub(crate) fn linked(source: &str, compiler: Compiler) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    put_library(folder.path());
    let program = program(source, compiler, folder.path());
    (folder, program)
}

fn assert_checks(compiler: Compiler) {
    let (_folder, checks) = linked("tests/c/checks.c", compiler);
    assert_succeeds(&mut Command::new(checks));
}

/// Right and wrong calls of every function of the library.
fn assert_library(test: &str, compiler: Compiler) {
    let (_folder, checks) = linked("tests/c/library.c", compiler);
    let world = World::new(test);
    assert_succeeds(Command::new(checks).arg(&world.prefix));
}

fn assert_succeeds(command: &mut Command) -> String {
    let ran = command.output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    let errors = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}{errors}");
    said
}

/// The example, in front of a monitor.
fn assert_client(test: &str, compiler: Compiler) {
    let (_folder, client) = linked("examples/client.c", compiler);
    let world = World::new(test);
    let monitor = world.monitor(&data("tiny.toml"), &["--quiet"]);
    let said = assert_succeeds(
        Command::new(client)
            .args([data("tiny.toml"), data("tiny.urdf")])
            .args(["5", "--prefix", &world.prefix]),
    );
    let monitor = monitor.end();
    assert!(monitor.status.success(), "{}", monitor.err);
    let counts = "0 lost, 0 refused, 0 repeated";
    assert!(monitor.err.contains(counts), "{}", monitor.err);
    let lines: Vec<_> = said.lines().collect();
    for line in [
        "assumed",
        "danger",
        "the monitor confirms the acknowledgement",
    ] {
        assert!(lines.contains(&line), "{said}");
    }
    let (own, rest) = lines.last().unwrap().split_once(' ').unwrap();
    assert!(own.parse::<u64>().unwrap() > 100, "{said}");
    assert_eq!(rest, "verdicts of this session, 0 lost, 0 refused");
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
fn library_refuses_wrong_calls_from_c() {
    assert_library("calls", C);
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
    fn library_refuses_wrong_calls_from_cpp() {
        assert_library("cppcalls", CPP);
    }

    #[test]
    #[ignore = "needs a C++ compiler"]
    fn monitor_understands_a_client_in_cpp() {
        assert_client("cpp", CPP);
    }
}

//! Runs the commands of a page in a folder of its own and compares what they print.
//!
//! A line that begins with `$ ` is a command, the lines up to the next one are what it prints on both streams.
//! No lines: the output is not compared. `...` alone stands for any lines, `[..]` for any text within a line.
//! Every command must end with exit code 0; a page that shows another one says `; echo $?`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use tempfile::TempDir;
use tipwatch_tests::python_package;

use super::page::{Block, Page, Part, is_blessing, root};

/// Stands between the outputs of two commands, with the exit code of the first.
const MARK: char = '\u{1}';
/// Name of the temporary folder in the documents.
const HOME: &str = "/home/you";

/// Runs a page; with `python` its Python blocks too, which may import the package of the tree. Returns the differences.
pub(super) fn run(page: &Page, python: Option<&str>) -> Vec<String> {
    let blocks = page.blocks();
    let imports =
        |block: &Block| block.language == "python" && block.text.contains("import tipwatch");
    let package = (python.is_some() && blocks.iter().any(imports)).then(python_package);
    let folder = TempDir::with_prefix("documents_").expect("a temporary folder");
    let folder = folder.path().canonicalize().expect("a path");
    let mut differences = Vec::new();
    let mut text = page.text.clone();
    let mut parts = page.parts().into_iter().peekable();
    while let Some(part) = parts.next() {
        match part {
            Part::Setup(commands) => {
                let output = shell(&folder, &format!("set -e\n{commands}\n"));
                assert!(output.1, "{}: setup {commands}: {}", page.name, output.0);
            }
            Part::Block(block) if block.language == "console" && block.not_run().is_none() => {
                let (found, block_differences) = run_block(&folder, page, &block);
                differences.extend(block_differences);
                text = text.replacen(&block.text, &found, 1);
            }
            Part::Block(block) if block.language == "python" && block.not_run().is_none() => {
                let check = parts.next_if(|next| matches!(next, Part::Check(_)));
                let Some(program) = python else { continue };
                let check = match &check {
                    Some(Part::Check(check)) => check.as_str(),
                    _ => "",
                };
                let script = format!("{}\n{check}\n", block.text);
                let output = Command::new(program)
                    .args(["-c", &script])
                    .current_dir(&folder)
                    .envs(package.map(|package| ("PYTHONPATH", package)))
                    .output()
                    .unwrap_or_else(|e| panic!("{program}: {e}"));
                if !output.status.success() {
                    let told = String::from_utf8_lossy(&output.stderr);
                    differences.push(format!("{}:{}: {told}", page.name, block.line));
                }
            }
            Part::Block(_) | Part::Check(_) => {}
        }
    }
    if is_blessing() && text != page.text {
        fs::write(root().join(&page.name), text).expect("a page that can be written");
    }
    differences
}

/// A command with the output that the page shows for it.
struct Shown<'a> {
    command: &'a str,
    output: Vec<&'a str>,
}

fn shown(block: &str) -> Vec<Shown<'_>> {
    let mut all: Vec<Shown<'_>> = Vec::new();
    for line in block.lines() {
        match (line.strip_prefix("$ "), all.last_mut()) {
            (Some(command), _) => all.push(Shown {
                command,
                output: Vec::new(),
            }),
            (None, Some(last)) => last.output.push(line),
            (None, None) => panic!("expected a line that begins with \"$ \", found {line:?}"),
        }
    }
    all
}

/// Returns the block with the outputs as found, and the differences.
fn run_block(folder: &Path, page: &Page, block: &Block) -> (String, Vec<String>) {
    let shown = shown(&block.text);
    let script: String = (shown.iter())
        .map(|s| format!("{}\nprintf '{MARK}%d{MARK}' $?\n", s.command))
        .chain(["wait\n".into()])
        .collect();
    let (output, _) = shell(folder, &script);
    let mut pieces = output.split(MARK);
    let (mut text, mut differences) = (String::new(), Vec::new());
    for Shown { command, output } in &shown {
        let found = pieces.next().unwrap_or_default().trim_matches('\n');
        let code = pieces.next().unwrap_or("none");
        let found: Vec<&str> = found.lines().map(str::trim_end).collect();
        let place = format!("{}:{}: $ {command}", page.name, block.line);
        if code != "0" {
            differences.push(format!("{place}\nexit code {code}: {}", found.join("\n")));
        }
        let fits = output.is_empty() || lines_match(output, &found);
        if !fits && !is_blessing() {
            let (expected, found) = (output.join("\n"), found.join("\n"));
            differences.push(format!(
                "{place}\nexpected:\n{expected}\nfound:\n{found}\n\
                 TIPWATCH_BLESS=1 writes the output that was found into the page"
            ));
        }
        text.push_str(&format!("$ {command}\n"));
        let lines = if fits { output } else { &found };
        lines
            .iter()
            .for_each(|line| text.push_str(&format!("{line}\n")));
    }
    (text, differences)
}

fn lines_match(expected: &[&str], found: &[&str]) -> bool {
    match expected {
        [] => found.is_empty(),
        ["...", rest @ ..] => (0..=found.len()).any(|skipped| lines_match(rest, &found[skipped..])),
        [line, rest @ ..] => match found {
            [] => false,
            [other, others @ ..] => line_matches(line, other) && lines_match(rest, others),
        },
    }
}

fn line_matches(expected: &str, found: &str) -> bool {
    let mut pieces = expected.split("[..]");
    let first = pieces.next().unwrap_or_default();
    let Some(mut rest) = found.strip_prefix(first) else {
        return false;
    };
    let mut is_open = false;
    for piece in pieces {
        is_open = true;
        let Some(at) = rest.find(piece) else {
            return false;
        };
        if piece.is_empty() {
            rest = "";
        } else {
            rest = &rest[at + piece.len()..];
            is_open = false;
        }
    }
    rest.is_empty() || is_open
}

/// Runs a script; gives both streams, the folder's name replaced, and whether it succeeded.
fn shell(folder: &Path, script: &str) -> (String, bool) {
    let programs = programs();
    let prelude = format!(
        // programs under the names that a reader uses, apart from other programs on this computer
        "exec 2>&1\n\
         tipwatch-live() {{\n\
           case $1 in header|--help) command tipwatch-live \"$@\";;\n\
           *) local sub=$1; shift; command tipwatch-live \"$sub\" --prefix {prefix} \"$@\";; esac\n\
         }}\n\
         tipwatch() {{\n\
           case \"$*\" in 'demo --live'*) command tipwatch \"$@\" --prefix {prefix} --speed max;;\n\
           *) command tipwatch \"$@\";; esac\n\
         }}\n\
         cargo() {{\n\
           case \"$*\" in\n\
           'run --release --bin tipwatch -- '*) shift 5; tipwatch \"$@\";;\n\
           'run --release -p tipwatch-analyze --example csv_to_mcap -- '*) shift 7; csv_to_mcap \"$@\";;\n\
           *) echo \"no program for: cargo $*\"; return 127;;\n\
           esac\n\
         }}\n",
        prefix = folder.file_name().expect("a name").display(),
    );
    let search = std::env::var("PATH").unwrap_or_default();
    let programs = programs.display();
    let output = Command::new("timeout")
        .args(["600", "bash", "-c", &(prelude + script)])
        .current_dir(folder)
        .env("PATH", format!("{programs}:{programs}/examples:{search}"))
        .env(
            "DATA",
            root().join("tests/data").canonicalize().expect("data"),
        )
        .env("NO_COLOR", "1")
        // alarms that a monitor keeps
        .env("XDG_STATE_HOME", folder.join(".state"))
        .output()
        .expect("timeout and bash");
    let text = String::from_utf8_lossy(&output.stdout);
    let text = text.replace(&folder.display().to_string(), HOME);
    (text, output.status.success())
}

/// The folder of the built programs. They are built by `cargo test --workspace`; a test of this package alone
/// does not build them, so they must be newer than what they are made of, so far as cargo has written that down
/// (`cargo test` builds them without doing so).
fn programs() -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    let folder = test
        .ancestors()
        .nth(2)
        .expect("target/PROFILE")
        .to_path_buf();
    let changed = |path: &Path| fs::metadata(path).and_then(|m| m.modified());
    for name in ["tipwatch", "tipwatch-live", "examples/csv_to_mcap"] {
        let program = folder.join(name);
        let sources = fs::read_to_string(program.with_extension("d")).unwrap_or_default();
        let built = changed(&program).unwrap_or(SystemTime::UNIX_EPOCH);
        let newer = sources
            .split_whitespace()
            .skip(1)
            .find(|source| changed(Path::new(source)).is_ok_and(|time| time > built));
        assert!(
            newer.is_none() && program.exists(),
            "{}: expected a current program, found {newer:?} changed; \
             build with `cargo build --workspace --bins --examples`",
            program.display()
        );
    }
    folder
}

#[test]
fn output_matches_only_with_its_wildcards() {
    let fits = |expected: &[&str], found: &[&str]| lines_match(expected, found);
    assert!(fits(&["a", "...", "c"], &["a", "b", "b", "c"]));
    assert!(fits(&["...", "c", "..."], &["c"]));
    assert!(!fits(&["a", "..."], &["b", "a"]));
    assert!(!fits(&["a"], &["a", "b"]));
    assert!(fits(&["load [..] N"], &["load 12 N"]));
    assert!(fits(&["load [..]"], &["load 12 N"]));
    assert!(!fits(&["load [..] N"], &["load 12 kN at t"]));
    assert!(!fits(&["load 1"], &["load 12"]));
}

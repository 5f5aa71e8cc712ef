//! Snippets are valid: machine files, policies, fleet files, JSON, Rust.

use std::collections::BTreeSet;
use std::fs;

use tipwatch_analyze::policy::Policy;
use tipwatch_analyze::screen::Fleet;
use tipwatch_datasheet::Sheet;
use tipwatch_mechanics::MachineSpec;
use tipwatch_tests::data;

use super::fail_on;
use super::page::{Block, Page, root};

#[test]
fn snippets_of_the_documents_parse() {
    let mut differences = Vec::new();
    for page in Page::all() {
        for block in page.blocks() {
            let place = format!("{}:{}", page.name, block.line);
            let parsed = match block.language.as_str() {
                "toml" => parse_toml(&block, &place),
                "json" => serde_json::Deserializer::from_str(&block.text)
                    .into_iter::<serde_json::Value>()
                    .try_for_each(|value| value.map(drop))
                    .map_err(|e| e.to_string()),
                "text" => is_no_command(&block.text),
                "console" | "python" | "sh" if block.not_run().is_some() => Ok(()),
                "console" | "python" | "rust" if block.kind.is_empty() => Ok(()),
                other => Err(format!(
                    "nothing checks a block of {other:?} {:?}",
                    block.kind
                )),
            };
            differences.extend(parsed.err().map(|e| format!("{place}: {e}")));
        }
    }
    fail_on(&differences);
}

/// A machine file, whole or a part of one; a data sheet; a fleet file; a policy.
fn parse_toml(block: &Block, place: &str) -> Result<(), String> {
    match block.kind.as_str() {
        "" => {
            let text = fs::read_to_string(data("tiny.toml")).expect("a machine file");
            let mut whole: toml::Table = text.parse().expect("a machine file");
            let part: toml::Table = block
                .text
                .parse()
                .map_err(|e: toml::de::Error| e.to_string())?;
            merge(&mut whole, part);
            let text = toml::to_string(&whole).expect("a table");
            MachineSpec::from_toml(&text, place)
                .map(drop)
                .map_err(|e| e.to_string())
        }
        "complete" => {
            let spec = MachineSpec::from_toml(&block.text, place);
            spec.map(drop).map_err(|e| e.to_string())
        }
        "sheet" => {
            let sheet = Sheet::from_toml(&block.text, place);
            let machine = sheet.and_then(|sheet| sheet.machine());
            machine.map(drop).map_err(|e| e.to_string())
        }
        "policy" => {
            let policy = Policy::from_text(&block.text, place);
            policy.map(drop).map_err(|e| format!("{e:#}"))
        }
        "fleet" => {
            let folder = tempfile::tempdir().expect("a folder");
            let path = |name: &str| folder.path().join(name);
            fs::write(path("fleet.toml"), &block.text).expect("a file");
            for machine in block.text.split('"').filter(|name| name.ends_with(".toml")) {
                fs::copy(data("tiny.toml"), path(machine)).expect("a copy");
            }
            let fleet = Fleet::read(&path("fleet.toml"));
            fleet.map(drop).map_err(|e| format!("{e:#}"))
        }
        other => Err(format!(
            "expected complete, fleet, policy or nothing, found {other:?}"
        )),
    }
}

/// Puts a part of a machine file into a whole one: tables into tables, the rest in place of the earlier values.
fn merge(whole: &mut toml::Table, part: toml::Table) {
    for (key, value) in part {
        match (whole.get_mut(&key), value) {
            (Some(toml::Value::Table(known)), toml::Value::Table(more)) => merge(known, more),
            (_, value) => drop(whole.insert(key, value)),
        }
    }
}

fn is_no_command(text: &str) -> Result<(), String> {
    let is_command = |line: &&str| {
        ["$ ", "tipwatch", "cargo "]
            .iter()
            .any(|c| line.starts_with(c))
    };
    match text.lines().find(is_command) {
        Some(line) => Err(format!("a command that nothing runs: {line:?}")),
        None => Ok(()),
    }
}

#[test]
fn code_stands_in_fenced_blocks_only() {
    for page in Page::all() {
        let prose = page.prose();
        let lines: Vec<_> = prose.lines().collect();
        let indented = lines
            .windows(2)
            .find(|pair| pair[0].is_empty() && pair[1].starts_with("    "));
        assert!(indented.is_none(), "{}: {indented:?}", page.name);
    }
}

#[test]
fn pages_with_rust_are_compiled_as_doctests() {
    let doctests = fs::read_to_string(root().join("tests/support/documents.rs")).expect("a file");
    let included: BTreeSet<String> = (doctests.split("include_str!(\"../../").skip(1))
        .filter_map(|rest| Some(rest.split_once('"')?.0.to_string()))
        .collect();
    let with_rust: BTreeSet<String> = (Page::all().into_iter())
        .filter(|page| page.blocks().iter().any(|b| b.language == "rust"))
        .map(|page| page.name)
        .collect();
    assert_eq!(with_rust, included);
}

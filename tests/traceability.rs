//! Every requirement has a test, every tag names a requirement, and the page that lists both is current.
//!
//! A requirement is a row of a table of the book whose first cell is an identifier, `TW-KIND-NUMBER`. A test holds it
//! with a line `// requirement: TW-KIND-NUMBER` above its `#[test]`; several identifiers are separated by commas.

mod register;
mod tags;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use strum::VariantArray;
use tipwatch_live::wire::command::HoldReason;
use tipwatch_live::wire::refusal::Refusal;
use tipwatch_mechanics::machine::FaultKind;
use tipwatch_mechanics::state::Reason;
use tipwatch_mechanics::verdict::{InputFault, Level};

use register::{Requirement, register};
use tags::{Tag, tags};

/// The page that this test writes.
const MATRIX: &str = "book/src/reference/traceability.md";

/// Folders with tests.
const SOURCES: [&str; 7] = [
    "analyze",
    "calibration",
    "ingest",
    "live",
    "mechanics",
    "packaging",
    "tests",
];

/// The repository.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn all_tags() -> Vec<Tag> {
    let mut found = Vec::new();
    for folder in SOURCES {
        let folder = root().join(folder);
        if folder.is_dir() {
            tags::below(root(), &folder, &mut found);
        }
    }
    found.sort();
    found
}

#[test]
fn every_requirement_has_a_test_and_every_tag_a_requirement() {
    let problems = problems(&register(&root().join("book/src")), &all_tags());
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn the_traceability_matrix_is_current() {
    let new = matrix(&register(&root().join("book/src")), &all_tags());
    let path = root().join(MATRIX);
    let old = fs::read_to_string(&path).unwrap_or_default();
    if std::env::var_os("TIPWATCH_BLESS").is_some() && old != new {
        fs::write(path, new).expect("a page that can be written");
    } else {
        assert!(
            old == new,
            "{MATRIX} is not current: TIPWATCH_BLESS=1 writes it anew"
        );
    }
}

/// The matches have no wildcard: a new fault, reason or refusal does not compile until it has a requirement here, and
/// its requirement does not pass until the book and a test have it.
#[test]
fn every_fault_reason_and_refusal_of_the_code_has_its_requirement() {
    let register = register(&root().join("book/src"));
    let row = |id: &str| {
        let found = register.iter().find(|requirement| requirement.id == id);
        found.unwrap_or_else(|| panic!("{id} is not in the book"))
    };
    let names = |ids: &[&str], name: &str| {
        assert!(!ids.is_empty(), "{name}");
        for id in ids {
            let quoted = format!("`{name}`");
            assert!(row(id).text.contains(&quoted), "{id} does not name {name}");
        }
    };
    for &fault in InputFault::VARIANTS {
        names(of_fault(fault), fault.name());
    }
    for &reason in HoldReason::VARIANTS {
        names(of_hold_reason(reason), reason.name());
    }
    for &refusal in Refusal::VARIANTS {
        names(of_refusal(refusal), refusal.into());
    }
    // what these do to the verdict is said in words
    for &kind in FaultKind::VARIANTS {
        names(of_fault_kind(kind), InputFault::from(kind).name());
    }
    for &reason in Reason::VARIANTS {
        row(of_reason(reason));
    }
    for &level in Level::VARIANTS {
        row(of_level(level));
    }
}

fn of_fault(fault: InputFault) -> &'static [&'static str] {
    match fault {
        InputFault::NeverReceived => &["TW-FAULT-01"],
        InputFault::Stale => &["TW-FAULT-02"],
        InputFault::Lost => &["TW-FAULT-03"],
        InputFault::Disordered => &["TW-FAULT-04"],
        InputFault::ClockJump => &["TW-FAULT-05", "TW-FAULT-06"],
        InputFault::NotFinite => &["TW-FAULT-07"],
        InputFault::OutOfRange => &["TW-FAULT-08"],
        InputFault::ImpossibleRate => &["TW-FAULT-09"],
        InputFault::Frozen => &["TW-FAULT-10"],
        InputFault::JointLimit => &["TW-FAULT-11"],
        InputFault::NotUnit => &["TW-FAULT-12"],
        InputFault::Disagreement => &["TW-FAULT-13", "TW-FAULT-14"],
        InputFault::Torn => &["TW-FAULT-15"],
        InputFault::WrongSource => &["TW-FAULT-16"],
        InputFault::WrongMachine => &["TW-FAULT-17"],
        InputFault::SessionRefused => &["TW-FAULT-18"],
        InputFault::AlarmUnsaved => &["TW-FAULT-19"],
        InputFault::ProducerGone => &["TW-FAULT-20"],
        InputFault::VerdictLate => &["TW-FAULT-21"],
    }
}

fn of_fault_kind(kind: FaultKind) -> &'static [&'static str] {
    match kind {
        FaultKind::NotFinite => &["TW-FAULT-07"],
        FaultKind::OutOfRange | FaultKind::Saturated => &["TW-FAULT-08"],
        FaultKind::JointLimit => &["TW-FAULT-11"],
        FaultKind::ImpossibleRate | FaultKind::Outlier => &["TW-FAULT-09"],
        FaultKind::Frozen => &["TW-FAULT-10"],
        FaultKind::NotUnit => &["TW-FAULT-12"],
        FaultKind::Disagreement => &["TW-FAULT-13"],
        FaultKind::Contradiction => &["TW-FAULT-14"],
    }
}

fn of_reason(reason: Reason) -> &'static str {
    match reason {
        Reason::JointsGap | Reason::ImuGap | Reason::OdometryGap | Reason::ToolWrenchGap => {
            "TW-VERDICT-11"
        }
        Reason::JointsFault
        | Reason::ImuFault
        | Reason::OdometryFault
        | Reason::ToolWrenchFault => "TW-VERDICT-10",
        Reason::Contradiction => "TW-VERDICT-26",
        Reason::Settling => "TW-VERDICT-01",
        Reason::LinkageOpen | Reason::NoGroundContact | Reason::NotFinite => "TW-VERDICT-12",
        Reason::Tipping => "TW-VERDICT-06",
        Reason::GrossInput => "TW-VERDICT-13",
        Reason::SupportsUnknown => "TW-VERDICT-14",
    }
}

fn of_level(level: Level) -> &'static str {
    match level {
        Level::Unknown => "TW-VERDICT-01",
        Level::Safe => "TW-VERDICT-02",
        Level::Assumed => "TW-VERDICT-28",
        Level::Notice | Level::Warning | Level::Danger => "TW-VERDICT-03",
        Level::Fault => "TW-VERDICT-08",
    }
}

fn of_hold_reason(reason: HoldReason) -> &'static [&'static str] {
    match reason {
        HoldReason::NoRow => &["TW-CONTROL-01"],
        HoldReason::RowInvalid => &["TW-CONTROL-02"],
        HoldReason::NoVerdict => &["TW-CONTROL-03"],
        HoldReason::Verdict => &["TW-CONTROL-04"],
        HoldReason::Input => &["TW-CONTROL-05"],
        HoldReason::NoSolution => &["TW-CONTROL-06"],
        HoldReason::NotFollowing => &["TW-CONTROL-07"],
        HoldReason::WrongWay => &["TW-CONTROL-08"],
        HoldReason::OutsideStroke => &["TW-CONTROL-09"],
        HoldReason::Late => &["TW-CONTROL-10"],
        HoldReason::Starting => &["TW-CONTROL-11"],
    }
}

fn of_refusal(refusal: Refusal) -> &'static [&'static str] {
    match refusal {
        Refusal::Damaged => &["TW-REFUSAL-01"],
        Refusal::OtherMachine => &["TW-REFUSAL-02"],
        Refusal::Untimed => &["TW-REFUSAL-03"],
        Refusal::SensorMissing => &["TW-REFUSAL-04"],
        Refusal::SensorUnknown => &["TW-REFUSAL-05"],
        Refusal::Joints => &["TW-REFUSAL-06"],
        Refusal::ImuMounting => &["TW-REFUSAL-07"],
        Refusal::Unsuitable => &["TW-REFUSAL-08"],
    }
}

/// Returns the contradictions between the register of requirements and the tags of tests, one line each.
fn problems(register: &[Requirement], tags: &[Tag]) -> Vec<String> {
    let mut problems = Vec::new();
    let mut known = BTreeSet::new();
    for requirement in register {
        if !known.insert(requirement.id.as_str()) {
            problems.push(format!("{}: stands twice in the book", requirement.id));
        }
        let mut holding = tags.iter().filter(|tag| tag.id == requirement.id);
        if !holding.any(|tag| tag.test.is_some() && !tag.is_ignored) {
            problems.push(format!(
                "{}: expected a test that runs by default, found none ({})",
                requirement.id, requirement.page
            ));
        }
    }
    for tag in tags {
        if !known.contains(tag.id.as_str()) {
            problems.push(format!("{}: {} is no requirement", tag.place, tag.id));
        }
        if tag.test.is_none() {
            problems.push(format!("{}: {} stands above no test", tag.place, tag.id));
        }
    }
    problems
}

/// The page.
fn matrix(register: &[Requirement], tags: &[Tag]) -> String {
    let mut by_id: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    for tag in tags {
        if let Some(test) = &tag.test {
            let by_hand = if tag.is_ignored { " (on request)" } else { "" };
            let line = format!("`{}` {test}{by_hand}", tag.file);
            by_id.entry(&tag.id).or_default().insert(line);
        }
    }
    let tests: BTreeSet<&String> = by_id.values().flatten().collect();
    let mut page = format!(
        "# Traceability\n\n\
         <!-- Written by a test: TIPWATCH_BLESS=1 cargo test --workspace --test tests traceability -->\n\n\
         Every [requirement](requirements.md) and the tests that hold it: {} requirements, {} tests. The page is made of the tables\n\
         of the book and of the tags in the tests; the tests fail if a requirement has no test, if a tag names no requirement, or if\n\
         a fault of the code has no requirement. Tests marked \"on request\" need more than the repository and do not count. [Glossary](../glossary.md).\n",
        register.len(),
        tests.len()
    );
    let mut kind = "";
    for requirement in register {
        if requirement.kind() != kind {
            kind = requirement.kind();
            page += &format!("\n## {kind}\n\n| requirement | subject | tests |\n|---|---|---|\n");
        }
        let tests = by_id.get(requirement.id.as_str());
        let tests = tests.map(|tests| tests.iter().cloned().collect::<Vec<_>>());
        page += &format!(
            "| [{}]({}) | {} | {} |\n",
            requirement.id,
            requirement.link(),
            requirement.subject,
            tests.unwrap_or_default().join("<br>")
        );
    }
    page
}

#[test]
fn what_does_not_fit_together_is_found() {
    let book = "| id | x |\n|---|---|\n| TW-A-01 | `one` | text |\n| TW-A-02 | two |\n| TW-A-03 | three |\n| other | row |\n";
    let register = register::of_page("reference/page.md", book);
    assert_eq!(register.len(), 3);
    assert_eq!(register[0].subject, "`one`");
    // not a tag of this file
    let source = "\
MARK TW-A-01, TW-A-09
#[test]
fn holds() {}
#[test]
MARK TW-A-02
#[ignore = \"needs more\"]
fn ignored() {}
MARK TW-A-03
fn helper() {}
"
    .replace("MARK", "// requirement:");
    let found = tags("x.rs", &source);
    let problems = problems(&register, &found);
    let expected = [
        "TW-A-09 is no",
        "TW-A-02: expected",
        "TW-A-03: expected",
        "TW-A-03 stands above no",
    ];
    assert_eq!(problems.len(), expected.len(), "{problems:?}");
    for words in expected {
        assert!(
            problems.iter().any(|p| p.contains(words)),
            "{words}: {problems:?}"
        );
    }
    let twice = register::of_page("p.md", "| TW-A-01 | a |\n| TW-A-01 | b |\n");
    let twice = self::problems(&twice, &found);
    assert!(twice.iter().any(|p| p.contains("twice")), "{twice:?}");
}

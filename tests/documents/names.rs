//! Existence of everything that the documents name: links, anchors, files, identifiers, expansions of abbreviations.

use std::collections::BTreeSet;
use std::fs;

use super::page::{Page, book_files, files_below, root};
use super::{fail_on, quoted};

/// Abbreviations that a page must expand, unless it links to the glossary.
const ABBREVIATIONS: [(&str, &str); 10] = [
    ("CAN", "controller area network"),
    ("CRC", "cyclic redundancy check"),
    ("IMU", "inertial measurement unit"),
    ("ITOM", "improved tipping-over moment"),
    ("LTR", "load transfer ratio"),
    ("MHS", "moment-height stability"),
    ("OTF", "overturning force"),
    ("TOM", "tipping-over moment"),
    ("URDF", "unified robot description format"),
    ("ZMP", "zero-moment point"),
];

#[test]
fn links_and_anchors_exist() {
    let mut differences = Vec::new();
    for page in Page::all() {
        let folder = root()
            .join(&page.name)
            .parent()
            .expect("a folder")
            .to_path_buf();
        for target in links(&page.prose()) {
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let file = match path {
                "" => root().join(&page.name),
                path => folder.join(path),
            };
            let exists = match fs::read_to_string(&file) {
                Ok(text) if !anchor.is_empty() => headings(&text).contains(anchor),
                _ => file.exists(),
            };
            if !exists {
                differences.push(format!("{}: no such target: {target}", page.name));
            }
        }
    }
    fail_on(&differences);
}

/// Targets of the links of a page within the repository.
fn links(prose: &str) -> Vec<String> {
    let targets = prose
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'));
    let targets = targets.map(|(target, _)| target.to_string());
    targets.filter(|target| !target.contains("://")).collect()
}

/// Anchors of the headings of a page.
fn headings(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| -> String {
        let kept = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = kept
            .chars()
            .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn the_summary_lists_every_page_once() {
    let summary = Page::read("book/src/SUMMARY.md");
    let mut listed: Vec<_> = links(&summary.text)
        .iter()
        .map(|target| format!("book/src/{target}"))
        .collect();
    listed.push(summary.name);
    listed.sort();
    assert_eq!(listed, book_files());
}

#[test]
fn files_that_the_documents_name_exist() {
    let roots = [
        "analyze",
        "book",
        "calibration",
        "ingest",
        "live",
        "mechanics",
        "packaging",
        "tests",
        ".ci",
        ".cargo",
    ];
    let mut missing = Vec::new();
    for page in Page::all() {
        for name in quoted(&page.prose()) {
            let is_path = !name.contains([' ', '*', '<']) && name.contains('/');
            let first = name.split('/').next().unwrap_or_default();
            if is_path && roots.contains(&first) && !root().join(&name).exists() {
                missing.push(format!("{}: {name}", page.name));
            }
        }
    }
    fail_on(&missing);
}

/// Identifiers stand in the documents for contributors only.
#[test]
fn identifiers_that_the_documents_name_exist() {
    let sources: String = files_below(root())
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .map(|path| fs::read_to_string(path).expect("a source file"))
        .collect();
    let words: BTreeSet<&str> = sources
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    let mut missing = Vec::new();
    for page in [
        Page::read("CONTRIBUTING.md"),
        Page::read("book/src/architecture.md"),
    ] {
        for name in quoted(&page.prose()) {
            let starts_a_type = name.starts_with(|c: char| c.is_ascii_uppercase());
            let is_identifier = starts_a_type && name.contains(|c: char| c.is_ascii_lowercase())
                || name.ends_with("()")
                || name.contains("::");
            if is_identifier && !name.contains(['.', ' ', '=']) {
                let parts = name.trim_end_matches("()").split("::");
                let unknown = parts.filter(|part| !words.contains(part));
                missing.extend(unknown.map(|part| format!("{}: {name}: {part}", page.name)));
            }
        }
    }
    fail_on(&missing);
}

#[test]
fn abbreviations_are_expanded_on_every_page() {
    let mut missing = Vec::new();
    for page in Page::all() {
        if ["CHANGELOG.md", "book/src/SUMMARY.md"].contains(&page.name.as_str()) {
            continue;
        }
        let prose = page.prose();
        // a line may end within an expansion
        let text = prose
            .to_lowercase()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let words: BTreeSet<_> = prose.split(|c: char| !c.is_alphanumeric()).collect();
        for (abbreviation, expansion) in ABBREVIATIONS {
            let is_explained = text.contains(expansion) || prose.contains("glossary.md");
            if words.contains(abbreviation) && !is_explained {
                missing.push(format!("{}: {abbreviation} ({expansion})", page.name));
            }
        }
    }
    fail_on(&missing);
}

//! README, book and CONTRIBUTING are true: commands run, snippets parse, links and names exist.

mod console;
mod page;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use tipwatch_analyze::options::Options;
use tipwatch_analyze::policy::Policy;
use tipwatch_analyze::screen::Fleet;
use tipwatch_analyze::table;
use tipwatch_mechanics::MachineSpec;
use tipwatch_tests::{analysed, data};

use page::{Block, Page, book_files, files_below, is_blessing, root};

/// Blocks that are not run, by page. The page says why in the block's first line.
const NOT_RUN: [(&str, usize); 4] = [
    ("CONTRIBUTING.md", 3),
    ("README.md", 2),
    ("book/src/benchmarks.md", 4),
    ("book/src/tutorial/live.md", 1),
];

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

fn fail_on(differences: &[String]) {
    assert!(differences.is_empty(), "\n{}", differences.join("\n\n"));
}

#[test]
fn commands_of_the_documents_run_and_print_what_is_shown() {
    let pages = Page::all();
    let differences: Vec<_> = std::thread::scope(|scope| {
        let runs: Vec<_> = (pages.iter())
            .map(|page| scope.spawn(|| console::run(page, None)))
            .collect();
        let joined = runs
            .into_iter()
            .map(|run| run.join().expect("a page that runs"));
        joined.flatten().collect()
    });
    fail_on(&differences);
}

#[test]
#[ignore = "needs python3 with polars, duckdb"]
fn queries_of_the_documents_run() {
    let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
    let pages = Page::all();
    let with_python = |page: &&Page| page.blocks().iter().any(|b| b.language == "python");
    let differences = pages
        .iter()
        .filter(with_python)
        .flat_map(|page| console::run(page, Some(&python)));
    fail_on(&differences.collect::<Vec<_>>());
}

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
                "console" if block.kind.is_empty() || block.not_run().is_some() => Ok(()),
                "python" | "rust" if block.kind.is_empty() => Ok(()),
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

/// A machine file, whole or a part of one; a fleet file; a policy.
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

/// Puts a part of a machine file into a whole one: tables into tables, the rest in place of what was there.
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
fn blocks_that_are_not_run_are_known() {
    let mut found: BTreeMap<String, usize> = BTreeMap::new();
    for page in Page::all() {
        let count = page
            .blocks()
            .iter()
            .filter(|b| b.not_run().is_some())
            .count();
        if count > 0 {
            found.insert(page.name, count);
        }
    }
    let known = NOT_RUN.map(|(page, count)| (page.to_string(), count));
    assert_eq!(found, BTreeMap::from(known));
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
        "binding",
        "book",
        "ingest",
        "live",
        "mechanics",
        "suspension",
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

/// Texts between backquotes.
fn quoted(prose: &str) -> Vec<String> {
    let lines = prose.lines();
    let texts = lines.flat_map(|line| line.split('`').skip(1).step_by(2));
    texts.map(ToString::to_string).collect()
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

#[test]
fn the_readme_has_at_most_120_lines() {
    let lines = Page::read("README.md").text.lines().count();
    assert!(lines <= 120, "{lines}");
}

#[test]
fn every_column_is_in_the_reference() {
    let page = Page::read("book/src/reference/columns.md");
    let documented: BTreeSet<_> = quoted(&region(&page.text, "columns")).into_iter().collect();
    let analysis = analysed(&data("bogie_bump.mcap"), Options::default());
    let table = table::samples(&analysis).expect("a table");
    let machine = &analysis.machine;
    let wheels = machine
        .wheels()
        .iter()
        .map(|w| (w.name.to_lowercase(), "<wheel>"));
    let edges = machine
        .polygon()
        .edges()
        .iter()
        .map(|e| (e.name.clone(), "<edge>"));
    let linkages = machine
        .linkages()
        .iter()
        .map(|l| (l.name.to_lowercase(), "<linkage>"));
    let places: Vec<_> = wheels.chain(edges).chain(linkages).collect();
    let undocumented: Vec<_> = (table.units.iter().map(|(name, _)| name))
        .filter(|name| {
            let mut pattern: String = name.to_string();
            for (place, kind) in &places {
                if let Some(start) = name
                    .strip_suffix(place.as_str())
                    .filter(|s| s.ends_with('_'))
                {
                    pattern = format!("{start}{kind}");
                } else if name.contains(&format!("_{place}_")) {
                    pattern = name.replace(&format!("_{place}_"), &format!("_{kind}_"));
                }
            }
            if pattern.starts_with("cause_") {
                pattern = "cause_<cause>_<wheel>".into();
            }
            !documented.contains(*name) && !documented.contains(&pattern)
        })
        .collect();
    assert!(undocumented.is_empty(), "{undocumented:?}");
}

/// The map of the tree is made of the first sentence of every folder.
#[test]
fn the_map_of_the_tree_is_current() {
    let page = Page::read("CONTRIBUTING.md");
    let old = region(&page.text, "tree");
    let new = tree();
    if is_blessing() && old != new {
        let begin = "<!-- begin: tree -->\n";
        let text = page
            .text
            .replacen(&format!("{begin}{old}"), &format!("{begin}{new}"), 1);
        fs::write(root().join(&page.name), text).expect("a page that can be written");
    } else {
        assert_eq!(old, new, "TIPWATCH_BLESS=1 writes the map anew");
    }
}

/// The text between `<!-- begin: NAME -->` and `<!-- end: NAME -->`.
fn region(text: &str, name: &str) -> String {
    let (begin, end) = (
        format!("<!-- begin: {name} -->\n"),
        format!("<!-- end: {name} -->"),
    );
    let rest = text.split_once(&begin).expect("a begin").1;
    rest.split_once(&end).expect("an end").0.to_string()
}

fn tree() -> String {
    let mut map = String::new();
    for name in [
        "mechanics",
        "suspension",
        "ingest",
        "binding",
        "analyze",
        "live",
    ] {
        let source = root().join(name).join("src");
        let Some(purpose) = first_sentence(&source.join("lib.rs")) else {
            continue;
        };
        map += &format!("\n**{name}**: {purpose}\n");
        let entries = fs::read_dir(&source).expect("a folder").flatten();
        let mut folders: Vec<_> = entries.map(|e| e.path()).filter(|p| p.is_dir()).collect();
        folders.sort();
        if !folders.is_empty() {
            map += "\n| folder | holds |\n|---|---|\n";
        }
        for folder in folders {
            let purpose = first_sentence(&folder.join("mod.rs"))
                .or_else(|| first_sentence(&folder.with_extension("rs")))
                .unwrap_or_default();
            let room = folder.file_name().expect("a name").display();
            map += &format!("| `{name}/src/{room}` | {purpose} |\n");
        }
    }
    map + "\n"
}

/// The first sentence of a file's documentation.
fn first_sentence(path: &Path) -> Option<String> {
    let text = fs::read_to_string(path).ok()?;
    let lines = text.lines().map_while(|line| line.strip_prefix("//! "));
    let paragraph = lines.collect::<Vec<_>>().join(" ");
    let sentence = paragraph.split(". ").next()?.trim_end_matches('.');
    // Rust's links to items are not links in Markdown
    let plain = sentence.replace("[`", "`").replace("`]", "`");
    (!plain.is_empty()).then(|| plain.replace('|', "\\|"))
}

//! README, book and CONTRIBUTING are true: commands run, snippets parse, links and names exist.

mod console;
mod generated;
mod names;
mod page;
mod snippets;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use page::Page;

/// Blocks that are not run, by page. The page says why in the block's first line.
const NOT_RUN: [(&str, usize); 15] = [
    ("book/src/calibration.md", 2),
    ("CONTRIBUTING.md", 3),
    ("README.md", 1),
    ("book/src/benchmarks.md", 9),
    ("book/src/howto/black-box.md", 2),
    ("book/src/howto/commissioning.md", 1),
    ("book/src/howto/object-storage.md", 1),
    ("book/src/howto/packages.md", 3),
    ("book/src/howto/ros2-and-can-live.md", 5),
    ("book/src/howto/engines.md", 2),
    ("book/src/howto/validate-and-identify.md", 1),
    ("book/src/reference/c-header.md", 1),
    ("book/src/tutorial/data-sheet.md", 1),
    ("book/src/tutorial/live.md", 1),
    ("book/src/tutorial/python.md", 1),
];

fn fail_on(differences: &[String]) {
    assert!(differences.is_empty(), "\n{}", differences.join("\n\n"));
}

#[test]
fn commands_of_the_documents_run_and_print_what_is_shown() {
    let pages = Page::all();
    // all at once they would take each other's time, and each page has a limit
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let run = || {
        let pages = std::iter::from_fn(|| pages.get(next.fetch_add(1, Ordering::Relaxed)));
        pages
            .flat_map(|page| console::run(page, None))
            .collect::<Vec<_>>()
    };
    let differences: Vec<_> = std::thread::scope(|scope| {
        let runs: Vec<_> = (0..threads).map(|_| scope.spawn(run)).collect();
        let joined = runs
            .into_iter()
            .map(|run| run.join().expect("pages that run"));
        joined.flatten().collect()
    });
    fail_on(&differences);
}

mod needs_python {
    use super::*;

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

/// Texts between backquotes.
fn quoted(prose: &str) -> Vec<String> {
    let lines = prose.lines();
    let texts = lines.flat_map(|line| line.split('`').skip(1).step_by(2));
    texts.map(ToString::to_string).collect()
}

#[test]
fn the_readme_has_at_most_120_lines() {
    let lines = Page::read("README.md").text.lines().count();
    assert!(lines <= 120, "{lines}");
}

//! Parts of the documents that follow from the code: the columns, the map of the tree.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tipwatch_analyze::base::options::Options;
use tipwatch_analyze::tables::table;
use tipwatch_tests::{analysed, data};

use super::page::{Page, is_blessing, root};
use super::quoted;

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

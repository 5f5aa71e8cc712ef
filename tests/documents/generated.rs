//! Parts of the documents that follow from the code: the columns, the services, the numbers on the wire, the map of
//! the tree.

use std::fs;
use std::path::Path;

use tipwatch_live::wire::contract::{Coding, enumerations, services};
use tipwatch_live::wire::topics::{
    LAYOUT_ATTRIBUTE, MAX_BORROWED, MAX_NODES, MAX_READERS, SAFE_OVERFLOW,
};
use tipwatch_mechanics::prediction::PREDICTED;
use tipwatch_mechanics::{Quantity, RowColumn, When};

use super::page::{Page, is_blessing, root};

/// The reference of the columns is made of the table of quantities.
#[test]
fn the_reference_of_the_columns_is_current() {
    assert_current("book/src/reference/columns.md", "columns", &columns());
}

/// The reference of a fleet's tables is made of the records behind them.
#[test]
fn the_reference_of_the_data_set_is_current() {
    for (name, columns) in &*tipwatch_analyze::screen::TABLES {
        let mut text = String::from("| column | type | unit | meaning |\n|---|---|---|---|\n");
        for column in columns {
            let unit = column.unit.map_or(" ".into(), |unit| format!(" {unit} "));
            let meaning: Vec<&str> = column.meaning.iter().map(|line| line.trim()).collect();
            let meaning = meaning.join(" ");
            text += &format!(
                "| `{}` | {} |{unit}| {meaning} |\n",
                column.name, column.type_name
            );
        }
        assert_current("book/src/reference/data-set.md", name, &text);
    }
}

/// The settings of the services are those with which they are opened.
#[test]
fn the_settings_of_the_services_are_current() {
    assert_current("book/src/reference/services.md", "settings", &settings());
}

/// The numbers on the wire are those of the enumerations.
#[test]
fn the_numbers_on_the_wire_are_current() {
    assert_current("book/src/reference/c-header.md", "numbers", &numbers());
}

/// The map of the tree is made of the first sentence of every folder.
#[test]
fn the_map_of_the_tree_is_current() {
    assert_current("CONTRIBUTING.md", "tree", &tree());
}

/// Compares a region of a page with its expected content, or writes that content.
fn assert_current(page: &str, name: &str, new: &str) {
    let page = Page::read(page);
    let old = region(&page.text, name);
    if is_blessing() && old != new {
        let begin = format!("<!-- begin: {name} -->\n");
        let text = page
            .text
            .replacen(&format!("{begin}{old}"), &format!("{begin}{new}"), 1);
        fs::write(root().join(&page.name), text).expect("a page that can be written");
    } else {
        assert_eq!(old, new, "TIPWATCH_BLESS=1 writes the region anew");
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

fn columns() -> String {
    let mut text = String::from("| column | unit | meaning |\n|---|---|---|\n");
    let mut add = |name: &str, unit: &str, meaning: &str| {
        let unit = if unit.is_empty() {
            " "
        } else {
            &format!(" {unit} ")
        };
        text += &format!("| `{name}` |{unit}| {meaning} |\n");
    };
    for column in RowColumn::BEFORE {
        add(column.name, column.unit, column.meaning);
    }
    for kind in Quantity::KINDS {
        let option = match kind.when {
            When::Terms => " (`--model closed-form --columns terms`)",
            When::Parts => " (`--columns parts`)",
            When::BetweenRows => " (quasi-static)",
            _ => "",
        };
        let name = kind.pattern.replace('{', "<").replace('}', ">");
        add(&name, kind.unit, &format!("{}{option}", kind.meaning));
    }
    for column in RowColumn::AFTER {
        add(column.name, column.unit, column.meaning);
    }
    for column in &PREDICTED {
        let name = column.name.replace('{', "<").replace('}', ">");
        let meaning = format!("{} (`--estimator causal`)", column.meaning);
        add(&name, column.unit, &meaning);
    }
    text
}

fn settings() -> String {
    let mut text = String::from(
        "| service | message | max_publishers | subscriber_max_buffer_size | history_size | events |\n|---|---|---|---|---|---|\n",
    );
    for service in services() {
        text += &format!(
            "| `{}` | `struct tipwatch_{}` | {} | {} | {} |{}|\n",
            service.suffix,
            service.message,
            service.writers,
            service.buffer,
            service.history,
            if service.has_events { " yes " } else { " " }
        );
    }
    text += "\n| settings of all services | publish-subscribe | events |\n|---|---|---|\n";
    text += &format!("| enable_safe_overflow | {SAFE_OVERFLOW} | |\n");
    text += &format!("| subscriber_max_borrowed_samples | {MAX_BORROWED} | |\n");
    text += &format!("| max_subscribers | {MAX_READERS} | |\n");
    text += &format!("| max_listeners, max_notifiers | | {MAX_READERS} |\n");
    text += &format!("| max_nodes | {MAX_NODES} | {MAX_NODES} |\n");
    text += &format!("| attribute | `{LAYOUT_ATTRIBUTE}` | |\n");
    text
}

fn numbers() -> String {
    let mut text = String::new();
    for list in enumerations() {
        let head = match list.coding {
            Coding::Number => "number",
            Coding::Bit => "bit",
            Coding::Index => "index",
        };
        text += &format!(
            "\n`enum tipwatch_{}`: {}\n\n| {head} | name | meaning |\n|---|---|---|\n",
            list.name, list.fields
        );
        for entry in &list.entries {
            text += &format!("| {} | `{}` | {} |\n", entry.number, entry.name, entry.doc);
        }
    }
    text + "\n"
}

fn tree() -> String {
    let mut map = String::new();
    for name in [
        "mechanics",
        "mechanics/suspension",
        "calibration",
        "ingest",
        "ingest/can",
        "ingest/storage",
        "ingest/binding",
        "analyze",
        "analyze/datasheet",
        "live",
        "live/client",
        "packaging",
        "tests/benchmarks",
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

//! The licences of all crates of the programs with their texts, as MIT, BSD, Apache and the licences of fonts oblige.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use spdx::{Expression, LicenseId, ParseMode, license_id};

use crate::bill::Crate;

/// Beginnings of the names of files with licences, in small letters.
const NAMES: [&str; 8] = [
    "license",
    "licence",
    "copying",
    "notice",
    "unlicense",
    "copyright",
    "ofl",
    "ufl",
];

/// Folders of a crate's sources that no program is made of.
const NOT_BUILT: [&str; 9] = [
    "benches", "contrib", "doc", "docs", "examples", "programs", "scripts", "tests", "target",
];

/// Deepest folder that is searched: sources in C bring their licences along.
const DEEPEST: usize = 4;

const HEAD: &str = "\
Software of others in Tipwatch

The programs and the Python module consist of the crates below, each under the licence that its author chose; where
there is a choice (\"OR\"), the texts of all of them that the crate brings are given. Crates with the
same text are listed together. The standard library of Rust (MIT OR Apache-2.0, https://www.rust-lang.org) is part of
every program. SQLite is in the public domain.
";

/// All licences as one text. The same crates give the same text.
///
/// # Errors
/// A crate has no licence file and states no licence of which a standard text exists, or a file cannot be read.
pub fn licences(crates: &[Crate]) -> Result<String> {
    // by the words of the text: margins and line ends differ
    let mut texts: BTreeMap<String, (String, Vec<String>)> = BTreeMap::new();
    for found in crates.iter().filter(|found| found.source.is_some()) {
        let licence = found.licence.as_deref().unwrap_or("none stated");
        let name = format!("{} {} ({licence})", found.name, found.version);
        for text in texts_of(found)? {
            let words: Vec<&str> = text.split_whitespace().collect();
            let (_, names) = texts.entry(words.join(" ")).or_insert((text, Vec::new()));
            if !names.contains(&name) {
                names.push(name.clone());
            }
        }
    }
    let mut out = HEAD.to_owned();
    let rule = "=".repeat(100);
    let mut all: Vec<_> = texts.into_values().collect();
    all.sort_by(|a, b| a.1.cmp(&b.1).then_with(|| a.0.cmp(&b.0)));
    for (text, names) in all {
        write!(out, "\n{rule}\n{}\n\n{}\n", names.join("\n"), text.trim())?;
    }
    Ok(out)
}

/// Returns the texts of a crate's licences: its own files, else the standard texts of its stated licences.
fn texts_of(found: &Crate) -> Result<Vec<String>> {
    let mut texts = Vec::new();
    search(&found.folder, 0, &mut texts)
        .with_context(|| format!("{} {}: its licences", found.name, found.version))?;
    if !texts.is_empty() {
        return Ok(texts);
    }
    let licence = found.licence.as_deref().unwrap_or("");
    let expression = Expression::parse_mode(licence, ParseMode::LAX);
    let expression = expression
        .map_err(|error| anyhow::anyhow!("{error}"))
        .with_context(|| format!("{} {}: licence \"{licence}\"", found.name, found.version))?;
    // needs no name of an author
    let apache = license_id("Apache-2.0").filter(|_| {
        expression.evaluate(|required| {
            let id = required.license.id();
            id.is_some_and(|id| id.name == "Apache-2.0")
        })
    });
    let stated = |id: LicenseId| {
        let authors = match found.authors.is_empty() {
            true => format!("the authors of {}", found.name),
            false => found.authors.join(", "),
        };
        format!("Copyright: {authors}\n\n{}", id.text())
    };
    let ids: Vec<LicenseId> = match apache {
        Some(apache) => vec![apache],
        None => (expression.requirements())
            .filter_map(|required| required.req.license.id())
            .collect(),
    };
    ensure!(
        !ids.is_empty(),
        "{} {}: expected a licence with a standard text, found \"{licence}\"",
        found.name,
        found.version
    );
    Ok(match apache {
        Some(apache) => vec![apache.text().to_owned()],
        None => ids.into_iter().map(stated).collect(),
    })
}

/// The texts of the files with licences in a folder and in those below it.
fn search(folder: &Path, depth: usize, texts: &mut Vec<String>) -> Result<()> {
    let mut entries = fs::read_dir(folder)
        .and_then(Iterator::collect::<std::io::Result<Vec<_>>>)
        .with_context(|| format!("{}: cannot be read", folder.display()))?;
    entries.sort_by_key(fs::DirEntry::file_name);
    let name_of = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().to_lowercase();
    // of two that a library offers, the one that obliges less: zstd has BSD and GPL
    let has_choice = entries
        .iter()
        .any(|entry| name_of(entry).starts_with("license"));
    for entry in &entries {
        let (path, name) = (entry.path(), name_of(entry));
        if path.is_dir() {
            let is_built = !name.starts_with('.') && !NOT_BUILT.contains(&name.as_str());
            if is_built && depth < DEEPEST {
                search(&path, depth + 1, texts)?;
            }
            continue;
        }
        let is_source = [".rs", ".c", ".h", ".py", ".toml", ".json"]
            .iter()
            .any(|end| name.ends_with(end));
        let is_named = NAMES.iter().any(|start| name.starts_with(start))
            || name.contains("license")
            || name.contains("licence")
            // each font has its own
            || (folder.ends_with("fonts") && name.ends_with(".txt"));
        let is_other_choice = has_choice && name.starts_with("copying");
        if is_named && !is_source && !is_other_choice {
            let bytes =
                fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
            texts.push(String::from_utf8_lossy(&bytes).into_owned());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(folder: &Path, name: &str, licence: &str) -> Crate {
        Crate {
            name: name.into(),
            version: "1.0.0".into(),
            licence: Some(licence.into()),
            source: Some("registry".into()),
            sha256: None,
            authors: vec!["Ada Author".into()],
            folder: folder.into(),
        }
    }

    #[test]
    fn each_text_is_given_once_with_all_its_crates() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str, file: &str, text: &str| {
            let path = folder.path().join(name).join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        at("a", "LICENSE-MIT", "Copyright A\nuse it as you like");
        at("a", "c_src/lib/LICENSE", "Copyright C library");
        at("a", "c_src/lib/COPYING", "obliges everybody");
        at("a", "tests/LICENSE", "of the tests");
        at(
            "b",
            "license.txt",
            "Copyright A\r\n  use it as you like\r\n",
        );
        at("c", "src/license.rs", "code");
        at("d", "README.md", "nothing");
        let crates = [
            with(&folder.path().join("a"), "a", "MIT"),
            with(&folder.path().join("b"), "b", "MIT"),
            with(&folder.path().join("c"), "c", "MIT OR Apache-2.0"),
            with(&folder.path().join("d"), "d", "BSD-3-Clause"),
        ];
        let text = licences(&crates).unwrap();
        assert_eq!(text.matches("as you like").count(), 1, "{text}");
        assert!(text.contains("a 1.0.0 (MIT)\nb 1.0.0 (MIT)\n\nCopyright A"));
        assert!(text.contains("Copyright C library"));
        assert!(!text.contains("obliges everybody") && !text.contains("of the tests"));
        assert!(text.contains("c 1.0.0 (MIT OR Apache-2.0)") && text.contains("Apache License"));
        assert!(text.contains("Copyright: Ada Author") && text.contains("Neither the name"));
        let unknown = with(&folder.path().join("d"), "d", "LicenseRef-Own");
        assert!(licences(&[unknown]).is_err());
    }
}

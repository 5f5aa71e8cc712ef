//! Hash of the sources that a result depends on: the code of this crate and of the crates below it, and the versions of all crates
//! of others among them. It is the same on every computer, whatever else is in the tree, and changes with every change of the code.
//!
//! Used when the program is built, and by its tests.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The crate that computes the results.
const ROOT: &str = "tipwatch-analyze";
/// Folders of our crates in the tree.
const CRATES: [(&str, &str); 12] = [
    (ROOT, "analyze"),
    ("tipwatch-allocator", "packaging/allocator"),
    ("tipwatch-binding", "ingest/binding"),
    ("tipwatch-calibration", "calibration"),
    ("tipwatch-can", "ingest/can"),
    ("tipwatch-datasheet", "analyze/datasheet"),
    ("tipwatch-ingest", "ingest"),
    ("tipwatch-language", "packaging/language"),
    ("tipwatch-language-macros", "packaging/language/macros"),
    ("tipwatch-mechanics", "mechanics"),
    ("tipwatch-storage", "ingest/storage"),
    ("tipwatch-suspension", "mechanics/suspension"),
];
/// The versions of the crates of others, in the tree.
const LOCK: &str = "Cargo.lock";

/// Returns the files and folders that are hashed: the sources of all crates and the lock file. Without a lock file, as in a
/// package made by others, the versions of foreign crates are unknown.
pub(crate) fn places(tree: &Path) -> Vec<PathBuf> {
    let sources = CRATES
        .iter()
        .map(|(_, folder)| tree.join(folder).join("src"));
    let lock = tree.join(LOCK);
    sources.chain(lock.exists().then_some(lock)).collect()
}

/// The hash, as hexadecimal digits.
///
/// # Errors
/// A source cannot be read, or one of our crates is in none of the known folders.
pub(crate) fn hash(tree: &Path) -> io::Result<String> {
    let mut hash = Hash::new();
    for (_, folder) in CRATES {
        let source = tree.join(folder).join("src");
        for file in files(&source)? {
            let name = file.strip_prefix(tree).unwrap_or(&file);
            let name: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
            hash.add(name.join("/").as_bytes());
            hash.add(&fs::read(&file)?);
        }
    }
    if let Ok(lock) = fs::read_to_string(tree.join(LOCK)) {
        for package in needed(&lock)? {
            hash.add(package.as_bytes());
        }
    }
    Ok(format!("{:032x}", hash.0))
}

/// All files below a folder, by name.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder)? {
            let entry = entry?;
            match entry.file_type()?.is_dir() {
                true => open.push(entry.path()),
                false => found.push(entry.path()),
            }
        }
    }
    found.sort();
    Ok(found)
}

/// The packages of a lock that the root needs, each with its version.
fn needed(lock: &str) -> io::Result<BTreeSet<String>> {
    let mut packages = BTreeMap::new();
    for package in lock.split("[[package]]").skip(1) {
        let value = |key: &str| {
            let mut lines = package.lines();
            let line = lines.find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
            line.map_or("", |text| text.trim_matches('"'))
        };
        // `"name",`, with the version where there are several, and with the source where these are of several, too
        let needs = package.lines().filter_map(|line| {
            let quoted = line.strip_prefix(" \"")?.split('"').next()?;
            Some(quoted.split(" (").next().unwrap_or(quoted))
        });
        let needs: Vec<&str> = needs.collect();
        let (name, version) = (value("name"), value("version"));
        for key in [name.to_owned(), format!("{name} {version}")] {
            packages.insert(key, (name, version, needs.clone()));
        }
    }
    let (mut found, mut open) = (BTreeSet::new(), vec![ROOT]);
    while let Some(key) = open.pop() {
        let Some((name, version, needs)) = packages.get(key) else {
            return Err(io::Error::other(format!(
                "{LOCK}: expected {key}, found none"
            )));
        };
        if name.starts_with("tipwatch-") && !CRATES.iter().any(|(own, _)| own == name) {
            let text = format!("{name}: expected its folder in analyze/build/sources.rs");
            return Err(io::Error::other(text));
        }
        if found.insert(format!("{name} {version}")) {
            open.extend(needs);
        }
    }
    Ok(found)
}

/// Fowler, Noll and Vo's hash 1a of 128 bits: nobody is to be kept from finding another text for it.
struct Hash(u128);

impl Hash {
    fn new() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }

    /// Adds a text and its end. Ends of lines are those of the computer that it is on.
    fn add(&mut self, text: &[u8]) {
        let bytes = text.iter().filter(|byte| **byte != b'\r');
        for byte in bytes.chain(&[0xff]) {
            self.0 ^= u128::from(*byte);
            self.0 = self
                .0
                .wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}

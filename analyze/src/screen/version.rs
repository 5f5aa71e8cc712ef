//! The version of an analysis: everything except the log that its result depends on.

use anyhow::Result;
use serde::Serialize;
use tipwatch_binding::{MachineFile, sha256};
use tipwatch_ingest::{ReadOptions, read_options};

use super::record::RECORD_SCHEMA;
use crate::base::file_hash::{FileHash, hash_file};
use crate::base::options::Options;
use crate::tables::summary;

/// Hash of the sources of this program and of the versions of all crates in it, see `analyze/build/sources.rs`: another build of
/// the same sources has the same one, on any computer and in Python, too.
pub(super) const SOURCES: &str = env!("TIPWATCH_SOURCES");

/// The inputs of a result, in the order in which they are hashed.
#[derive(Serialize)]
struct Ingredients<'a> {
    tipwatch: &'a str,
    sources: &'a str,
    summary_schema: u32,
    record_schema: u32,
    machine_file: &'a str,
    /// Name of the machine that a fleet file gives it, which the report has; absent if it is that in the machine file, by whose
    /// hash it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    machine: Option<&'a str>,
    urdf: Option<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    dbc_files: Vec<String>,
    options: &'a Options,
    /// Language of report and findings; absent if it is English.
    #[serde(skip_serializing_if = "Option::is_none")]
    language: Option<&'static str>,
    /// Read options that were stated for the logs; absent if none were.
    #[serde(skip_serializing_if = "Option::is_none")]
    reading: Option<ReadOptions>,
}

/// The version of analyses with this machine and these options: the same log and the same version give
/// the same result.
///
/// # Errors
/// A DBC file of the machine cannot be read.
pub(super) fn analysis_version(
    machine: &MachineFile,
    urdf: Option<&FileHash>,
    options: &Options,
) -> Result<String> {
    let ingredients = Ingredients {
        tipwatch: env!("CARGO_PKG_VERSION"),
        sources: SOURCES,
        summary_schema: summary::SCHEMA,
        record_schema: RECORD_SCHEMA,
        machine_file: &machine_sha256(machine),
        machine: machine.other_name(),
        urdf: urdf.map(FileHash::identity),
        dbc_files: dbc_hashes(machine)?,
        options,
        language: Some(tipwatch_language::tag()).filter(|_| !tipwatch_language::is_english()),
        reading: Some(read_options()).filter(|stated| *stated != ReadOptions::default()),
    };
    ingredients.version()
}

impl Ingredients<'_> {
    fn version(&self) -> Result<String> {
        let mut hash = sha256(serde_json::to_string(self)?.as_bytes());
        hash.truncate(16);
        Ok(hash)
    }
}

/// Hash of the URDF that a machine file names. Without one, the URDF in the log is part of the log.
///
/// # Errors
/// The URDF cannot be read.
pub(super) fn urdf_hash(machine: &MachineFile) -> Result<Option<FileHash>> {
    machine.urdf_path().map(|path| hash_file(&path)).transpose()
}

/// SHA-256 over the identities of the URDF and the DBC files that a machine file names: with the same text, another folder may
/// hold others.
///
/// # Errors
/// One of them cannot be read.
pub(super) fn named_files(machine: &MachineFile, urdf: Option<&FileHash>) -> Result<String> {
    let urdf = urdf.map(FileHash::identity).unwrap_or_default();
    let files = [vec![urdf], dbc_hashes(machine)?].concat();
    Ok(sha256(files.join("\n").as_bytes()))
}

fn dbc_hashes(machine: &MachineFile) -> Result<Vec<String>> {
    let files = machine.dbc_files();
    let hashes = files.iter().map(|file| Ok(hash_file(file)?.identity()));
    hashes.collect()
}

/// SHA-256 of a machine file.
pub(super) fn machine_sha256(machine: &MachineFile) -> String {
    sha256(machine.effective_text().as_bytes())
}

#[cfg(test)]
#[path = "../../build/sources.rs"]
mod sources;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use std::fs;
    use std::path::Path;

    use super::*;

    fn version(sources: &str) -> String {
        let ingredients = Ingredients {
            tipwatch: "1.2.3",
            sources,
            summary_schema: 1,
            record_schema: 1,
            machine_file: "aa",
            machine: None,
            urdf: None,
            dbc_files: Vec::new(),
            options: &Options::default(),
            language: None,
            reading: None,
        };
        ingredients.version().unwrap()
    }

    #[test]
    fn only_a_name_that_is_not_in_the_machine_file_is_part_of_the_version() {
        let text = |machine| {
            let ingredients = Ingredients {
                tipwatch: "1.2.3",
                sources: "aa",
                summary_schema: 1,
                record_schema: 1,
                machine_file: "aa",
                machine,
                urdf: None,
                dbc_files: Vec::new(),
                options: &Options::default(),
                language: None,
                reading: None,
            };
            serde_json::to_string(&ingredients).unwrap()
        };
        assert!(!text(None).contains("\"machine\""));
        assert!(text(Some("one")).contains("\"machine\":\"one\""));
    }

    #[test]
    fn another_program_of_the_same_number_is_another_version() {
        assert_eq!(version("aa"), version("aa"));
        assert_ne!(version("aa"), version("ab"));
    }

    #[test]
    fn the_program_knows_the_sources_it_was_built_from() {
        let tree = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        assert_eq!(sources::hash(&tree).unwrap(), SOURCES);
    }

    /// A tree with one file in each crate, and a lock.
    fn tree(at: &Path, lock: &str) {
        for place in sources::places(at) {
            fs::create_dir_all(place.join("inner")).unwrap();
            fs::write(place.join("inner/lib.rs"), "fn a() {}\n").unwrap();
        }
        fs::write(at.join("Cargo.lock"), lock).unwrap();
    }

    #[test]
    fn the_hash_changes_with_the_code_and_with_nothing_else() {
        let lock = |used: u32, unused: u32| {
            format!(
                "version = 4\n\n[[package]]\nname = \"libm\"\nversion = \"0.2.{used}\"\n\n\
                 [[package]]\nname = \"tipwatch-analyze\"\nversion = \"0.1.0\"\ndependencies = [\n \"libm\",\n]\n\n\
                 [[package]]\nname = \"ratatui\"\nversion = \"0.{unused}.0\"\ndependencies = [\n \"libm\",\n]\n"
            )
        };
        let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let hash = || sources::hash(other.path()).unwrap();
        tree(one.path(), &lock(1, 1));
        tree(other.path(), &lock(1, 1));
        let first = sources::hash(one.path()).unwrap();
        assert_eq!(hash(), first);
        let file = |name: &str| other.path().join(name);
        // what no result depends on
        fs::create_dir_all(file("mechanics/tests")).unwrap();
        fs::write(file("mechanics/tests/lib.rs"), "fn b() {}").unwrap();
        fs::write(file("ingest/src/inner/lib.rs"), "fn a() {}\r\n").unwrap();
        fs::write(file("Cargo.lock"), lock(1, 2)).unwrap();
        assert_eq!(hash(), first);
        // what they depend on: another crate, another file, another text in the deepest crate
        fs::write(file("Cargo.lock"), lock(2, 2)).unwrap();
        let mut found = vec![first, hash()];
        fs::write(file("mechanics/src/new.rs"), "").unwrap();
        found.push(hash());
        fs::write(file("mechanics/src/inner/lib.rs"), "fn a() { }\n").unwrap();
        found.push(hash());
        found.sort();
        found.dedup();
        assert_eq!(found.len(), 4);
    }
}

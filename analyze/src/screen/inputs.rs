//! Resolves folders, patterns, manifests and logs to one list of logs.
//!
//! Folders, patterns and logs may be in a bucket (`s3://logs/2026-*/**/*.mcap`).
//!
//! A manifest is a text file (`.txt`, `.list`, `.manifest`): one log per line, relative to the manifest;
//! empty lines and lines that start with `#` are skipped. A missing log stays in the list, so that it is
//! reported as failed.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Component, Path, PathBuf, absolute};

use anyhow::{Context, Result};
use glob::Pattern;
use tipwatch_binding::read_text;
use tipwatch_can::ContainerFormat;
use tipwatch_storage::{ErrorKind, Expanded, Folder, Location, expand};

use super::failure::FailureKind;
use super::workers;
use crate::base::error_text::error_text;
use crate::output::{CLIPS, DERIVED, EVENTS, SAMPLES, SUMMARY};

/// File extensions of logs; logs given by name may have any.
const LOG_ENDINGS: [&str; 6] = [".mcap", ".bag", ".db3", ".bag.active", ".blf", ".mf4"];
/// File extensions of texts that are traces of a CAN bus if their content says so.
const TRACE_ENDINGS: [&str; 4] = [".asc", ".trc", ".log", ".candump"];
/// Endings of files that are certainly traces, also where the content is packed or in a bucket.
const SURE_TRACE_ENDINGS: [&str; 2] = [".asc", ".trc"];
/// File extensions of tables. A folder has others than those of logs, such as results.
const TABLE_ENDINGS: [&str; 6] = [".csv", ".tsv", ".parquet", ".pq", ".jsonl", ".ndjson"];
/// Enough to see a trace in a text.
const BEGINNING_BYTES: u64 = 4096;
/// Extensions added by whole-file compression.
const PACKED_ENDINGS: [&str; 6] = ["", ".zstd", ".zst", ".gz", ".bz2", ".lz4"];
const MANIFEST_ENDINGS: [&str; 3] = [".txt", ".list", ".manifest"];
/// The file that makes a folder a log.
const ROSBAG2_METADATA: &str = "metadata.yaml";

/// Requested logs.
#[derive(Debug, Default)]
pub struct RequestedLogs {
    /// All logs, each once, sorted by path; those in the output folder are skipped.
    pub(super) logs: Vec<PathBuf>,
    /// Tables and packed texts in folders, which are not logs unless they are named.
    left_out: Vec<PathBuf>,
    /// Folders that are named like a log and hold none.
    empty: Vec<PathBuf>,
    /// Folders and patterns that were searched.
    searched: Vec<PathBuf>,
    /// Sizes of the logs of buckets that were listed (bytes).
    remote_bytes: BTreeMap<PathBuf, u64>,
    /// Places of a bucket that the storage did not list, and why. Each is one of the logs, which fails by storage.
    refused: BTreeMap<PathBuf, String>,
}

impl RequestedLogs {
    /// Returns the reason why the storage did not list a place; `None` for a log.
    pub(super) fn refusal(&self, path: &Path) -> Option<&str> {
        self.refused.get(path).map(String::as_str)
    }

    /// Size of a log's files, for order and memory only; zero if unknown.
    pub(super) fn size_of(&self, log: &Path) -> u64 {
        match Location::is_remote_path(log) {
            true => self.remote_bytes.get(log).copied().unwrap_or(0),
            false => workers::size_of(log),
        }
    }

    /// Whether a log was found or named.
    pub(super) fn is_listed(&self, path: &Path) -> bool {
        let place = (self.logs).binary_search_by(|log| log.as_os_str().cmp(path.as_os_str()));
        place.is_ok()
    }

    /// Whether a log of this computer that a call or a manifest names is absent, and its folder is present. Of an empty folder
    /// this is only known where another of the logs beside it is present: an unmounted medium looks like an empty folder.
    pub(super) fn is_missing(&self, path: &Path) -> bool {
        // a folder that was named and is away is listed, too
        let is_file = || is_log(path) || is_table(path) || ends_with_any(path, &TRACE_ENDINGS);
        let may_be_folder = || !is_file() && self.searched.iter().any(|place| place == path);
        if Location::is_remote_path(path)
            || !self.is_listed(path)
            || path.exists()
            || may_be_folder()
        {
            return false;
        }
        let Some(Ok(mut beside)) = path.parent().map(fs::read_dir) else {
            return false;
        };
        beside.next().is_some()
            || (path.ancestors().nth(2)).is_some_and(|above| self.has_log_below(above))
    }

    /// Whether one of the logs in a folder of this computer is present.
    fn has_log_below(&self, folder: &Path) -> bool {
        let first = folder.join("");
        let first = (self.logs).partition_point(|log| log.as_os_str() < first.as_os_str());
        let mut below = (self.logs[first..].iter()).take_while(|log| log.starts_with(folder));
        below.any(|log| log.exists())
    }

    /// Returns whether the log of a record is still present.
    pub(super) fn presence(&self, path: &str) -> Presence {
        let is_text = !path.contains(char::REPLACEMENT_CHARACTER);
        let path = Path::new(path);
        let is_remote = Location::is_remote_path(path);
        if self.is_listed(path) {
            return match self.is_missing(path) {
                true => Presence::Gone { is_named: true },
                false => Presence::Here,
            };
        }
        if self.refused.keys().any(|place| covers(place, path)) {
            return Presence::OutOfReach;
        }
        let mut above = path.ancestors().skip(1);
        if let Some(folder) = above.find(|folder| self.is_listed(folder)) {
            // a folder that is away or cannot be read is listed, too
            let is_bag = match is_remote {
                true => !self.searched.iter().any(|place| place == folder),
                false => folder.join(ROSBAG2_METADATA).is_file(),
            };
            return match is_bag {
                true => Presence::NoLog,
                false => Presence::OutOfReach,
            };
        }
        let is_covered = self.searched.iter().any(|place| covers(place, path));
        if (is_covered && path.is_dir()) || self.searched.iter().any(|place| place == path) {
            return Presence::NoLog;
        }
        if !is_remote && path.exists() {
            return Presence::Here;
        }
        // what is not mounted looks like an empty folder: all its logs are missing
        let is_there = |place: &&PathBuf| {
            let mut others = self.logs.iter().filter(|log| log != place);
            others.any(|log| covers(place, log))
        };
        let mut searched = self.searched.iter().filter(|place| covers(place, path));
        let mut beside = path
            .parent()
            .map(fs::read_dir)
            .into_iter()
            .flatten()
            .flatten();
        match is_remote {
            _ if searched.any(|place| is_there(&place)) => Presence::Gone { is_named: true },
            // what is in the bucket outside the places that were searched is not known
            true => Presence::OutOfReach,
            // a name that is no text is not that of the file
            false if !is_text => Presence::Here,
            false if beside.next().is_some() => Presence::Gone { is_named: false },
            false => Presence::OutOfReach,
        }
    }

    /// Says what was not taken as a log although it may be one.
    pub(super) fn notes(&self) -> Vec<String> {
        self.left_out_note()
            .into_iter()
            .chain(self.empty_note())
            .collect()
    }

    fn empty_note(&self) -> Option<String> {
        let first = self.empty.first()?.display();
        Some(format!(
            "folders that are named like a log and hold none were skipped: {}, the first {first}",
            self.empty.len()
        ))
    }

    /// Describes the files that were left out, and how to include them.
    fn left_out_note(&self) -> Option<String> {
        let first = self.left_out.first()?;
        let ending = first.extension().unwrap_or_default().to_string_lossy();
        let folder = first.parent().unwrap_or(first).display();
        Some(format!(
            "tables or packed texts in folders that were left out, because they need not be logs: {}, the first {}; name them to \
             include them, for example \"{folder}/*.{ending}\"",
            self.left_out.len(),
            first.display()
        ))
    }
}

/// Presence of the log of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Presence {
    /// The log is present, or its presence is unknown.
    Here,
    /// The log is no longer in its folder, which is one of those that were searched or not.
    Gone { is_named: bool },
    /// Its folder is not there either, or has nothing: a medium may not be mounted.
    OutOfReach,
    /// Its path is that of a folder of logs, or of a part of a log.
    NoLog,
}

/// Whether a searched folder or pattern covers a path.
fn covers(searched: &Path, path: &Path) -> bool {
    let is_matched = || {
        let pattern = Pattern::new(&searched.to_string_lossy());
        is_pattern(searched) && pattern.is_ok_and(|pattern| pattern.matches_path(path))
    };
    path.starts_with(searched) || is_matched()
}

/// All requested logs.
///
/// # Errors
/// A pattern matches nothing, a manifest cannot be read, or there is no log at all.
pub(super) fn find(requested: &[PathBuf], out: &Path) -> Result<RequestedLogs> {
    let mut finder = Finder {
        logs: BTreeSet::new(),
        tables: BTreeSet::new(),
        named_like_logs: BTreeSet::new(),
        remote_bytes: BTreeMap::new(),
        refused: BTreeMap::new(),
        out: tidy(out)?,
    };
    for path in requested {
        finder.add_requested(path)?;
    }
    let Finder {
        logs,
        tables,
        named_like_logs,
        remote_bytes,
        refused,
        out: _,
    } = finder;
    let is_empty = |folder: &PathBuf| {
        let mut all = logs.iter().chain(&tables);
        !all.any(|path| Path::new(path).starts_with(folder))
    };
    let folders = named_like_logs.into_iter().map(PathBuf::from);
    let found = RequestedLogs {
        searched: requested
            .iter()
            .map(|path| tidy(path))
            .collect::<Result<_>>()?,
        left_out: tables.difference(&logs).map(PathBuf::from).collect(),
        empty: folders.filter(is_empty).collect(),
        remote_bytes,
        refused,
        logs: logs.into_iter().map(PathBuf::from).collect(),
    };
    if found.logs.is_empty() {
        let names: Vec<_> = requested.iter().map(|p| p.display().to_string()).collect();
        let notes = found.notes().into_iter().map(|note| format!("; {note}"));
        let places = match names.join(", ") {
            none if none.is_empty() => none,
            places => format!("{places}: "),
        };
        return Err(mistake(format!(
            "{places}expected logs (*.mcap, *.bag, *.db3, rosbag2 folders, CAN traces: *.blf, *.asc, *.trc, *.mf4, candump *.log), \
             found none{}",
            notes.collect::<String>()
        )));
    }
    Ok(found)
}

/// The error of a call that names no log.
fn mistake(text: String) -> anyhow::Error {
    io::Error::new(io::ErrorKind::InvalidInput, text).into()
}

/// Checks that at least one of the named places of this computer exists, if all are such.
///
/// # Errors
/// None of them does: a mistake in the call, rather than logs that are missing among others.
pub(super) fn require_any(requested: &[PathBuf]) -> Result<()> {
    let is_missing =
        |path: &PathBuf| !Location::is_remote_path(path) && !is_pattern(path) && !path.exists();
    if !requested.is_empty() && requested.iter().all(is_missing) {
        let names: Vec<_> = requested.iter().map(|p| p.display().to_string()).collect();
        let text = format!(
            "{}: expected folders or logs, found nothing there",
            names.join(", ")
        );
        return Err(io::Error::new(io::ErrorKind::NotFound, text).into());
    }
    Ok(())
}

/// Paths by their texts: as a path `s3://logs/a//b` equals `s3://logs/a/b`, but in a bucket these are two objects.
struct Finder {
    logs: BTreeSet<OsString>,
    /// Tables in folders.
    tables: BTreeSet<OsString>,
    /// Folders that are named like a log and are none.
    named_like_logs: BTreeSet<OsString>,
    remote_bytes: BTreeMap<PathBuf, u64>,
    refused: BTreeMap<PathBuf, String>,
    out: PathBuf,
}

impl Finder {
    fn add_requested(&mut self, path: &Path) -> Result<()> {
        if Location::is_remote_path(path) {
            return self.add_remote(path);
        }
        if !path.exists() && is_pattern(path) {
            return self.add_matches(path);
        }
        if path.is_file() && ends_with_any(path, &MANIFEST_ENDINGS) {
            return self.add_manifest(path);
        }
        self.add_path(path)
    }

    /// A folder's logs, or a log.
    fn add_path(&mut self, path: &Path) -> Result<()> {
        if path.is_dir() {
            self.add_folder(&tidy(path)?, &mut BTreeSet::new());
        } else {
            self.logs.insert(tidy(path)?.into());
        }
        Ok(())
    }

    fn add_matches(&mut self, pattern: &Path) -> Result<()> {
        let text = pattern
            .to_str()
            .with_context(|| format!("{}: expected a pattern in Unicode", pattern.display()))?;
        let matches = glob::glob(text).with_context(|| format!("{text}: not a valid pattern"))?;
        let mut is_empty = true;
        for found in matches {
            is_empty = false;
            match found {
                Ok(path) => self.add_path(&path)?,
                Err(error) => {
                    self.logs.insert(tidy(error.path())?.into());
                }
            }
        }
        if is_empty {
            return Err(mistake(format!(
                "{text}: expected matching logs, found none"
            )));
        }
        Ok(())
    }

    fn add_manifest(&mut self, path: &Path) -> Result<()> {
        let text = read_text(path)
            .with_context(|| format!("{}: cannot be read as a manifest", path.display()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
        for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
            self.logs
                .insert(match Location::is_remote_path(Path::new(line)) {
                    true => Location::parse(line)?.path().into(),
                    false => tidy(&folder.join(line))?.into(),
                });
        }
        Ok(())
    }

    /// A log, a folder or a pattern of a bucket or server.
    fn add_remote(&mut self, path: &Path) -> Result<()> {
        if is_pattern(path) {
            let Some(expanded) = self.listed(path, expand(&path.to_string_lossy()))? else {
                return Ok(());
            };
            let Expanded { found, unnameable } = expanded.unwrap_or_default();
            if found.is_empty() && unnameable.is_empty() {
                let path = path.display();
                return Err(mistake(format!(
                    "{path}: expected matching logs, found none"
                )));
            }
            let sizes = found.iter();
            self.remote_bytes
                .extend(sizes.map(|found| (found.location.path().into(), found.bytes)));
            let found = found.iter().map(|found| found.location.path().into());
            // those that cannot be named are reported as failed
            let all = found.chain(unnameable.into_iter().map(OsString::from));
            self.logs
                .extend(all.filter(|path| !Path::new(path).starts_with(&self.out)));
            return Ok(());
        }
        if is_log(path) || is_table(path) || ends_with_any(path, &TRACE_ENDINGS) {
            self.logs.insert(path.into());
            return Ok(());
        }
        let folder = Folder::open(&Location::of(path)?)?;
        let Some((entries, unnameable)) = self.listed(path, folder.list_all("**"))? else {
            return Ok(());
        };
        let folder_of = |key: &str| {
            key.rsplit_once('/')
                .map_or("", |(folder, _)| folder)
                .to_owned()
        };
        let is_metadata = |key: &str| key.rsplit('/').next() == Some(ROSBAG2_METADATA);
        let keys = || entries.iter().map(|entry| entry.key.as_str());
        let bags: BTreeSet<String> = keys()
            .filter(|key| is_metadata(key))
            .map(folder_of)
            .collect();
        // a text in a bucket is not fetched to see whether it is a trace
        let is_named = |key: &str| {
            let path = Path::new(key);
            is_log(path) || ends_packed(path, &SURE_TRACE_ENDINGS)
        };
        for entry in &entries {
            let key = entry.key.as_str();
            if !is_named(key) && !is_metadata(key) {
                continue;
            }
            let bag = bags.iter().find(|bag| {
                bag.is_empty()
                    || key
                        .strip_prefix(bag.as_str())
                        .is_some_and(|k| k.starts_with('/'))
            });
            let log: PathBuf = match bag {
                Some(bag) if bag.is_empty() => path.to_path_buf(),
                Some(bag) => folder.location().join(bag)?.path().into(),
                None => folder.location().join(key)?.path().into(),
            };
            if !log.starts_with(&self.out) {
                *self.remote_bytes.entry(log.clone()).or_default() += entry.bytes;
                self.logs.insert(log.into());
            }
        }
        for key in unnameable.iter().filter(|key| is_named(key)) {
            let log = folder.location().full(key);
            if !Path::new(&log).starts_with(&self.out) {
                // it is reported as failed
                self.logs.insert(log.into());
            }
        }
        for key in keys().filter(|key| is_left_out(Path::new(key))) {
            self.tables
                .insert(folder.location().join(key)?.path().into());
        }
        if entries.is_empty() && unnameable.is_empty() {
            // it is reported as failed
            self.logs.insert(path.into());
        }
        Ok(())
    }

    /// Returns the content that the storage listed at a place. If it refused, the place is one of the logs, which fails by
    /// storage: nothing is known of the logs below it, and the others are analysed.
    ///
    /// # Errors
    /// The place is a mistake in the call, or cannot be listed at all.
    fn listed<T>(
        &mut self,
        place: &Path,
        listed: Result<T, tipwatch_storage::Error>,
    ) -> Result<Option<T>> {
        let error = match listed {
            Ok(listed) => return Ok(Some(listed)),
            Err(error) => error,
        };
        let is_mistake = error.kind == ErrorKind::NotAPlace;
        let error = error.into();
        if is_mistake || FailureKind::of(&error) != FailureKind::Storage {
            return Err(error);
        }
        self.logs.insert(place.into());
        self.refused.insert(place.into(), error_text(&error));
        Ok(None)
    }

    /// The logs in a folder tree. An unreadable folder is listed itself, so that it is reported.
    fn add_folder(&mut self, folder: &Path, above: &mut BTreeSet<PathBuf>) {
        if folder == self.out || is_clips_of_result(folder) {
            return;
        }
        if folder.join(ROSBAG2_METADATA).is_file() {
            self.logs.insert(folder.into());
            return;
        }
        let (Ok(real), Ok(entries)) = (folder.canonicalize(), fs::read_dir(folder)) else {
            self.logs.insert(folder.into());
            return;
        };
        // a link to a parent folder would never end
        if !above.insert(real.clone()) {
            return;
        }
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                self.add_folder(&path, above);
            } else if is_result(&path) {
                // of an analysis, not of a machine
            } else if is_log(&path) || is_trace(&path) {
                self.logs.insert(path.into());
            } else if is_left_out(&path) {
                self.tables.insert(path.into());
            }
        }
        above.remove(&real);
        if is_log(folder) {
            self.named_like_logs.insert(folder.into());
        }
    }
}

/// The absolute path without `.` and `..`. Links are kept, except those before a `..`.
fn tidy(path: &Path) -> Result<PathBuf> {
    if Location::is_remote_path(path) {
        return Ok(path.into());
    }
    let path = absolute(path).with_context(|| format!("{}: not a valid path", path.display()))?;
    let parts: Vec<Component<'_>> = path.components().collect();
    let Some(last) = parts.iter().rposition(|part| *part == Component::ParentDir) else {
        return Ok(path);
    };
    let before: PathBuf = parts[..=last].iter().collect();
    let Ok(mut tidied) = before.canonicalize() else {
        return Ok(path);
    };
    tidied.extend(&parts[last + 1..]);
    Ok(tidied)
}

fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?', '['])
}

fn is_log(path: &Path) -> bool {
    ends_packed(path, &LOG_ENDINGS)
}

/// Whether a file is one that an analysis wrote beside its summary.
fn is_result(path: &Path) -> bool {
    let is = |name: &&str| path.file_name().is_some_and(|own| own == *name);
    [SAMPLES, EVENTS, DERIVED].iter().any(is) && path.with_file_name(SUMMARY).is_file()
}

/// Whether a folder has the clips that an analysis cut from its log.
fn is_clips_of_result(folder: &Path) -> bool {
    let is_named = folder.file_name().is_some_and(|name| name == CLIPS);
    is_named && folder.with_file_name(SUMMARY).is_file()
}

fn is_table(path: &Path) -> bool {
    ends_packed(path, &TABLE_ENDINGS)
}

/// A table, or a packed text that may be a trace.
fn is_left_out(path: &Path) -> bool {
    let is_packed_text = || {
        ends_packed(path, &TRACE_ENDINGS)
            && !ends_with_any(path, &TRACE_ENDINGS)
            && !ends_packed(path, &SURE_TRACE_ENDINGS)
    };
    is_table(path) || is_packed_text()
}

/// Whether a name has one of these endings, packed or not.
fn ends_packed(path: &Path, endings: &[&str]) -> bool {
    let name = name_of(path);
    PACKED_ENDINGS.iter().any(|packed| {
        let bare = name.strip_suffix(packed).unwrap_or("");
        endings.iter().any(|ending| bare.ends_with(ending))
    })
}

/// Whether a text has frames of a CAN bus.
fn is_trace(path: &Path) -> bool {
    if !ends_with_any(path, &TRACE_ENDINGS) {
        return ends_packed(path, &SURE_TRACE_ENDINGS);
    }
    let mut beginning = Vec::new();
    let mut read = || {
        fs::File::open(path)?
            .take(BEGINNING_BYTES)
            .read_to_end(&mut beginning)
    };
    read().is_ok() && ContainerFormat::of(&beginning).is_some()
}

fn ends_with_any(path: &Path, endings: &[&str]) -> bool {
    let name = name_of(path);
    endings.iter().any(|ending| name.ends_with(ending))
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().to_lowercase()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;

    /// Names relative to the folder.
    fn found(folder: &Path, requested: &[&str]) -> Vec<String> {
        let requested: Vec<_> = requested.iter().map(|name| folder.join(name)).collect();
        let logs = find(&requested, &folder.join("out")).unwrap().logs;
        let name = |log: PathBuf| log.strip_prefix(folder).unwrap().display().to_string();
        logs.into_iter().map(name).collect()
    }

    #[test]
    fn folders_patterns_and_manifests_list_each_log_once() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().canonicalize().unwrap();
        let at = |name: &str| folder.join(name);
        for name in ["a/bag2", "a/deep", "a/results", "out", "sets"] {
            fs::create_dir_all(at(name)).unwrap();
        }
        let logs = [
            "a/1.mcap",
            "a/2.MCAP",
            "a/3.bag.active",
            "a/4.db3.zstd",
            "a/7.blf",
            "a/8.log",
            "a/a.trc",
            "a/b.ASC.gz",
            "a/bag2",
            "a/deep/5.bag",
        ];
        let others = [
            "a/notes.md",
            "a/recorder.log",
            "a/recorder.trc",
            "a/old.log.gz",
            "a/9.csv",
            "a/deep/9.parquet",
            "a/results/derived.mcap",
            "a/results/samples.parquet",
            "a/results/summary.json",
            "a/bag2/metadata.yaml",
            "a/bag2/x_0.db3",
            "out/6.mcap",
        ];
        let files = logs
            .iter()
            .chain(&others)
            .filter(|name| !name.ends_with("bag2"));
        for name in files {
            fs::write(at(name), "").unwrap();
        }
        let manifest = "\u{feff}# the first shift\n../a/1.mcap\n\n  ../a/deep/missing.mcap \r\n";
        fs::write(at("sets/shift.txt"), manifest).unwrap();
        fs::write(at("a/8.log"), "(1700000000.000000) can0 101#F049\n").unwrap();
        fs::write(at("a/a.trc"), ";$FILEVERSION=1.1\n;$STARTTIME=45244.5\n").unwrap();
        assert_eq!(found(&folder, &[""]), logs);
        // tables must be named
        let notes = find(&[at("a")], &at("out")).unwrap().notes();
        assert!(
            notes.len() == 1 && notes[0].contains(": 3, the first") && notes[0].contains("a/*.csv"),
            "{notes:?}"
        );
        assert_eq!(found(&folder, &["a/*.csv"]), ["a/9.csv"]);
        let named = find(
            &[
                at("a"),
                at("a/9.csv"),
                at("a/deep/*.parquet"),
                at("a/old.log.gz"),
            ],
            &at("out"),
        );
        assert_eq!(named.unwrap().notes(), Vec::<String>::new());
        assert_eq!(
            found(&folder, &["a/*.mcap", "sets/../a/1.mcap"]),
            ["a/1.mcap"]
        );
        let listed = found(&folder, &["sets/shift.txt"]);
        assert_eq!(listed, ["a/1.mcap", "a/deep/missing.mcap"]);
        let error = find(&[at("a/*.xyz")], &at("out")).unwrap_err().to_string();
        assert!(
            error.contains("*.xyz") && error.contains("expected matching logs"),
            "{error}"
        );
        let error = find(&[at("sets")], &at("out")).unwrap_err().to_string();
        assert!(
            error.contains("expected logs") && error.contains("found none"),
            "{error}"
        );
    }

    #[test]
    fn folders_named_like_a_log_without_one_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().canonicalize().unwrap();
        let at = |name: &str| folder.join(name);
        for name in ["a/empty.mcap", "a/full.mcap"] {
            fs::create_dir_all(at(name)).unwrap();
        }
        fs::write(at("a/full.mcap/1.mcap"), "").unwrap();
        let whole = find(&[at("a")], &at("out")).unwrap();
        let named = find(&[at("a/empty.mcap"), at("a/full.mcap")], &at("out")).unwrap();
        for found in [whole, named] {
            assert_eq!(found.logs, [at("a/full.mcap/1.mcap")]);
            let notes = found.notes();
            assert!(
                notes.len() == 1
                    && notes[0].contains("skipped: 1")
                    && notes[0].ends_with("a/empty.mcap"),
                "{notes:?}"
            );
        }
        let error = find(&[at("a/empty.mcap")], &at("out"))
            .unwrap_err()
            .to_string();
        assert!(error.contains("named like a log"), "{error}");
    }
}

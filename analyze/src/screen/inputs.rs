//! Resolves folders, patterns, manifests and logs to one list of logs.
//!
//! Folders, patterns and logs may be in a bucket (`s3://logs/2026-*/**/*.mcap`).
//!
//! A manifest is a text file (`.txt`, `.list`, `.manifest`): one log per line, relative to the manifest;
//! empty lines and lines that start with `#` are skipped. A missing log stays in the list, so that it is
//! reported as failed.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf, absolute};

use anyhow::{Context, Result, bail};
use tipwatch_binding::read_text;
use tipwatch_storage::{Folder, Location, expand};

/// File extensions of logs; logs given by name may have any.
const LOG_ENDINGS: [&str; 4] = [".mcap", ".bag", ".db3", ".bag.active"];
/// Extensions added by whole-file compression.
const PACKED_ENDINGS: [&str; 6] = ["", ".zstd", ".zst", ".gz", ".bz2", ".lz4"];
const MANIFEST_ENDINGS: [&str; 3] = [".txt", ".list", ".manifest"];
/// The file that makes a folder a log.
const ROSBAG2_METADATA: &str = "metadata.yaml";

/// All requested logs, each once, sorted by path; files in `out` are skipped.
///
/// # Errors
/// A pattern matches nothing, a manifest cannot be read, or there is no log at all.
pub(super) fn find(requested: &[PathBuf], out: &Path) -> Result<Vec<PathBuf>> {
    let mut finder = Finder {
        logs: BTreeSet::new(),
        out: tidy(out)?,
    };
    for path in requested {
        finder.add_requested(path)?;
    }
    if finder.logs.is_empty() {
        let names: Vec<_> = requested.iter().map(|p| p.display().to_string()).collect();
        bail!(
            "{}: expected logs (*.mcap, *.bag, *.db3 or rosbag2 folders), found none",
            names.join(", ")
        );
    }
    Ok(finder.logs.into_iter().collect())
}

struct Finder {
    logs: BTreeSet<PathBuf>,
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
            self.logs.insert(tidy(path)?);
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
                    self.logs.insert(tidy(error.path())?);
                }
            }
        }
        if is_empty {
            bail!("{text}: expected matching logs, found none");
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
                    false => tidy(&folder.join(line))?,
                });
        }
        Ok(())
    }

    /// A log, a folder or a pattern of a bucket or server.
    fn add_remote(&mut self, path: &Path) -> Result<()> {
        if is_pattern(path) {
            let found = expand(&path.to_string_lossy())?.unwrap_or_default();
            if found.is_empty() {
                bail!("{}: expected matching logs, found none", path.display());
            }
            let found = found
                .iter()
                .map(|found| found.location.path().to_path_buf());
            self.logs
                .extend(found.filter(|path| !path.starts_with(&self.out)));
            return Ok(());
        }
        if is_log(path) {
            self.logs.insert(path.into());
            return Ok(());
        }
        let folder = Folder::open(&Location::of(path)?)?;
        let entries = folder.list("**")?;
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
        for key in keys().filter(|key| is_log(Path::new(key)) || is_metadata(key)) {
            let bag = bags.iter().find(|bag| {
                bag.is_empty()
                    || key
                        .strip_prefix(bag.as_str())
                        .is_some_and(|k| k.starts_with('/'))
            });
            let log = match bag {
                Some(bag) if bag.is_empty() => path.to_path_buf(),
                Some(bag) => folder.location().join(bag)?.path().into(),
                None => folder.location().join(key)?.path().into(),
            };
            if !log.starts_with(&self.out) {
                self.logs.insert(log);
            }
        }
        if entries.is_empty() {
            // it is reported as failed
            self.logs.insert(path.into());
        }
        Ok(())
    }

    /// The logs in a folder tree. An unreadable folder is listed itself, so that it is reported.
    fn add_folder(&mut self, folder: &Path, above: &mut BTreeSet<PathBuf>) {
        if folder == self.out {
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
            } else if is_log(&path) {
                self.logs.insert(path);
            }
        }
        above.remove(&real);
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
    PACKED_ENDINGS.iter().any(|packed| {
        let name = name_of(path);
        let bare = name.strip_suffix(packed).unwrap_or("");
        LOG_ENDINGS.iter().any(|ending| bare.ends_with(ending))
    })
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
        let logs = find(&requested, &folder.join("out")).unwrap();
        let name = |log: PathBuf| log.strip_prefix(folder).unwrap().display().to_string();
        logs.into_iter().map(name).collect()
    }

    #[test]
    fn folders_patterns_and_manifests_list_each_log_once() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().canonicalize().unwrap();
        let at = |name: &str| folder.join(name);
        for name in ["a/bag2", "a/deep", "out", "sets"] {
            fs::create_dir_all(at(name)).unwrap();
        }
        let logs = [
            "a/1.mcap",
            "a/2.MCAP",
            "a/3.bag.active",
            "a/4.db3.zstd",
            "a/bag2",
            "a/deep/5.bag",
        ];
        let others = [
            "a/notes.md",
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
        assert_eq!(found(&folder, &[""]), logs);
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
}

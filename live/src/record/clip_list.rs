//! The list of a black box's clips, `clips.jsonl`: one line for each, with its SHA-256; and what a killed recorder left.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tipwatch_binding::{hash_file, hex};

use super::clip_file::{FinishedClip, UNFINISHED, partial};
use super::repair::repair;
use super::retention::recorded_files;

/// Name of the list, in the recorder's folder.
const LIST: &str = "clips.jsonl";

/// A line of the list.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Line {
    /// Path relative to the list.
    file: String,
    sha256: String,
    bytes: u64,
    /// Whether the recorder finished the clip. An interrupted clip ends before its time.
    is_complete: bool,
    /// The conditions in order, and when each began to be met (ns); empty for a clip that was interrupted.
    triggers: Vec<(String, i64)>,
    first_log_time_ns: Option<i64>,
    last_log_time_ns: Option<i64>,
    samples: Option<u64>,
    verdicts: Option<u64>,
}

/// Adds a finished clip, and tells of it.
pub(super) fn add(root: &Path, clip: &FinishedClip) {
    let counts = &clip.counts;
    let (first_ns, last_ns) = clip.log_span_ns;
    let names: BTreeSet<_> = clip
        .onsets
        .iter()
        .map(|onset| onset.trigger.name())
        .collect();
    let names: Vec<_> = names.into_iter().collect();
    eprintln!(
        "record: {}: {}, {:.1} s, {} samples, {} verdicts",
        clip.path.display(),
        names.join(", "),
        (last_ns - first_ns) as f64 * 1e-9,
        counts.samples,
        counts.verdicts
    );
    let onsets = clip.onsets.iter();
    let line = Line {
        triggers: onsets
            .map(|o| (o.trigger.name().to_owned(), o.log_time_ns))
            .collect(),
        first_log_time_ns: Some(first_ns),
        last_log_time_ns: Some(last_ns),
        samples: Some(counts.samples),
        verdicts: Some(counts.verdicts),
        ..blank(true)
    };
    list(root, &clip.path, line);
}

/// Keeps what a killed recorder left: closes its clip and says that it is partial; lists clips that are not listed.
pub(super) fn adopt_all(root: &Path) {
    for path in unfinished_clips(root) {
        match adopt(&path) {
            Ok(None) => {}
            Ok(Some(kept)) => {
                eprintln!(
                    "record: {}: partial: its recording was interrupted before its end",
                    kept.display()
                );
                list(root, &kept, blank(false));
            }
            Err(error) => eprintln!("record: {}: cannot close it: {error}", path.display()),
        }
    }
    let text = std::fs::read_to_string(root.join(LIST)).unwrap_or_default();
    let listed = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    let listed: BTreeSet<String> = listed.map(|line: Line| line.file).collect();
    for path in recorded_files(root) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("clip_") && !listed.contains(&relative(root, &path)) {
            let is_complete = !name.ends_with("_partial.mcap");
            list(root, &path, blank(is_complete));
        }
    }
}

/// Closes an unfinished clip and names it a partial one; `None` if it is being written, or empty.
fn adopt(path: &Path) -> io::Result<Option<PathBuf>> {
    let file = File::options().read(true).write(true).open(path)?;
    if file.try_lock().is_err() {
        return Ok(None);
    }
    let is_empty = file.metadata()?.len() == 0;
    drop(file);
    if is_empty {
        std::fs::remove_file(path)?;
        return Ok(None);
    }
    repair(path)?;
    let kept = partial(&path.with_extension(""));
    std::fs::rename(path, &kept)?;
    Ok(Some(kept))
}

fn unfinished_clips(root: &Path) -> Vec<PathBuf> {
    let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
    let folders = entries(root).map(|entry| entry.path());
    let folders = folders.filter(|path| path.is_dir());
    let files = folders.flat_map(|folder| entries(&folder).map(|e| e.path()).collect::<Vec<_>>());
    files
        .filter(|path| path.extension().is_some_and(|e| e == UNFINISHED))
        .collect()
}

fn blank(is_complete: bool) -> Line {
    Line {
        file: String::new(),
        sha256: String::new(),
        bytes: 0,
        is_complete,
        triggers: Vec::new(),
        first_log_time_ns: None,
        last_log_time_ns: None,
        samples: None,
        verdicts: None,
    }
}

/// Adds a line with path and hash of the file. The clip does not depend on it.
fn list(root: &Path, path: &Path, line: Line) {
    let added = hash_file(path).and_then(|(hash, bytes)| {
        let file = relative(root, path);
        let line = Line {
            file,
            sha256: hex(&hash),
            bytes,
            ..line
        };
        let mut text = serde_json::to_string(&line)?;
        text.push('\n');
        let mut list = File::options()
            .create(true)
            .append(true)
            .open(root.join(LIST))?;
        list.write_all(text.as_bytes())?;
        list.sync_data()
    });
    if let Err(error) = added {
        eprintln!(
            "record: {}: cannot list {}: {error}",
            root.join(LIST).display(),
            path.display()
        );
    }
}

fn relative(root: &Path, path: &Path) -> String {
    path.strip_prefix(root)
        .unwrap_or(path)
        .display()
        .to_string()
}

//! Removes what iceoryx2 0.10 leaves of a node that was killed while it made a port.
//!
//! Its cleanup removes a dead node's tags, then its details, then its folder. A tag that was killed in the making is
//! not listed, so it stays, the folder is not empty, and the cleanup stops after the details. Without them the next one
//! looks for the node under the default prefix and takes it as removed.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::*;

/// A younger node may still be in the hands of another process.
const MIN_AGE: Duration = Duration::from_secs(2);

/// Removes the files of dead nodes without details; returns how many nodes these were. Such a node has no port and no
/// place in a service: the details are the first that a node gets, and iceoryx2 removes all else before them.
pub(super) fn remove_leftovers(config: &Config) -> u64 {
    let mut left = Vec::new();
    let listed = Node::<ipc::Service>::list(config, |state| {
        if let NodeState::Dead(node) = &state
            && node.details().is_none()
        {
            left.push(node.id().value());
        }
        CallbackProgression::Continue
    });
    if listed.is_err() {
        return 0;
    }
    let folder = PathBuf::from(config.global.node_dir().to_string());
    let prefix = config.global.prefix.to_string();
    let removed = left.into_iter().filter(|id| remove(&folder, &prefix, *id));
    removed.count() as u64
}

/// Removes the files of one node, the one that shows its state last.
fn remove(folder: &Path, prefix: &str, id: u128) -> bool {
    let of_node = format!("{prefix}{id}.");
    let mut files = files(folder, &of_node);
    let is_young = |path: &PathBuf| {
        let changed = path.metadata().and_then(|metadata| metadata.modified());
        let age = changed.ok().and_then(|changed| changed.elapsed().ok());
        age.is_none_or(|age| age < MIN_AGE)
    };
    if files.is_empty() || files.iter().any(is_young) {
        return false;
    }
    let own = folder.join(id.to_string());
    for tag in self::files(&own, prefix) {
        let _ = fs::remove_file(tag);
    }
    // what remains is of another prefix
    if own.exists() && fs::remove_dir(&own).is_err() {
        return false;
    }
    files.sort_by_key(|path| std::cmp::Reverse(path.as_os_str().len()));
    files.iter().all(|file| fs::remove_file(file).is_ok())
}

/// The files in a folder whose names begin so.
fn files(folder: &Path, beginning: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(beginning));
    named
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .collect()
}

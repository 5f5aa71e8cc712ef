//! Removes what iceoryx2 0.10 leaves of a process that was killed at a bad moment.
//!
//! While it made a port: the cleanup removes a dead node's tags, then its details, then its folder. A tag that was killed
//! in the making is not listed, so it stays, the folder is not empty, and the cleanup stops after the details. Without
//! them the next one looks for the node under the default prefix and takes it as removed.
//!
//! While it made shared memory: before that gets its size, whoever opens it waits for the size without end, the cleanup
//! too, and with it every process that joins.

use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use iceoryx2::node::NodeView;
use iceoryx2::prelude::*;

/// Least age of files that may be removed: a younger one may still be in the hands of another process.
const MIN_AGE: Duration = Duration::from_secs(2);

/// Folder in which Linux keeps named shared memory.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";

/// Waits until all shared memory of this prefix has a size or is removed: at most as long as it counts as young.
pub(super) fn wait_for_sizes(config: &Config) {
    let start = Instant::now();
    while !remove_unsized(config) && start.elapsed() < 2 * MIN_AGE {
        sleep(MIN_AGE / 100);
    }
}

/// Removes the shared memory of this prefix that never got a size. False: some is so young that it may still get one,
/// and until then nothing that opens shared memory may be called.
pub(super) fn remove_unsized(config: &Config) -> bool {
    let prefix = config.global.prefix.to_string();
    let mut all_sized = true;
    for path in files(Path::new(SHARED_MEMORY), &prefix) {
        match path.metadata() {
            Ok(metadata) if metadata.len() > 0 => {}
            Ok(metadata) if is_young(&metadata) => all_sized = false,
            // removed meanwhile
            Err(_) => {}
            // of another user: then it cannot be opened either, and nobody waits for it
            Ok(_) => drop(fs::remove_file(path)),
        }
    }
    all_sized
}

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
    let is_young = |path: &PathBuf| path.metadata().is_ok_and(|file| is_young(&file));
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

/// Whether a file was changed less than `MIN_AGE` ago. One that was changed in the future counts as old: the clock was set back
/// since.
fn is_young(file: &Metadata) -> bool {
    let age = file.modified().map(|changed| changed.elapsed());
    age.is_ok_and(|age| age.is_ok_and(|age| age < MIN_AGE))
}

/// The files in a folder whose names begin so.
pub(super) fn files(folder: &Path, beginning: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(beginning));
    named
        .map(|entry| entry.path())
        .filter(|path| path.is_file())
        .collect()
}

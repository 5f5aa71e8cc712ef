//! Limits the size of all files: the oldest are removed first, never the one being written.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The limit on a recorder's folder.
#[derive(Debug, Clone)]
pub(super) struct Retention {
    folder: PathBuf,
    max_bytes: Option<u64>,
    current: PathBuf,
}

impl Retention {
    pub(super) fn new(folder: &Path, max_bytes: Option<u64>) -> Self {
        Self {
            folder: folder.into(),
            max_bytes,
            current: PathBuf::new(),
        }
    }

    /// The recorder's folder.
    pub(super) fn root(&self) -> PathBuf {
        self.folder.clone()
    }

    /// Protects this file, which is being written.
    pub(super) fn keep(&mut self, path: &Path) {
        self.current = path.into();
    }

    /// Removes the oldest files if all together are too large; returns which.
    pub(super) fn apply(&self) -> Vec<PathBuf> {
        let mut removed = Vec::new();
        let Some(max) = self.max_bytes else {
            return removed;
        };
        let files = self.files();
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files {
            if bytes <= max {
                break;
            }
            if remove(&file.path) {
                bytes -= file.bytes;
                removed.push(file.path);
            }
        }
        removed
    }

    /// Removes the oldest file, if the options allow it: the disk is full. Returns which.
    pub(super) fn make_room(&self) -> Option<PathBuf> {
        self.max_bytes?;
        let oldest = self.files().into_iter().next()?;
        remove(&oldest.path).then_some(oldest.path)
    }

    /// The files, oldest first.
    fn files(&self) -> Vec<Kept> {
        let mut files: Vec<Kept> = recorded_files(&self.folder)
            .filter(|path| *path != self.current)
            .filter_map(|path| {
                let metadata = path.metadata().ok()?;
                Some(Kept {
                    path,
                    bytes: metadata.len(),
                    changed: metadata.modified().ok()?,
                })
            })
            .collect();
        files.sort_by_key(|file| file.changed);
        files
    }
}

/// The MCAP files of all sessions in a recorder's folder.
pub(super) fn recorded_files(root: &Path) -> impl Iterator<Item = PathBuf> {
    fn entries(folder: &Path) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).collect()
    }
    let folders = entries(root).into_iter().filter(|path| path.is_dir());
    let files = folders.flat_map(|folder| entries(&folder));
    files.filter(|path| path.extension().is_some_and(|e| e == "mcap"))
}

struct Kept {
    path: PathBuf,
    bytes: u64,
    changed: SystemTime,
}

fn remove(path: &Path) -> bool {
    let removed = std::fs::remove_file(path);
    match &removed {
        Ok(()) => eprintln!("record: removed {} to make room", path.display()),
        Err(error) => eprintln!("record: {}: cannot remove it: {error}", path.display()),
    }
    removed.is_ok()
}

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

    /// Protects this file, which is being written.
    pub(super) fn keep(&mut self, path: &Path) {
        self.current = path.into();
    }

    /// Removes the oldest files if all together are too large.
    pub(super) fn apply(&self) {
        let Some(max) = self.max_bytes else { return };
        let files = self.files();
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files {
            if bytes <= max {
                return;
            }
            if remove(&file.path) {
                bytes -= file.bytes;
            }
        }
    }

    /// Removes the oldest file, if the options allow it: the disk is full.
    pub(super) fn make_room(&self) {
        if self.max_bytes.is_some()
            && let Some(oldest) = self.files().first()
        {
            remove(&oldest.path);
        }
    }

    /// The files, oldest first.
    fn files(&self) -> Vec<Kept> {
        let entries = |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten();
        let folders = entries(&self.folder).map(|entry| entry.path());
        let mut files: Vec<Kept> = folders
            .filter(|path| path.is_dir())
            .flat_map(|folder| {
                entries(&folder)
                    .map(|entry| entry.path())
                    .collect::<Vec<_>>()
            })
            .filter(|path| path.extension().is_some_and(|e| e == "mcap") && *path != self.current)
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

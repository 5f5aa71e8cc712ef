//! How much is kept: the oldest files go first, never the one being written.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// All files of a recorder's folder, bounded.
#[derive(Debug, Clone)]
pub(super) struct Retention {
    folder: PathBuf,
    most_bytes: Option<u64>,
    current: PathBuf,
}

impl Retention {
    pub(super) fn new(folder: &Path, most_bytes: Option<u64>) -> Self {
        Self {
            folder: folder.into(),
            most_bytes,
            current: PathBuf::new(),
        }
    }

    /// This file is being written now.
    pub(super) fn keep(&mut self, path: &Path) {
        self.current = path.into();
    }

    /// Removes the oldest files where all together are too large.
    pub(super) fn apply(&self) {
        let Some(most) = self.most_bytes else { return };
        let files = self.files();
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files {
            if bytes <= most {
                return;
            }
            if remove(&file.path) {
                bytes -= file.bytes;
            }
        }
    }

    /// The disk is full: removes the oldest file, if that was allowed.
    pub(super) fn make_room(&self) {
        if self.most_bytes.is_some()
            && let Some(oldest) = self.files().first()
        {
            remove(&oldest.path);
        }
    }

    /// The files, the oldest first.
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
        Ok(()) => eprintln!("record: {} removed to make room", path.display()),
        Err(error) => eprintln!("record: {}: cannot be removed: {error}", path.display()),
    }
    removed.is_ok()
}

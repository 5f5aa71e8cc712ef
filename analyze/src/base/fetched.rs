//! Folders of results in a bucket, copied into a temporary folder to be read.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tempfile::TempDir;
use tipwatch_storage::{Folder, Location};

/// A folder to read from. A copy is removed with the value.
#[derive(Debug)]
pub(crate) struct Fetched {
    path: PathBuf,
    _copy: Option<TempDir>,
}

impl Fetched {
    /// A local folder as it is, or a copy of the files of a folder in a bucket whose names match the pattern.
    pub(crate) fn folder(place: &Path, pattern: &str) -> Result<Self> {
        let location = Location::of(place)?;
        if let Some(local) = location.as_local() {
            return Ok(Self {
                path: local.into(),
                _copy: None,
            });
        }
        let folder = Folder::open(&location)?;
        let copy = tempfile::Builder::new().prefix("tipwatch-").tempdir();
        let copy = copy.context("no temporary folder can be created")?;
        let entries = folder.list(pattern)?;
        if entries.is_empty() {
            bail!("{location}: expected a folder of results, found none");
        }
        for entry in entries {
            let path = copy.path().join(&entry.key);
            let bytes = folder.get(&entry.key)?;
            let written = std::fs::create_dir_all(path.parent().unwrap_or(copy.path()))
                .and_then(|()| std::fs::write(&path, bytes));
            written.with_context(|| format!("{}: cannot be written", path.display()))?;
        }
        Ok(Self {
            path: copy.path().into(),
            _copy: Some(copy),
        })
    }

    /// Returns the local folder with the files.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

/// Whether a folder in a bucket has a file of this name; false if the folder cannot be listed.
pub(crate) fn has_file(place: &Path, name: &str) -> bool {
    let has = || -> Result<bool, tipwatch_storage::Error> {
        let (files, _) = Folder::open(&Location::of(place)?)?.children("")?;
        Ok(files.iter().any(|entry| entry.key == name))
    };
    has().unwrap_or(false)
}

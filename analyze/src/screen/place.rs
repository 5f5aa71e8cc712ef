//! Where records and reports are: small objects by name in a folder.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::base::files::{remove_unfinished, write_atomically, write_if_absent};

/// A folder of objects. Names are relative, with `/`.
#[derive(Debug, Clone)]
pub(super) struct Place {
    folder: PathBuf,
}

impl Place {
    pub(super) fn at(folder: &Path) -> Self {
        Self {
            folder: folder.into(),
        }
    }

    /// The folder, if it is one of this machine.
    pub(super) fn local(&self) -> Option<&Path> {
        Some(&self.folder)
    }

    /// Names of the objects directly in a subfolder, without its name; none if there is no such folder.
    pub(super) fn list(&self, subfolder: &str) -> Result<Vec<String>> {
        let folder = self.folder.join(subfolder);
        let cannot = || format!("{}: cannot be read", folder.display());
        let entries = match fs::read_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.with_context(cannot)?,
        };
        let mut names = Vec::new();
        for entry in entries {
            let name = entry.with_context(cannot)?.file_name();
            names.extend(name.to_str().map(String::from));
        }
        names.sort();
        Ok(names)
    }

    /// Those whose names begin with `prefix`.
    pub(super) fn list_with_prefix(&self, subfolder: &str, prefix: &str) -> Result<Vec<String>> {
        let mut names = self.list(subfolder)?;
        names.retain(|name| name.starts_with(prefix));
        Ok(names)
    }

    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>> {
        let path = self.folder.join(name);
        fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))
    }

    /// Writes an object; an earlier one of this name is replaced as a whole.
    pub(super) fn put(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_atomically(&self.folder.join(name), bytes)
    }

    /// Writes a new object; returns whether it is new. An existing one stays.
    pub(super) fn put_if_absent(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        write_if_absent(&self.folder.join(name), bytes)
    }

    pub(super) fn exists(&self, name: &str) -> bool {
        self.folder.join(name).is_file()
    }

    /// Removes an object, if there is one.
    pub(super) fn remove(&self, name: &str) -> Result<()> {
        let path = self.folder.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(error).with_context(|| format!("{}: cannot be removed", path.display()))
            }
            _ => Ok(()),
        }
    }

    /// Removes partial files that a killed program left in a subfolder; only while holding the lock.
    pub(super) fn tidy(&self, subfolder: &str) {
        remove_unfinished(&self.folder.join(subfolder));
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.folder.display())
    }
}

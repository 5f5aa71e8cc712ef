//! Storage of records and reports: small objects by name, in a local folder or a bucket.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use rayon::prelude::*;
use tipwatch_storage::{Folder, Location, Put};

use crate::base::files::remove_unfinished;

/// Requests to a bucket at a time: each waits for an answer.
const PARALLEL: usize = 128;

/// A folder of objects. Names are relative, with `/`.
#[derive(Clone)]
pub(super) struct Place {
    folder: Arc<Folder>,
}

impl Place {
    /// A local path, or a URL.
    pub(super) fn at(path: &Path) -> Result<Self> {
        let folder = Folder::open(&Location::of(path)?)?;
        Ok(Self {
            folder: Arc::new(folder),
        })
    }

    /// The folder, if it is one of this machine.
    pub(super) fn local(&self) -> Option<&Path> {
        self.folder.location().as_local()
    }

    /// Names of the objects directly in a subfolder, without its name; none if there is no such folder.
    pub(super) fn list(&self, subfolder: &str) -> Result<Vec<String>> {
        let entries = self.folder.list(&format!("{subfolder}/*"))?.into_iter();
        let name = |key: &str| key.rsplit('/').next().map(String::from);
        Ok(entries.filter_map(|entry| name(&entry.key)).collect())
    }

    /// Names of all objects below a subfolder.
    pub(super) fn below(&self, subfolder: &str) -> Result<Vec<String>> {
        let entries = self.folder.list(&format!("{subfolder}/**/*"))?.into_iter();
        Ok(entries.map(|entry| entry.key).collect())
    }

    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>> {
        Ok(self.folder.get(name)?)
    }

    /// Writes an object; an earlier one of this name is replaced as a whole.
    pub(super) fn put(&self, name: &str, bytes: &[u8]) -> Result<()> {
        Ok(self.folder.put(name, bytes)?)
    }

    /// Writes a local file as an object.
    pub(super) fn put_file(&self, name: &str, file: &Path) -> Result<()> {
        Ok(self.folder.put_file(name, file)?)
    }

    /// Writes a new object; returns whether it is new. An existing one stays.
    pub(super) fn put_if_absent(&self, name: &str, bytes: &[u8]) -> Result<bool> {
        Ok(self.folder.put_if_absent(name, bytes)? == Put::Written)
    }

    /// Does the same with many objects; those of a bucket wait for their answers at the same time. The results have the
    /// order of `names`.
    ///
    /// # Errors
    /// The first error of `work`, or the threads cannot be started.
    pub(super) fn in_parallel<N: Sync, R: Send>(
        &self,
        names: &[N],
        work: impl Fn(&N) -> Result<R> + Sync + Send,
    ) -> Result<Vec<R>> {
        let all = || names.par_iter().map(work).collect();
        if self.local().is_some() {
            return all();
        }
        let threads = rayon::ThreadPoolBuilder::new().num_threads(PARALLEL.min(names.len().max(1)));
        threads
            .build()
            .context("cannot start threads")?
            .install(all)
    }

    /// Removes an object, if there is one.
    pub(super) fn remove(&self, name: &str) -> Result<()> {
        Ok(self.folder.delete(name)?)
    }

    /// Removes partial files that a killed program left in a subfolder; only while holding the lock.
    pub(super) fn tidy(&self, subfolder: &str) {
        if let Some(folder) = self.local() {
            remove_unfinished(&folder.join(subfolder));
        }
    }
}

impl std::fmt::Debug for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Place({self})")
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.folder.location())
    }
}

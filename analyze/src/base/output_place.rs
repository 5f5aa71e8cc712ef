//! Destination of results: a local folder or file, or one of a bucket.
//!
//! Results for a bucket are written into a temporary folder first and sent when they are complete.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tempfile::TempDir;
use tipwatch_storage::{Folder, Location};

/// A place for results.
#[derive(Debug)]
pub struct OutputPlace {
    place: PathBuf,
    local: PathBuf,
    remote: Option<(Folder, TempDir)>,
}

impl OutputPlace {
    /// A folder for results.
    ///
    /// # Errors
    /// The place is not valid, or no temporary folder can be made.
    pub fn folder(place: &Path) -> Result<Self> {
        let location = Location::of(place)?;
        match location.as_local() {
            Some(local) => Ok(Self::local(place, local)),
            None => Self::remote(&location, Folder::open(&location)?, None),
        }
    }

    /// A single file, which is not there yet if it `must_be_new`.
    ///
    /// # Errors
    /// The place is not valid, or no temporary folder can be made; or the file is in a bucket and there already.
    pub fn file(place: &Path, must_be_new: bool) -> Result<Self> {
        let location = Location::of(place)?;
        if let Some(local) = location.as_local() {
            return Ok(Self::local(place, local));
        }
        let shown = location.path();
        let name = shown.file_name().and_then(|name| name.to_str());
        let (Some(folder), Some(name)) = (shown.parent(), name) else {
            bail!("{location}: expected the name of a file in a bucket");
        };
        let folder = Folder::open(&Location::of(folder)?)?;
        if must_be_new && folder.children("")?.0.iter().any(|entry| entry.key == name) {
            bail!("{location}: cannot be created: it is already there");
        }
        Self::remote(&location, folder, Some(name))
    }

    /// Refuses a place that is not on this computer.
    ///
    /// # Errors
    /// The place is in a bucket or on a server.
    pub fn require_local(place: &Path) -> Result<()> {
        if Location::is_remote_path(place) {
            bail!(
                "{}: expected a local path: this command writes nowhere else",
                place.display()
            );
        }
        Ok(())
    }

    fn local(place: &Path, local: &Path) -> Self {
        Self {
            place: place.into(),
            local: local.into(),
            remote: None,
        }
    }

    fn remote(location: &Location, folder: Folder, name: Option<&str>) -> Result<Self> {
        let temporary = tempfile::Builder::new().prefix("tipwatch-").tempdir();
        let temporary = temporary.context("no temporary folder can be created for the results")?;
        let local = name.map_or(temporary.path().into(), |name| temporary.path().join(name));
        Ok(Self {
            place: location.path().into(),
            local,
            remote: Some((folder, temporary)),
        })
    }

    /// The local path to write to.
    pub fn path(&self) -> &Path {
        &self.local
    }

    /// The place by which messages name it.
    pub fn place(&self) -> &Path {
        &self.place
    }

    /// Sends the files to the bucket, `last` at the end: if it is there, all others are. A local place has them
    /// already.
    ///
    /// # Errors
    /// A file cannot be sent; then those that were sent are removed again, and `last` is not there.
    pub fn publish(self, last: &str) -> Result<()> {
        let Some((folder, temporary)) = self.remote else {
            return Ok(());
        };
        let mut files = Vec::new();
        list(temporary.path(), "", &mut files)?;
        files.sort_by_key(|name| (name == last, name.clone()));
        // an old one would vouch for files that are being replaced
        if files.iter().any(|name| name == last) {
            folder.delete(last)?;
        }
        let mut sent: Vec<&String> = Vec::new();
        for name in &files {
            if let Err(error) = folder.put_file(name, &temporary.path().join(name)) {
                for name in sent {
                    // best effort: the first error is the one that matters
                    let _ = folder.delete(name);
                }
                return Err(error).context("the results were not written");
            }
            sent.push(name);
        }
        Ok(())
    }
}

/// The files below a folder, by their names within it.
fn list(folder: &Path, within: &str, found: &mut Vec<String>) -> Result<()> {
    let cannot = || format!("{}: cannot be read", folder.display());
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        let entry = entry.with_context(cannot)?;
        let name = format!("{within}{}", entry.file_name().to_string_lossy());
        match entry.path().is_dir() {
            true => list(&entry.path(), &format!("{name}/"), found)?,
            false => found.push(name),
        }
    }
    Ok(())
}

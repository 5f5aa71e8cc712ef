//! A folder or bucket: lists, reads and writes whole objects.

use std::path::Path;

use bytes::Bytes;
use object_store::path::Path as Key;

use crate::bucket::{Bucket, send};
use crate::counted::Transfer;
use crate::error::Error;
use crate::place::{Kind, Location};
use crate::runtime::wait_for;

use super::entry::{Entry, Put};
use super::local;
use super::pattern::{Keys, split};

/// Larger files are sent in parts of this size.
const PART_BYTES: usize = 16 << 20;

/// A folder of the local file system, of a bucket or of a web server. Objects are read and written as a whole:
/// nobody ever sees a part of one.
///
/// A web server has to know WebDAV to be listed, and cannot [`put_if_absent`](Self::put_if_absent).
pub struct Folder {
    location: Location,
    bucket: Option<Bucket>,
}

impl Folder {
    /// The folder at a place. It need not exist, and nothing is sent yet.
    ///
    /// # Errors
    /// The environment does not say how to reach it.
    pub fn open(location: &Location) -> Result<Self, Error> {
        Ok(Self {
            location: location.clone(),
            bucket: location.as_remote().map(Bucket::of).transpose()?,
        })
    }

    /// The place.
    pub fn location(&self) -> &Location {
        &self.location
    }

    /// Returns the requests and bytes so far; none in a local folder.
    pub fn transfer(&self) -> Transfer {
        let counts = self.bucket.as_ref().map(|bucket| bucket.counts.transfer());
        counts.unwrap_or_default()
    }

    /// Lists the objects whose names match a pattern (`*` and `?` within a name, `**` over folders), by name.
    ///
    /// # Errors
    /// The folder cannot be listed. A folder that is absent is empty.
    pub fn list(&self, pattern: &str) -> Result<Vec<Entry>, Error> {
        Ok(self.list_all(pattern)?.0)
    }

    /// Lists the objects that match a pattern as [`list`](Self::list) does, and the matching keys of a bucket that no request can
    /// name, such as `a//b`: their objects cannot be read.
    ///
    /// # Errors
    /// The folder cannot be listed. A folder that is absent is empty.
    pub fn list_all(&self, pattern: &str) -> Result<(Vec<Entry>, Vec<String>), Error> {
        let keys = Keys::new(&self.location.shown(), pattern)?;
        let (mut found, mut unnameable) = self.below(split(pattern).0)?;
        found.retain(|entry| keys.has(&entry.key));
        unnameable.retain(|key| keys.has(key));
        Ok((found, unnameable))
    }

    /// All objects below a folder of this one, and the keys of those that no request can name.
    fn below(&self, inner: &str) -> Result<(Vec<Entry>, Vec<String>), Error> {
        let from = match inner {
            "" => self.location.clone(),
            inner => self.location.join(inner)?,
        };
        let (Some(bucket), Some(remote)) = (self.bucket.clone(), from.as_remote().cloned()) else {
            let folder = from.as_local().unwrap_or(Path::new(""));
            let mut found = local::list(folder)?;
            if !inner.is_empty() {
                for entry in &mut found {
                    entry.key = format!("{inner}/{}", entry.key);
                }
            }
            return Ok((found, Vec::new()));
        };
        let own = self.location.as_remote().map(|own| own.key.clone());
        let own = own.unwrap_or_default();
        wait_for(async move {
            let below = (!remote.key.as_ref().is_empty()).then_some(&remote.key);
            let (found, unnameable) = bucket.list(&remote.shown(), below).await?;
            let entries = found.into_iter().filter_map(|meta| {
                Some(Entry {
                    key: relative(&own, meta.location.as_ref())?,
                    bytes: meta.size,
                    e_tag: meta.e_tag,
                })
            });
            let unnameable = unnameable.iter().filter_map(|key| relative(&own, key));
            Ok((entries.collect(), unnameable.collect()))
        })
    }

    /// Lists the objects directly in a folder of this one ("" for itself), and the names of its folders; both by name.
    ///
    /// # Errors
    /// The folder cannot be listed. A folder that is absent is empty.
    pub fn children(&self, inner: &str) -> Result<(Vec<Entry>, Vec<String>), Error> {
        let from = match inner {
            "" => self.location.clone(),
            inner => self.location.join(inner)?,
        };
        let within = |name: String| match inner {
            "" => name,
            inner => format!("{inner}/{name}"),
        };
        let (mut entries, mut folders) = match (self.bucket.clone(), from.as_remote().cloned()) {
            (Some(bucket), Some(remote)) => wait_for(async move {
                let below = (!remote.key.as_ref().is_empty()).then_some(&remote.key);
                let found = bucket.children(&remote.shown(), below).await?;
                let objects = found.objects.into_iter().filter_map(|meta| {
                    Some(Entry {
                        key: relative(&remote.key, meta.location.as_ref())?,
                        bytes: meta.size,
                        e_tag: meta.e_tag,
                    })
                });
                let prefixes = found.common_prefixes.iter();
                let folders = prefixes.filter_map(|prefix| relative(&remote.key, prefix.as_ref()));
                Ok((objects.collect(), folders.collect()))
            })?,
            _ => local::children(from.path())?,
        };
        entries.sort_by(|a: &Entry, b| a.key.cmp(&b.key));
        folders.sort();
        for entry in &mut entries {
            entry.key = within(std::mem::take(&mut entry.key));
        }
        Ok((entries, folders.into_iter().map(within).collect()))
    }

    /// Reads an object as a whole.
    ///
    /// # Errors
    /// The object is absent or cannot be read.
    pub fn get(&self, key: &str) -> Result<Vec<u8>, Error> {
        let place = self.location.join(key)?;
        match (self.bucket.clone(), place.as_remote().cloned()) {
            (Some(bucket), Some(remote)) => wait_for(async move {
                let bytes = bucket.whole(&remote.shown(), &remote.key).await?;
                Ok(bytes.to_vec())
            }),
            _ => std::fs::read(place.path()).map_err(|error| Error::local(place.shown(), &error)),
        }
    }

    /// Writes an object, replacing another of this name.
    ///
    /// # Errors
    /// The object cannot be written; another of this name is then unchanged, unless only the answer was lost.
    pub fn put(&self, key: &str, bytes: &[u8]) -> Result<(), Error> {
        let place = self.location.join(key)?;
        match (self.bucket.clone(), place.as_remote().cloned()) {
            (Some(bucket), Some(remote)) => {
                let bytes = Bytes::copy_from_slice(bytes);
                wait_for(async move { bucket.put(&remote.shown(), &remote.key, bytes).await })
            }
            _ => local::put(place.path(), bytes),
        }
    }

    /// Writes an object unless one of this name is there. Of several writers exactly one succeeds.
    ///
    /// If an answer was lost on the way and the object then found has these very bytes, it counts as written.
    ///
    /// # Errors
    /// The object cannot be written.
    pub fn put_if_absent(&self, key: &str, bytes: &[u8]) -> Result<Put, Error> {
        let place = self.location.join(key)?;
        let (Some(bucket), Some(remote)) = (self.bucket.clone(), place.as_remote().cloned()) else {
            return local::put_if_absent(place.path(), bytes);
        };
        let bytes = Bytes::copy_from_slice(bytes);
        wait_for(async move {
            let written = bucket
                .put_if_absent(&remote.shown(), &remote.key, bytes)
                .await?;
            Ok(match written {
                true => Put::Written,
                false => Put::AlreadyThere,
            })
        })
    }

    /// Removes an object; it may be absent.
    ///
    /// # Errors
    /// The object cannot be removed.
    pub fn delete(&self, key: &str) -> Result<(), Error> {
        let place = self.location.join(key)?;
        match (self.bucket.clone(), place.as_remote().cloned()) {
            (Some(bucket), Some(remote)) => {
                wait_for(async move { bucket.delete(&remote.shown(), &remote.key).await })
            }
            _ => match std::fs::remove_file(place.path()) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    Err(Error::local(place.shown(), &error))
                }
                _ => Ok(()),
            },
        }
    }

    /// Writes a local file as an object, a large one in parts; it is there only when all have arrived.
    ///
    /// # Errors
    /// The file cannot be read or the object cannot be written; then another of this name is unchanged.
    pub fn put_file(&self, key: &str, file: &Path) -> Result<(), Error> {
        let failed = |error: std::io::Error| Error::local(file.display().to_string(), &error);
        let size = std::fs::metadata(file).map_err(failed)?.len();
        let place = self.location.join(key)?;
        let (Some(bucket), Some(remote)) = (self.bucket.clone(), place.as_remote().cloned()) else {
            return self.put(key, &std::fs::read(file).map_err(failed)?);
        };
        if size <= PART_BYTES as u64 || bucket.root.kind == Kind::Http {
            return self.put(key, &std::fs::read(file).map_err(failed)?);
        }
        let file = file.to_path_buf();
        wait_for(async move {
            let shown = remote.shown();
            send(&bucket, &shown, &remote.key, &file, PART_BYTES).await
        })
    }
}

/// The name of an object within a folder.
fn relative(folder: &Key, key: &str) -> Option<String> {
    let rest = match folder.as_ref() {
        "" => key,
        folder => key.strip_prefix(folder)?.strip_prefix('/')?,
    };
    (!rest.is_empty()).then(|| rest.to_owned())
}

impl std::fmt::Debug for Folder {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Folder({})", self.location)
    }
}

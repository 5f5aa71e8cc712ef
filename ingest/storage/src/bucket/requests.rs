//! Requests to a bucket or server, each made until it succeeds or fails for good.

use std::ops::Range;
use std::sync::Arc;

use bytes::{Bytes, BytesMut};
use futures_util::{StreamExt, TryStreamExt};
use object_store::path::Path as Key;
use object_store::{
    GetOptions, GetRange, GetResult, ListResult, ObjectMeta, ObjectStore, ObjectStoreExt, PutMode,
    PutPayload,
};

use crate::counted::{Counts, take_unnameable};
use crate::error::{Error, ErrorKind};
use crate::place::{Access, Kind, Remote, Root, root};

use super::attempts::{Failed, Failure, attempt};

/// Identity of the version of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Version {
    pub(crate) size: u64,
    pub(crate) e_tag: Option<String>,
    /// Time of the last change (seconds since 1970), where the server states it; otherwise zero.
    pub(crate) modified_s: i64,
}

impl Version {
    fn of(meta: &ObjectMeta) -> Self {
        Self {
            size: meta.size,
            e_tag: meta.e_tag.clone(),
            modified_s: meta.last_modified.timestamp(),
        }
    }

    /// The tag by which a server returns this version alone; weak ones never match.
    fn strong_tag(&self) -> Option<String> {
        let is_strong = |tag: &&String| !tag.starts_with("W/");
        self.e_tag.as_ref().filter(is_strong).cloned()
    }

    /// Whether a later answer can be recognised as one of this version.
    fn is_known(&self) -> bool {
        self.e_tag.is_some() || self.modified_s != 0
    }

    /// Whether an answer is of this version.
    fn is_same(&self, other: &Self) -> bool {
        let same_tag = match (&self.e_tag, &other.e_tag) {
            (Some(own), Some(other)) => own == other,
            // without tags the time has to do
            (None, None) => self.modified_s == other.modified_s,
            _ => false,
        };
        same_tag && self.size == other.size
    }
}

/// A place of a bucket with all that requests need.
#[derive(Clone)]
pub(crate) struct Bucket {
    pub(crate) root: Arc<Root>,
    pub(crate) counts: Arc<Counts>,
}

impl Bucket {
    pub(crate) fn of(remote: &Remote) -> Result<Self, Error> {
        Ok(Self {
            root: root(&remote.address)?,
            counts: Arc::default(),
        })
    }

    pub(crate) fn access(&self) -> &Access {
        &self.root.access
    }

    /// The last `count` bytes, or all of a smaller object, and its version.
    pub(crate) async fn tail(
        &self,
        place: &str,
        key: &Key,
        count: u64,
    ) -> Result<(Bytes, Version), Error> {
        if self.root.kind == Kind::Azure {
            // Azure has no suffix reads.
            let version = self.head(place, key).await?;
            let start = version.size.saturating_sub(count);
            let range = start..version.size;
            let bytes = self.range(place, key, range, &version).await?;
            return Ok((bytes, version));
        }
        let request = || async {
            let options = GetOptions::new().with_range(Some(GetRange::Suffix(count)));
            let result = self.root.store.get_opts(key, options).await?;
            let version = Version::of(&result.meta);
            let expected = version.size.min(count);
            if version.size > count && !version.is_known() {
                return Err(Failure::Other(unversioned(place)));
            }
            Ok((self.body(result, expected).await?, version))
        };
        let once = Access {
            attempts: 1,
            ..self.access().clone()
        };
        match attempt(place, &once, &self.counts, request).await {
            Ok(found) => Ok(found),
            // Some servers fail where an object is empty or shorter than its end that is asked for.
            Err(failed)
                if matches!(
                    failed.error.kind,
                    ErrorKind::Refused
                        | ErrorKind::Unavailable
                        | ErrorKind::Incomplete
                        | ErrorKind::TimedOut
                ) =>
            {
                let version = self.head(place, key).await?;
                let range = version.size.saturating_sub(count)..version.size;
                let bytes = self.range(place, key, range, &version).await?;
                Ok((bytes, version))
            }
            Err(failed) => Err(failed.error),
        }
    }

    pub(crate) async fn head(&self, place: &str, key: &Key) -> Result<Version, Error> {
        let request = || async {
            let options = GetOptions::new().with_head(true);
            let result = self.root.store.get_opts(key, options).await?;
            Ok(Version::of(&result.meta))
        };
        one(attempt(place, self.access(), &self.counts, request).await)
    }

    /// Bytes of one version of an object.
    pub(crate) async fn range(
        &self,
        place: &str,
        key: &Key,
        range: Range<u64>,
        version: &Version,
    ) -> Result<Bytes, Error> {
        if range.is_empty() {
            return Ok(Bytes::new());
        }
        if !version.is_known() && range != (0..version.size) {
            return Err(unversioned(place));
        }
        let request = || async {
            let options = GetOptions::new()
                .with_range(Some(GetRange::Bounded(range.clone())))
                .with_if_match(version.strong_tag());
            let result = self.root.store.get_opts(key, options).await?;
            self.require(place, version, &result.meta)?;
            self.body(result, range.end - range.start).await
        };
        let bytes = one(attempt(place, self.access(), &self.counts, request).await);
        bytes.map_err(|error| match error.kind {
            ErrorKind::Changed => changed(place),
            // it was there when it was opened
            ErrorKind::NotFound => Error {
                detail: format!("it was removed while it was read ({})", error.detail),
                ..error
            },
            _ => error,
        })
    }

    fn require(&self, place: &str, version: &Version, meta: &ObjectMeta) -> Result<(), Failure> {
        match version.is_same(&Version::of(meta)) {
            true => Ok(()),
            false => Err(Failure::Other(changed(place))),
        }
    }

    /// All bytes of an object.
    pub(crate) async fn whole(&self, place: &str, key: &Key) -> Result<Bytes, Error> {
        let (bytes, _) = self.whole_version(place, key).await?;
        Ok(bytes)
    }

    /// All bytes of an object, and its version.
    pub(crate) async fn whole_version(
        &self,
        place: &str,
        key: &Key,
    ) -> Result<(Bytes, Version), Error> {
        let request = || async {
            let result = self.root.store.get_opts(key, GetOptions::new()).await?;
            let version = Version::of(&result.meta);
            Ok((self.body(result, version.size).await?, version))
        };
        one(attempt(place, self.access(), &self.counts, request).await)
    }

    async fn body(&self, result: GetResult, expected: u64) -> Result<Bytes, Failure> {
        let mut stream = result.into_stream();
        let mut bytes = BytesMut::new();
        while let Some(part) = stream.next().await {
            let part = part?;
            self.counts.add_bytes(part.len() as u64);
            if bytes.len() as u64 + part.len() as u64 > expected {
                break;
            }
            bytes.extend_from_slice(&part);
        }
        let found = bytes.len() as u64;
        match found == expected {
            true => Ok(bytes.freeze()),
            false => Err(Failure::Incomplete(format!(
                "expected {expected} bytes, found {found}"
            ))),
        }
    }

    /// Objects whose keys begin with a folder, by key, and the keys of those that no request can name.
    pub(crate) async fn list(
        &self,
        place: &str,
        folder: Option<&Key>,
    ) -> Result<(Vec<ObjectMeta>, Vec<String>), Error> {
        let request = || async {
            let found: Vec<ObjectMeta> = self.root.store.list(folder).try_collect().await?;
            Ok((found, take_unnameable()))
        };
        let (mut found, unnameable) =
            one(attempt(place, self.access(), &self.counts, request).await)?;
        found.sort_by(|a, b| a.location.cmp(&b.location));
        Ok((found, unnameable))
    }

    /// Lists the objects and folders directly in a folder, without those that no request can name.
    pub(crate) async fn children(
        &self,
        place: &str,
        folder: Option<&Key>,
    ) -> Result<ListResult, Error> {
        let request = || async { Ok(self.root.store.list_with_delimiter(folder).await?) };
        one(attempt(place, self.access(), &self.counts, request).await)
    }

    /// Writes an object, replacing another.
    pub(crate) async fn put(&self, place: &str, key: &Key, bytes: Bytes) -> Result<(), Error> {
        one(self.put_as(place, key, bytes, PutMode::Overwrite).await)
    }

    /// Writes an object that is not there yet; false if it was.
    pub(crate) async fn put_if_absent(
        &self,
        place: &str,
        key: &Key,
        bytes: Bytes,
    ) -> Result<bool, Error> {
        match self
            .put_as(place, key, bytes.clone(), PutMode::Create)
            .await
        {
            Ok(_) => Ok(true),
            Err(failed)
                if failed.error.kind == ErrorKind::Local(std::io::ErrorKind::AlreadyExists) =>
            {
                if failed.attempts == 1 {
                    return Ok(false);
                }
                // An earlier attempt may have arrived although its answer did not.
                Ok(self.whole(place, key).await? == bytes)
            }
            Err(failed) => Err(failed.error),
        }
    }

    async fn put_as(
        &self,
        place: &str,
        key: &Key,
        bytes: Bytes,
        mode: PutMode,
    ) -> Result<(), Failed> {
        let count = bytes.len() as u64;
        let request = || async {
            let payload = PutPayload::from_bytes(bytes.clone());
            let sent = self
                .root
                .store
                .put_opts(key, payload, mode.clone().into())
                .await;
            match sent {
                Ok(_) => {
                    self.counts.add_bytes(count);
                    Ok(())
                }
                Err(object_store::Error::AlreadyExists { .. }) => {
                    let kind = ErrorKind::Local(std::io::ErrorKind::AlreadyExists);
                    Err(Failure::Other(Error::new(
                        place,
                        kind,
                        "it is already there",
                    )))
                }
                Err(error) => Err(error.into()),
            }
        };
        attempt(place, self.access(), &self.counts, request).await
    }

    /// Removes an object; it may be absent.
    pub(crate) async fn delete(&self, place: &str, key: &Key) -> Result<(), Error> {
        let request = || async { Ok(self.root.store.delete(key).await?) };
        match one(attempt(place, self.access(), &self.counts, request).await) {
            Err(error) if error.kind == ErrorKind::NotFound => Ok(()),
            other => other,
        }
    }
}

fn unversioned(place: &str) -> Error {
    let detail = "the server states neither ETag nor Last-Modified: nobody would notice that parts are of different \
                  versions; --fetch-whole reads the whole file in one request";
    Error::new(place, ErrorKind::NoRanges, detail)
}

fn changed(place: &str) -> Error {
    Error::new(
        place,
        ErrorKind::Changed,
        "the object was replaced after it was opened; start again",
    )
}

/// The result of a request whose number of attempts does not matter.
pub(crate) fn one<T>(result: Result<T, Failed>) -> Result<T, Error> {
    result.map_err(|failed| failed.error)
}

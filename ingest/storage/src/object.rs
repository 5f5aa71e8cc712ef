//! One object of a bucket or server, read by position.
//!
//! What was transferred is kept in a private temporary file at its position, so that nothing is transferred twice
//! and memory stays bounded. All bytes are of the version that the first request found: if the object is replaced
//! meanwhile, reading fails.

use std::collections::VecDeque;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use object_store::path::Path as Key;
use tempfile::TempDir;
use tokio::task::AbortHandle;

use crate::bucket::{Bucket, Version};
use crate::counted::Transfer;
use crate::error::{Error, ErrorKind};
use crate::place::{Location, whole_reads};
use crate::ranges::{RangeSet, merged};
use crate::runtime::{start, wait_for};

/// Read from the end of an object when it is opened: it has the summary of a log.
const TAIL_BYTES: u64 = 128 << 10;
/// Bytes between two wanted ranges that are rather transferred than asked around.
const MOST_GAP_BYTES: u64 = 16 << 10;
/// Largest request.
const MOST_REQUEST_BYTES: u64 = 8 << 20;

/// An object open for reading. Its temporary file is removed with the value.
pub struct Object {
    location: Location,
    shared: Arc<Shared>,
    data: PathBuf,
    _private: TempDir,
}

struct Shared {
    place: String,
    key: Key,
    bucket: Bucket,
    version: Version,
    file: File,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Ranges that the file has.
    present: RangeSet,
    /// Requests that are under way.
    running: Vec<Range<u64>>,
    /// Requests that may be made ahead, in the order of reading.
    ahead: VecDeque<Range<u64>>,
    /// Number of requests made ahead at a time. It grows while they are used, so that a reader that stops early has cost little.
    window: usize,
    /// The first error; every later read that needs a transfer fails with it.
    failure: Option<Error>,
    tasks: Vec<AbortHandle>,
}

impl Object {
    /// Opens an object with one request: for its last bytes. (Azure needs two.)
    ///
    /// # Errors
    /// The object is absent, cannot be read, or the place is local.
    pub fn open(location: &Location) -> Result<Self, Error> {
        let remote = location
            .as_remote()
            .cloned()
            .ok_or_else(|| Error::new(location.shown(), ErrorKind::NotAPlace, "expected a URL"))?;
        let place = location.shown();
        if remote.key.as_ref().is_empty() {
            return Err(Error::new(
                place,
                ErrorKind::NotFound,
                "it is a bucket, no object",
            ));
        }
        let bucket = Bucket::of(&remote)?;
        let (tail, version) = {
            let (bucket, place, key) = (bucket.clone(), place.clone(), remote.key.clone());
            wait_for(async move {
                match bucket.tail(&place, &key, TAIL_BYTES).await {
                    Err(error) if error.kind == ErrorKind::NoRanges && whole_reads() => {
                        bucket.whole_version(&place, &key).await
                    }
                    other => other,
                }
            })?
        };
        let local = |error: std::io::Error| {
            Error::local(std::env::temp_dir().display().to_string(), &error)
        };
        let private = tempfile::Builder::new()
            .prefix("tipwatch-")
            .tempdir()
            .map_err(local)?;
        let data = private.path().join("log");
        let file = File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&data)
            .map_err(local)?;
        // no space is used before bytes come
        file.set_len(version.size).map_err(local)?;
        let tail_start = version.size.saturating_sub(tail.len() as u64);
        file.write_all_at(&tail, tail_start).map_err(local)?;
        let mut state = State {
            window: 1,
            ..State::default()
        };
        state.present.insert(tail_start..version.size);
        Ok(Self {
            location: location.clone(),
            data,
            _private: private,
            shared: Arc::new(Shared {
                place,
                key: remote.key,
                bucket,
                version,
                file,
                state: Mutex::new(state),
                changed: Condvar::new(),
            }),
        })
    }

    /// The place.
    pub fn location(&self) -> &Location {
        &self.location
    }

    /// The length of the object (bytes).
    pub fn size(&self) -> u64 {
        self.shared.version.size
    }

    /// The tag of the version that is read, if the server states one.
    pub fn e_tag(&self) -> Option<&str> {
        self.shared.version.e_tag.as_deref()
    }

    /// Requests and bytes so far.
    pub fn transfer(&self) -> Transfer {
        self.shared.bucket.counts.transfer()
    }

    /// The temporary file. It has the size of the object, but only the requested bytes.
    pub fn data(&self) -> &Path {
        &self.data
    }

    /// Whether all of the object has been transferred.
    pub fn is_whole(&self) -> bool {
        self.shared.lock().present.has(&(0..self.size()))
    }

    /// States which ranges will be read, in this order. They are transferred ahead, merged into few requests, as
    /// reading proceeds.
    pub fn plan(&self, ranges: Vec<Range<u64>>) {
        let mut state = self.shared.lock();
        let missing = ranges
            .into_iter()
            .flat_map(|range| {
                state
                    .present
                    .missing(range.start..range.end.min(self.size()))
            })
            .collect();
        state.ahead = merged(missing, MOST_GAP_BYTES, MOST_REQUEST_BYTES).into();
        state.window = 1;
    }

    /// Fills `bytes` from `offset`.
    ///
    /// # Errors
    /// The bytes are not within the object, cannot be transferred, or are of another version.
    pub fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), Error> {
        let range = offset..offset.saturating_add(bytes.len() as u64);
        self.require(range)?;
        let local = |error| Error::local(self.data.display().to_string(), &error);
        self.shared.file.read_exact_at(bytes, offset).map_err(local)
    }

    /// Transfers a range unless that is done.
    ///
    /// # Errors
    /// See [`read_at`](Self::read_at).
    pub fn require(&self, range: Range<u64>) -> Result<(), Error> {
        let size = self.size();
        if range.end > size {
            let (start, end) = (range.start, range.end);
            let detail = format!("bytes {start} to {end} of {size} do not exist");
            return Err(Error::new(
                &self.shared.place,
                ErrorKind::Incomplete,
                detail,
            ));
        }
        let shared = &self.shared;
        let mut state = shared.lock();
        loop {
            if state.present.has(&range) {
                shared.send_ahead(&mut state, &range)?;
                return Ok(());
            }
            if let Some(error) = &state.failure {
                return Err(error.clone());
            }
            shared.send_ahead(&mut state, &range)?;
            let missing = state.missing(&range);
            for request in merged(missing, MOST_GAP_BYTES, MOST_REQUEST_BYTES) {
                let parallel = shared.bucket.access().parallel;
                if state.running.len() < parallel {
                    shared.send(&mut state, request)?;
                }
            }
            state = shared
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Transfers the whole object.
    ///
    /// # Errors
    /// See [`read_at`](Self::read_at).
    pub fn require_all(&self) -> Result<(), Error> {
        self.require(0..self.size())
    }
}

impl State {
    /// Returns the parts of a range that are neither present nor requested.
    fn missing(&self, range: &Range<u64>) -> Vec<Range<u64>> {
        let mut known = self.present.clone();
        self.running
            .iter()
            .for_each(|request| known.insert(request.clone()));
        known.missing(range.clone())
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // no thread panics while it holds the lock
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes planned requests up to the window beyond what is read now.
    fn send_ahead(self: &Arc<Self>, state: &mut State, reading: &Range<u64>) -> Result<(), Error> {
        let most = state.window.min(self.bucket.access().parallel);
        let mut used = false;
        while let Some(next) = state.ahead.front() {
            let is_read_now = next.start < reading.end;
            if !is_read_now && state.running.len() >= most {
                break;
            }
            if is_read_now && state.running.len() >= self.bucket.access().parallel {
                break;
            }
            used |= is_read_now;
            if let Some(request) = state.ahead.pop_front() {
                for part in state.missing(&request) {
                    self.send(state, part)?;
                }
            }
        }
        if used {
            state.window = state.window.saturating_mul(2);
        }
        Ok(())
    }

    fn send(self: &Arc<Self>, state: &mut State, request: Range<u64>) -> Result<(), Error> {
        let shared = Arc::clone(self);
        let range = request.clone();
        let task = start(async move {
            let got = shared
                .bucket
                .range(&shared.place, &shared.key, range.clone(), &shared.version)
                .await;
            let kept = got.and_then(|bytes| {
                let local = |error| Error::local(shared.place.clone(), &error);
                shared.file.write_all_at(&bytes, range.start).map_err(local)
            });
            let mut state = shared.lock();
            state.running.retain(|other| *other != range);
            match kept {
                Ok(()) => state.present.insert(range),
                Err(error) => {
                    state.failure.get_or_insert(error);
                }
            }
            drop(state);
            shared.changed.notify_all();
        })?;
        state.tasks.retain(|task| !task.is_finished());
        state.tasks.push(task);
        state.running.push(request);
        Ok(())
    }
}

impl Drop for Object {
    fn drop(&mut self) {
        let state = self.shared.lock();
        state.tasks.iter().for_each(AbortHandle::abort);
    }
}

impl std::fmt::Debug for Object {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            formatter,
            "Object({}, {} bytes)",
            self.location,
            self.size()
        )
    }
}

//! Room in the shared memory. Linux gives a file there its memory when it is first touched, and kills a process that touches
//! what is no longer there (SIGBUS). So nothing is opened where there is no room for it, and what a writer may ever touch is
//! reserved when it is opened: it cannot fail later, when somebody fills the rest.

use std::fs::File;
use std::io::{Error, ErrorKind};
use std::os::fd::AsRawFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::leftovers::files;
use crate::wire::topics::{MAX_BORROWED, MAX_READERS, Topic};

/// Shared memory of a process that joins, or of a port without messages of its own, with its connections (bytes).
pub(super) const PORT_BYTES: u64 = 128 << 10;
/// Most that iceoryx2 adds to a message (bytes).
const HEADER_BYTES: usize = 256;
/// Most that iceoryx2 adds to each place for a message, in a list of the free places (bytes).
const PLACE_BYTES: usize = 8;
/// Messages that a writer has in its hands.
const LOANED: usize = 2;

/// There is no room for shared memory.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{}: expected {} KiB of free shared memory, found {} KiB: remove what is not needed there, or enlarge it (`mount -o \
     remount,size=256m`; of a container `--shm-size=256m`)",
    .folder.display(), .needed >> 10, .free >> 10
)]
pub struct NoRoom {
    /// Folder of the shared memory.
    pub folder: PathBuf,
    /// Needed size (bytes).
    pub needed: u64,
    /// Free size (bytes).
    pub free: u64,
}

/// Returns the most shared memory that a writer of these messages may ever touch (bytes). iceoryx2 has places for as many
/// messages as if no two readers had the same one before them. But a full queue drops its oldest message, so all queues together
/// never hold more than the latest ones that fit into one of them; and the place that was free last is taken first.
pub(super) const fn of_writer<T: Topic>() -> u64 {
    let at_once = T::QUEUE + MAX_READERS * MAX_BORROWED + T::HISTORY + LOANED;
    let places = MAX_READERS * (T::QUEUE + MAX_BORROWED) + T::HISTORY + LOANED;
    (at_once * (size_of::<T>() + HEADER_BYTES) + places * PLACE_BYTES) as u64 + PORT_BYTES
}

/// Checks that so many bytes are free in a folder.
///
/// # Errors
/// They are not.
pub(super) fn require(folder: &Path, needed: u64) -> Result<(), NoRoom> {
    match free(folder) {
        Some(free) if free < needed => Err(NoRoom {
            folder: folder.into(),
            needed,
            free,
        }),
        _ => Ok(()),
    }
}

/// The free bytes of a file system; `None` if it knows no limit.
#[allow(
    unsafe_code,
    reason = "the standard library has no interface to this call"
)]
fn free(folder: &Path) -> Option<u64> {
    let folder = std::ffi::CString::new(folder.as_os_str().as_bytes()).ok()?;
    // SAFETY: zeros are a valid value of a structure of numbers; the text ends with zero, and both outlive the call.
    let (result, found) = unsafe {
        let mut found: libc::statvfs = std::mem::zeroed();
        (libc::statvfs(folder.as_ptr(), &raw mut found), found)
    };
    (result == 0 && found.f_blocks > 0).then(|| found.f_bavail.saturating_mul(found.f_frsize))
}

/// Gives the beginning of a writer's memory its pages now.
///
/// # Errors
/// There is no room for it, or it is not found.
pub(super) fn reserve(folder: &Path, prefix: &str, writer: u128, bytes: u64) -> Result<()> {
    let ending = format!("_{writer}.data");
    let memory = files(folder, prefix).into_iter();
    let mut own = memory.filter(|file| file.as_os_str().as_bytes().ends_with(ending.as_bytes()));
    let path = own.next().with_context(|| {
        format!(
            "{}: expected the memory *{ending}, found none",
            folder.display()
        )
    })?;
    let open = || {
        let file = File::options().write(true).open(&path)?;
        let bytes = bytes.min(file.metadata()?.len());
        allocate(&file, bytes)
    };
    match open() {
        Err(error) if error.kind() == ErrorKind::StorageFull => Err(NoRoom {
            folder: folder.into(),
            needed: bytes,
            free: free(folder).unwrap_or_default(),
        }
        .into()),
        // a file system that cannot do it
        Err(error) if error.kind() == ErrorKind::Unsupported => Ok(()),
        done => done.with_context(|| format!("{}: cannot be reserved", path.display())),
    }
}

#[allow(
    unsafe_code,
    reason = "the standard library has no interface to this call"
)]
fn allocate(file: &File, bytes: u64) -> std::io::Result<()> {
    let length = libc::off_t::try_from(bytes).unwrap_or(libc::off_t::MAX);
    loop {
        // SAFETY: no memory is passed; the file is open.
        if unsafe { libc::fallocate(file.as_raw_fd(), 0, 0, length) } == 0 {
            return Ok(());
        }
        let error = Error::last_os_error();
        if error.kind() != ErrorKind::Interrupted {
            return Err(error);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use super::*;
    use crate::wire::topics::{WireSample, WireVerdict};

    #[test]
    fn more_than_is_free_is_refused_with_both_numbers() {
        let folder = Path::new("/dev/shm");
        assert_eq!(require(folder, 1), Ok(()));
        let refused = require(folder, u64::MAX).unwrap_err();
        assert_eq!(refused.needed, u64::MAX);
        assert!(refused.free < u64::MAX && refused.folder == folder);
    }

    #[test]
    fn the_beginning_of_a_writers_memory_is_there_after_it_is_reserved() {
        let folder = tempfile::tempdir_in("/dev/shm").unwrap();
        let path = folder.path().join("own_7_42.data");
        let file = File::create_new(&path).unwrap();
        file.set_len(1 << 20).unwrap();
        assert_eq!(file.metadata().unwrap().blocks(), 0);
        reserve(folder.path(), "own_", 42, 512 << 10).unwrap();
        // in units of 512 bytes
        assert_eq!(file.metadata().unwrap().blocks(), 1024);
        reserve(folder.path(), "own_", 42, u64::MAX).unwrap();
        assert_eq!(file.metadata().unwrap().len(), 1 << 20);
        assert!(reserve(folder.path(), "own_", 2, 1).is_err());
    }

    #[test]
    fn a_writer_reserves_a_small_part_of_what_it_has_places_for() {
        for (bytes, message, queue) in [
            (
                of_writer::<WireSample>(),
                size_of::<WireSample>(),
                WireSample::QUEUE,
            ),
            (
                of_writer::<WireVerdict>(),
                size_of::<WireVerdict>(),
                WireVerdict::QUEUE,
            ),
        ] {
            let one_queue = (message * queue) as u64;
            assert!((one_queue..3 * one_queue).contains(&bytes), "{bytes}");
        }
    }
}

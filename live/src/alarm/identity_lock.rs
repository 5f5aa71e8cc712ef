//! One monitor for each machine in a folder: of two, one would write what the other was told to forget.
//!
//! `alarm-IDENTITY_CRC32.lock` is locked as long as the monitor runs, and says which machine it is of. The kernel ends the lock of a
//! process that is killed.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, bail};

/// Number of further attempts to take a lock, and the pause before each.
const TRIES: u32 = 5;
const PAUSE: Duration = Duration::from_millis(2);

/// Held by the monitor of a machine.
#[derive(Debug)]
pub(super) struct IdentityLock(
    #[expect(dead_code, reason = "it is locked as long as it is open")] File,
);

impl IdentityLock {
    /// Locks the machine of this program in a folder; `None`, which is told, where the folder cannot be written or its file system
    /// has no locks.
    ///
    /// # Errors
    /// Another monitor has it.
    pub(super) fn take(folder: &Path, identity: &str) -> Result<Option<Self>> {
        let path = path(folder, identity);
        match Self::try_take(folder, identity) {
            Ok(lock) => Ok(Some(lock)),
            Err(TryLockError::WouldBlock) => bail!(
                "{}: another monitor of the machine {identity} runs and keeps its alarm in this folder: end it, or state another \
                 folder (--state)",
                path.display()
            ),
            Err(TryLockError::Error(error)) => {
                eprintln!(
                    "monitor: {}: {error}; a second monitor with this folder would not be noticed",
                    path.display()
                );
                Ok(None)
            }
        }
    }

    /// Locks a machine in a folder.
    ///
    /// # Errors
    /// `WouldBlock` where another monitor has it. After another error nobody knows whether one does.
    pub(super) fn try_take(folder: &Path, identity: &str) -> Result<Self, TryLockError> {
        let path = path(folder, identity);
        // who looks whether a machine is monitored has its lock for a moment
        let mut tries = 0;
        loop {
            match locked(&path, identity) {
                Err(TryLockError::WouldBlock) if tries < TRIES => {
                    tries += 1;
                    std::thread::sleep(PAUSE);
                }
                taken => return taken.map(Self),
            }
        }
    }
}

pub(super) fn path(folder: &Path, identity: &str) -> PathBuf {
    folder.join(format!(
        "alarm-{:08x}.lock",
        crc32fast::hash(identity.as_bytes())
    ))
}

fn locked(path: &Path, identity: &str) -> Result<File, TryLockError> {
    let open = || {
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        options.open(path)
    };
    let mut file = open().map_err(TryLockError::Error)?;
    file.try_lock()?;
    write(&mut file, identity).map_err(TryLockError::Error)?;
    Ok(file)
}

/// Says which machine it is of, if it does not yet.
fn write(file: &mut File, identity: &str) -> io::Result<()> {
    let mut found = Vec::new();
    file.read_to_end(&mut found)?;
    if found == identity.as_bytes() {
        return Ok(());
    }
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    file.write_all(identity.as_bytes())?;
    file.sync_all()
}

/// The identities with a serial number of the machines of this name that have been monitored with this folder. Those that are
/// monitored now are other machines.
pub(super) fn once_numbered(folder: &Path, name: &str) -> Vec<String> {
    let beginning = format!("{name:?} \"");
    let mut found = not_monitored(folder);
    found.retain(|identity| identity.starts_with(&beginning));
    found
}

/// The other identities with the same serial number as this one, of a machine of this name: it was renamed. The same holds of
/// those that are monitored now.
pub(super) fn once_named(folder: &Path, identity: &str, name: &str) -> Vec<String> {
    let Some(serial) = identity.strip_prefix(&format!("{name:?}")) else {
        return Vec::new();
    };
    let is_renamed =
        |other: &String| other != identity && other.starts_with('"') && other.ends_with(serial);
    let mut found = not_monitored(folder);
    found.retain(is_renamed);
    found
}

/// The identities of the machines that have been monitored with this folder, and are not now.
fn not_monitored(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_lock = |path: &PathBuf| {
        path.extension()
            .is_some_and(|extension| extension == "lock")
    };
    let is_free = |path: &PathBuf| File::open(path).is_ok_and(|file| file.try_lock().is_ok());
    let paths = entries
        .map(|entry| entry.path())
        .filter(is_lock)
        .filter(is_free);
    paths
        .filter_map(|path| fs::read_to_string(path).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    // requirement: TW-VERDICT-20
    #[test]
    fn machine_is_locked_by_one_monitor_until_that_ends() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("new");
        let first = IdentityLock::take(&folder, "m").unwrap();
        assert!(first.is_some());
        let error = IdentityLock::take(&folder, "m").unwrap_err().to_string();
        assert!(
            error.contains("another monitor of the machine m"),
            "{error}"
        );
        assert!(IdentityLock::take(&folder, "other").unwrap().is_some());
        drop(first);
        assert!(IdentityLock::take(&folder, "m").unwrap().is_some());
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn machines_that_had_a_serial_number_are_found_by_their_name() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let taken = ["\"m\" \"7\"", "\"m\" \"8\"", "\"m 2\" \"7\"", "m"]
            .map(|identity| (identity, IdentityLock::take(folder, identity).unwrap()));
        assert!(once_numbered(folder, "m").is_empty(), "they run");
        assert!(once_named(folder, "\"new\" \"7\"", "new").is_empty());
        drop(taken);
        let mut found = once_numbered(folder, "m");
        found.sort();
        assert_eq!(found, ["\"m\" \"7\"", "\"m\" \"8\""]);
        assert!(once_numbered(&folder.join("none"), "m").is_empty());
        assert_eq!(once_named(folder, "\"m\" \"7\"", "m"), ["\"m 2\" \"7\""]);
        assert!(once_named(folder, "\"new\" \"77\"", "new").is_empty());
    }
}

//! One small file for each machine, replaced as a whole: after a power cut it holds the old alarm or the new one.
//!
//! ```text
//!     tipwatch-alarm 2 MACHINE_HASH IDENTITY_CRC32 LEVEL ACKNOWLEDGED CONTRADICTION CRC32
//! ```
//! Whoever changes the machine file gets another hash. The alarm is then taken over from the files of machines of the same
//! identity, which is the name with the serial number; IDENTITY_CRC32 is its checksum. CONTRADICTION is `-`, or names the
//! commissioning under which the sensors were contradicted (0: none).

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tipwatch_mechanics::verdict::{Latch, Level};

/// First words of the file.
const BEGINNING: &str = "tipwatch-alarm 2";

/// The folder for alarms if none is stated: that of systemd's service (`StateDirectory=`), else
/// `$XDG_STATE_HOME/tipwatch`, else `~/.local/state/tipwatch`. `None` if none of them is known.
#[must_use]
pub fn default_folder(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let folder = |name| {
        let value = variable(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from).filter(|path| path.is_absolute())
    };
    folder("STATE_DIRECTORY")
        .or_else(|| folder("XDG_STATE_HOME").map(|state| state.join("tipwatch")))
        .or_else(|| folder("HOME").map(|home| home.join(".local/state/tipwatch")))
}

/// What outlives a session, a restart and a power cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Kept {
    /// The latched alarm.
    pub latch: Latch,
    /// The commissioning under which the mounting, a sign, the order or a scale of a sensor was contradicted: the first bytes
    /// of its hash, 0 without one. `None` without a contradiction.
    pub contradiction: Option<u32>,
}

impl Kept {
    /// An alarm alone.
    #[must_use]
    pub fn alarm(latch: Latch) -> Self {
        Self {
            latch,
            contradiction: None,
        }
    }
}

/// The file of a machine's alarm.
#[derive(Debug, Clone)]
pub struct AlarmFile {
    folder: PathBuf,
    machine_hash: u64,
    identity_checksum: u32,
}

impl AlarmFile {
    /// The file of the machine with this hash and identity in this folder.
    #[must_use]
    pub fn new(folder: &Path, machine_hash: u64, identity: &str) -> Self {
        Self {
            folder: folder.into(),
            machine_hash,
            identity_checksum: crc32fast::hash(identity.as_bytes()),
        }
    }

    /// Files with an alarm or a contradiction of a machine of the same identity, if this machine has none yet.
    pub(super) fn predecessors(&self) -> Vec<(Self, Kept)> {
        if self.path().exists() {
            return Vec::new();
        }
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let hashes = entries.filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let hash = name.strip_prefix("alarm-")?.strip_suffix(".txt")?;
            u64::from_str_radix(hash, 16).ok()
        });
        let files = hashes.map(|machine_hash| Self {
            machine_hash,
            ..self.clone()
        });
        let kept = files.filter_map(|file| Some((file.read().ok()?, file)));
        let kept =
            kept.filter(|(kept, _)| kept.latch.level.is_some() || kept.contradiction.is_some());
        kept.map(|(kept, file)| (file, kept)).collect()
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        let name = format!("alarm-{:016x}.txt", self.machine_hash);
        self.folder.join(name)
    }

    /// What is in the file; nothing if there is no file.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged: then nobody knows whether there was an alarm.
    pub fn read(&self) -> io::Result<Kept> {
        let text = match fs::read_to_string(self.path()) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Kept::default()),
            Err(error) => return Err(error),
        };
        let known = [None, Some(Level::Danger), Some(Level::Fault)];
        let known = known.into_iter().flat_map(|level| {
            [false, true].map(|is_acknowledged| Latch {
                level,
                is_acknowledged,
            })
        });
        let of_contradiction = text.split(' ').rev().nth(1).unwrap_or_default();
        let contradiction = u32::from_str_radix(of_contradiction, 16).ok();
        let known = known.map(|latch| Kept {
            latch,
            contradiction,
        });
        // a file is good if it is exactly what one of them is written as
        let mut read = known.filter(|kept| self.text(*kept) == text);
        read.next().ok_or_else(|| {
            let expected = format!(
                "expected an alarm file of machine {:016x}",
                self.machine_hash
            );
            io::Error::new(ErrorKind::InvalidData, expected)
        })
    }

    /// Replaces the file; afterwards the alarm is on the disk.
    ///
    /// # Errors
    /// The disk cannot be written.
    pub fn write(&self, kept: Kept) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let new = self.path().with_extension("new");
        let mut file = File::create(&new)?;
        file.write_all(self.text(kept).as_bytes())?;
        file.sync_all()?;
        fs::rename(&new, self.path())?;
        // the new name must survive a power cut too
        File::open(&self.folder)?.sync_all()
    }

    /// Keeps a copy of a damaged file beside it.
    pub(super) fn keep_damaged(&self) {
        let _ = fs::copy(self.path(), self.path().with_extension("damaged"));
    }

    fn text(&self, kept: Kept) -> String {
        let level = kept.latch.level.map_or("none", Level::name);
        let acknowledged = u8::from(kept.latch.is_acknowledged);
        let hash = self.machine_hash;
        let identity = self.identity_checksum;
        let contradiction =
            (kept.contradiction).map_or("-".into(), |commissioning| format!("{commissioning:08x}"));
        let content = format!(
            "{BEGINNING} {hash:016x} {identity:08x} {level} {acknowledged} {contradiction}"
        );
        format!("{content} {:08x}\n", crc32fast::hash(content.as_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alarms_survive_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(&folder.path().join("new/folder"), 7, "m");
        assert_eq!(file.read().unwrap(), Kept::default());
        let mut latch = Latch::raised(Level::Danger);
        for contradiction in [None, Some(0), Some(0xdead_beef)] {
            let kept = Kept {
                latch,
                contradiction,
            };
            file.write(kept).unwrap();
            assert_eq!(file.read().unwrap(), kept);
            latch.acknowledge();
        }
        file.write(Kept::default()).unwrap();
        assert_eq!(file.read().unwrap(), Kept::default());
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn every_changed_byte_is_damage() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        file.write(Kept::alarm(Latch::raised(Level::Danger)))
            .unwrap();
        let good = fs::read(file.path()).unwrap();
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            fs::write(file.path(), &bytes).unwrap();
            assert!(file.read().is_err(), "byte {at}");
            fs::write(file.path(), &good[..at]).unwrap();
            assert!(file.read().is_err(), "{at} bytes");
        }
        // another machine's file under this machine's name
        fs::write(
            file.path(),
            AlarmFile::new(folder.path(), 8, "m").text(Kept::default()),
        )
        .unwrap();
        assert!(file.read().is_err());
    }

    #[test]
    fn default_folder_is_that_of_the_service_or_of_the_user() {
        let folder = |known: &[(&str, &str)]| {
            default_folder(|name| {
                let mut found = known.iter().filter(|(key, _)| *key == name);
                found.next().map(|(_, value)| value.into())
            })
        };
        let home = ("HOME", "/home/you");
        assert_eq!(folder(&[]), None);
        assert_eq!(
            folder(&[home]),
            Some("/home/you/.local/state/tipwatch".into())
        );
        let state = ("XDG_STATE_HOME", "/state");
        assert_eq!(folder(&[home, state]), Some("/state/tipwatch".into()));
        let service = ("STATE_DIRECTORY", "/var/lib/tipwatch");
        assert_eq!(
            folder(&[home, state, service]),
            Some("/var/lib/tipwatch".into())
        );
    }
}

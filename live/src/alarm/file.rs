//! One small file for each machine, replaced as a whole: after a power cut it holds the old alarm or the new one.
//!
//! ```text
//!     tipwatch-alarm 1 MACHINE_HASH NAME_CRC32 LEVEL ACKNOWLEDGED CRC32
//! ```
//! Whoever changes the machine file gets another hash. The alarm is then taken over from the files of machines of the same
//! name: NAME_CRC32 is the checksum of the name.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tipwatch_mechanics::verdict::{Latch, Level};

/// First words of the file.
const BEGINNING: &str = "tipwatch-alarm 1";

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

/// The file of a machine's alarm.
#[derive(Debug, Clone)]
pub struct AlarmFile {
    folder: PathBuf,
    machine_hash: u64,
    name_checksum: u32,
}

impl AlarmFile {
    /// The file of the machine with this hash and name in this folder.
    #[must_use]
    pub fn new(folder: &Path, machine_hash: u64, machine_name: &str) -> Self {
        Self {
            folder: folder.into(),
            machine_hash,
            name_checksum: crc32fast::hash(machine_name.as_bytes()),
        }
    }

    /// Files with an alarm of a machine of the same name, if this machine has none yet.
    pub(super) fn predecessors(&self) -> Vec<(Self, Latch)> {
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
        let latched = files.filter_map(|file| Some((file.read().ok()?, file)));
        let latched = latched.filter(|(latch, _)| latch.level.is_some());
        latched.map(|(latch, file)| (file, latch)).collect()
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        let name = format!("alarm-{:016x}.txt", self.machine_hash);
        self.folder.join(name)
    }

    /// The alarm in the file; none if there is no file.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged: then nobody knows whether there was an alarm.
    pub fn read(&self) -> io::Result<Latch> {
        let text = match fs::read_to_string(self.path()) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Latch::default()),
            Err(error) => return Err(error),
        };
        let known = [None, Some(Level::Danger), Some(Level::Fault)];
        let known = known.into_iter().flat_map(|level| {
            [false, true].map(|is_acknowledged| Latch {
                level,
                is_acknowledged,
            })
        });
        // a file is good if it is exactly what one of the alarms is written as
        let mut read = known.filter(|latch| self.text(*latch) == text);
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
    pub fn write(&self, latch: Latch) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let new = self.path().with_extension("new");
        let mut file = File::create(&new)?;
        file.write_all(self.text(latch).as_bytes())?;
        file.sync_all()?;
        fs::rename(&new, self.path())?;
        // the new name must survive a power cut too
        File::open(&self.folder)?.sync_all()
    }

    /// Keeps a copy of a damaged file beside it.
    pub(super) fn keep_damaged(&self) {
        let _ = fs::copy(self.path(), self.path().with_extension("damaged"));
    }

    fn text(&self, latch: Latch) -> String {
        let level = latch.level.map_or("none", Level::name);
        let acknowledged = u8::from(latch.is_acknowledged);
        let hash = self.machine_hash;
        let name = self.name_checksum;
        let content = format!("{BEGINNING} {hash:016x} {name:08x} {level} {acknowledged}");
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
        assert_eq!(file.read().unwrap(), Latch::default());
        let mut latch = Latch::raised(Level::Danger);
        for _ in 0..2 {
            file.write(latch).unwrap();
            assert_eq!(file.read().unwrap(), latch);
            latch.acknowledge();
        }
        file.write(Latch::default()).unwrap();
        assert_eq!(file.read().unwrap(), Latch::default());
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn every_changed_byte_is_damage() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        file.write(Latch::raised(Level::Danger)).unwrap();
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
            AlarmFile::new(folder.path(), 8, "m").text(Latch::default()),
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

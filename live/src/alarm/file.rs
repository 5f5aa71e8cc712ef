//! One small file for each machine, replaced as a whole: after a power cut it holds the old alarm or the new one.
//!
//! ```text
//!     tipwatch-alarm 5 MACHINE_HASH IDENTITY_CRC32 LEVEL ACKNOWLEDGED CONTRADICTION DOUBTED CRC32
//! ```
//! Whoever changes the machine file gets another hash. The alarm is then taken over from the files of machines of the same
//! identity, which is the name with the serial number; IDENTITY_CRC32 is its checksum. A machine file that states a serial number
//! for the first time has another identity, too: files of its name alone are of this machine, and so are those of its name with a
//! serial number, unless they are monitored, of a machine whose file states none, and those of another name with its serial number:
//! it was renamed. CONTRADICTION is `-`, or the time at which
//! the sensors were contradicted last (UTC). It is never erased: a commissioning whose drive is later overrules it, an earlier one
//! does not. DOUBTED is `-`, or the signals that failed visibly, see [`super::doubted`]. Version 4 keeps no sign of a velocity there.
//! Version 3 has none of them. Version 2 names no time either; its contradictions count as of when they are read.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use tipwatch_mechanics::verdict::{Latch, Level};

use super::doubted::{DoubtedSignal, DoubtedSignals, Full};

/// First words of the file.
const BEGINNING: &str = "tipwatch-alarm";
const VERSION: &str = "5";
const VERSION_WITHOUT_SIGN: &str = "4";
const VERSION_WITHOUT_SIGNALS: &str = "3";
const VERSION_WITHOUT_TIME: &str = "2";

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

/// State that outlives a session, a restart and a power cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Kept {
    /// The latched alarm.
    pub latch: Latch,
    /// Time at which the mounting, a sign, the order or a scale of a sensor was last contradicted; `None` if none ever was.
    pub contradicted: Option<Timestamp>,
    /// The signals that failed visibly, and that nobody trusts yet.
    pub doubted: DoubtedSignals,
}

impl Kept {
    /// Returns the state with an alarm alone.
    #[must_use]
    pub fn alarm(latch: Latch) -> Self {
        Self {
            latch,
            ..Self::default()
        }
    }

    /// Returns the state in which the sensors were contradicted at this time or later.
    #[must_use]
    pub fn contradicted_at(mut self, time: Timestamp) -> Self {
        self.contradicted = self.contradicted.max(Some(to_the_second(time)));
        self
    }

    /// Returns the state with the doubt of this signal added. Where there is no room for another doubt, all sensors count as
    /// contradicted.
    #[must_use]
    pub fn doubting(mut self, signal: DoubtedSignal) -> Self {
        match self.doubted.push(signal) {
            Ok(()) => self,
            Err(Full) => self.contradicted_at(signal.since),
        }
    }
}

/// The file of a machine's alarm.
#[derive(Debug, Clone)]
pub struct AlarmFile {
    pub(super) folder: PathBuf,
    pub(super) machine_hash: u64,
    pub(super) identity_checksum: u32,
    /// Checksums of the identities that it has had if its machine file stated a serial number later, states none any more, or had
    /// another name with it.
    before: Vec<u32>,
}

impl AlarmFile {
    /// The file of the machine with this hash and identity in this folder.
    #[must_use]
    pub fn new(folder: &Path, machine_hash: u64, identity: &str) -> Self {
        Self {
            folder: folder.into(),
            machine_hash,
            identity_checksum: checksum_of(identity),
            before: Vec::new(),
        }
    }

    /// Returns the file of a machine that may have had these identities before.
    #[must_use]
    pub(super) fn once(mut self, identities: &[String]) -> Self {
        self.before = identities.iter().map(|it| checksum_of(it)).collect();
        self
    }

    /// The other files of machines of the same identity with an alarm or a contradiction, and files of which nobody can tell: a
    /// damaged one may be of this machine, and counts as a latched fault.
    ///
    /// They are looked for even if this machine has a file: whoever goes back to a machine file of before finds its old one.
    ///
    /// # Errors
    /// The folder cannot be listed: nobody knows whether there are such files.
    pub(super) fn predecessors(&self) -> io::Result<Vec<Predecessor>> {
        let entries = match fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(error),
        };
        let mut found = Vec::new();
        for entry in entries {
            let Some(machine_hash) = hash_of(&entry?.file_name()) else {
                continue;
            };
            let mut file = Self {
                machine_hash,
                ..self.clone()
            };
            let identity = file.written_identity();
            let is_ours =
                |identity| identity == self.identity_checksum || self.before.contains(&identity);
            if machine_hash == self.machine_hash || identity.is_some_and(|it| !is_ours(it)) {
                continue;
            }
            file.identity_checksum = identity.unwrap_or(self.identity_checksum);
            match file.read() {
                Ok(kept) if kept == Kept::default() => {}
                Ok(kept) => found.push(Predecessor {
                    file,
                    kept,
                    damage: None,
                }),
                Err(error) => found.push(Predecessor {
                    file,
                    kept: Kept::alarm(Latch::raised(Level::Fault)),
                    damage: Some(error),
                }),
            }
        }
        Ok(found)
    }

    /// Checksum of the identity in its file; `None` if that is damaged.
    fn written_identity(&self) -> Option<u32> {
        let text = fs::read_to_string(self.path()).ok()?;
        let written = Written::parse(&text)?;
        (written.machine_hash == self.machine_hash).then_some(written.identity_checksum)
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> PathBuf {
        let name = format!("alarm-{:016x}.txt", self.machine_hash);
        self.folder.join(name)
    }

    /// Reads the file; without one, the state has no alarm, contradiction or doubt.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged: then nobody knows whether there was an alarm.
    pub fn read(&self) -> io::Result<Kept> {
        let text = match fs::read_to_string(self.path()) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Kept::default()),
            Err(error) => return Err(error),
        };
        let written = Written::parse(&text).filter(|written| {
            written.machine_hash == self.machine_hash
                && written.identity_checksum == self.identity_checksum
        });
        written.map(|written| written.kept).ok_or_else(|| {
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
    pub fn write(&self, kept: &Kept) -> io::Result<()> {
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

    fn text(&self, kept: &Kept) -> String {
        let written = Written {
            machine_hash: self.machine_hash,
            identity_checksum: self.identity_checksum,
            kept: *kept,
        };
        written.text()
    }
}

/// Checksum of an identity.
pub(super) fn checksum_of(identity: &str) -> u32 {
    crc32fast::hash(identity.as_bytes())
}

/// An alarm file of a machine of the same identity.
#[derive(Debug)]
pub(super) struct Predecessor {
    pub(super) file: AlarmFile,
    pub(super) kept: Kept,
    /// Error of reading the file, which then counts as a latched fault; `None` if the file could be read.
    pub(super) damage: Option<io::Error>,
}

/// The hash of the machine by the name of its file; `None` if it is no alarm file.
fn hash_of(name: &OsStr) -> Option<u64> {
    let hash = name.to_str()?.strip_prefix("alarm-")?;
    u64::from_str_radix(hash.strip_suffix(".txt")?, 16).ok()
}

/// Content of an alarm file.
#[derive(Debug, Clone, Copy)]
struct Written {
    machine_hash: u64,
    identity_checksum: u32,
    kept: Kept,
}

impl Written {
    fn text(&self) -> String {
        let Self {
            machine_hash,
            identity_checksum,
            kept,
        } = self;
        let level = kept.latch.level.map_or("none", Level::name);
        let acknowledged = u8::from(kept.latch.is_acknowledged);
        let contradiction = (kept.contradicted).map_or("-".into(), |time| time.to_string());
        sealed(&format!(
            "{BEGINNING} {VERSION} {machine_hash:016x} {identity_checksum:08x} {level} {acknowledged} {contradiction} {}",
            kept.doubted
        ))
    }

    /// `None` if it is damaged: a file is good if it is exactly what its content is written as.
    fn parse(text: &str) -> Option<Self> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let [
            _,
            version,
            hash,
            identity,
            level,
            acknowledged,
            contradiction,
            ref rest @ ..,
        ] = words[..]
        else {
            return None;
        };
        let doubted = match (version, rest) {
            (VERSION_WITHOUT_TIME | VERSION_WITHOUT_SIGNALS, [_]) => DoubtedSignals::default(),
            (VERSION, [doubted, _]) => doubted.parse().ok()?,
            (VERSION_WITHOUT_SIGN, [doubted, _]) => {
                let before: DoubtedSignals = doubted.parse().ok()?;
                let mut signals = DoubtedSignals::default();
                for signal in before.iter() {
                    signals.push(signal.of_version_4()).ok()?;
                }
                signals
            }
            _ => return None,
        };
        let (content, _) = text.rsplit_once(' ')?;
        let known = [None, Some(Level::Danger), Some(Level::Fault)];
        let named = |it: &Option<Level>| it.map_or("none", Level::name) == level;
        let contradicted = match (version, contradiction) {
            (_, "-") => None,
            // version 2 names a commissioning here, and no time
            (VERSION_WITHOUT_TIME, _) => Some(Timestamp::now()),
            (_, time) => Some(time.parse().ok()?),
        };
        let written = Self {
            machine_hash: u64::from_str_radix(hash, 16).ok()?,
            identity_checksum: u32::from_str_radix(identity, 16).ok()?,
            kept: Kept {
                latch: Latch {
                    level: known.into_iter().find(named)?,
                    is_acknowledged: acknowledged == "1",
                },
                contradicted: contradicted.map(to_the_second),
                doubted,
            },
        };
        let is_good = match version {
            VERSION => written.text() == text,
            _ => content.starts_with(BEGINNING) && sealed(content) == text,
        };
        is_good.then_some(written)
    }
}

/// The content with its checksum: a file is whole if it is exactly that.
pub(super) fn sealed(content: &str) -> String {
    format!("{content} {:08x}\n", crc32fast::hash(content.as_bytes()))
}

/// The next full second: what is later than that is later.
fn to_the_second(time: Timestamp) -> Timestamp {
    let second = time.as_second() + i64::from(time.subsec_nanosecond() > 0);
    Timestamp::from_second(second).unwrap_or(Timestamp::MAX)
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
        let time = |second| Timestamp::from_second(second).unwrap();
        for contradicted in [None, Some(time(0)), Some(time(1_800_000_000))] {
            let kept = Kept {
                contradicted,
                ..Kept::alarm(latch)
            };
            let slipped = slipped("joint.slew");
            file.write(&kept.doubting(slipped)).unwrap();
            assert_eq!(file.read().unwrap(), kept.doubting(slipped));
            file.write(&kept).unwrap();
            assert_eq!(file.read().unwrap(), kept);
            latch.acknowledge();
        }
        file.write(&Kept::default()).unwrap();
        assert_eq!(file.read().unwrap(), Kept::default());
    }

    fn slipped(name: &str) -> DoubtedSignal {
        format!("{name}=1.5~0.02@2026-11-27T10:00:00Z")
            .parse()
            .unwrap()
    }

    /// A file as version 3 wrote it.
    #[test]
    fn file_of_before_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        let identity = file.identity_checksum;
        for version in ["3", "5"] {
            let content = format!(
                "tipwatch-alarm {version} {:016x} {identity:08x} fault 1 2026-11-27T10:00:00Z",
                7
            );
            fs::write(file.path(), sealed(&content)).unwrap();
            let read = file.read();
            assert_eq!(read.is_ok(), version == "3");
            if let Ok(kept) = read {
                assert!(kept.latch.is_acknowledged && kept.doubted.is_empty());
                assert_eq!(kept.contradicted, "2026-11-27T10:00:00Z".parse().ok());
            }
        }
        // and none of a later version
        let content = format!("tipwatch-alarm 6 {:016x} {identity:08x} none 0 - -", 7);
        fs::write(file.path(), sealed(&content)).unwrap();
        assert!(file.read().is_err());
    }

    /// Version 4 marks a joint that was contradicted as stopped by a velocity of -1, and keeps no sign of other velocities.
    // requirement: TW-VERDICT-31
    #[test]
    fn doubts_of_version_4_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        let since = "2026-11-27T10:00:00Z";
        let content = format!(
            "tipwatch-alarm 4 {:016x} {:08x} none 0 - joint.slew=0~-1@{since},joint.lift=0~0.3@{since},joint.tilt=1.5~0.02@{since}",
            7, file.identity_checksum
        );
        fs::write(file.path(), sealed(&content)).unwrap();
        let kept = file.read().unwrap();
        let moved: Vec<f64> = kept.doubted.iter().map(|it| it.moved).collect();
        assert_eq!(moved, [f64::INFINITY, 0.3, 0.02]);
        // as it is written again
        file.write(&kept).unwrap();
        assert_eq!(file.read().unwrap(), kept);
    }

    /// Nobody knows when it was: it counts as of now, so that only a drive from now on can be later.
    #[test]
    fn contradiction_without_a_time_counts_as_of_when_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        let identity = file.identity_checksum;
        let content = format!("tipwatch-alarm 2 {:016x} {identity:08x} danger 0", 7);
        let before = Timestamp::now();
        fs::write(file.path(), sealed(&format!("{content} 0000002a"))).unwrap();
        let kept = file.read().unwrap();
        assert_eq!(kept.latch, Latch::raised(Level::Danger));
        assert!(kept.contradicted.unwrap() >= before);
        fs::write(file.path(), sealed(&format!("{content} -"))).unwrap();
        assert_eq!(file.read().unwrap().contradicted, None);
    }

    // requirement: TW-VERDICT-20
    #[test]
    fn every_changed_byte_is_damage() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::new(folder.path(), 7, "m");
        let alarm = Kept::alarm(Latch::raised(Level::Danger));
        let alarm = alarm.contradicted_at(Timestamp::now());
        file.write(&alarm.doubting(slipped("joint.slew"))).unwrap();
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
            AlarmFile::new(folder.path(), 8, "m").text(&Kept::default()),
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

//! Positions of the joints when the monitor last saw them: the next session begins near them, or an encoder was set anew or
//! slipped meanwhile.
//!
//! ```text
//!     tipwatch-positions 1 MACHINE_HASH BOOT ELSEWHERE_NS SESSION IS_REPLAY JOINT=POSITION@HOST_NS,... CRC32
//! ```
//! HOST_NS is CLOCK_MONOTONIC of the boot with the identity BOOT; ELSEWHERE_NS is by how much the time of day is ahead of it, by which a
//! suspended computer is noticed. After another boot nobody knows for how long the machine went on, and nothing is compared. So the
//! file need not survive a power cut: it is replaced as a whole, and not synced.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::file::sealed;
use crate::system::clock::{monotonic_ns, unix_ns};
use crate::wire::topics::MAX_JOINTS;

const BEGINNING: &str = "tipwatch-positions 1";
const BOOT_ID: &str = "/proc/sys/kernel/random/boot_id";

/// Last known position of a joint, with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastPosition {
    /// Time at which the joint was seen (ns), by CLOCK_MONOTONIC.
    pub host_ns: i64,
    /// Position of the joint (rad or m).
    pub position: f64,
}

/// The last positions of all joints, by index in the machine; joints beyond the places on the wire have none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LastPositions {
    /// The session that showed them.
    pub session: u64,
    /// Whether that session replays a log: the next session does not go on from its positions.
    pub is_replay: bool,
    /// Last position of each joint; `None` if it is unknown.
    pub joints: [Option<LastPosition>; MAX_JOINTS],
}

impl Default for LastPositions {
    fn default() -> Self {
        Self {
            session: 0,
            is_replay: false,
            joints: [None; MAX_JOINTS],
        }
    }
}

impl LastPositions {
    /// Reads the last positions of the machine with this hash from this folder. None are known if there is no file of this boot,
    /// or if it is damaged.
    #[must_use]
    pub fn read(folder: &Path, machine_hash: u64) -> Self {
        let text = fs::read_to_string(path(folder, machine_hash)).ok();
        let read = text.and_then(|text| Self::parse(&text, machine_hash));
        read.unwrap_or_default()
    }

    /// Replaces the file.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn write(&self, folder: &Path, machine_hash: u64) -> io::Result<()> {
        let file = path(folder, machine_hash);
        let new = file.with_extension("new-positions");
        fs::write(&new, self.text(machine_hash, &boot()?))?;
        fs::rename(&new, &file)
    }

    fn text(&self, machine_hash: u64, boot: &str) -> String {
        let Self {
            session, is_replay, ..
        } = self;
        let joints = self.joints.iter().enumerate();
        let joints = joints.filter_map(|(joint, at)| {
            let LastPosition { host_ns, position } = (*at)?;
            Some(format!("{joint}={position}@{host_ns}"))
        });
        let joints: Vec<String> = joints.collect();
        sealed(&format!(
            "{BEGINNING} {machine_hash:016x} {boot} {} {session:016x} {} {}",
            elsewhere_ns(),
            u8::from(*is_replay),
            joints.join(",")
        ))
    }

    /// `None` if it is damaged, of another machine or of another boot.
    fn parse(text: &str, machine_hash: u64) -> Option<Self> {
        let (content, _) = text.rsplit_once(' ')?;
        let is_whole = sealed(content) == text;
        let rest = content.strip_prefix(BEGINNING).filter(|_| is_whole)?;
        let words: Vec<&str> = rest.split_whitespace().collect();
        let [
            hash,
            of_boot,
            elsewhere,
            session,
            is_replay,
            ref joints @ ..,
        ] = words[..]
        else {
            return None;
        };
        if hash != format!("{machine_hash:016x}") || of_boot != boot().ok()? {
            return None;
        }
        // CLOCK_MONOTONIC stands still while the computer is suspended
        let suspended_ns = elsewhere_ns()
            .saturating_sub(elsewhere.parse().ok()?)
            .max(0);
        let mut read = Self {
            session: u64::from_str_radix(session, 16).ok()?,
            is_replay: is_replay == "1",
            ..Self::default()
        };
        for joint in joints.iter().flat_map(|joints| joints.split(',')) {
            let (joint, at) = joint.split_once('=')?;
            let (position, host_ns) = at.split_once('@')?;
            let host_ns: i64 = host_ns.parse().ok()?;
            let at = LastPosition {
                host_ns: host_ns.saturating_sub(suspended_ns),
                position: position.parse().ok().filter(|at: &f64| at.is_finite())?,
            };
            *read.joints.get_mut(joint.parse::<usize>().ok()?)? = Some(at);
        }
        Some(read)
    }
}

fn path(folder: &Path, machine_hash: u64) -> PathBuf {
    folder.join(format!("positions-{machine_hash:016x}.txt"))
}

fn boot() -> io::Result<String> {
    Ok(fs::read_to_string(BOOT_ID)?.trim().to_owned())
}

fn elsewhere_ns() -> i64 {
    unix_ns().saturating_sub(monotonic_ns())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_read_as_they_were_written_in_the_same_boot_only() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(
            LastPositions::read(folder.path(), 7),
            LastPositions::default()
        );
        let mut last = LastPositions {
            session: 9,
            is_replay: true,
            ..LastPositions::default()
        };
        let of = |host_ns, position| Some(LastPosition { host_ns, position });
        for (joint, at) in [(0, of(5, 0.1 + 0.2)), (63, of(-5, -1e-300))] {
            // without joints, too
            last.write(folder.path(), 7).unwrap();
            let read = LastPositions::read(folder.path(), 7);
            assert_eq!((read.session, read.is_replay), (9, true));
            let positions = |of: &LastPositions| of.joints.map(|at| at.map(|at| at.position));
            assert_eq!(positions(&read), positions(&last));
            last.joints[joint] = at;
        }
        assert_eq!(
            LastPositions::read(folder.path(), 8),
            LastPositions::default()
        );
        let text = last.text(7, &boot().unwrap());
        let read = LastPositions::parse(&text, 7).unwrap();
        // the two clocks are read one after the other
        let apart_ns = 5 - read.joints[0].unwrap().host_ns;
        assert!((0..1_000_000_000).contains(&apart_ns), "{apart_ns}");
        for damaged in [
            last.text(7, "another"),
            text.replace("63=", "64="),
            text.replace('@', "#"),
            text.trim().to_owned(),
            String::new(),
        ] {
            assert_eq!(LastPositions::parse(&damaged, 7), None, "{damaged}");
        }
    }
}

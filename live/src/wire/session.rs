//! Sessions: the machine and its sensors, on which both sides agree before the first sample.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, bail, ensure};
use tipwatch_binding::{MachineFile, Urdf};

use crate::system::clock::monotonic_ns;
use crate::wire::hash::Fnv1a;
use crate::wire::topics::{Head, MAX_JOINTS, NAME_BYTES, Wire, WireSession};

/// Paces of a clock that is related to real time: with a slower or faster one, times of this computer do not fit into nanoseconds.
pub const PACES: RangeInclusive<f64> = 1e-3..=1e3;

/// Progress of a session: whether more samples are to come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The session goes on.
    Running,
    /// The session is over.
    Ended,
}

/// Offset between the sensors' clock and this computer's, as one instant by both clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StampClock {
    /// The instant by the sensors' clock (ns).
    pub stamp_ns: i64,
    /// The instant by CLOCK_MONOTONIC of this computer (ns).
    pub host_ns: i64,
}

impl StampClock {
    /// Converts a time by CLOCK_MONOTONIC (ns) to the stamp of a measurement at that time (ns).
    #[must_use]
    pub fn stamp_ns(self, measured_ns: i64, pace: f64) -> i64 {
        let since_ns = measured_ns.saturating_sub(self.host_ns) as f64 * pace;
        self.stamp_ns.saturating_add(since_ns as i64)
    }

    /// Converts a stamp to the time of its measurement (ns) by CLOCK_MONOTONIC.
    #[must_use]
    pub fn measured_ns(self, stamp_ns: i64, pace: f64) -> i64 {
        let since_ns = stamp_ns.saturating_sub(self.stamp_ns) as f64 / pace;
        self.host_ns.saturating_add(since_ns as i64)
    }
}

/// A session.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Identity: unique for every session.
    pub id: u64,
    /// Hash of machine file and URDF.
    pub machine_hash: u64,
    /// Samples of the session without the end message; 0 if unknown.
    pub total_samples: u64,
    /// Speed of the sensors' clock relative to real time; 0 if unrelated to real time.
    pub pace: f64,
    /// Offset of the sensors' clock. Unused if the pace is 0.
    pub clock: StampClock,
    /// Whether readers must report their progress.
    pub wants_progress: bool,
    /// Names of the joints of each stream, in the order of its values.
    pub streams: Vec<Vec<String>>,
    /// Whether there is an IMU.
    pub imu: bool,
    /// Whether there is odometry.
    pub odometry: bool,
    /// Whether the tool wrench is measured.
    pub tool_wrench: bool,
    /// The machine's actuated joints whose force is measured, ascending.
    pub actuated_joints: Vec<u32>,
    /// The machine's signals that tell which supports are on the ground, ascending: indices in
    /// [`Supports::switches`](tipwatch_mechanics::machine::Supports::switches).
    pub switches: Vec<u32>,
    /// The machine's load sensors, ascending: indices in
    /// [`Machine::load_sensors`](tipwatch_mechanics::Machine::load_sensors).
    pub load_sensors: Vec<u32>,
    /// The joints whose rate a controller asks for, ascending: indices in
    /// [`Machine::joint_commands`](tipwatch_mechanics::Machine::joint_commands).
    pub joint_commands: Vec<u32>,
    /// The signals that tell masses of payloads, ascending: indices in
    /// [`Machine::payload_signals`](tipwatch_mechanics::Machine::payload_signals).
    pub payload_signals: Vec<u32>,
    /// The signals of the forces of the arm, ascending: indices in
    /// [`Machine::force_signals`](tipwatch_mechanics::Machine::force_signals).
    pub force_signals: Vec<u32>,
    /// `frame_id` of the IMU.
    pub imu_frame: Option<String>,
}

/// Hash of the texts of machine file and URDF: both sides compare it.
#[must_use]
pub fn machine_hash(file: &MachineFile, urdf: &Urdf) -> u64 {
    hash_of_texts(&file.effective_text(), &urdf.text)
}

/// Returns the hash of the texts of a machine file and a URDF.
#[must_use]
pub fn hash_of_texts(machine: &str, urdf: &str) -> u64 {
    Fnv1a::new()
        .bytes(machine.as_bytes())
        .bytes(urdf.as_bytes())
        .finish()
}

impl TryFrom<&Session> for WireSession {
    type Error = anyhow::Error;

    fn try_from(session: &Session) -> Result<Self> {
        let joint_count = session.streams.iter().map(Vec::len).sum::<usize>();
        ensure!(
            joint_count <= MAX_JOINTS,
            "session: expected no more than {MAX_JOINTS} joints, found {joint_count}"
        );
        let mut wire = Self {
            total_samples: session.total_samples,
            pace: session.pace,
            clock_stamp_ns: session.clock.stamp_ns,
            clock_host_ns: session.clock.host_ns,
            joint_count: joint_count as u32,
            stream_count: u32::try_from(session.streams.len())?,
            has_imu: session.imu.into(),
            has_odometry: session.odometry.into(),
            has_tool_wrench: session.tool_wrench.into(),
            wants_progress: session.wants_progress.into(),
            actuated_joints: bits_of(&session.actuated_joints)
                .context("session: expected no more than 32 actuated joints")?,
            switches: bits_of(&session.switches)
                .context("session: expected no more than 32 signals that tell of supports")?,
            load_sensors: bits_of(&session.load_sensors)
                .context("session: expected no more than 32 load sensors")?,
            joint_commands: bits_of(&session.joint_commands).context(
                "session: expected no more than 32 joints that a controller asks to move",
            )?,
            payload_signals: bits_of(&session.payload_signals).context(
                "session: expected no more than 32 signals that tell masses of payloads",
            )?,
            force_signals: bits_of(&session.force_signals)
                .context("session: expected no more than 32 signals of forces of the arm")?,
            imu_frame: name_to_wire(session.imu_frame.as_deref().unwrap_or(""))?,
            ..Self::blank()
        };
        let joints = (0..)
            .zip(&session.streams)
            .flat_map(|(stream, names)| names.iter().map(move |name| (stream, name)));
        for (place, (stream, name)) in joints.enumerate() {
            wire.joint_streams[place] = stream;
            wire.joint_names[place] = name_to_wire(name)?;
        }
        wire.seal(Head {
            source: session.id,
            machine_hash: session.machine_hash,
            published_ns: monotonic_ns(),
            ..Head::default()
        });
        Ok(wire)
    }
}

impl TryFrom<&WireSession> for Session {
    type Error = anyhow::Error;

    fn try_from(wire: &WireSession) -> Result<Self> {
        ensure!(
            wire.is_whole(),
            "session: expected an undamaged message of this version"
        );
        ensure!(
            wire.pace == 0.0 || PACES.contains(&wire.pace),
            "session: expected a pace from {} to {}, or 0 of a clock without relation to real time, found {}",
            PACES.start(),
            PACES.end(),
            wire.pace
        );
        let (joints, streams) = (wire.joint_count as usize, wire.stream_count as usize);
        ensure!(
            joints <= MAX_JOINTS && streams <= joints,
            "session: expected no more than {MAX_JOINTS} joints in no more streams, found {joints} in {streams}"
        );
        let mut session = Self {
            id: wire.source,
            machine_hash: wire.machine_hash,
            total_samples: wire.total_samples,
            pace: wire.pace,
            clock: StampClock {
                stamp_ns: wire.clock_stamp_ns,
                host_ns: wire.clock_host_ns,
            },
            wants_progress: flag(wire.wants_progress, "wants_progress")?,
            streams: vec![Vec::new(); streams],
            imu: flag(wire.has_imu, "has_imu")?,
            odometry: flag(wire.has_odometry, "has_odometry")?,
            tool_wrench: flag(wire.has_tool_wrench, "has_tool_wrench")?,
            actuated_joints: list_of(wire.actuated_joints),
            switches: list_of(wire.switches),
            load_sensors: list_of(wire.load_sensors),
            joint_commands: list_of(wire.joint_commands),
            payload_signals: list_of(wire.payload_signals),
            force_signals: list_of(wire.force_signals),
            imu_frame: Some(name_from_wire(&wire.imu_frame)?).filter(|frame| !frame.is_empty()),
        };
        let mut before = 0;
        let all = wire.joint_streams.iter().zip(&wire.joint_names);
        // what a sender has behind them may be of a session before
        for (&stream, name) in all.take(joints) {
            let name = name_from_wire(name)?;
            ensure!(
                stream >= before,
                "session: expected the streams of the joints in ascending order, found stream {stream} of \"{name}\" behind {before}"
            );
            before = stream;
            let names = session.streams.get_mut(stream as usize);
            let names = names.with_context(|| {
                format!(
                    "session: expected joints of {streams} streams as in stream_count, found \"{name}\" of stream {stream}"
                )
            })?;
            names.push(name);
        }
        let empty = session.streams.iter().position(Vec::is_empty);
        ensure!(
            empty.is_none(),
            "session: expected joints of {streams} streams as in stream_count, found none of stream {}",
            empty.unwrap_or_default()
        );
        Ok(session)
    }
}

/// A yes or no of the session.
fn flag(found: u32, field: &str) -> Result<bool> {
    match found {
        0 => Ok(false),
        1 => Ok(true),
        _ => bail!("session: expected 0 or 1 in {field}, found {found}"),
    }
}

/// Returns a set bit for each number; `None` if a number exceeds the bits.
fn bits_of(numbers: &[u32]) -> Option<u32> {
    let mut numbers = numbers.iter();
    numbers.try_fold(0, |bits, &number| Some(bits | 1_u32.checked_shl(number)?))
}

fn list_of(bits: u32) -> Vec<u32> {
    (0..u32::BITS)
        .filter(|number| bits >> number & 1 == 1)
        .collect()
}

pub(crate) fn name_to_wire(name: &str) -> Result<[u8; NAME_BYTES]> {
    let bytes = name.as_bytes();
    ensure!(
        bytes.len() < NAME_BYTES,
        "\"{name}\": expected a name of no more than {} bytes, found {}",
        NAME_BYTES - 1,
        bytes.len()
    );
    ensure!(
        !bytes.contains(&0),
        "{name:?}: expected a name without zero bytes"
    );
    let mut wire = [0; NAME_BYTES];
    wire[..bytes.len()].copy_from_slice(bytes);
    Ok(wire)
}

pub(crate) fn name_from_wire(wire: &[u8; NAME_BYTES]) -> Result<String> {
    let Some(end) = wire.iter().position(|&byte| byte == 0) else {
        bail!("session: expected a name that ends with a zero byte");
    };
    Ok(std::str::from_utf8(&wire[..end])
        .context("session: a name")?
        .to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::topics::MAX_ARM_FORCES;

    fn session() -> Session {
        Session {
            id: 7,
            machine_hash: 9,
            total_samples: 11,
            pace: 0.5,
            clock: StampClock {
                stamp_ns: 1_000,
                host_ns: -5,
            },
            wants_progress: true,
            streams: vec![vec!["a".into(), "b".repeat(63)], vec!["c".into()]],
            imu: true,
            odometry: false,
            tool_wrench: true,
            actuated_joints: vec![1, 4],
            switches: vec![0, 3],
            load_sensors: vec![2, 31],
            joint_commands: vec![1],
            payload_signals: vec![0, 2],
            force_signals: vec![1, 3],
            imu_frame: Some("imu_link".into()),
        }
    }

    #[test]
    fn sessions_survive_the_wire() {
        let wire = WireSession::try_from(&session()).unwrap();
        assert_eq!(Session::try_from(&wire).unwrap(), session());
    }

    #[test]
    fn stamps_are_put_on_the_clock_of_the_host() {
        let clock = session().clock;
        assert_eq!(clock.measured_ns(1_000, 0.5), -5);
        assert_eq!(clock.measured_ns(1_100, 0.5), 195);
        assert_eq!(clock.measured_ns(900, 2.0), -55);
        assert_eq!(clock.measured_ns(i64::MIN, 1e-9), i64::MIN);
    }

    #[test]
    fn names_are_never_truncated() {
        let long = Session {
            streams: vec![vec!["b".repeat(64)]],
            ..session()
        };
        assert!(
            WireSession::try_from(&long)
                .unwrap_err()
                .to_string()
                .contains("found 64")
        );
        let many = Session {
            streams: vec![vec!["b".into(); 65]],
            ..session()
        };
        assert!(
            WireSession::try_from(&many)
                .unwrap_err()
                .to_string()
                .contains("found 65")
        );
    }

    /// So a monitor has no more forces of the arm than bits tell of.
    #[test]
    fn no_signal_is_announced_that_has_no_bit() {
        let announced = |signals| {
            let session = Session {
                force_signals: (0..signals).collect(),
                ..session()
            };
            let wire = WireSession::try_from(&session).ok()?;
            Some(Session::try_from(&wire).unwrap().force_signals.len())
        };
        assert_eq!(announced(u32::BITS), Some(MAX_ARM_FORCES));
        assert_eq!(announced(u32::BITS + 1), None);
    }

    #[test]
    fn inconsistent_sessions_are_rejected() {
        let mut wire = WireSession::try_from(&session()).unwrap();
        wire.joint_streams[0] = 5;
        assert!(Session::try_from(&wire).is_err(), "damage");
        wire.seal(wire.head());
        assert!(
            Session::try_from(&wire).is_err(),
            "joint of an unknown stream"
        );
        wire.joint_count = 1000;
        wire.seal(wire.head());
        assert!(Session::try_from(&wire).is_err(), "too many joints");
    }

    /// A sender may use its message again for a session with fewer joints.
    #[test]
    fn what_stands_behind_the_joints_is_not_read() {
        let mut wire = WireSession::try_from(&session()).unwrap();
        wire.joint_count = 2;
        wire.stream_count = 1;
        wire.joint_names[3] = [0xff; NAME_BYTES];
        wire.seal(wire.head());
        let read = Session::try_from(&wire).unwrap();
        assert_eq!(read.streams, session().streams[..1]);
    }

    /// A message that is whole and contradicts itself says what was expected and what was found.
    // requirement: TW-REFUSAL-01
    #[test]
    fn sessions_that_contradict_themselves_are_rejected() {
        type Change = fn(&mut WireSession);
        let changes: [(&str, Change); 11] = [
            ("0 or 1 in has_imu, found 7", |it| it.has_imu = 7),
            ("0 or 1 in has_odometry, found 2", |it| it.has_odometry = 2),
            ("has_tool_wrench, found 255", |it| it.has_tool_wrench = 255),
            ("wants_progress, found 3", |it| it.wants_progress = 3),
            (
                "3 streams as in stream_count, found none of stream 2",
                |it| {
                    it.stream_count = 3;
                },
            ),
            (
                "1 streams as in stream_count, found \"c\" of stream 1",
                |it| {
                    it.stream_count = 1;
                },
            ),
            ("found stream 0 of \"c\" behind 1", |it| {
                it.joint_streams[..3].copy_from_slice(&[1, 1, 0]);
            }),
            ("found -1", |it| it.pace = -1.0),
            ("found NaN", |it| it.pace = f64::NAN),
            ("found inf", |it| it.pace = f64::INFINITY),
            ("from 0.001 to 1000, or 0", |it| it.pace = 1e-300),
        ];
        for (words, change) in changes {
            let mut wire = WireSession::try_from(&session()).unwrap();
            change(&mut wire);
            wire.seal(wire.head());
            let error = Session::try_from(&wire).unwrap_err().to_string();
            assert!(error.contains(words), "{words}: {error}");
        }
    }
}

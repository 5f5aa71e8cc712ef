//! The signals that failed visibly, as they are kept: by name, since a changed machine file may number joints otherwise.
//!
//! ```text
//!     SIGNAL=BY~MOVED@TIME,...        joint.slew=1.5707963267948966~0.0235@2026-11-27T10:00:00Z
//! ```
//! BY is by how much it is off (rad, m or m/s^2), MOVED what of that may be motion, TIME when that was found (UTC). In names, all
//! but letters, digits and `_.-` stands as `%` and two hexadecimal digits.
//!
//! BY is 0 of a joint that stopped to be measured; MOVED is its velocity then (rad/s or m/s). MOVED is `inf` where the lean of the platform
//! has contradicted that the joint stood still, and `-inf` where the joint does not show what its controller asks: those doubts stand
//! beside another one of the same joint.
//!
//! Of the specific force there are two doubts: that it stepped (MOVED is the step that does no harm), and that its mean length is
//! impossible (MOVED is 0). Of the angular velocity of an IMU, BY is by how much its heading jumped: its housing may have turned.

use std::fmt::{self, Write};
use std::str::FromStr;

use jiff::Timestamp;
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::estimation::plausibility::SignalDoubt;
use tipwatch_mechanics::machine::Proof;

use crate::wire::topics::{MAX_JOINTS, NAME_BYTES};

/// Bytes of the longest name: what a signal is, and the name of a joint.
const SIGNAL_BYTES: usize = NAME_BYTES + 8;
/// Most signals that are kept.
const MOST: usize = MAX_JOINTS;

/// Name of a signal, as in [`Proof::name`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignalName {
    length: usize,
    bytes: [u8; SIGNAL_BYTES],
}

impl SignalName {
    /// The name of a signal of this machine; `None` if it is too long. It does not allocate.
    #[must_use]
    pub fn of(signal: Proof, machine: &Machine) -> Option<Self> {
        let joint = match signal {
            Proof::Joint(joint) => Some(machine.joints().get(joint)?.name.as_str()),
            _ => None,
        };
        let dot = joint.map(|_| ".");
        let parts = [Some(signal.stem()), dot, joint];
        Self::joined(parts.into_iter().flatten().map(str::as_bytes))
    }

    fn joined<'b>(parts: impl Iterator<Item = &'b [u8]>) -> Option<Self> {
        let mut name = Self {
            length: 0,
            bytes: [0; SIGNAL_BYTES],
        };
        for part in parts {
            let end = name.length + part.len();
            name.bytes.get_mut(name.length..end)?.copy_from_slice(part);
            name.length = end;
        }
        Some(name)
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

impl fmt::Display for SignalName {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for &byte in self.bytes() {
            match is_plain(byte) {
                true => out.write_char(byte.into())?,
                false => write!(out, "%{byte:02x}")?,
            }
        }
        Ok(())
    }
}

impl FromStr for SignalName {
    type Err = Damaged;

    fn from_str(text: &str) -> Result<Self, Damaged> {
        let (mut rest, mut bytes) = (text.as_bytes(), Vec::new());
        while let [first, after @ ..] = rest {
            let (byte, left) = match (first, after) {
                (b'%', [high, low, left @ ..]) => {
                    let digits = [*high, *low];
                    let digits = std::str::from_utf8(&digits).map_err(|_| Damaged)?;
                    (u8::from_str_radix(digits, 16).map_err(|_| Damaged)?, left)
                }
                (&byte, left) if is_plain(byte) => (byte, left),
                _ => return Err(Damaged),
            };
            bytes.push(byte);
            rest = left;
        }
        Self::joined([bytes.as_slice()].into_iter()).ok_or(Damaged)
    }
}

fn is_plain(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b"_.-".contains(&byte)
}

/// A signal that failed visibly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubtedSignal {
    /// The signal.
    pub name: SignalName,
    /// Deviation of the signal (rad, m or m/s^2; signed), and the part of the deviation that may be motion: see [`SignalDoubt`].
    pub by: f64,
    /// See `by`.
    pub moved: f64,
    /// Time at which the failure was found.
    pub since: Timestamp,
}

impl DoubtedSignal {
    /// Whether both are the same doubt of a signal: that it is off, that it stopped, that its standstill was contradicted, that it does
    /// not show what is asked, or that the mean length of the specific force is impossible.
    #[must_use]
    pub fn is_alike(&self, other: &Self) -> bool {
        let is_of_force = self.name.bytes() == Proof::SpecificForce.stem().as_bytes();
        let kind = |it: &Self| {
            let is_of_length = is_of_force && it.moved == 0.0;
            let of_standstill = [f64::INFINITY, f64::NEG_INFINITY].map(|moved| it.moved == moved);
            (it.by == 0.0, of_standstill, is_of_length)
        };
        self.name == other.name && kind(self) == kind(other)
    }

    /// Returns the doubt that an alarm file of version 4 states, before velocities had a sign.
    #[must_use]
    pub(super) fn of_version_4(self) -> Self {
        Self {
            moved: SignalDoubt::moved_of_before(self.by, self.moved),
            ..self
        }
    }

    /// Returns the doubt as one of a signal of this machine; `None` if the machine has no such signal.
    #[must_use]
    pub fn of_machine(&self, machine: &Machine) -> Option<SignalDoubt> {
        let mut signals = Proof::all(machine.joints().len());
        let signal = signals.find(|&it| SignalName::of(it, machine) == Some(self.name))?;
        Some(SignalDoubt {
            signal,
            by: self.by,
            moved: self.moved,
        })
    }
}

impl fmt::Display for DoubtedSignal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            by,
            moved,
            since,
        } = self;
        write!(out, "{name}={by}~{moved}@{since}")
    }
}

impl FromStr for DoubtedSignal {
    type Err = Damaged;

    fn from_str(text: &str) -> Result<Self, Damaged> {
        let (name, rest) = text.split_once('=').ok_or(Damaged)?;
        let (by, rest) = rest.split_once('~').ok_or(Damaged)?;
        let (moved, since) = rest.split_once('@').ok_or(Damaged)?;
        let number = |text: &str, is_valid: &dyn Fn(f64) -> bool| {
            let number: f64 = text.parse().map_err(|_| Damaged)?;
            is_valid(number).then_some(number).ok_or(Damaged)
        };
        let by = number(by, &f64::is_finite)?;
        let may_move = |moved: f64| moved.is_finite() || (by == 0.0 && moved.is_infinite());
        Ok(Self {
            name: name.parse()?,
            by,
            moved: number(moved, &may_move)?,
            since: since.parse().map_err(|_| Damaged)?,
        })
    }
}

/// Error of a text that is not the written form of doubted signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damaged;

/// Error of a list of doubted signals that is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full;

/// Doubted signals, each doubt once. The list has room for its largest number from the start, so that nothing allocates.
#[derive(Clone, Copy)]
pub struct DoubtedSignals {
    count: usize,
    signals: [Option<DoubtedSignal>; MOST],
}

impl DoubtedSignals {
    /// Adds a signal.
    ///
    /// # Errors
    /// There is no room.
    pub fn push(&mut self, signal: DoubtedSignal) -> Result<(), Full> {
        *self.signals.get_mut(self.count).ok_or(Full)? = Some(signal);
        self.count += 1;
        Ok(())
    }

    /// The signals, in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &DoubtedSignal> {
        self.signals[..self.count].iter().flatten()
    }

    /// Whether no signal is doubted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl Default for DoubtedSignals {
    fn default() -> Self {
        Self {
            count: 0,
            signals: [None; MOST],
        }
    }
}

impl PartialEq for DoubtedSignals {
    fn eq(&self, other: &Self) -> bool {
        self.iter().eq(other.iter())
    }
}

impl fmt::Debug for DoubtedSignals {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{self}")
    }
}

impl fmt::Display for DoubtedSignals {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return out.write_char('-');
        }
        for (index, signal) in self.iter().enumerate() {
            let comma = if index == 0 { "" } else { "," };
            write!(out, "{comma}{signal}")?;
        }
        Ok(())
    }
}

impl FromStr for DoubtedSignals {
    type Err = Damaged;

    fn from_str(text: &str) -> Result<Self, Damaged> {
        let mut all = Self::default();
        if text != "-" {
            for signal in text.split(',') {
                all.push(signal.parse()?).map_err(|Full| Damaged)?;
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use tipwatch_mechanics::machine::{LogFacts, MachineSpec};

    use super::*;

    fn signal(name: &str, by: f64) -> DoubtedSignal {
        DoubtedSignal {
            name: SignalName::joined([name.as_bytes()].into_iter()).unwrap(),
            by,
            moved: 0.1 + 0.2,
            since: Timestamp::from_second(1_800_000_000).unwrap(),
        }
    }

    #[test]
    fn signals_are_read_as_they_were_written_whatever_they_are_called() {
        let mut all = DoubtedSignals::default();
        assert_eq!("-".parse(), Ok(all));
        for (name, by) in [
            ("joint.slew", std::f64::consts::FRAC_PI_2),
            ("joint.a b,c=d~e@f%g", -1e-300),
            ("joint.Drehkränz", 5e-324),
            ("", 0.0),
        ] {
            all.push(signal(name, by)).unwrap();
            let text = all.to_string();
            assert!(!text.contains([' ', '\n']), "{text}");
            assert_eq!(text.parse(), Ok(all), "{text}");
        }
        let wrong = |text: &str| text.parse::<DoubtedSignals>() == Err(Damaged);
        for text in [
            "",
            ",",
            "a",
            "a=1~2",
            "a=inf~0@2026-11-27T10:00:00Z",
            "a=1~inf@2026-11-27T10:00:00Z",
            "a=1~-inf@2026-11-27T10:00:00Z",
            "a=0~NaN@2026-11-27T10:00:00Z",
            "a%2=1~0@2026-11-27T10:00:00Z",
            "a b=1~0@2026-11-27T10:00:00Z",
            "a=1~0@yesterday",
        ] {
            assert!(wrong(text), "{text:?}");
        }
    }

    #[test]
    fn a_joint_that_stopped_keeps_its_velocity_and_each_doubt_of_its_standstill() {
        let kept = "joint.slew=0~-0.3@2026-11-27T10:00:00Z,joint.slew=0~inf@2026-11-27T10:00:00Z,\
                    joint.slew=0~-inf@2026-11-27T10:00:00Z";
        let all: DoubtedSignals = kept.parse().unwrap();
        assert_eq!(all.to_string(), kept);
        let moved: Vec<f64> = all.iter().map(|it| it.moved).collect();
        assert_eq!(moved, [-0.3, f64::INFINITY, f64::NEG_INFINITY]);
        for (place, one) in all.iter().enumerate() {
            let alike = all.iter().map(|other| one.is_alike(other));
            assert_eq!(alike.collect::<Vec<_>>(), [0, 1, 2].map(|it| it == place));
        }
    }

    #[test]
    fn a_step_of_the_specific_force_is_another_doubt_than_its_length() {
        let kept = "imu.specific_force=3~1@2026-11-27T10:00:00Z,imu.specific_force=1.5~0@2026-11-27T10:00:00Z";
        let all: DoubtedSignals = kept.parse().unwrap();
        let [step, length] = all.iter().collect::<Vec<_>>()[..] else {
            panic!("two doubts")
        };
        assert!(!step.is_alike(length));
        assert!(step.is_alike(&DoubtedSignal { by: 4.0, ..*step }));
        // a joint that jumped, of which nothing or something may be motion
        let jumped: DoubtedSignal = "joint.slew=1.5~0@2026-11-27T10:00:00Z".parse().unwrap();
        let moved = DoubtedSignal {
            moved: 0.02,
            ..jumped
        };
        assert!(jumped.is_alike(&moved));
    }

    /// As it was written before an accelerometer could step: the signal, by how much its mean length is beyond, and 0.
    #[test]
    fn a_length_of_the_specific_force_is_read_as_it_was_written_before_steps_were_told() {
        let before = "imu.specific_force=1.8273645~0@2026-11-27T10:00:00Z";
        let all: DoubtedSignals = before.parse().unwrap();
        assert_eq!(all.to_string(), before);
        let spec = include_str!("../../../mechanics/tests/data/rigid.toml");
        let urdf = include_str!("../../../mechanics/tests/data/rigid.urdf");
        let spec = MachineSpec::from_toml(spec, "rigid.toml").unwrap();
        let machine = spec.check(urdf, "rigid.urdf", LogFacts::default()).unwrap();
        let doubt = all.iter().next().unwrap().of_machine(&machine).unwrap();
        assert_eq!(doubt.signal, Proof::SpecificForce);
        assert!(doubt.is_of_length());
    }

    #[test]
    fn no_more_are_kept_than_there_is_room_for() {
        let mut all = DoubtedSignals::default();
        for index in 0..MOST {
            assert_eq!(all.push(signal(&index.to_string(), 1.0)), Ok(()));
        }
        assert_eq!(all.push(signal("one more", 1.0)), Err(Full));
        assert_eq!(all.to_string().parse(), Ok(all));
        let longest = "x".repeat(SIGNAL_BYTES);
        assert!(longest.parse::<SignalName>().is_ok());
        assert_eq!(format!("{longest}x").parse::<SignalName>(), Err(Damaged));
    }
}

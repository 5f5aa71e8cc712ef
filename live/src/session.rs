//! What both ends agree on before the first sample: the machine, and which sensors there are.

use anyhow::{Context, Result, bail, ensure};
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::LogFacts;
use tipwatch_mechanics::signal::{MatchedSensors, OtherSensors, Sensors};

use crate::fnv::Fnv;
use crate::topics::{MAX_JOINTS, NAME_BYTES, WireSession};

/// A session as its reader and its writer use it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Session {
    /// Tells this session from every other one.
    pub id: u64,
    /// Hash of machine file and URDF.
    pub machine_hash: u64,
    /// Samples of the session, the end not counted.
    pub total_samples: u64,
    /// Names of the joints of each stream, in the order of its values.
    pub streams: Vec<Vec<String>>,
    /// Whether there is an IMU.
    pub imu: bool,
    /// Whether there is odometry.
    pub odometry: bool,
    /// Whether the tool wrench is measured.
    pub tool_wrench: bool,
    /// Which of the machine's actuated joints have their force measured, ascending.
    pub actuated_joints: Vec<u32>,
    /// The frame that the IMU names.
    pub imu_frame: Option<String>,
}

impl Session {
    /// The machine and its sensors, as the session's writer has them.
    ///
    /// # Errors
    /// The session is of another machine, or the machine does not fit its sensors.
    pub fn machine(&self, file: &MachineFile, urdf: &Urdf) -> Result<(Machine, Sensors)> {
        let hash = machine_hash(file, urdf);
        ensure!(
            hash == self.machine_hash,
            "{}: expected the machine of the session, hash {:016x}, found hash {hash:016x} with URDF {}",
            file.path.display(),
            self.machine_hash,
            urdf.name
        );
        let names: Vec<String> = self.streams.concat();
        let facts = LogFacts {
            joint_names: Some(&names),
            lacks_imu: !self.imu,
            imu_frame: self.imu_frame.as_deref(),
            static_transforms: &[],
        };
        let machine = file.spec.check(&urdf.text, &urdf.name, facts)?;
        if machine
            .payloads()
            .iter()
            .any(|payload| payload.is_estimated)
        {
            bail!(
                "{}: payload with mass = \"estimate\": a mass is estimated from a whole log; expected a number for live use",
                file.spec.file
            );
        }
        let sensors = self.sensors(&machine)?;
        Ok((machine, sensors))
    }

    fn sensors(&self, machine: &Machine) -> Result<Sensors> {
        let streams: Vec<(&str, &[String])> = self
            .streams
            .iter()
            .map(|s| ("session", s.as_slice()))
            .collect();
        let others = OtherSensors {
            imu: self.imu,
            odometry: self.odometry,
            tool_wrench: self.tool_wrench,
        };
        let matched = MatchedSensors::new(machine, &streams, others)?;
        let found: Vec<_> = (0..matched.streams.len())
            .map(|stream| matched.joint_names(machine, stream))
            .collect();
        ensure!(
            found == self.streams,
            "session: expected joint states of {}, found {}",
            listed(&found),
            listed(&self.streams)
        );
        let mut sensors = matched.sensors;
        let is_there = |joint: usize| self.actuated_joints.contains(&(joint as u32));
        sensors.actuators = machine.contact().actuator_signals(is_there);
        Ok(sensors)
    }
}

/// The hash of a machine file's text and its URDF's, by which both ends know that they mean one machine.
#[must_use]
pub fn machine_hash(file: &MachineFile, urdf: &Urdf) -> u64 {
    Fnv::new()
        .bytes(file.text.as_bytes())
        .bytes(urdf.text.as_bytes())
        .finish()
}

fn listed(streams: &[Vec<String>]) -> String {
    streams
        .iter()
        .map(|names| names.join(", "))
        .collect::<Vec<_>>()
        .join(" / ")
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
            session: session.id,
            machine_hash: session.machine_hash,
            total_samples: session.total_samples,
            joint_count: joint_count as u32,
            stream_count: u32::try_from(session.streams.len())?,
            has_imu: session.imu.into(),
            has_odometry: session.odometry.into(),
            has_tool_wrench: session.tool_wrench.into(),
            actuated_joints: (session.actuated_joints.iter())
                .try_fold(0_u32, |bits, &joint| Some(bits | 1_u32.checked_shl(joint)?))
                .context("session: expected no more than 32 actuated joints")?,
            imu_frame: name_to_wire(session.imu_frame.as_deref().unwrap_or(""))?,
            joint_streams: [0; MAX_JOINTS],
            joint_names: [[0; NAME_BYTES]; MAX_JOINTS],
        };
        let joints = (0..)
            .zip(&session.streams)
            .flat_map(|(stream, names)| names.iter().map(move |name| (stream, name)));
        for (place, (stream, name)) in joints.enumerate() {
            wire.joint_streams[place] = stream;
            wire.joint_names[place] = name_to_wire(name)?;
        }
        Ok(wire)
    }
}

impl TryFrom<&WireSession> for Session {
    type Error = anyhow::Error;

    fn try_from(wire: &WireSession) -> Result<Self> {
        let (joints, streams) = (wire.joint_count as usize, wire.stream_count as usize);
        ensure!(
            joints <= MAX_JOINTS && streams <= joints,
            "session: expected no more than {MAX_JOINTS} joints in no more streams, found {joints} in {streams}"
        );
        let mut session = Self {
            id: wire.session,
            machine_hash: wire.machine_hash,
            total_samples: wire.total_samples,
            streams: vec![Vec::new(); streams],
            imu: wire.has_imu != 0,
            odometry: wire.has_odometry != 0,
            tool_wrench: wire.has_tool_wrench != 0,
            actuated_joints: (0..32)
                .filter(|joint| wire.actuated_joints >> joint & 1 == 1)
                .collect(),
            imu_frame: Some(name_from_wire(&wire.imu_frame)?).filter(|frame| !frame.is_empty()),
        };
        for (stream, name) in wire
            .joint_streams
            .iter()
            .zip(&wire.joint_names)
            .take(joints)
        {
            let names = session.streams.get_mut(*stream as usize);
            names
                .context("session: a joint of no stream")?
                .push(name_from_wire(name)?);
        }
        Ok(session)
    }
}

fn name_to_wire(name: &str) -> Result<[u8; NAME_BYTES]> {
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

fn name_from_wire(wire: &[u8; NAME_BYTES]) -> Result<String> {
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

    fn session() -> Session {
        Session {
            id: 7,
            machine_hash: 9,
            total_samples: 11,
            streams: vec![vec!["a".into(), "b".repeat(63)], vec!["c".into()]],
            imu: true,
            odometry: false,
            tool_wrench: true,
            actuated_joints: vec![1, 4],
            imu_frame: Some("imu_link".into()),
        }
    }

    #[test]
    fn wire_keeps_everything() {
        let wire = WireSession::try_from(&session()).unwrap();
        assert_eq!(Session::try_from(&wire).unwrap(), session());
    }

    #[test]
    fn nothing_is_cut() {
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

    #[test]
    fn a_session_that_makes_no_sense_is_refused() {
        let mut wire = WireSession::try_from(&session()).unwrap();
        wire.joint_streams[0] = 5;
        assert!(Session::try_from(&wire).is_err());
        wire.joint_count = 1000;
        assert!(Session::try_from(&wire).is_err());
    }
}

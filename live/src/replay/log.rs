//! The samples of a log that a machine's monitor needs.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use tipwatch_binding::{BoundLog, MachineFile, Urdf, arrivals, bind};
use tipwatch_ingest::{Losses, SensorRecording};
use tipwatch_mechanics::machine::MountSource;
use tipwatch_mechanics::state::{NumberKind, Sample, Sensor};

use crate::wire::identity::new_identity;
use crate::wire::session::{Session, StampClock, machine_hash};

/// The samples of a machine's sensors in a log.
#[derive(Debug)]
pub struct LogSamples {
    /// The session to announce. Its identity is not set.
    pub session: Session,
    /// Losses of the log.
    pub losses: Losses,
    sensors: Vec<Sensor>,
    columns: Vec<SensorRecording>,
}

impl LogSamples {
    /// Reads the samples of the sensors that the machine file binds to.
    ///
    /// # Errors
    /// The log cannot be read, a signal is missing or ambiguous, or the machine does not match the log.
    pub fn read(path: &Path, file: &MachineFile, urdf: Option<&Path>) -> Result<Self> {
        let log = file.open_log(path)?;
        let urdf = file.urdf(urdf, Some(&log))?;
        let bound = bind(&log, &file.spec, &urdf.text, &urdf.name)?;
        let mut session = session_of(&bound, file, &urdf)?;
        let sensors = bound.all().map(|b| b.sensor).collect();
        let (columns, losses) = bound.record(&log, &mut |_| {})?;
        session.total_samples = columns.iter().map(|c| c.stamps_ns.len() as u64).sum();
        session.wants_progress = true;
        // an error that every reader would meet is reported here
        session.machine(file, &urdf)?;
        let mut log_samples = Self {
            session,
            losses,
            sensors,
            columns,
        };
        log_samples.session.clock = log_samples.clock();
        Ok(log_samples)
    }

    /// Estimates the offset between the sensors' clock and that of the recorder: nobody knows it, so the smallest delay of all
    /// samples counts as none.
    fn clock(&self) -> StampClock {
        let delays =
            (self.samples()).map(|(sample, log_ns)| log_ns.saturating_sub(sample.stamp_ns));
        let least_ns = delays.min().unwrap_or(0);
        let first_ns = self
            .samples()
            .next()
            .map_or(0, |(_, log_time_ns)| log_time_ns);
        StampClock {
            stamp_ns: first_ns.saturating_sub(least_ns),
            host_ns: first_ns,
        }
    }

    /// The samples and their log times (ns), in the order in which the recorder received them.
    pub fn samples(&self) -> impl Iterator<Item = (Sample<'_>, i64)> {
        let signals: Vec<_> = self.sensors.iter().copied().zip(&self.columns).collect();
        arrivals(signals)
    }

    /// Gives the session a new identity: two replays of one log are two sessions.
    pub fn set_identity(&mut self) {
        self.session.id = new_identity(self.session.machine_hash);
    }
}

/// The session of a machine whose sensors are bound to topics, at their own speed and without identity and clock.
///
/// # Errors
/// Only a topic that a monitor does not see tells where the IMU is.
pub fn session_of(bound: &BoundLog, file: &MachineFile, urdf: &Urdf) -> Result<Session> {
    let (machine, matched) = (&bound.machine, &bound.matched);
    // a monitor does not see /tf_static and would assume another mounting
    ensure!(
        !matches!(machine.imu().source, MountSource::StaticTransform { .. }),
        "{}: the IMU's mounting is known only from {}; expected [imu] in the machine file for live use",
        file.path.display(),
        machine.imu().source
    );
    // nor the frames of messages, but the IMU's
    let other_frame = machine
        .tool()
        .map(|tool| &tool.source)
        .filter(|it| **it != MountSource::MachineFile);
    if let Some(source) = other_frame {
        bail!(
            "{}: the wrench of the tool is in the axes of {source}; expected those of arm.tool for live use",
            file.path.display(),
        );
    }
    let mut actuated_joints: Vec<u32> = (matched.sensors.actuators.iter())
        .map(|signal| signal.joint as u32)
        .collect();
    actuated_joints.dedup();
    let beside = |kind: NumberKind| {
        let sensors = bound.beside.iter().map(|it| it.sensor);
        let of_kind = sensors.filter_map(|sensor| match sensor {
            Sensor::Number(of, index) if of == kind => Some(index as u32),
            _ => None,
        });
        of_kind.collect()
    };
    let joints = 0..matched.streams.len();
    Ok(Session {
        id: 0,
        machine_hash: machine_hash(file, urdf),
        total_samples: 0,
        streams: joints
            .map(|stream| matched.joint_names(machine, stream))
            .collect(),
        pace: 1.0,
        clock: StampClock::default(),
        wants_progress: false,
        imu: matched.sensors.imu,
        odometry: matched.sensors.odometry,
        tool_wrench: matched.sensors.tool_wrench,
        actuated_joints,
        switches: beside(NumberKind::Switch),
        load_sensors: beside(NumberKind::Load),
        joint_commands: beside(NumberKind::Command),
        payload_signals: beside(NumberKind::Payload),
        force_signals: beside(NumberKind::Force),
        imu_frame: bound.topics.imu_frame.clone(),
    })
}

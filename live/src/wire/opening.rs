//! Opening a session: it must be of this machine, and have every sensor that the machine file binds.

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{LogFacts, MachineError, NoteKind, QuasiStaticMode};
use tipwatch_mechanics::state::{JointStream, MatchedSensors, OtherSensors, Sensors};

use crate::wire::refusal::{Refusal, SessionRefused};
use crate::wire::session::{Session, machine_hash};
use crate::wire::topics::WireSession;

/// Whether sessions whose clock is unrelated to real time are followed: no delay can be checked in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Untimed {
    /// They are refused.
    #[default]
    Refused,
    /// They are followed: only replays are.
    Allowed,
}

/// Reads an announced session, and checks that it is of this machine.
///
/// # Errors
/// The message is damaged, or the session is refused: see [`SessionRefused::of`].
pub fn open_session(
    announced: &WireSession,
    file: &MachineFile,
    urdf: &Urdf,
    untimed: Untimed,
) -> Result<(Session, Machine, Sensors)> {
    let session = Session::try_from(announced)
        .map_err(|error| Refusal::Damaged.because(format!("{error:#}")))?;
    let (machine, sensors) = session.machine(file, urdf)?;
    if machine.quasi_static().mode == QuasiStaticMode::Always {
        bail!(Refusal::Unsuitable.because(format!(
            "quasi_static.mode: expected \"auto\" or \"never\" for a monitor, found \"always\": static rows are computed offline, where the next sample is known; live, every sensor must be sampled at least every {} s (estimator.max_gap)",
            machine.estimator().max_gap
        )));
    }
    if session.pace == 0.0 && untimed == Untimed::Refused {
        bail!(Refusal::Untimed.because(
            "session: expected a clock in real time, found pace 0; a monitor of a replay as fast as possible needs --allow-untimed"
        ));
    }
    Ok((session, machine, sensors))
}

impl Session {
    /// The machine and its sensors, as the producer has them. Every sensor that the machine file binds must be
    /// there.
    ///
    /// # Errors
    /// The session is of another machine, lacks a sensor or contradicts the machine file.
    pub fn machine(&self, file: &MachineFile, urdf: &Urdf) -> Result<(Machine, Sensors)> {
        let hash = machine_hash(file, urdf);
        if hash != self.machine_hash {
            bail!(Refusal::OtherMachine.because(format!(
                "{}: expected the machine of the session, hash {:016x}, found hash {hash:016x} with URDF {}",
                file.path.display(),
                self.machine_hash,
                urdf.name
            )));
        }
        self.check_bound_signals(file)?;
        let names: Vec<String> = self.streams.concat();
        let facts = LogFacts {
            joint_names: Some(&names),
            lacks_imu: !self.imu,
            imu_frame: self.imu_frame.as_deref(),
            // a session gives it in the frame of the tool's link
            tool_wrench_frame: None,
            static_transforms: &[],
        };
        let checked = file.spec.check(&urdf.text, &urdf.name, facts);
        let mut machine = checked.map_err(|error| match error {
            MachineError::UnmeasuredJoints { .. } => Refusal::Joints.because(error.to_string()),
            _ => Refusal::Unsuitable.because(error.to_string()),
        })?;
        let mut payloads = machine.payloads().iter();
        if payloads.any(|payload| payload.is_estimated && payload.lift.is_none()) {
            bail!(Refusal::Unsuitable.because(format!(
                "{}: payload with mass = \"estimate\": expected force or pressure on a [[linkage]] that carries it, found neither",
                file.spec.file
            )));
        }
        machine.weigh_payloads_by_row();
        if let Some(which) = machine.supports().told_by_spans() {
            bail!(Refusal::Unsuitable.because(format!(
                "{}: {which}: expected true, false or a signal that tells of it for live use, found spans of time, which are those of one log (tipwatch analyze)",
                file.spec.file
            )));
        }
        self.check_imu_mounting(file, &machine)?;
        let sensors = self.sensors(&machine)?;
        if !sensors.tool_wrench {
            machine.leave_out_tool();
        }
        // on supports that come and go, each set of them has its own
        if !machine.supports().vary() {
            machine.set_reference_loads()?;
        }
        Ok((machine, sensors))
    }

    /// Signals that the machine file binds are required.
    fn check_bound_signals(&self, file: &MachineFile) -> Result<(), SessionRefused> {
        let (spec, signals) = (&file.spec, &file.spec.signals);
        let has_tool = spec.arm.as_ref().is_some_and(|arm| arm.tool.is_some());
        let needed = [
            ("imu", signals.imu.is_some() || spec.imu.is_some(), self.imu),
            ("odometry", signals.odometry.is_some(), self.odometry),
            (
                "tool wrench",
                signals.tool_wrench.is_some() && has_tool,
                self.tool_wrench,
            ),
        ];
        let mut missing: Vec<String> = (needed.into_iter())
            .filter(|(_, is_needed, is_there)| *is_needed && !is_there)
            .map(|(name, ..)| name.to_string())
            .collect();
        let is_there = |joint: &String| self.streams.iter().flatten().any(|name| name == joint);
        let bound = signals.joints.iter();
        let bound = bound.filter(|(joint, fields)| fields.position.is_some() && !is_there(joint));
        missing.extend(bound.map(|(joint, _)| format!("joint \"{joint}\"")));
        if !missing.is_empty() {
            return Err(Refusal::SensorMissing.because(format!(
                "session: expected every sensor that {} binds, found no {}",
                spec.file,
                missing.join(", no ")
            )));
        }
        if self.tool_wrench && !has_tool {
            return Err(Refusal::SensorUnknown.because(format!(
                "session: expected no tool wrench, because {} has no arm.tool, found one",
                spec.file
            )));
        }
        Ok(())
    }

    /// Live, nothing but the machine file and the URDF tells where the IMU is.
    fn check_imu_mounting(
        &self,
        file: &MachineFile,
        machine: &Machine,
    ) -> Result<(), SessionRefused> {
        if !self.imu {
            return Ok(());
        }
        let mut notes = machine.notes().iter();
        if let Some(conflict) = notes.find(|note| note.kind == NoteKind::ImuMountingConflict) {
            return Err(Refusal::ImuMounting.because(format!("session: {conflict}")));
        }
        let frame = self.imu_frame.as_deref().unwrap_or("");
        let frame = frame.trim_start_matches('/');
        let is_link = machine.links().iter().any(|link| link.name == frame);
        if file.spec.imu.is_none() && !is_link {
            return Err(Refusal::ImuMounting.because(format!(
                "session: expected the mounting of the IMU in [imu] of {} or its frame in the URDF, found frame \"{frame}\"",
                file.spec.file
            )));
        }
        Ok(())
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
        let joints = |text: String| Refusal::Joints.because(text);
        let matched = MatchedSensors::new(machine, &streams, others);
        let mut sensors = matched.map_err(|error| joints(error.to_string()))?.sensors;
        // in the order of the session's values, not in the machine's
        sensors.joints.clear();
        for names in &self.streams {
            let found = names.iter().map(|name| joint_of(machine, name));
            let found: Vec<usize> = found.collect::<Result<_, _>>()?;
            let is_again = |place: usize| found[..place].contains(&found[place]);
            if let Some(place) = (0..found.len()).find(|&place| is_again(place)) {
                let joint = &names[place];
                bail!(joints(format!(
                    "session: joint \"{joint}\" twice in one stream"
                )));
            }
            sensors.joints.push(JointStream { joints: found });
        }
        if sensors.joints.is_empty() {
            bail!(joints(
                "session: expected joint states, found none".to_string()
            ));
        }
        self.check_actuators(machine)?;
        self.check_switches(machine)?;
        self.check_load_sensors(machine)?;
        self.check_joint_commands(machine)?;
        self.check_payload_signals(machine)?;
        let is_there = |joint: usize| self.actuated_joints.contains(&(joint as u32));
        sensors.actuators = machine.contact().actuator_signals(is_there);
        Ok(sensors)
    }

    /// The forces of exactly those joints are measured for which the machine file binds a force or pressures.
    fn check_actuators(&self, machine: &Machine) -> Result<(), SessionRefused> {
        let bound = &machine.contact().actuated_joints;
        let mut missing = (0..bound.len()).filter(|&k| !self.actuated_joints.contains(&(k as u32)));
        if let Some(k) = missing.next() {
            let linkage = bound[k].name(machine.linkages());
            return Err(Refusal::SensorMissing.because(format!(
                "session: expected the bound force or pressures of \"{linkage}\", found none"
            )));
        }
        let mut unknown = self.actuated_joints.iter();
        match unknown.find(|&&k| k as usize >= bound.len()) {
            None => Ok(()),
            Some(k) => Err(Refusal::SensorUnknown.because(format!(
                "session: expected the forces of no more than {} actuated joints, found one of joint {k}",
                bound.len()
            ))),
        }
    }

    /// All signals are there that tell which supports are on the ground, and no others.
    fn check_switches(&self, machine: &Machine) -> Result<(), SessionRefused> {
        let supports = machine.supports();
        let is_there = |index: usize| self.switches.contains(&(index as u32));
        let mut bound = supports.switches.iter().enumerate();
        if let Some((_, switch)) = bound.find(|(index, _)| !is_there(*index)) {
            return Err(Refusal::SensorMissing.because(format!(
                "session: expected the bound signal that tells of support {}, found none",
                supports.names(&switch.supports)
            )));
        }
        no_more_than(
            &self.switches,
            supports.switches.len(),
            "signals that tell of supports",
        )
    }

    /// No joint is asked to move that the machine file does not name. What is not asked for is not known.
    fn check_joint_commands(&self, machine: &Machine) -> Result<(), SessionRefused> {
        no_more_than(
            &self.joint_commands,
            machine.joint_commands().len(),
            "commands of joints",
        )
    }

    /// All signals are there that tell masses of payloads, and no others.
    fn check_payload_signals(&self, machine: &Machine) -> Result<(), SessionRefused> {
        let bound = machine.payload_signals();
        let is_there = |index: usize| self.payload_signals.contains(&(index as u32));
        if let Some(missing) = (0..bound.len()).find(|index| !is_there(*index)) {
            return Err(Refusal::SensorMissing.because(format!(
                "session: expected the bound signal {} that tells the mass of a payload, found none",
                bound[missing].field.topic
            )));
        }
        no_more_than(
            &self.payload_signals,
            bound.len(),
            "signals that tell masses of payloads",
        )
    }

    /// All load sensors are there, and no others.
    fn check_load_sensors(&self, machine: &Machine) -> Result<(), SessionRefused> {
        let bound = machine.load_sensors();
        let is_there = |index: usize| self.load_sensors.contains(&(index as u32));
        if let Some(missing) = (0..bound.len()).find(|index| !is_there(*index)) {
            return Err(Refusal::SensorMissing.because(format!(
                "session: expected the bound load sensor {}, found none",
                bound[missing].name
            )));
        }
        no_more_than(&self.load_sensors, bound.len(), "load sensors")
    }
}

/// No signal has an index that the machine does not know.
fn no_more_than(found: &[u32], known: usize, of: &str) -> Result<(), SessionRefused> {
    match found.iter().find(|&&it| it as usize >= known) {
        None => Ok(()),
        Some(it) => Err(Refusal::SensorUnknown.because(format!(
            "session: expected no more than {known} {of}, found one with index {it}"
        ))),
    }
}

fn joint_of(machine: &Machine, name: &str) -> Result<usize, SessionRefused> {
    let joints = machine.joints();
    let place = joints.iter().position(|joint| joint.name == name);
    place.ok_or_else(|| {
        let known: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        Refusal::Joints.because(format!(
            "session: expected joints of the machine ({}), found \"{name}\"",
            known.join(", ")
        ))
    })
}

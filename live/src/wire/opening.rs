//! Opening a session: it must be of this machine, and have every sensor that the machine file binds.

use anyhow::{Result, bail};
use tipwatch_binding::{MachineFile, Urdf};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::{LogFacts, MachineError, NoteKind, QuasiStaticMode};
use tipwatch_mechanics::state::{JointStream, MatchedSensors, OtherSensors, Sensors};

use crate::wire::refusal::{Refusal, SessionRefused};
use crate::wire::session::{Session, machine_hash};
use crate::wire::topics::WireSession;

/// Policy for sessions whose clock is unrelated to real time: no delay can be checked in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Untimed {
    /// Such sessions are refused.
    #[default]
    Refused,
    /// Such sessions are followed: all of them are replays.
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
        self.check_numbers(machine)?;
        let is_there = |joint: usize| self.actuated_joints.contains(&(joint as u32));
        sensors.actuators = machine.contact().actuator_signals(is_there);
        Ok(sensors)
    }

    /// All numbers are there that the machine file binds, and no others. What is not asked of a joint is not known.
    fn check_numbers(&self, machine: &Machine) -> Result<(), SessionRefused> {
        let joints = &machine.contact().actuated_joints;
        are_all(
            &self.actuated_joints,
            joints.len(),
            "actuated joints",
            |joint| {
                let name = joints[joint].name(machine.linkages());
                format!("force or pressures of \"{name}\"")
            },
        )?;
        let supports = machine.supports();
        let switches = &supports.switches;
        are_all(
            &self.switches,
            switches.len(),
            "signals that tell of supports",
            |switch| {
                format!(
                    "signal that tells of support {}",
                    supports.names(&switches[switch].supports)
                )
            },
        )?;
        let sensors = machine.load_sensors();
        are_all(
            &self.load_sensors,
            sensors.len(),
            "load sensors",
            |sensor| format!("load sensor {}", sensors[sensor].name),
        )?;
        let commands = machine.joint_commands();
        are_known(&self.joint_commands, commands.len(), "commands of joints")?;
        let payloads = machine.payload_signals();
        let of = "signals that tell masses of payloads";
        are_all(&self.payload_signals, payloads.len(), of, |signal| {
            format!(
                "signal {} that tells the mass of a payload",
                payloads[signal].field.topic
            )
        })?;
        let forces = machine.force_signals();
        let of = "signals of forces of the arm";
        are_all(&self.force_signals, forces.len(), of, |signal| {
            let linkage = &machine.linkages()[forces[signal].linkage];
            format!("force or pressures of \"{}\"", linkage.name)
        })
    }
}

/// Every index that the machine knows is there, and no other; `name` tells which signal an index is.
fn are_all(
    found: &[u32],
    known: usize,
    of: &str,
    name: impl Fn(usize) -> String,
) -> Result<(), SessionRefused> {
    match (0..known).find(|&index| !found.contains(&(index as u32))) {
        Some(index) => Err(Refusal::SensorMissing.because(format!(
            "session: expected the bound {}, found none",
            name(index)
        ))),
        None => are_known(found, known, of),
    }
}

/// No signal has an index that the machine does not know.
fn are_known(found: &[u32], known: usize, of: &str) -> Result<(), SessionRefused> {
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

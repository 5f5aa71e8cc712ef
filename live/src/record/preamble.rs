//! The beginning of every file: topics, machine and metadata.

use std::collections::BTreeMap;

use tipwatch_binding::{MachineFile, Urdf, monitor_topic};
use tipwatch_mechanics::Machine;
use tipwatch_mechanics::machine::PayloadQuantity;
use tipwatch_mechanics::state::{NumberKind, Sensor, Sensors};

use super::segment::{Channels, Preamble};
use super::topics;
use crate::wire::fingerprint::Fingerprint;
use crate::wire::names::Names;
use crate::wire::session::Session;

pub(super) fn preamble(
    file: &MachineFile,
    urdf: &Urdf,
    session: &Session,
    machine: &Machine,
    sensors: &Sensors,
    names: &Names,
    begun_ns: i64,
) -> Preamble {
    let mut topics: Vec<_> = sensors
        .all()
        .map(|sensor| match sensor {
            Sensor::Joints(stream) => topics::joint_states(stream),
            Sensor::Imu => topics::imu(),
            Sensor::Odometry => topics::odometry(),
            Sensor::ToolWrench => topics::tool_wrench(),
            Sensor::Number(kind, index) => {
                let name = match kind {
                    NumberKind::Actuator => actuator_topic(machine, sensors, index),
                    NumberKind::Switch => {
                        let supports = machine.supports();
                        let first = supports.switches[index].supports[0];
                        monitor_topic::switch(&supports.support(first).name)
                    }
                    NumberKind::Load => {
                        monitor_topic::load_sensor(&machine.load_sensors()[index].name)
                    }
                    NumberKind::Command => {
                        let joint = machine.joint_commands()[index].joint;
                        monitor_topic::joint_command(&machine.joints()[joint].name)
                    }
                    NumberKind::Payload => match machine.payload_signals()[index].quantity {
                        PayloadQuantity::Mass(payload) => monitor_topic::payload_mass(payload + 1),
                        PayloadQuantity::Lift { linkage, signal } => {
                            let name = signal_topic(file, linkage, signal);
                            return topics::number(NumberKind::Actuator, name);
                        }
                    },
                    NumberKind::Force => {
                        let force = &machine.force_signals()[index];
                        signal_topic(file, force.linkage, force.signal)
                    }
                };
                topics::number(kind, name)
            }
        })
        .collect();
    let channels = Channels {
        verdicts: topics.len(),
        commands: topics.len() + 1,
        gaps: topics.len() + 2,
        programs: topics.len() + 3,
    };
    topics.extend([
        topics::verdict(names),
        topics::command(),
        topics::gap(),
        topics::program(),
    ]);
    let metadata = BTreeMap::from([
        ("version".into(), env!("CARGO_PKG_VERSION").into()),
        ("machine".into(), file.spec.name.clone()),
        (
            "serial".into(),
            file.spec.serial.clone().unwrap_or_default(),
        ),
        ("session".into(), format!("{:016x}", session.id)),
        (
            "machine_hash".into(),
            format!("{:016x}", session.machine_hash),
        ),
        ("pace".into(), session.pace.to_string()),
        ("wheels".into(), names.wheels.join(" ")),
        ("edges".into(), names.edges.join(" ")),
    ]);
    let name = |path: &str| {
        let path = std::path::Path::new(path);
        path.file_name().map_or_else(
            || "machine".into(),
            |name| name.to_string_lossy().into_owned(),
        )
    };
    Preamble {
        topics,
        channels,
        attachments: [
            (
                name(&file.path.to_string_lossy()),
                file.effective_text().into_owned(),
            ),
            (name(&urdf.name), urdf.text.clone()),
        ],
        metadata,
        begun_ns,
    }
}

impl Preamble {
    /// Adds the fingerprint of the recorder to the metadata.
    pub(super) fn by(mut self, recorder: &Fingerprint) -> Self {
        let entries = recorder.entries().into_iter();
        let named = entries.map(|(name, value)| (format!("recorder_{name}"), value));
        self.metadata.extend(named);
        self
    }
}

/// Topic of a force or pressure signal of an actuator.
fn actuator_topic(machine: &Machine, sensors: &Sensors, signal: usize) -> String {
    let signal = sensors.actuators[signal];
    let joint = &machine.contact().actuated_joints[signal.joint];
    let linkage = joint.name(machine.linkages());
    if joint.linkage().is_none() {
        return monitor_topic::support_load(linkage);
    }
    force_topic(linkage, joint.signals.len(), signal.signal)
}

/// Topic of a signal of a linkage's force that enters no equation of the loads.
fn signal_topic(file: &MachineFile, linkage: usize, signal: usize) -> String {
    let linkage = &file.spec.linkage[linkage];
    force_topic(&linkage.name, file.spec.signals_of(linkage).len(), signal)
}

/// Topic of one of so many signals of a linkage's force.
fn force_topic(linkage: &str, signals: usize, signal: usize) -> String {
    match (signals, signal) {
        (1, _) => monitor_topic::force(linkage),
        (_, 0) => monitor_topic::piston_pressure(linkage),
        _ => monitor_topic::rod_pressure(linkage),
    }
}

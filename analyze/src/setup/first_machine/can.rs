//! CAN (controller area network) messages of a log as topics, and how a machine file names their signals.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::Result;
use tipwatch_can::CanId;
use tipwatch_can::j1939::Identifier;
use tipwatch_ingest::{CanTopic, Log};
use tipwatch_mechanics::machine::{CanMessageSpec, CanSpec};

use super::text::{Text, quoted};
use super::urdf::beside;
use super::words::is_no_position;
use crate::setup::inspect::{Described, Reading, message_of, reading_of};

/// The public parameter groups of an inertial measurement unit: acceleration and angular rate.
const ACCELERATION: u32 = 61485;
const ANGULAR_RATE: u32 = 61482;
/// The public parameter groups of wheel speeds and of weights.
const SPEEDS: [(u32, &str); 2] = [
    (65265, "wheel_based_vehicle_speed"),
    (65215, "front_axle_speed"),
];
const VEHICLE_WEIGHT: u32 = 65258;
/// Buses have some hundreds of identifiers.
const MOST_IDS: usize = 2048;
/// A signal that changes less does not show a joint that moves (rad or m).
const LEAST_MOTION: f64 = 0.01;

/// The described messages of the buses of a log, which are topics now.
#[derive(Debug, Default)]
pub(super) struct CanMessages {
    by_topic: BTreeMap<String, CanMessage>,
}

/// A message.
#[derive(Debug)]
struct CanMessage {
    /// `pgn = 61485, source = 33`, or `dbc = "crane.dbc", message = "Joint_lift"`, after the bus if there are several.
    keys: String,
    pgn: Option<u32>,
    source: Option<u8>,
    /// Signals whose values are in SI units by their description.
    converted: BTreeSet<String>,
    /// Those of them of a DBC file that change.
    moving: Vec<Moving>,
}

/// A signal that changes.
#[derive(Debug)]
struct Moving {
    signal: String,
    unit: String,
    /// Its least and its greatest number.
    span: [f64; 2],
}

/// A signal that may be the position of a joint, by unit and motion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    /// The table of its keys.
    pub(super) text: String,
    pub(super) signal: String,
    /// Its least and its greatest number (rad or m).
    pub(super) span: [f64; 2],
}

impl CanMessages {
    /// Makes every message that a DBC file or a public parameter group describes a topic of its own. DBC files are named
    /// relative to the folder of the machine file.
    ///
    /// # Errors
    /// The log cannot be read.
    pub(super) fn decode(log: &mut Log, databases: &[Described], out: &Path) -> Result<Self> {
        let buses: Vec<_> = log
            .can_buses()
            .map(|bus| (bus.id, bus.name.clone()))
            .collect();
        let mut found = Self::default();
        let mut topics = Vec::new();
        for (id, name) in &buses {
            let mut seen: BTreeMap<CanId, Option<Reading>> = BTreeMap::new();
            log.read_can_frames(*id, &mut |frame| {
                if seen.len() < MOST_IDS {
                    seen.entry(frame.id)
                        .or_insert_with(|| reading_of(frame.id, databases));
                }
                if let Some(Some(reading)) = seen.get_mut(&frame.id) {
                    reading.take(frame);
                }
            })?;
            let bus = (buses.len() > 1).then(|| name.clone());
            for (id, reading) in seen {
                let Some((path, message)) = message_of(id, databases) else {
                    continue;
                };
                let group = Identifier::of(id);
                let spec = CanSpec {
                    bus: bus.clone(),
                    message: match path {
                        Some(path) => CanMessageSpec::Dbc {
                            file: beside(path, out),
                            message: message.name.clone(),
                        },
                        None => CanMessageSpec::ParameterGroup(message.pgn().unwrap_or_default()),
                    },
                    source: group
                        .filter(|_| message.pgn().is_some())
                        .map(|group| group.source),
                    signal: String::new(),
                };
                let topic = spec.topic();
                if found.by_topic.contains_key(&topic) {
                    continue;
                }
                let of_file = reading.iter().filter(|_| path.is_some());
                let moving = of_file
                    .flat_map(Reading::spans)
                    .filter_map(moving)
                    .collect();
                let converted = message.signals.iter().filter(|signal| signal.is_converted);
                let known = CanMessage {
                    keys: keys(&spec),
                    pgn: message.pgn(),
                    source: spec.source,
                    converted: converted.map(|signal| signal.name.clone()).collect(),
                    moving,
                };
                found.by_topic.insert(topic.clone(), known);
                topics.push(CanTopic {
                    name: topic,
                    bus: bus.clone(),
                    source: spec.source,
                    message,
                    notes: Vec::new(),
                });
            }
        }
        log.decode_can(&topics)?;
        Ok(found)
    }

    /// How a machine file names a field, and whether it is in SI units by its description; `None` if its topic is no CAN
    /// message.
    pub(super) fn field(&self, topic: &str, field: &str) -> Option<(String, bool)> {
        let message = self.by_topic.get(topic)?;
        let text = format!("{}, signal = {}", message.keys, quoted(field));
        Some((text, message.converted.contains(field)))
    }

    /// The signals of this unit that change, but for rates and forces by their names.
    pub(super) fn candidates(&self, unit: &str) -> Vec<Candidate> {
        let all = self.by_topic.values().flat_map(|message| {
            let moving = message.moving.iter().filter(|it| it.unit == unit);
            moving.map(|it| Candidate {
                text: format!("{{ {}, signal = {} }}", message.keys, quoted(&it.signal)),
                signal: it.signal.clone(),
                span: it.span,
            })
        });
        all.filter(|it| !is_no_position(&it.signal)).collect()
    }

    fn of_group(&self, pgn: u32) -> impl Iterator<Item = &CanMessage> {
        let messages = self.by_topic.values();
        messages.filter(move |message| message.pgn == Some(pgn))
    }

    /// Whether the log has an IMU on a bus.
    pub(super) fn has_imu(&self) -> bool {
        self.of_group(ACCELERATION).next().is_some()
    }

    /// Writes the IMU of `[signals]`, if a bus has one.
    pub(super) fn write_imu(&self, text: &mut Text) {
        let Some(acceleration) = self.of_group(ACCELERATION).next() else {
            return;
        };
        text.comment(
            "Parameter groups of SAE J1939. It does not fix the signs in the axes of the machine: CHECK them on a log \
             whose slope you know, and use scale = -1 where an axis is turned.",
        );
        let signals = [
            "longitudinal_acceleration",
            "lateral_acceleration",
            "vertical_acceleration",
        ];
        text.line(&triple("imu.specific_force", acceleration, signals));
        // the rates of the same sensor, if it has some
        let mut rates = self.of_group(ANGULAR_RATE);
        let same = rates.find(|message| message.source == acceleration.source);
        match same.or_else(|| self.of_group(ANGULAR_RATE).next()) {
            Some(rates) => {
                let signals = ["roll_rate", "pitch_rate", "yaw_rate"];
                text.line(&triple("imu.angular_velocity", rates, signals));
            }
            None => {
                text.comment(
                    "Needed: its angular velocity (rad/s), which no described message has.",
                );
                text.open(
                    "imu.angular_velocity = [ { pgn = 61482, signal = \"roll_rate\" }, ... ]",
                );
            }
        }
    }

    /// Writes the velocity of `[signals]`, if a bus has the speed of the wheels.
    pub(super) fn write_speed(&self, text: &mut Text) {
        let mut speeds = SPEEDS.iter();
        let Some((speed, signal)) =
            speeds.find_map(|&(pgn, signal)| Some((self.of_group(pgn).next()?, signal)))
        else {
            return;
        };
        text.comment(
            "Speed by the wheels, which has no sign: right where the machine only drives forward.",
        );
        text.open(&format!(
            "odometry.velocity = [ {{ {}, signal = {} }}, 0, 0 ]",
            speed.keys,
            quoted(signal)
        ));
    }

    /// Writes payload and axle loads that a bus has, to be completed.
    pub(super) fn write_weights(&self, text: &mut Text) {
        let Some(weight) = self.of_group(VEHICLE_WEIGHT).next() else {
            return;
        };
        let keys = &weight.keys;
        text.gap().comment(
            "The bus has weights. A payload as weighed, with the link that carries it and its standard deviation (kg):",
        );
        text.open(&format!(
            "[[payload]]\nlink = \"tool\"\nmass = {{ signal = {{ {keys}, signal = \"cargo_weight\" }}, max_age = 15.0 }}\nmass_sigma = 50.0"
        ));
        text.comment("Loads of axles, for comparison (N; weights of the bus are in kg):");
        text.open(&format!(
            "[[signals.load_sums]]\nwheels = [\"FL\", \"FR\"]\nload = {{ {keys}, signal = \"axle_1_weight\", scale = 9.80665 }}"
        ));
    }
}

fn moving((signal, unit, span): (&str, &str, [f64; 2])) -> Option<Moving> {
    (span[1] - span[0] >= LEAST_MOTION).then(|| Moving {
        signal: signal.to_owned(),
        unit: unit.to_owned(),
        span,
    })
}

fn keys(spec: &CanSpec) -> String {
    let bus = spec
        .bus
        .as_ref()
        .map(|bus| format!("topic = {}, ", quoted(bus)));
    let source = spec.source.map(|source| format!(", source = {source}"));
    let message = match &spec.message {
        CanMessageSpec::ParameterGroup(pgn) => format!("pgn = {pgn}"),
        CanMessageSpec::Dbc { file, message } => {
            format!("dbc = {}, message = {}", quoted(file), quoted(message))
        }
    };
    format!(
        "{}{message}{}",
        bus.unwrap_or_default(),
        source.unwrap_or_default()
    )
}

fn triple(key: &str, message: &CanMessage, signals: [&str; 3]) -> String {
    let of = |signal: &str| format!("{{ {}, signal = {} }}", message.keys, quoted(signal));
    format!("{key} = [ {} ]", signals.map(of).join(", "))
}

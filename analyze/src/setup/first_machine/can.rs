//! CAN (controller area network) messages of a log as topics, and how a machine file names their signals.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use tipwatch_can::j1939::Identifier;
use tipwatch_can::{CanId, Message};
use tipwatch_ingest::{CanTopic, Log};
use tipwatch_mechanics::machine::{CanMessageSpec, CanSpec};

use super::text::{Text, number, quoted};
use super::urdf::beside;
use super::words::{is_no_position, words};
use crate::setup::inspect::{Described, KnownSignal, MOST_IDS, Reading, descriptions_of};

/// The public parameter groups of an inertial measurement unit: acceleration and angular rate.
const ACCELERATION: u32 = 61485;
const ACCELERATIONS: [&str; 3] = [
    "longitudinal_acceleration",
    "lateral_acceleration",
    "vertical_acceleration",
];
const ANGULAR_RATE: u32 = 61482;
const RATES: [&str; 3] = ["roll_rate", "pitch_rate", "yaw_rate"];
/// The public parameter groups of wheel speeds, the best first, each with its signal and the meaning of the speed.
const SPEEDS: [(u32, &str, &str); 3] = [
    (65265, "wheel_based_vehicle_speed", "Speed by the wheels"),
    (65215, "front_axle_speed", "Speed of the front axle"),
    (
        65134,
        "front_left_wheel_speed",
        "Speed of one wheel, which in a turn is not that of the machine",
    ),
];
const VEHICLE_WEIGHT: u32 = 65258;
const CARGO: &str = "cargo_weight";
/// Weights are sent every 10 s (s).
const MASS_MAX_AGE: f64 = 15.0;
/// A signal that changes less does not show a joint that moves (rad or m).
const LEAST_MOTION: f64 = 0.01;
/// Words for the load on the tool, and for masses that are something else.
const LOAD: [&str; 8] = [
    "load", "payload", "hookload", "cargo", "weight", "mass", "scale", "lmi",
];
const NO_LOAD: [&str; 29] = [
    "axle",
    "wheel",
    "front",
    "rear",
    "left",
    "right",
    "tare",
    "gross",
    "max",
    "maximum",
    "min",
    "minimum",
    "rated",
    "permissible",
    "permitted",
    "allowed",
    "allowable",
    "limit",
    "capacity",
    "counterweight",
    "ballast",
    "vehicle",
    "machine",
    "trailer",
    "preset",
    "jack",
    "command",
    "target",
    "setpoint",
];

/// The described messages of the buses of a log, which are topics now.
#[derive(Debug, Default)]
pub(super) struct CanMessages {
    by_topic: BTreeMap<String, CanMessage>,
}

/// A message.
#[derive(Debug)]
struct CanMessage {
    name: String,
    /// `pgn = 61485, source = 33`, or `dbc = "crane.dbc", message = "Joint_lift"`, after the bus if there are several.
    keys: String,
    /// Public parameter group of the message; `None` if a DBC file describes it.
    group: Option<u32>,
    source: Option<u8>,
    signals: Vec<KnownSignal>,
}

/// A signal of a bus that a machine file may name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    /// The table of its keys.
    pub(super) text: String,
    pub(super) message: String,
    pub(super) signal: String,
    /// Its least and its greatest number (rad, m or kg).
    pub(super) span: [f64; 2],
}

impl Candidate {
    /// Whether the signal shows a motion (rad or m).
    pub(super) fn moves(&self) -> bool {
        self.span[1] - self.span[0] >= LEAST_MOTION
    }
}

/// A signal of a bus as the field of a topic.
pub(super) struct CanField<'a> {
    /// Keys of the machine file that name the signal.
    pub(super) source: String,
    pub(super) signal: &'a KnownSignal,
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
            let mut seen: BTreeMap<CanId, Vec<Of>> = BTreeMap::new();
            log.read_can_frames(*id, &mut |frame| {
                if seen.len() < MOST_IDS {
                    seen.entry(frame.id)
                        .or_insert_with(|| Of::all(frame.id, databases));
                }
                for of in seen.get_mut(&frame.id).into_iter().flatten() {
                    of.reading.take(frame);
                }
            })?;
            let bus = (buses.len() > 1).then(|| name.clone());
            let all = seen.into_iter();
            for (id, of) in all.flat_map(|(id, all)| all.into_iter().map(move |of| (id, of))) {
                let message = of.message;
                let spec = CanSpec {
                    bus: bus.clone(),
                    message: match of.file {
                        Some(path) => CanMessageSpec::Dbc {
                            file: beside(path, out),
                            message: message.name.clone(),
                        },
                        None => CanMessageSpec::ParameterGroup(message.pgn().unwrap_or_default()),
                    },
                    source: Identifier::of(id)
                        .filter(|_| message.pgn().is_some())
                        .map(|group| group.source),
                    signal: String::new(),
                };
                let topic = spec.topic();
                if found.by_topic.contains_key(&topic) {
                    continue;
                }
                let known = CanMessage {
                    name: message.name.clone(),
                    keys: keys(&spec),
                    group: message.pgn().filter(|_| of.file.is_none()),
                    source: spec.source,
                    signals: of.reading.known().collect(),
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

    /// A field of a topic, if that is a CAN message.
    pub(super) fn field(&self, topic: &str, field: &str) -> Option<CanField<'_>> {
        let message = self.by_topic.get(topic)?;
        Some(CanField {
            source: format!("{}, signal = {}", message.keys, quoted(field)),
            signal: message.signal(field)?,
        })
    }

    /// The signals of DBC files that may be a position of this unit: with numbers, and neither rates, forces nor commands by
    /// their names.
    pub(super) fn positions(&self, unit: &str) -> Vec<Candidate> {
        let mut all = self.of_unit(unit);
        all.retain(|it| !is_no_position(&it.signal));
        all
    }

    /// The signals of DBC files that have numbers of this unit.
    fn of_unit(&self, unit: &str) -> Vec<Candidate> {
        let of_files = self.by_topic.values().filter(|it| it.group.is_none());
        let all = of_files.flat_map(|message| {
            let of_unit = message
                .signals
                .iter()
                .filter(|it| it.is_si && it.unit == unit);
            of_unit.filter_map(|it| {
                Some(Candidate {
                    text: format!("{{ {}, signal = {} }}", message.keys, quoted(&it.name)),
                    message: message.name.clone(),
                    signal: it.name.clone(),
                    span: it.span?,
                })
            })
        });
        all.collect()
    }

    /// The messages of a public parameter group with numbers of all these signals.
    fn of_group(&self, pgn: u32, signals: &[&str]) -> impl Iterator<Item = &CanMessage> {
        let messages = self.by_topic.values();
        let messages = messages.filter(move |message| message.group == Some(pgn));
        messages.filter(|message| signals.iter().all(|signal| message.has_numbers(signal)))
    }

    fn accelerations(&self) -> impl Iterator<Item = &CanMessage> {
        self.of_group(ACCELERATION, &ACCELERATIONS)
    }

    /// Whether the log has an IMU on a bus.
    pub(super) fn has_imu(&self) -> bool {
        self.accelerations().next().is_some()
    }

    /// Writes the IMU of `[signals]`, if a bus has one.
    pub(super) fn write_imu(&self, text: &mut Text) {
        let Some(acceleration) = self.accelerations().next() else {
            return;
        };
        text.comment(
            "Parameter groups of SAE J1939. It does not fix the signs in the axes of the machine: CHECK them on a log \
             whose slope you know, and use scale = -1 where an axis is turned.",
        );
        let others = self.accelerations().skip(1);
        let others: Vec<&str> = others.map(|message| message.keys.as_str()).collect();
        if !others.is_empty() {
            text.comment(&format!(
                "CHECK which sensor it is; accelerations are also in: {}.",
                others.join("; ")
            ));
        }
        text.line(&triple("imu.specific_force", acceleration, ACCELERATIONS));
        // the rates of the same sensor, if it has some
        let mut rates = self.of_group(ANGULAR_RATE, &RATES);
        let same = rates.find(|message| message.source == acceleration.source);
        match same.or_else(|| self.of_group(ANGULAR_RATE, &RATES).next()) {
            Some(rates) => {
                text.line(&triple("imu.angular_velocity", rates, RATES));
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
        let Some((speed, signal, what)) = speeds.find_map(|&(pgn, signal, what)| {
            Some((self.of_group(pgn, &[signal]).next()?, signal, what))
        }) else {
            return;
        };
        text.comment(&format!(
            "{what}. It has no sign: right where the machine only drives forward."
        ));
        text.open(&format!(
            "odometry.velocity = [ {{ {}, signal = {} }}, 0, 0 ]",
            speed.keys,
            quoted(signal)
        ));
    }

    /// Writes payload and axle loads that a bus has, to be completed; `tool` is the link that carries the load.
    pub(super) fn write_weights(&self, text: &mut Text, tool: Option<&str>) {
        let loads = self.loads();
        if !loads.is_empty() {
            text.gap().comment(
                "The bus has the mass of a load. A payload as weighed, with the link that carries it and its standard \
                 deviation (kg). CHECK that the signal is what hangs or lies on that link, and nothing else:",
            );
            let mass = |load: &Candidate| {
                format!(
                    "mass = {{ signal = {}, max_age = {MASS_MAX_AGE:?} }}  # {} to {} kg in this log",
                    load.text,
                    number(load.span[0]),
                    number(load.span[1])
                )
            };
            let masses: Vec<String> = loads.iter().map(mass).collect();
            text.open(&format!(
                "[[payload]]\nlink = {}\n{}\nmass_sigma = 50.0",
                quoted(tool.unwrap_or("tool")),
                masses.join("\n")
            ));
        }
        for weight in self.of_group(VEHICLE_WEIGHT, &[]) {
            let axles = weight.signals.iter().filter(|signal| signal.span.is_some());
            let axles = axles.filter(|signal| signal.name.starts_with("axle_") && signal.is_si);
            for axle in axles {
                text.gap().comment(&format!(
                    "{} of the bus, for comparison (N; weights of the bus are in kg). Name the wheels of that axle:",
                    axle.name
                ));
                text.open(&format!(
                    "[[signals.load_sums]]\nwheels = [\"LEFT\", \"RIGHT\"]\nload = {{ {}, signal = {}, scale = 9.80665 }}",
                    weight.keys,
                    quoted(&axle.name)
                ));
            }
        }
    }

    /// Returns the candidates for the mass of the load: the cargo of the public group, and masses of DBC files by their names.
    fn loads(&self) -> Vec<Candidate> {
        let of_group = self
            .of_group(VEHICLE_WEIGHT, &[CARGO])
            .filter_map(|message| {
                Some(Candidate {
                    text: format!("{{ {}, signal = {} }}", message.keys, quoted(CARGO)),
                    message: message.name.clone(),
                    signal: CARGO.into(),
                    span: message.signal(CARGO)?.span?,
                })
            });
        let of_files = self.of_unit("kg").into_iter().filter(|it| {
            let has = |name: &str, wanted: &[&str]| {
                let mut words = words(name).into_iter();
                words.any(|word| wanted.contains(&word.as_str()))
            };
            (has(&it.signal, &LOAD) || has(&it.message, &LOAD)) && !has(&it.signal, &NO_LOAD)
        });
        of_files.chain(of_group).collect()
    }
}

impl CanMessage {
    fn signal(&self, name: &str) -> Option<&KnownSignal> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    fn has_numbers(&self, name: &str) -> bool {
        self.signal(name)
            .is_some_and(|signal| signal.span.is_some())
    }
}

/// A description of an identifier, and the message that it decodes.
struct Of<'a> {
    file: Option<&'a Path>,
    message: Message,
    reading: Reading,
}

impl<'a> Of<'a> {
    fn all(id: CanId, databases: &'a [Described]) -> Vec<Self> {
        let all = descriptions_of(id, databases).into_iter();
        all.map(|(file, message)| Self {
            reading: Reading::of(&message, file),
            file,
            message,
        })
        .collect()
    }
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

//! Guesses the log fields of joints whose names differ from the URDF.

use tipwatch_ingest::{Topic, number_fields};

use super::can::CanMessages;
use super::text::quoted;
use super::words::{OTHER, VELOCITY, own_words};

/// Units by word in a field name, with the factor to SI.
const UNITS: [(&str, f64); 8] = [
    ("deg", std::f64::consts::PI / 180.0),
    ("degree", std::f64::consts::PI / 180.0),
    ("degrees", std::f64::consts::PI / 180.0),
    ("mrad", 1e-3),
    ("mm", 1e-3),
    ("cm", 1e-2),
    ("rad", 1.0),
    ("m", 1.0),
];
const POSITION: [&str; 7] = [
    "position",
    "pos",
    "angle",
    "length",
    "stroke",
    "extension",
    "value",
];

/// Fields for a joint that has another name in the log.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointGuess {
    pub(super) joint: String,
    /// The fields of `[signals.joints.NAME]`, its position first.
    pub(super) fields: Vec<GuessedField>,
    pub(super) why: String,
    /// Whether unit, sign and zero are guesses that a person must confirm.
    pub(super) is_doubtful: bool,
}

/// A number of the log that a key of `[signals.joints.NAME]` may be.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GuessedField {
    key: &'static str,
    /// The keys that name it, such as `topic = "/arm", field = "lift_deg"`.
    pub(super) source: String,
    /// Factor from the number to SI units.
    pub(super) scale: f64,
    /// What is added then (rad or m, of a position).
    pub(super) offset: f64,
}

impl GuessedField {
    /// Its line of the machine file.
    pub(super) fn line(&self) -> String {
        let key = |name: &str, value: f64, default: f64| match value == default {
            true => String::new(),
            false => format!(", {name} = {value:?}"),
        };
        let scale = key("scale", self.scale, 1.0);
        let offset = key("offset", self.offset, 0.0);
        format!("{} = {{ {}{scale}{offset} }}", self.key, self.source)
    }
}

impl JointGuess {
    /// The same with another factor and offset of its position, as a person states them. Its velocity is in the same unit and
    /// has the same sign.
    pub(super) fn confirm(&mut self, scale: f64, offset: f64) {
        let before = self.fields.first().map_or(1.0, |position| position.scale);
        for field in &mut self.fields {
            field.scale *= scale / before;
        }
        if let Some(position) = self.fields.first_mut() {
            (position.scale, position.offset) = (scale, offset);
        }
        self.is_doubtful = false;
    }
}

/// A topic of joint states and its joint names.
pub(super) type NamedJoints = (String, Vec<String>);

/// Finds a joint under another name: first in joint states, then among the fields of other messages.
pub(super) fn find(
    joint: &str,
    states: &[NamedJoints],
    topics: &[Topic],
    can: &CanMessages,
) -> Option<JointGuess> {
    in_joint_states(joint, states).or_else(|| in_fields(joint, topics, can))
}

fn in_joint_states(joint: &str, states: &[NamedJoints]) -> Option<JointGuess> {
    let own = own_words(joint);
    let named = states
        .iter()
        .flat_map(|(topic, names)| names.iter().map(move |name| (topic, name)));
    let last = |name: &str| {
        let last = name.rsplit(['/', ':', '.']).next().unwrap_or(name);
        own_words(last)
    };
    let mut alike = named.filter(|(_, name)| own_words(name) == own || last(name) == own);
    let (topic, name) = alike.next().filter(|_| !own.is_empty())?;
    // two matches are ambiguous
    if alike.next().is_some() {
        return None;
    }
    let at = |list: &'static str| GuessedField {
        key: list,
        source: format!(
            "topic = {}, field = \"{list}\", joint = {}",
            quoted(topic),
            quoted(name)
        ),
        scale: 1.0,
        offset: 0.0,
    };
    Some(JointGuess {
        joint: joint.into(),
        fields: vec![at("position"), at("velocity")],
        why: format!("similar to joint {name} on {topic}"),
        is_doubtful: false,
    })
}

fn in_fields(joint: &str, topics: &[Topic], can: &CanMessages) -> Option<JointGuess> {
    let own = own_words(joint);
    let mut positions = Vec::new();
    let mut rates = Vec::new();
    for topic in topics.iter().filter(|topic| topic.message_count != Some(0)) {
        for field in number_fields(topic) {
            let Some(number) = Named::read(&topic.name, &field, &own) else {
                continue;
            };
            match number.is_rate {
                true => rates.push((topic, field, number)),
                false => positions.push((topic, field, number)),
            }
        }
    }
    let [(topic, field, number)] = &positions[..] else {
        return None;
    };
    let of_bus = |field: &str| can.field(&topic.name, field);
    let guessed = |key: &'static str, field: &str, scale: f64| {
        let of_topic = || format!("topic = {}, field = {}", quoted(&topic.name), quoted(field));
        let (source, is_si) = of_bus(field).unwrap_or_else(|| (of_topic(), false));
        GuessedField {
            key,
            source,
            scale: if is_si { 1.0 } else { scale },
            offset: 0.0,
        }
    };
    let mut fields = vec![guessed("position", field, number.scale)];
    let on_topic: Vec<_> = rates.iter().filter(|(t, ..)| t.id == topic.id).collect();
    if let [(_, field, number)] = on_topic[..] {
        fields.push(guessed("velocity", field, number.scale));
    }
    let is_si = of_bus(field).is_some_and(|(_, is_si)| is_si);
    let unit = match number.unit.is_empty() {
        _ if is_si => "in SI units by its description: CHECK sign and zero".into(),
        true => "unknown unit: CHECK unit, sign and zero".into(),
        false => format!(
            "in {} according to its name: CHECK sign and zero",
            number.unit
        ),
    };
    Some(JointGuess {
        joint: joint.into(),
        fields,
        why: format!("similar to field {field} of {}; {unit}", topic.name),
        is_doubtful: true,
    })
}

/// Meaning of a field name.
struct Named {
    is_rate: bool,
    scale: f64,
    unit: String,
}

impl Named {
    /// Interprets a field name, preceded by its topic's last word if necessary; `None` if it does not
    /// match the joint's words.
    fn read(topic: &str, field: &str, own: &[String]) -> Option<Self> {
        let mut rest = own_words(field);
        let mut take = |known: &[&str]| {
            let place = rest
                .iter()
                .position(|w| known.contains(&w.as_str()) && !own.contains(w))?;
            Some(rest.remove(place))
        };
        if take(&OTHER).is_some() {
            return None;
        }
        let is_rate = take(&VELOCITY).is_some();
        take(&POSITION);
        let unit = UNITS
            .iter()
            .find_map(|(unit, scale)| Some((take(&[unit])?, *scale)));
        if is_rate {
            take(&["s", "sec", "per"]);
        }
        let is_about = |words: &[String]| !words.is_empty() && words == own;
        let mut with_topic = rest.clone();
        with_topic.extend(own_words(topic.rsplit('/').next().unwrap_or(topic)));
        with_topic.sort();
        with_topic.retain(|word| own.contains(word) || rest.contains(word));
        let (unit, scale) = unit.unwrap_or((String::new(), 1.0));
        (is_about(&rest) || is_about(&with_topic)).then_some(Self {
            is_rate,
            scale,
            unit,
        })
    }
}

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
    /// Lines of `[signals.joints.NAME]`.
    pub(super) lines: Vec<String>,
    pub(super) why: String,
    /// Whether unit, sign and zero are guesses that a person must confirm.
    pub(super) is_doubtful: bool,
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
    let at = |list: &str| {
        format!(
            "{{ topic = {}, field = \"{list}\", joint = {} }}",
            quoted(topic),
            quoted(name)
        )
    };
    Some(JointGuess {
        joint: joint.into(),
        lines: vec![
            format!("position = {}", at("position")),
            format!("velocity = {}", at("velocity")),
        ],
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
    let line = |key: &str, field: &str, scale: f64| {
        let named = of_bus(field);
        let is_si = named.as_ref().is_some_and(|(_, is_si)| *is_si);
        let scale = match is_si || scale == 1.0 {
            true => String::new(),
            false => format!(", scale = {scale:?}"),
        };
        if let Some((named, _)) = named {
            return format!("{key} = {{ {named}{scale} }}");
        }
        let topic = quoted(&topic.name);
        format!(
            "{key} = {{ topic = {topic}, field = {}{scale} }}",
            quoted(field)
        )
    };
    let mut lines = vec![line("position", field, number.scale)];
    let on_topic: Vec<_> = rates.iter().filter(|(t, ..)| t.id == topic.id).collect();
    if let [(_, field, number)] = on_topic[..] {
        lines.push(line("velocity", field, number.scale));
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
        lines,
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

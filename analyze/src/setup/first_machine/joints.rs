//! Guesses the log fields of joints whose names differ from the URDF.

use tipwatch_ingest::{Topic, number_fields};
use tipwatch_mechanics::machine::{JointMotion, OutlineJoint};

use super::can::CanMessages;
use super::text::quoted;
use super::words::{OTHER, VELOCITY, own_words};
use crate::setup::inspect::KnownSignal;

/// Units by word in a field name, with the factor to SI.
const ANGLES: [(&str, f64); 5] = [
    ("deg", std::f64::consts::PI / 180.0),
    ("degree", std::f64::consts::PI / 180.0),
    ("degrees", std::f64::consts::PI / 180.0),
    ("mrad", 1e-3),
    ("rad", 1.0),
];
const LENGTHS: [(&str, f64); 3] = [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
/// A way that is longer than between the limits by less than this factor may be rounding.
const ROUNDING: f64 = 1.05;
const POSITION: [&str; 3] = ["position", "pos", "value"];
const ANGLE: [&str; 2] = ["angle", "ang"];
const LENGTH: [&str; 4] = ["length", "len", "stroke", "extension"];
/// Words for a motion that the whole machine or its cab has as well, and for these.
const OF_ANY_BODY: [&str; 7] = [
    "tilt", "pitch", "roll", "level", "lean", "incline", "rotation",
];
const BODIES: [&str; 16] = [
    "cab",
    "cabin",
    "chassis",
    "frame",
    "platform",
    "vehicle",
    "machine",
    "truck",
    "body",
    "base",
    "imu",
    "inclinometer",
    "slope",
    "seat",
    "antenna",
    "camera",
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
    /// Keys of the machine file that name the number, such as `topic = "/arm", field = "lift_deg"`.
    pub(super) source: String,
    /// Factor from the number to SI units.
    pub(super) scale: f64,
    /// Constant added to the scaled number (rad or m, of a position).
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
    /// Replaces factor and offset of the position by those that a person states. The velocity is in the same unit and has the
    /// same sign.
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

/// Finds a joint under another name: first in joint states, then among the fields of other messages. `others` are the names
/// of the machine's other joints.
pub(super) fn find(
    joint: &OutlineJoint,
    others: &[&str],
    states: &[NamedJoints],
    topics: &[Topic],
    can: &CanMessages,
) -> Option<JointGuess> {
    in_joint_states(&joint.name, states).or_else(|| in_fields(joint, others, topics, can))
}

/// Whether a name has every word of a joint; a name that only says what it measures counts with the name of its message.
pub(super) fn is_named(joint: &str, message: &str, name: &str) -> bool {
    let own = own_words(joint);
    let mut found = own_words(name);
    let units = ANGLES.iter().chain(&LENGTHS).map(|(unit, _)| *unit);
    let quantities: Vec<&str> = POSITION
        .iter()
        .chain(&ANGLE)
        .chain(&LENGTH)
        .copied()
        .chain(units)
        .collect();
    if found.iter().all(|word| quantities.contains(&word.as_str())) {
        found.extend(own_words(message));
    }
    !own.is_empty() && own.iter().all(|word| found.contains(word))
}

/// Whether a joint can make the motion of a signal (rad or m) within its limits: zero and sign may differ.
pub(super) fn can_go(joint: &OutlineJoint, [least, most]: [f64; 2]) -> bool {
    let limits = joint.limits;
    limits.is_none_or(|[low, high]| most - least <= ROUNDING * (high - low))
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

fn in_fields(
    joint: &OutlineJoint,
    others: &[&str],
    topics: &[Topic],
    can: &CanMessages,
) -> Option<JointGuess> {
    let sought = Sought::of(joint, others);
    let mut positions = Vec::new();
    let mut rates = Vec::new();
    for topic in topics.iter().filter(|topic| topic.message_count != Some(0)) {
        for field in number_fields(topic) {
            let Some(number) = sought.read(&topic.name, &field) else {
                continue;
            };
            let of_bus = can.field(&topic.name, &field);
            let signal = of_bus.as_ref().map(|it| it.signal);
            if signal.is_some_and(|signal| !sought.fits(number.is_rate, signal)) {
                continue;
            }
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
        let (source, is_si) =
            of_bus(field).map_or_else(|| (of_topic(), false), |it| (it.source, it.signal.is_si));
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
    let is_si = of_bus(field).is_some_and(|it| it.signal.is_si);
    let unit = match number.unit.is_empty() {
        _ if is_si => "in SI units by its description: CHECK sign and zero".into(),
        true => "unknown unit: CHECK unit, sign and zero".into(),
        false => format!(
            "in {} according to its name: CHECK sign and zero",
            number.unit
        ),
    };
    Some(JointGuess {
        joint: joint.name.clone(),
        fields,
        why: format!("similar to field {field} of {}; {unit}", topic.name),
        is_doubtful: true,
    })
}

/// Search for a field of a joint: its possible names, and the numbers it can have.
struct Sought<'a> {
    joint: &'a OutlineJoint,
    slides: bool,
    own: Vec<String>,
    /// The words of the other joints that are not its own.
    foreign: Vec<String>,
}

/// Meaning of a field name.
struct Named {
    is_rate: bool,
    scale: f64,
    unit: String,
}

impl<'a> Sought<'a> {
    fn of(joint: &'a OutlineJoint, others: &[&str]) -> Self {
        let own = own_words(&joint.name);
        let mut foreign: Vec<String> = others.iter().flat_map(|name| own_words(name)).collect();
        foreign.retain(|word| !own.contains(word));
        Self {
            joint,
            slides: joint.motion == JointMotion::Prismatic,
            own,
            foreign,
        }
    }

    /// Interprets a field name, preceded by its topic's last word if necessary; `None` if it does not
    /// match the joint's words, or names a number of another kind.
    fn read(&self, topic: &str, field: &str) -> Option<Named> {
        let own = &self.own;
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
        let (kind, units): (&[&str], &[(&str, f64)]) = match self.slides {
            true => (&LENGTH, &LENGTHS),
            false => (&ANGLE, &ANGLES),
        };
        take(kind);
        let unit = units
            .iter()
            .find_map(|(unit, scale)| Some((take(&[unit])?, *scale)));
        if is_rate {
            take(&["s", "sec", "per"]);
        }
        let of_topic = own_words(topic.rsplit('/').next().unwrap_or(topic));
        let (unit, scale) = unit.unwrap_or((String::new(), 1.0));
        self.is_about(rest, &of_topic).then_some(Named {
            is_rate,
            scale,
            unit,
        })
    }

    /// Whether the rest of a field's name, alone or with its topic's, names this joint and no other part.
    fn is_about(&self, rest: Vec<String>, of_topic: &[String]) -> bool {
        let own = &self.own;
        if own.is_empty() {
            return false;
        }
        let names_other = |word: &String| {
            self.foreign.contains(word) || (BODIES.contains(&word.as_str()) && !own.contains(word))
        };
        if rest == *own {
            // a tilt in a message about the chassis is that of the chassis
            let of_any = own.iter().all(|word| OF_ANY_BODY.contains(&word.as_str()));
            return !of_any || !of_topic.iter().any(names_other);
        }
        let mut with_topic = rest.clone();
        with_topic.extend(of_topic.iter().cloned());
        with_topic.sort();
        with_topic.dedup();
        with_topic.retain(|word| own.contains(word) || rest.contains(word));
        with_topic == *own && !of_topic.iter().any(names_other)
    }

    /// Whether a signal of a bus has a unit and a motion that the joint can have.
    fn fits(&self, is_rate: bool, signal: &KnownSignal) -> bool {
        let expected = match (self.slides, is_rate) {
            (true, false) => "m",
            (true, true) => "m/s",
            (false, false) => "rad",
            (false, true) => "rad/s",
        };
        let unit = signal.unit.trim();
        if unit != expected && !unit.is_empty() {
            return false;
        }
        let goes_too_far = |span| !can_go(self.joint, span);
        !(signal.is_si && !is_rate && signal.span.is_some_and(goes_too_far))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn joint(name: &str, motion: JointMotion) -> OutlineJoint {
        OutlineJoint {
            name: name.into(),
            motion,
            axis_in_link: Vector3::y(),
            axis_in_base: Vector3::y(),
            mimics: false,
            limits: Some([-0.3, 0.9]),
        }
    }

    /// Joint, whether it slides, other joints, message, field: whether the field is the position of that joint.
    #[test]
    fn a_field_is_the_position_of_the_joint_that_it_names_alone() {
        let others = ["boom", "boom_extension", "forks", "tilt", "slew"];
        for (name, slides, topic, field, expected) in [
            ("boom", false, "can/BoomStatus", "Boom_Angle", true),
            ("boom", false, "can/BoomStatus", "Angle", true),
            ("boom", false, "can/BoomStatus", "Boom_Extension", false),
            ("boom", false, "can/BoomStatus", "Boom_Length", false),
            ("boom", false, "can/BoomStatus", "Fork_Angle", false),
            ("boom", false, "can/Boom", "Boom_Angle_Cmd", false),
            ("forks", false, "can/BoomStatus", "Fork_Angle", true),
            ("forks", false, "can/BoomForks", "Angle", false),
            ("forks", false, "can/Forks", "Boom_Angle", false),
            (
                "boom_extension",
                true,
                "can/BoomStatus",
                "Boom_Extension",
                true,
            ),
            (
                "boom_extension",
                true,
                "can/BoomStatus",
                "Boom_Tele_Length",
                true,
            ),
            ("boom_extension", true, "can/Boom", "Extension", true),
            ("boom_extension", true, "can/Boom", "Angle", false),
            ("tilt", false, "can/Arm", "Tilt_Angle", true),
            ("tilt", false, "can/Chassis", "Tilt_Angle", false),
            ("tilt", false, "can/Forks", "Tilt", false),
            ("tilt", false, "can/Cab", "Tilt", false),
            ("slew", false, "can/Upper", "Swing_Angle", true),
            ("slew", false, "can/Upper", "SlewLever", false),
            ("steer_fl", false, "can/Drive", "Steering_Angle_FL", true),
            ("steer_fl", false, "can/Drive", "Steering_Angle", false),
            ("bucket", false, "can/Loader", "Bucket_Position_deg", true),
            ("bucket", false, "can/Loader", "Bucket_mm", false),
        ] {
            let motion = match slides {
                true => JointMotion::Prismatic,
                false => JointMotion::Revolute,
            };
            let others: Vec<&str> = others.into_iter().filter(|other| *other != name).collect();
            let joint = joint(name, motion);
            let found = Sought::of(&joint, &others).read(topic, field);
            let is_position = found.is_some_and(|number| !number.is_rate);
            assert_eq!(is_position, expected, "{name}: {topic} {field}");
        }
    }

    #[test]
    fn a_message_names_the_signals_that_have_no_name_of_their_own() {
        for (joint, message, name, expected) in [
            ("boom", "BoomStatus", "Boom_Inclination", true),
            ("boom", "BoomStatus", "Angle_deg", true),
            ("boom", "BoomStatus", "Fork_Angle", false),
            ("forks", "BoomStatus", "Fork_Angle", true),
            ("boom_extension", "BoomStatus", "Extension", true),
            ("steer_fl", "Steering", "Angle", false),
        ] {
            assert_eq!(is_named(joint, message, name), expected, "{joint}: {name}");
        }
    }

    #[test]
    fn unit_and_way_of_a_signal_are_those_of_the_joint() {
        let joint = joint("forks", JointMotion::Revolute);
        let sought = Sought::of(&joint, &[]);
        for (unit, is_si, span, expected) in [
            ("rad", true, Some([0.0, 1.2]), true),
            ("rad", true, None, true),
            ("rad", true, Some([0.0, 1.5]), false),
            ("m", true, Some([0.0, 1.0]), false),
            ("%", false, Some([0.0, 1.0]), false),
            ("", false, Some([0.0, 4000.0]), true),
        ] {
            let signal = KnownSignal {
                name: "Fork".into(),
                unit: unit.into(),
                is_si,
                span,
            };
            assert_eq!(sought.fits(false, &signal), expected, "{unit} {span:?}");
        }
    }
}

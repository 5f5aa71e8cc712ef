//! Samples made of single numbers of any messages: for what no usual message type carries.

use std::ops::Range;

use super::{error::DecodeError, fields::Fields, layout::Layout, sensor::SensorSample};
use crate::{
    message::{BindingError, Message, Topic},
    schema::FieldPath,
};

/// A number of a topic's messages.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberField {
    /// Path of the number, like `wrench.force.z`; with `joint` that of a list of numbers beside a list of
    /// names, like `effort`, or of a number in a list of messages that have names, like `joints[].effort`.
    pub field: String,
    /// The name whose place in the list of names the number has in its own.
    pub joint: Option<String>,
    /// What the number is multiplied by.
    pub scale: f64,
    /// What is added then.
    pub offset: f64,
}

/// A value of a sample.
#[derive(Debug, Clone, PartialEq)]
pub enum SampleValue {
    /// Other messages have it: NaN.
    Absent,
    /// Always this.
    Constant(f64),
    /// A number of the message.
    Field(NumberField),
}

/// The values of a sample, one by one, in the order of [`SensorSample`].
#[derive(Debug, Clone, PartialEq)]
pub struct NumberSample {
    /// The values.
    pub values: Vec<SampleValue>,
    /// Whether three of them after the sixth are roll, pitch and yaw about fixed axes (rad), and not four a
    /// quaternion.
    pub has_roll_pitch_yaw: bool,
}

/// How lists of names are called, the usual one first.
const NAME_LISTS: [&str; 3] = ["name", "names", "joint_names"];
/// ROS 1 calls the second part of a stamp otherwise in some languages.
const STAMPS: [[&str; 2]; 2] = [
    ["header.stamp.sec", "header.stamp.nanosec"],
    ["header.stamp.secs", "header.stamp.nsecs"],
];

/// Turns the messages of one topic into samples.
#[derive(Debug, Clone)]
pub(crate) struct NumberDecoder {
    topic: String,
    layout: Layout,
    fields: Fields,
    /// Whether the messages have a header; then its two paths are the first.
    is_stamped: bool,
    values: Vec<(SampleValue, Place)>,
    has_roll_pitch_yaw: bool,
    /// Whether any message had the number, by value.
    was_found: Vec<bool>,
    messages: u64,
}

/// Where a value stands in the decoded fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Nowhere,
    Single(usize),
    /// In a list of messages.
    Indexed {
        numbers: usize,
        index: usize,
    },
    Named {
        names: usize,
        numbers: usize,
    },
}

impl NumberDecoder {
    /// Prepares decoding.
    pub(crate) fn new(topic: &Topic, sample: &NumberSample) -> Result<Self, BindingError> {
        let (layout, is_stamped, places) = prepare(topic, sample)?;
        Ok(Self {
            topic: topic.name.clone(),
            layout,
            fields: Fields::new(),
            is_stamped,
            was_found: vec![false; places.len()],
            values: sample.values.iter().cloned().zip(places).collect(),
            has_roll_pitch_yaw: sample.has_roll_pitch_yaw,
            messages: 0,
        })
    }

    /// Decodes one message; whether it has any number of the sample's first part.
    pub(crate) fn decode(
        &mut self,
        message: &Message<'_>,
        sample: &mut SensorSample,
    ) -> Result<bool, DecodeError> {
        sample.values.clear();
        sample.log_time_ns = message.log_time_ns;
        sample.publish_time_ns = message.publish_time_ns;
        sample.header_stamp_ns = None;
        self.layout.decode(message.data, &mut self.fields)?;
        self.messages += 1;
        sample.header_stamp_ns = self.is_stamped.then(|| self.stamp_ns()).flatten();
        let first_part = self.first_part();
        let mut has_any = false;
        for (i, (value, place)) in self.values.iter().enumerate() {
            sample.values.push(match value {
                SampleValue::Absent => f64::NAN,
                SampleValue::Constant(constant) => *constant,
                SampleValue::Field(field) => {
                    let number = number(&self.fields, *place, field.joint.as_deref());
                    let is_there = number.is_finite();
                    has_any |= is_there && first_part.contains(&i);
                    self.was_found[i] |= is_there;
                    number * field.scale + field.offset
                }
            });
        }
        self.finish_attitude(&mut sample.values);
        Ok(has_any)
    }

    /// Takes over what another one found in the messages that follow, as if it had decoded them.
    pub(crate) fn append(&mut self, next: &mut Self) {
        if next.messages == 0 {
            return;
        }
        self.messages += std::mem::take(&mut next.messages);
        for (found, next) in self.was_found.iter_mut().zip(&mut next.was_found) {
            *found |= std::mem::take(next);
        }
        // With the names of the last message.
        std::mem::swap(&mut self.fields, &mut next.fields);
    }

    /// An error if no message had one of the numbers.
    pub(crate) fn check_found(&self) -> Result<(), BindingError> {
        let of_field = self.values.iter().zip(&self.was_found);
        for ((value, place), _) in of_field.filter(|(_, found)| !**found) {
            if let SampleValue::Field(field) = value
                && self.messages > 0
            {
                return Err(BindingError::NoNumber {
                    topic: self.topic.clone(),
                    field: field.field.clone(),
                    joint: field.joint.clone(),
                    messages: self.messages,
                    names: self.names_at(*place),
                });
            }
        }
        Ok(())
    }

    /// The first number of the log and, of a vector, those with it.
    fn first_part(&self) -> Range<usize> {
        let is_field = |(value, _): &(SampleValue, Place)| matches!(value, SampleValue::Field(_));
        let first = self.values.iter().position(is_field).unwrap_or(0);
        match self.values.len() {
            ..=2 => first..first + 1,
            _ => first - first % 3..first - first % 3 + 3,
        }
    }

    /// The names in the last message.
    fn names_at(&self, place: Place) -> Vec<String> {
        let Place::Named { names, .. } = place else {
            return Vec::new();
        };
        let text = |name| String::from_utf8_lossy(name).into_owned();
        self.fields.texts(names).map(text).collect()
    }

    fn stamp_ns(&self) -> Option<i64> {
        // Both are small integers, so nothing is lost.
        let (sec, nanosec) = (self.fields.number(0) as i64, self.fields.number(1) as i64);
        let stamp = sec.saturating_mul(1_000_000_000).saturating_add(nanosec);
        (stamp != 0).then_some(stamp)
    }

    /// Makes a quaternion of the angles; one that was never filled in becomes NaN.
    fn finish_attitude(&self, values: &mut Vec<f64>) {
        const FIRST: usize = 6;
        if self.has_roll_pitch_yaw
            && let [roll, pitch, yaw] = values[FIRST..]
        {
            values.truncate(FIRST);
            values.extend(quaternion([roll, pitch, yaw]));
        }
        if let Some(attitude) = values.get_mut(FIRST..FIRST + 4)
            && *attitude == [0.0; 4]
        {
            attitude.fill(f64::NAN);
        }
    }
}

/// Quaternion x y z w of the turn by roll about x, then pitch about y, then yaw about z, all fixed axes.
fn quaternion(angles: [f64; 3]) -> [f64; 4] {
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|angle| (0.5 * angle).sin_cos());
    [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
}

fn number(fields: &Fields, place: Place, joint: Option<&str>) -> f64 {
    match (place, joint) {
        (Place::Single(path), _) => fields.number(path),
        (Place::Indexed { numbers, index }, _) => {
            let number = fields.numbers(numbers).get(index);
            number.copied().unwrap_or(f64::NAN)
        }
        (Place::Named { names, numbers }, Some(joint)) => {
            let index = fields
                .texts(names)
                .position(|name| name == joint.as_bytes());
            let number = index.and_then(|index| fields.numbers(numbers).get(index));
            number.copied().unwrap_or(f64::NAN)
        }
        _ => f64::NAN,
    }
}

/// The layout of the header's stamp and the wanted numbers, or of the numbers alone where there is no
/// header; which of both; and where each value will be.
fn prepare(
    topic: &Topic,
    sample: &NumberSample,
) -> Result<(Layout, bool, Vec<Place>), BindingError> {
    let mut refusal = None;
    for names in NAME_LISTS {
        for stamp in STAMPS.map(Some).into_iter().chain([None]) {
            let mut paths: Vec<String> = (stamp.iter().flatten())
                .map(|path| (*path).to_owned())
                .collect();
            let places = places(topic, sample, names, &mut paths)?;
            let parsed: Vec<FieldPath> = (paths.iter())
                .map(|path| parse(topic, path))
                .collect::<Result<_, _>>()?;
            match Layout::of_topic(topic, &parsed) {
                Ok(layout) => return Ok((layout, stamp.is_some(), places)),
                // without a header and with the usual names the error is about the wanted field
                Err(error) if stamp.is_none() => {
                    refusal.get_or_insert(error);
                }
                Err(_) => {}
            }
        }
    }
    Err(refusal.unwrap_or_else(|| BindingError::NoFieldPath {
        topic: topic.name.clone(),
        field: String::new(),
    }))
}

/// Where each value stands among the paths, which grow as needed.
fn places(
    topic: &Topic,
    sample: &NumberSample,
    names: &str,
    paths: &mut Vec<String>,
) -> Result<Vec<Place>, BindingError> {
    let mut place_of = |path: String| {
        let known = paths.iter().position(|known| *known == path);
        known.unwrap_or_else(|| {
            paths.push(path);
            paths.len() - 1
        })
    };
    let mut places = Vec::with_capacity(sample.values.len());
    for value in &sample.values {
        let SampleValue::Field(field) = value else {
            places.push(Place::Nowhere);
            continue;
        };
        parse(topic, &field.field)?;
        let path = field.field.trim_end_matches("[]");
        places.push(match (&field.joint, path.rsplit_once("[].")) {
            (None, _) if field.field.contains("[]") => {
                return Err(BindingError::NoFieldPath {
                    topic: topic.name.clone(),
                    field: field.field.clone(),
                });
            }
            (None, _) => match element_of(&field.field) {
                Some((list, index)) => Place::Indexed {
                    numbers: place_of(list),
                    index,
                },
                None => Place::Single(place_of(field.field.clone())),
            },
            (Some(_), Some((list, _))) => Place::Named {
                names: place_of(format!("{list}[].{}", names.trim_end_matches('s'))),
                numbers: place_of(path.to_owned()),
            },
            (Some(_), None) => {
                let beside = path
                    .rsplit_once('.')
                    .map(|(parent, _)| format!("{parent}."));
                Place::Named {
                    names: place_of(format!("{}{names}[]", beside.unwrap_or_default())),
                    numbers: place_of(format!("{path}[]")),
                }
            }
        });
    }
    Ok(places)
}

/// Of a number in one element of a list of messages, `forces[2].x`, the path through all elements and
/// the index.
fn element_of(path: &str) -> Option<(String, usize)> {
    let (list, rest) = path.split_once('[')?;
    let (index, rest) = rest.split_once("].")?;
    Some((format!("{list}[].{rest}"), index.parse().ok()?))
}

fn parse(topic: &Topic, path: &str) -> Result<FieldPath, BindingError> {
    path.parse().map_err(|_| BindingError::NoFieldPath {
        topic: topic.name.clone(),
        field: path.to_owned(),
    })
}

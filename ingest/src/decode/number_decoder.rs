//! Builds samples from single numbers of any messages, for signals without a standard message type.

use std::ops::Range;

use super::{
    error::DecodeError,
    fields::Fields,
    layout::Layout,
    sensor::{SensorSample, stamp_ns},
};
use crate::{
    message::{BindingError, RawMessage, Topic},
    schema::FieldPath,
};

/// A number in the messages of a topic.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberField {
    /// Path of the number, such as `wrench.force.z`. With `joint`, the path of an array parallel to
    /// an array of names, such as `effort`, or of a number in an array of named messages, such as
    /// `joints[].effort`.
    pub field: String,
    /// The name that selects the element.
    pub joint: Option<String>,
    /// Factor applied to the number.
    pub scale: f64,
    /// Offset added after scaling.
    pub offset: f64,
}

/// A value of a sample.
#[derive(Debug, Clone, PartialEq)]
pub enum ValueSource {
    /// Absent from these messages: NaN.
    Absent,
    /// A constant.
    Constant(f64),
    /// A number from the message.
    Field(NumberField),
}

/// The source of each value of a sample, in the order of [`SensorSample`].
#[derive(Debug, Clone, PartialEq)]
pub struct SampleSpec {
    /// The values.
    pub values: Vec<ValueSource>,
    /// Whether the values after the sixth are roll, pitch and yaw about fixed axes (rad) instead of
    /// a quaternion.
    pub has_roll_pitch_yaw: bool,
}

impl SampleSpec {
    /// Values without angles.
    #[must_use]
    pub fn of(values: Vec<ValueSource>) -> Self {
        Self {
            values,
            has_roll_pitch_yaw: false,
        }
    }
}

/// Field names of arrays of names, the most common first.
const NAME_LISTS: [&str; 3] = ["name", "names", "joint_names"];
/// Some ROS 1 client libraries use other names for the parts of a stamp.
const STAMPS: [[&str; 2]; 2] = [
    ["header.stamp.sec", "header.stamp.nanosec"],
    ["header.stamp.secs", "header.stamp.nsecs"],
];

/// Decodes the messages of one topic into samples.
#[derive(Debug, Clone)]
pub(crate) struct NumberDecoder {
    topic: String,
    layout: Layout,
    fields: Fields,
    /// Whether the messages have a header; its two paths then come first.
    is_stamped: bool,
    values: Vec<(ValueSource, Location)>,
    has_roll_pitch_yaw: bool,
    /// Whether any message had the number, for each value.
    was_found: Vec<bool>,
    messages: u64,
}

/// Position of a value in the decoded fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Location {
    Absent,
    Single(usize),
    /// One element of an array of messages.
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
    pub(crate) fn new(topic: &Topic, sample: &SampleSpec) -> Result<Self, BindingError> {
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

    /// Decodes one message; returns whether it has any number of the sample's first part. A sample without values has
    /// times alone: every message has those.
    pub(crate) fn decode(
        &mut self,
        message: &RawMessage<'_>,
        sample: &mut SensorSample,
    ) -> Result<bool, DecodeError> {
        sample.values.clear();
        sample.log_time_ns = message.log_time_ns;
        sample.publish_time_ns = message.publish_time_ns;
        sample.header_stamp_ns = None;
        self.layout.decode(message.data, &mut self.fields)?;
        self.messages += 1;
        sample.header_stamp_ns = match self.is_stamped {
            true => stamp_ns(self.fields.number(0), self.fields.number(1)),
            false => None,
        };
        let first_part = self.first_part();
        let mut has_any = self.values.is_empty();
        for (i, (value, place)) in self.values.iter().enumerate() {
            sample.values.push(match value {
                ValueSource::Absent => f64::NAN,
                ValueSource::Constant(constant) => *constant,
                ValueSource::Field(field) => {
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

    /// Merges the results of a decoder that decoded the messages that follow.
    pub(crate) fn append(&mut self, next: &mut Self) {
        if next.messages == 0 {
            return;
        }
        self.messages += std::mem::take(&mut next.messages);
        for (found, next) in self.was_found.iter_mut().zip(&mut next.was_found) {
            *found |= std::mem::take(next);
        }
        // Keep the names of the last message.
        std::mem::swap(&mut self.fields, &mut next.fields);
    }

    /// An error if a number occurred in no message.
    pub(crate) fn check_found(&self) -> Result<(), BindingError> {
        let of_field = self.values.iter().zip(&self.was_found);
        for ((value, place), _) in of_field.filter(|(_, found)| !**found) {
            if let ValueSource::Field(field) = value
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

    /// The first value read from the log, with the other components if it belongs to a vector.
    fn first_part(&self) -> Range<usize> {
        let is_field =
            |(value, _): &(ValueSource, Location)| matches!(value, ValueSource::Field(_));
        let first = self.values.iter().position(is_field).unwrap_or(0);
        match self.values.len() {
            ..=2 => first..first + 1,
            _ => first - first % 3..first - first % 3 + 3,
        }
    }

    /// The names in the last message.
    fn names_at(&self, place: Location) -> Vec<String> {
        let Location::Named { names, .. } = place else {
            return Vec::new();
        };
        let text = |name| String::from_utf8_lossy(name).into_owned();
        self.fields.texts(names).map(text).collect()
    }

    /// Converts angles to a quaternion; a quaternion that was never set, and angles that are none, become NaN.
    fn finish_attitude(&self, values: &mut Vec<f64>) {
        const FIRST: usize = 6;
        if self.has_roll_pitch_yaw
            && let [roll, pitch, yaw] = values[FIRST..]
        {
            values.truncate(FIRST);
            let is_angle = [roll, pitch]
                .iter()
                .all(|angle| angle.abs() <= LARGEST_TILT_RAD);
            values.extend(match is_angle {
                true => quaternion([roll, pitch, yaw]),
                false => [f64::NAN; 4],
            });
        }
        if let Some(attitude) = values.get_mut(FIRST..FIRST + 4)
            && *attitude == [0.0; 4]
        {
            attitude.fill(f64::NAN);
        }
    }
}

/// Largest roll and pitch (rad), a full circle and its rounding: beyond it a value stands for none, or is in degrees. Yaw may count
/// turns.
pub const LARGEST_TILT_RAD: f64 = std::f64::consts::TAU + 0.02;

/// Quaternion x y z w of a rotation by roll about x, then pitch about y, then yaw about z (fixed
/// axes).
fn quaternion(angles: [f64; 3]) -> [f64; 4] {
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|angle| (0.5 * angle).sin_cos());
    [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
}

fn number(fields: &Fields, place: Location, joint: Option<&str>) -> f64 {
    match (place, joint) {
        (Location::Single(path), _) => fields.number(path),
        (Location::Indexed { numbers, index }, _) => {
            let number = fields.numbers(numbers).get(index);
            number.copied().unwrap_or(f64::NAN)
        }
        (Location::Named { names, numbers }, Some(joint)) => {
            let index = fields
                .texts(names)
                .position(|name| name == joint.as_bytes());
            let number = index.and_then(|index| fields.numbers(numbers).get(index));
            number.copied().unwrap_or(f64::NAN)
        }
        _ => f64::NAN,
    }
}

/// The layout of the header stamp and the wanted numbers, whether the messages have a header, and
/// where each value is found.
fn prepare(
    topic: &Topic,
    sample: &SampleSpec,
) -> Result<(Layout, bool, Vec<Location>), BindingError> {
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
                // without a header and with the usual names, the error concerns the wanted field
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

/// The path of each value; new paths are appended to `paths`.
fn places(
    topic: &Topic,
    sample: &SampleSpec,
    names: &str,
    paths: &mut Vec<String>,
) -> Result<Vec<Location>, BindingError> {
    let mut place_of = |path: String| {
        let known = paths.iter().position(|known| *known == path);
        known.unwrap_or_else(|| {
            paths.push(path);
            paths.len() - 1
        })
    };
    // Numbers in lists of lists are read one by one, and so are all others then: of one list, either all messages are
    // read or single ones.
    let is_nested = sample.values.iter().any(|value| match value {
        ValueSource::Field(field) => field.joint.is_none() && field.field.matches('[').count() > 1,
        _ => false,
    });
    let mut places = Vec::with_capacity(sample.values.len());
    for value in &sample.values {
        let ValueSource::Field(field) = value else {
            places.push(Location::Absent);
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
            (None, _) => match element_of(&field.field).filter(|_| !is_nested) {
                Some((list, index)) => Location::Indexed {
                    numbers: place_of(list),
                    index,
                },
                None => Location::Single(place_of(field.field.clone())),
            },
            (Some(_), Some((list, _))) => Location::Named {
                names: place_of(format!("{list}[].{}", names.trim_end_matches('s'))),
                numbers: place_of(path.to_owned()),
            },
            (Some(_), None) => {
                let beside = path
                    .rsplit_once('.')
                    .map(|(parent, _)| format!("{parent}."));
                Location::Named {
                    names: place_of(format!("{}{names}[]", beside.unwrap_or_default())),
                    numbers: place_of(format!("{path}[]")),
                }
            }
        });
    }
    Ok(places)
}

/// Splits a number in one element of an array of messages, `forces[2].x`, into the path through all
/// elements and the index.
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

//! Reads the first messages of a topic, before the whole log is read.

use std::ops::ControlFlow;

use crate::{
    decode::{Fields, Layout, layout_of},
    log::Log,
    message::{BindingError, Error, SensorKind, TopicId},
    schema::normal_type_name,
};

/// Drivers that report joints in turn, and publishers that share a topic, have named all of them after this many
/// messages.
const MESSAGES_WITH_ALL_NAMES: usize = 500;

/// Joints that come in the same messages of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct JointGroup {
    /// Names in order of first appearance.
    pub(crate) joint_names: Vec<String>,
    /// Joints that a message names twice with different positions.
    pub(crate) twice: Vec<JointNamedTwice>,
    /// Joints whose position is never a number.
    pub(crate) without_position: Vec<String>,
    /// Number of the first messages that name these joints, and of all first messages.
    messages: [u64; 2],
}

impl JointGroup {
    /// Estimates the number of messages with the joints among `of_topic` messages of the topic, by their share of the first ones.
    pub(crate) fn share_of(&self, of_topic: u64) -> u64 {
        let [with, all] = self.messages.map(u128::from);
        let share = u128::from(of_topic) * with / all.max(1);
        u64::try_from(share).unwrap_or(u64::MAX)
    }
}

/// A joint that one message names twice, with different positions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointNamedTwice {
    /// The joint.
    pub joint: String,
    /// Both positions, as text, and their places in the message.
    pub positions: [(String, usize); 2],
}

/// The joint names in the first messages of a joint state topic, in order of first appearance.
pub fn joint_names_in(log: &Log, topic: TopicId) -> Result<Vec<String>, Error> {
    Ok(NameLists::read(log, topic)?.names())
}

/// The joints of a joint state topic, in groups that come in the same messages: in its first ones.
pub(crate) fn joint_groups_in(log: &Log, topic: TopicId) -> Result<Vec<JointGroup>, Error> {
    Ok(NameLists::read(log, topic)?.groups())
}

/// The different lists of names in messages of a topic.
#[derive(Default)]
struct NameLists {
    /// Each list with the number of its messages.
    lists: Vec<(Vec<String>, u64)>,
    twice: Vec<JointNamedTwice>,
    /// Joints with a position that is a number.
    with_position: Vec<String>,
}

impl NameLists {
    fn read(log: &Log, topic: TopicId) -> Result<Self, Error> {
        let described = log.topic(topic)?;
        expect_type(log, topic, SensorKind::JointStates.type_name())?;
        let layout = layout_of(described, &["name[]", "position[]"])?;
        let mut fields = Fields::new();
        let mut found = Self::default();
        let mut messages = 0;
        let mut known: Option<(u64, usize)> = None;
        log.read(&[topic], &mut |message| {
            if layout.decode(message.data, &mut fields).is_ok() {
                let revision = fields.texts_revision(0);
                let list = match known.filter(|(of, _)| *of == revision) {
                    Some((_, list)) => list,
                    None => found.list_of(&fields),
                };
                known = Some((revision, list));
                found.lists[list].1 += 1;
                found.note_twice(list, &fields);
                found.note_positions(list, &fields);
            }
            messages += 1;
            if messages < MESSAGES_WITH_ALL_NAMES {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        })?;
        Ok(found)
    }

    /// The index of the list of names of a message.
    fn list_of(&mut self, fields: &Fields) -> usize {
        let names = fields.texts(0).map(String::from_utf8_lossy);
        let names: Vec<String> = names.map(std::borrow::Cow::into_owned).collect();
        let known = self.lists.iter().position(|(list, _)| *list == names);
        known.unwrap_or_else(|| {
            self.lists.push((names, 0));
            self.lists.len() - 1
        })
    }

    /// Notes joints that a message names twice with different positions.
    fn note_twice(&mut self, list: usize, fields: &Fields) {
        let names = &self.lists[list].0;
        let positions = fields.numbers(1);
        for (second, name) in names.iter().enumerate() {
            let Some(first) = names[..second].iter().position(|other| other == name) else {
                continue;
            };
            let at = |place: usize| positions.get(place).copied().unwrap_or(f64::NAN);
            let is_known = self.twice.iter().any(|twice| twice.joint == *name);
            if !is_known && at(first).to_bits() != at(second).to_bits() {
                self.twice.push(JointNamedTwice {
                    joint: name.clone(),
                    positions: [first, second].map(|place| (at(place).to_string(), place)),
                });
            }
        }
    }

    /// Notes joints whose position is a number.
    fn note_positions(&mut self, list: usize, fields: &Fields) {
        for (name, position) in self.lists[list].0.iter().zip(fields.numbers(1)) {
            if position.is_finite() && !self.with_position.contains(name) {
                self.with_position.push(name.clone());
            }
        }
    }

    /// All joints, each once.
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.lists.iter().flat_map(|(list, _)| list) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    fn groups(self) -> Vec<JointGroup> {
        let all: u64 = self.lists.iter().map(|(_, messages)| messages).sum();
        let mut groups: Vec<(Vec<usize>, JointGroup)> = Vec::new();
        for name in self.names() {
            let has = |(_, (list, _)): &(usize, &(Vec<String>, u64))| list.contains(&name);
            let with: Vec<(usize, u64)> = (self.lists.iter().enumerate())
                .filter(has)
                .map(|(index, (_, messages))| (index, *messages))
                .collect();
            let lists: Vec<usize> = with.iter().map(|(index, _)| *index).collect();
            let twice = self
                .twice
                .iter()
                .filter(|twice| twice.joint == name)
                .cloned();
            let lacks = (!self.with_position.contains(&name)).then(|| name.clone());
            match groups.iter_mut().find(|(of, _)| *of == lists) {
                Some((_, group)) => {
                    group.joint_names.push(name.clone());
                    group.twice.extend(twice);
                    group.without_position.extend(lacks);
                }
                None => {
                    let messages = with.iter().map(|(_, messages)| messages).sum();
                    let group = JointGroup {
                        joint_names: vec![name.clone()],
                        twice: twice.collect(),
                        without_position: lacks.into_iter().collect(),
                        messages: [messages, all],
                    };
                    groups.push((lists, group));
                }
            }
        }
        groups.into_iter().map(|(_, group)| group).collect()
    }
}

/// Passes every string on a topic of strings to `each`, with its log time (ns).
pub(crate) fn for_each_string(
    log: &Log,
    topic: TopicId,
    each: &mut dyn FnMut(std::borrow::Cow<'_, str>, i64),
) -> Result<(), Error> {
    expect_type(log, topic, "std_msgs/msg/String")?;
    let layout = layout_of(log.topic(topic)?, &["data"])?;
    let mut fields = Fields::new();
    log.read(&[topic], &mut |message| {
        if layout.decode(message.data, &mut fields).is_ok() {
            each(String::from_utf8_lossy(fields.text(0)), message.log_time_ns);
        }
        ControlFlow::Continue(())
    })?;
    Ok(())
}

/// The frame in the header of the first readable message, without a leading slash; `None` if there is
/// none.
pub fn first_frame(log: &Log, topic: TopicId) -> Result<Option<String>, Error> {
    let first = frames_in(log, topic, 1)?.into_iter().next();
    Ok(first.filter(|frame| !frame.is_empty()))
}

/// The frame of a sensor: the wanted one, else the only one in the first messages of its topic.
pub(crate) fn sensor_frame(
    log: &Log,
    topic: TopicId,
    kind: SensorKind,
    wanted: Option<&str>,
) -> Result<Option<String>, Error> {
    let mut found = frames_in(log, topic, MESSAGES_WITH_ALL_NAMES)?;
    let is_settled = match wanted {
        Some(wanted) => found.iter().any(|frame| frame == wanted),
        None => found.len() <= 1,
    };
    match is_settled {
        true if wanted.is_some() => Ok(wanted.map(str::to_owned)),
        true => Ok(found.pop()),
        false => Err(BindingError::Frames {
            kind,
            topic: log.topic(topic)?.name.clone(),
            wanted: wanted.map(str::to_owned),
            found,
        }
        .into()),
    }
}

/// The different frames in the headers of the first readable messages, without leading slashes.
pub(crate) fn frames_in(log: &Log, topic: TopicId, messages: usize) -> Result<Vec<String>, Error> {
    let Ok(layout) = layout_of(log.topic(topic)?, &["header.frame_id"]) else {
        return Ok(Vec::new());
    };
    let mut found: Vec<String> = Vec::new();
    for_first_texts(log, topic, &layout, messages, &mut |text| {
        let frame = text.trim_start_matches('/');
        if !found.iter().any(|known| known == frame) {
            found.push(frame.to_owned());
        }
    })?;
    Ok(found)
}

/// Passes the first path of a layout to `each`, as read from so many first messages that can be decoded.
fn for_first_texts(
    log: &Log,
    topic: TopicId,
    layout: &Layout,
    messages: usize,
    each: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let mut fields = Fields::new();
    let mut left = messages;
    log.read(&[topic], &mut |message| {
        if layout.decode(message.data, &mut fields).is_ok() {
            each(&String::from_utf8_lossy(fields.text(0)));
            left = left.saturating_sub(1);
        }
        match left {
            0 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }
    })?;
    Ok(())
}

fn expect_type(log: &Log, topic: TopicId, expected: &'static str) -> Result<(), Error> {
    let topic = log.topic(topic)?;
    if normal_type_name(&topic.type_name) == normal_type_name(expected) {
        return Ok(());
    }
    Err(BindingError::WrongType {
        topic: topic.name.clone(),
        expected,
        found: topic.type_name.clone(),
    }
    .into())
}

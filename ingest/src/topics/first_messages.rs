//! Reads the first messages of a topic, before the whole log is read.

use std::ops::ControlFlow;

use crate::{
    decode::{Fields, Layout, layout_of},
    log::Log,
    message::{BindingError, Error, SensorKind, TopicId},
    schema::normal_type_name,
};

/// Drivers that report joints in turn have named all of them after this many messages.
const MESSAGES_WITH_ALL_NAMES: usize = 50;

/// The joint names in the first 50 messages of a joint state topic, in order of first appearance.
pub fn joint_names_in(log: &Log, topic: TopicId) -> Result<Vec<String>, Error> {
    let described = log.topic(topic)?;
    expect_type(log, topic, SensorKind::JointStates.type_name())?;
    let layout = layout_of(described, &["name[]"])?;
    let mut fields = Fields::new();
    let mut names: Vec<String> = Vec::new();
    let mut messages = 0;
    let mut known_revision = None;
    log.read(&[topic], &mut |message| {
        let is_new = layout.decode(message.data, &mut fields).is_ok()
            && known_revision != Some(fields.texts_revision(0));
        if is_new {
            known_revision = Some(fields.texts_revision(0));
            for name in fields.texts(0).map(String::from_utf8_lossy) {
                if !names.iter().any(|known| *known == name) {
                    names.push(name.into_owned());
                }
            }
        }
        messages += 1;
        if messages < MESSAGES_WITH_ALL_NAMES {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    })?;
    Ok(names)
}

/// The first string on a topic of strings, such as a robot description; `None` without messages.
pub fn first_string(log: &Log, topic: TopicId) -> Result<Option<String>, Error> {
    expect_type(log, topic, "std_msgs/msg/String")?;
    let layout = layout_of(log.topic(topic)?, &["data"])?;
    first_text(log, topic, &layout)
}

/// The frame in the header of the first readable message, without a leading slash; `None` if there is
/// none.
pub fn first_frame(log: &Log, topic: TopicId) -> Result<Option<String>, Error> {
    let Ok(layout) = layout_of(log.topic(topic)?, &["header.frame_id"]) else {
        return Ok(None);
    };
    let frame = first_text(log, topic, &layout)?;
    let frame = frame.map(|frame| frame.trim_start_matches('/').to_owned());
    Ok(frame.filter(|frame| !frame.is_empty()))
}

/// The first path of a layout, read from the first message that can be decoded.
fn first_text(log: &Log, topic: TopicId, layout: &Layout) -> Result<Option<String>, Error> {
    let mut fields = Fields::new();
    let mut first = None;
    log.read(
        &[topic],
        &mut |message| match layout.decode(message.data, &mut fields) {
            Ok(()) => {
                first = Some(String::from_utf8_lossy(fields.text(0)).into_owned());
                ControlFlow::Break(())
            }
            Err(_) => ControlFlow::Continue(()),
        },
    )?;
    Ok(first)
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

//! CAN messages as topics: the frames of a bus are decoded while they are read, and every wanted message becomes a
//! topic of its own with one number per signal.

use std::{fmt::Write as _, ops::ControlFlow};

use tipwatch_can::{Decoder, Frame, Message, Selection};
use tipwatch_language::say;

use crate::{
    decode::{FrameDecoder, Stamp, is_can_frame},
    message::{BindingError, DefinitionSource, Losses, RawMessage, Topic, TopicId},
    schema::CDR,
};

/// A CAN message that is wanted as a topic.
#[derive(Debug, Clone, PartialEq)]
pub struct CanTopic {
    /// The name of the new topic.
    pub name: String,
    /// The topic of its frames; `None` for the only one of the log.
    pub bus: Option<String>,
    /// The message.
    pub message: Message,
    /// The only sender, of messages of SAE J1939.
    pub source: Option<u8>,
    /// Remarks for the notes of the log's losses.
    pub notes: Vec<String>,
}

/// The CAN messages of a log that are topics.
#[derive(Debug, Default)]
pub(super) struct CanTopics {
    buses: Vec<Bus>,
}

/// A topic of frames and what is decoded from it.
#[derive(Debug)]
struct Bus {
    topic: TopicId,
    name: String,
    frames: FrameDecoder,
    messages: Vec<(TopicId, String, Selection)>,
}

impl CanTopics {
    /// Adds a topic to those of the log. One that is there already is not added again.
    pub(super) fn add(
        &mut self,
        wanted: &CanTopic,
        topics: &mut Vec<Topic>,
    ) -> Result<(), BindingError> {
        if topics.iter().any(|topic| topic.name == wanted.name) {
            return Ok(());
        }
        let place = self.bus(wanted, topics)?;
        let id = TopicId(topics.len());
        topics.push(Topic {
            id,
            name: wanted.name.clone(),
            type_name: format!("tipwatch_can/msg/{}", wanted.message.name),
            encoding: "cdr".to_owned(),
            schema_encoding: "ros2msg".to_owned(),
            definition: Some(definition(&wanted.message)),
            descriptors: None,
            definition_source: DefinitionSource::BuiltIn,
            message_count: None,
            writers: Vec::new(),
        });
        if let Some(bus) = self.buses.get_mut(place) {
            let selection = Selection {
                message: wanted.message.clone(),
                source: wanted.source,
            };
            bus.messages.push((id, wanted.name.clone(), selection));
        }
        Ok(())
    }

    /// The index of the bus with the frames of a message.
    fn bus(&mut self, wanted: &CanTopic, topics: &[Topic]) -> Result<usize, BindingError> {
        let is_bus = |topic: &&Topic| is_can_frame(&topic.type_name);
        let is_meant = |topic: &&Topic| wanted.bus.as_ref().is_none_or(|name| topic.name == *name);
        let found: Vec<&Topic> = topics.iter().filter(is_bus).filter(is_meant).collect();
        let [topic] = found.as_slice() else {
            let buses = topics.iter().filter(is_bus).map(|topic| topic.name.clone());
            return Err(BindingError::NoBus {
                message: wanted.message.name.clone(),
                named: wanted.bus.clone(),
                available: buses.collect(),
            });
        };
        if let Some(place) = self.buses.iter().position(|bus| bus.topic == topic.id) {
            return Ok(place);
        }
        self.buses.push(Bus {
            topic: topic.id,
            name: topic.name.clone(),
            frames: FrameDecoder::new(topic)?,
            messages: Vec::new(),
        });
        Ok(self.buses.len() - 1)
    }

    /// Whether a topic is a CAN message.
    pub(super) fn has(&self, topic: TopicId) -> bool {
        let mut messages = self.buses.iter().flat_map(|bus| &bus.messages);
        messages.any(|(id, ..)| *id == topic)
    }

    /// Prepares a pass over the log for the wanted topics; `None` if none of them is a CAN message.
    pub(super) fn pass(&self, wanted: &[bool]) -> Option<CanPass> {
        let is_wanted = |topic: TopicId| wanted.get(topic.0).copied().unwrap_or(false);
        let mut buses = Vec::new();
        for bus in &self.buses {
            let messages = bus.messages.iter().filter(|(id, ..)| is_wanted(*id));
            let (topics, selections): (Vec<_>, Vec<_>) = messages
                .map(|(id, name, selection)| ((*id, name.clone()), selection.clone()))
                .unzip();
            if !topics.is_empty() {
                buses.push(BusPass {
                    topic: bus.topic,
                    name: bus.name.clone(),
                    frames: bus.frames.clone(),
                    decoder: Decoder::new(selections),
                    topics,
                    is_wanted: is_wanted(bus.topic),
                    undecodable: 0,
                });
            }
        }
        (!buses.is_empty()).then(|| CanPass {
            buses,
            frame: Frame::default(),
            message: Vec::new(),
        })
    }
}

/// One pass over the frames of a log.
pub(crate) struct CanPass {
    buses: Vec<BusPass>,
    frame: Frame,
    message: Vec<u8>,
}

struct BusPass {
    topic: TopicId,
    name: String,
    frames: FrameDecoder,
    decoder: Decoder,
    topics: Vec<(TopicId, String)>,
    /// Whether the frames themselves are wanted too.
    is_wanted: bool,
    undecodable: u64,
}

impl CanPass {
    /// The topics of frames to read.
    pub(super) fn buses(&self) -> impl Iterator<Item = TopicId> + '_ {
        self.buses.iter().map(|bus| bus.topic)
    }

    /// Passes on a message of the log, or the messages that its frame completes.
    pub(crate) fn visit(
        &mut self,
        message: &RawMessage<'_>,
        visit: &mut dyn FnMut(&RawMessage<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(bus) = self.buses.iter_mut().find(|bus| bus.topic == message.topic) else {
            return visit(message);
        };
        if bus.is_wanted {
            visit(message)?;
        }
        let Ok(Some(stamp)) = bus.frames.decode(message.data, &mut self.frame) else {
            bus.undecodable += 1;
            return ControlFlow::Continue(());
        };
        self.frame.time_ns = message.log_time_ns;
        let mut flow = ControlFlow::Continue(());
        bus.decoder.decode(&self.frame, &mut |place, values| {
            if flow.is_break() {
                return;
            }
            let Some((topic, _)) = bus.topics.get(place) else {
                return;
            };
            encode(stamp, values, &mut self.message);
            flow = visit(&RawMessage {
                topic: *topic,
                data: &self.message,
                ..*message
            });
        });
        flow
    }

    /// Reports what did not become numbers.
    ///
    /// # Errors
    /// Several senders send one message, and the machine file names none of them.
    pub(super) fn finish(self, losses: &mut Losses) -> Result<(), BindingError> {
        self.tell(losses)
    }

    /// Reports the values that did not become numbers so far, of a pass that goes on.
    pub(crate) fn tell(&self, losses: &mut Losses) -> Result<(), BindingError> {
        for bus in &self.buses {
            for _ in 0..bus.undecodable {
                losses.count_undecodable(&bus.name);
            }
            if bus.decoder.error_frames() > 0 {
                let count = bus.decoder.error_frames();
                losses.note(say!("{}: {count} error frames of the bus", bus.name));
            }
            for (place, (selection, (_, name))) in
                bus.decoder.selections().zip(&bus.topics).enumerate()
            {
                let tally = bus.decoder.tally(place).unwrap_or_default();
                if tally.sources.len() > 1 {
                    return Err(BindingError::SeveralSources {
                        topic: name.clone(),
                        sources: tally.sources.keys().copied().collect(),
                    });
                }
                for line in selection.message.told(&tally) {
                    losses.note(format!("{}: {line}", bus.name));
                }
            }
        }
        Ok(())
    }
}

/// The definition of the message type: a header and the signals, with their units as comments.
fn definition(message: &Message) -> String {
    let mut text = "std_msgs/Header header\n".to_owned();
    for signal in &message.signals {
        let unit = match (signal.is_converted, signal.si.symbol) {
            (true, symbol) => symbol.to_owned(),
            (false, _) => format!(
                "{} (unknown unit, not converted)",
                signal.unit.escape_default()
            ),
        };
        // writing to a string cannot fail
        let _ = writeln!(text, "float64 {} # {unit}", signal.name);
    }
    text
}

/// Writes a message of the type above (CDR).
fn encode(stamp: Stamp, values: &[f64], message: &mut Vec<u8>) {
    // the empty name of a frame of reference with its end, padded for the numbers
    const NO_FRAME: [u8; 8] = [1, 0, 0, 0, 0, 0, 0, 0];
    let (sec, nanosec) = stamp.unwrap_or((0, 0));
    message.clear();
    message.extend_from_slice(&CDR);
    message.extend_from_slice(&sec.to_le_bytes());
    message.extend_from_slice(&nanosec.to_le_bytes());
    message.extend_from_slice(&NO_FRAME);
    for value in values {
        message.extend_from_slice(&value.to_le_bytes());
    }
}

//! Any numbers of a log's messages as columns: signals that no kind of sensor covers.

use std::ops::ControlFlow;

use crate::{
    binary::DecodeError,
    binding::BindingError,
    clock::{StampDecision, StampSource},
    error::Error,
    field_path::FieldPath,
    fields::Fields,
    layout::Layout,
    log::Log,
    losses::Losses,
    message::Message,
    timing::TopicStatistics,
    topic::Topic,
};

/// A number of a topic's messages that is wanted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldRequest {
    /// Name of the topic, of any type.
    pub topic: String,
    /// Path of the number, like `wrench.force.z`; with `joint` that of a list, like `effort`.
    pub field: String,
    /// The joint whose place in the list `name` the number has in its own.
    pub joint: Option<String>,
}

/// A wanted number of all messages, in the order in which the file has them.
#[derive(Debug, Clone)]
pub struct FieldRecording {
    /// Which of the stamps is used, and why.
    pub clock: StampDecision,
    /// When each was measured, by that clock.
    pub stamps_ns: Vec<i64>,
    /// The numbers; messages without one are left out.
    pub values: Vec<f64>,
    /// Messages that could not be decoded or have no such number.
    pub missing: u64,
}

/// Reads numbers of any messages in one pass over the log.
///
/// # Errors
/// A topic is not in the log, its messages have no such field, or the log cannot be read. Damage is told
/// by the losses.
pub fn record_fields(
    log: &Log,
    requests: &[FieldRequest],
) -> Result<(Vec<FieldRecording>, Losses), Error> {
    let mut collectors = Vec::with_capacity(requests.len());
    for request in requests {
        collectors.push(Collector::new(log, request)?);
    }
    let topics: Vec<_> = collectors.iter().map(|collector| collector.topic).collect();
    let losses = log.read(&topics, &mut |message| {
        let wanted = collectors.iter_mut().filter(|c| c.topic == message.topic);
        wanted.for_each(|collector| collector.take(message));
        ControlFlow::Continue(())
    })?;
    Ok((
        collectors.into_iter().map(Collector::finish).collect(),
        losses,
    ))
}

/// Where the number stands in a message.
enum Place {
    /// The number itself.
    Single,
    /// In a list, where the list of names has this one.
    Named(String),
}

struct Collector {
    topic: crate::topic::TopicId,
    layout: Layout,
    /// Whether the messages have a header.
    stamped: bool,
    place: Place,
    fields: Fields,
    statistics: TopicStatistics,
    times: Vec<[Option<i64>; 3]>,
    values: Vec<f64>,
    missing: u64,
}

impl Collector {
    fn new(log: &Log, request: &FieldRequest) -> Result<Self, Error> {
        let topics = log.topics();
        let Some(topic) = topics.iter().find(|topic| topic.name == request.topic) else {
            return Err(Error::from(BindingError::NoTopicOfField {
                named: request.topic.clone(),
                field: request.field.clone(),
                available: topics.iter().map(|topic| topic.name.clone()).collect(),
            }));
        };
        let (paths, place) = match &request.joint {
            None => (vec![request.field.clone()], Place::Single),
            Some(joint) => (
                vec!["name[]".into(), format!("{}[]", request.field)],
                Place::Named(joint.clone()),
            ),
        };
        let (layout, stamped) = with_or_without_header(topic, &paths)?;
        Ok(Self {
            topic: topic.id,
            layout,
            stamped,
            place,
            fields: Fields::new(),
            statistics: TopicStatistics::default(),
            times: Vec::new(),
            values: Vec::new(),
            missing: 0,
        })
    }

    fn take(&mut self, message: &Message<'_>) {
        match self.number(message) {
            Ok(value) if value.is_finite() => self.values.push(value),
            _ => {
                self.missing += 1;
                return;
            }
        }
        let header = self.stamped.then(|| self.header_stamp_ns()).flatten();
        let (publish, log) = (message.publish_time_ns, message.log_time_ns);
        self.statistics.push(header, publish, log);
        self.times.push([header, Some(publish), Some(log)]);
    }

    fn number(&mut self, message: &Message<'_>) -> Result<f64, DecodeError> {
        self.layout.decode(message.data, &mut self.fields)?;
        let first = if self.stamped { 2 } else { 0 };
        Ok(match &self.place {
            Place::Single => self.fields.number(first),
            Place::Named(name) => {
                let mut names = self.fields.texts(first);
                let index = names.position(|text| text == name.as_bytes());
                let numbers = self.fields.numbers(first + 1);
                index
                    .and_then(|index| numbers.get(index))
                    .copied()
                    .unwrap_or(f64::NAN)
            }
        })
    }

    fn header_stamp_ns(&self) -> Option<i64> {
        let (sec, nanosec) = (self.fields.number(0) as i64, self.fields.number(1) as i64);
        let stamp = sec.saturating_mul(1_000_000_000).saturating_add(nanosec);
        (stamp != 0).then_some(stamp)
    }

    /// Decides on the clock and leaves out what has no stamp of it.
    fn finish(self) -> FieldRecording {
        let clock = self.statistics.decide();
        let source = match clock.source {
            StampSource::Header => 0,
            StampSource::Publish => 1,
            StampSource::Log => 2,
        };
        let pairs = self.times.iter().zip(&self.values);
        let kept = pairs.filter_map(|(times, &value)| Some((times[source]?, value)));
        let (stamps_ns, values) = kept.unzip();
        FieldRecording {
            clock,
            stamps_ns,
            values,
            missing: self.missing,
        }
    }
}

/// The layout of the header's stamp and the wanted fields, or of the fields alone where there is no
/// header; tells which.
fn with_or_without_header(topic: &Topic, paths: &[String]) -> Result<(Layout, bool), Error> {
    let parse = |paths: &[&str]| -> Result<Vec<FieldPath>, BindingError> {
        let path = |text: &&str| {
            text.parse().map_err(|_| BindingError::NoFieldPath {
                topic: topic.name.clone(),
                field: (*text).into(),
            })
        };
        paths.iter().map(path).collect()
    };
    let wanted: Vec<&str> = paths.iter().map(String::as_str).collect();
    // ROS 1 calls the second part of a stamp otherwise
    for stamp in [
        ["header.stamp.sec", "header.stamp.nanosec"],
        ["header.stamp.secs", "header.stamp.nsecs"],
    ] {
        let with_header = parse(&[&stamp[..], &wanted[..]].concat())?;
        if let Ok(layout) = Layout::of_topic(topic, &with_header) {
            return Ok((layout, true));
        }
    }
    Ok((Layout::of_topic(topic, &parse(&wanted)?)?, false))
}

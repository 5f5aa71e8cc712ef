//! Collects the samples of a log's sensors in columns.

use super::sensor_recording::SensorRecording;
use crate::{
    clock::{Placed, TimeBase, Times, TopicStatistics},
    decode::{DecodeError, NumberDecoder, SampleSpec, SensorDecoder, SensorSample},
    large_columns,
    log::Log,
    message::{BindingError, Error, RawMessage, SensorKind, Topic, TopicId},
};

/// The columns of all requested sensors, for a log or a part of it.
pub(crate) struct SensorColumns {
    sensors: Vec<Collector>,
    /// The number of messages taken.
    messages: u32,
}

impl SensorColumns {
    pub(crate) fn new(sensors: Vec<Collector>) -> Self {
        Self {
            sensors,
            messages: 0,
        }
    }

    /// Empty columns for a part of the same log.
    pub(crate) fn part(&self) -> Self {
        Self::new(self.sensors.iter().map(Collector::part).collect())
    }

    /// Adds a message of a requested topic.
    #[inline]
    pub(crate) fn take(&mut self, message: &RawMessage<'_>) {
        for sensor in &mut self.sensors {
            if sensor.topic == message.topic {
                sensor.take(message, self.messages);
            }
        }
        self.messages += 1;
    }

    /// Appends and empties the part that follows.
    pub(crate) fn append(&mut self, next: &mut Self) {
        for (sensor, next) in self.sensors.iter_mut().zip(&mut next.sensors) {
            sensor.append(next, self.messages);
        }
        self.messages += std::mem::take(&mut next.messages);
    }

    /// Removes and returns the sensors with their samples.
    pub(crate) fn take_sensors(&mut self) -> Vec<Collector> {
        std::mem::take(&mut self.sensors)
    }
}

/// Decodes messages into samples, by type or number by number.
#[derive(Clone)]
pub(crate) enum Decoder {
    Typed(Box<SensorDecoder>),
    Numbers(Box<NumberDecoder>),
}

impl Decoder {
    pub(crate) fn typed(
        topic: &Topic,
        kind: SensorKind,
        joint_names: &[String],
    ) -> Result<Self, BindingError> {
        let decoder = SensorDecoder::new(topic, kind, joint_names)?;
        Ok(Self::Typed(Box::new(decoder)))
    }

    pub(crate) fn numbers(topic: &Topic, sample: &SampleSpec) -> Result<Self, BindingError> {
        Ok(Self::Numbers(Box::new(NumberDecoder::new(topic, sample)?)))
    }

    /// Appends the values of one message and returns its header stamp; `None` for a message without
    /// any value of the sample. Appends nothing after an error. `sample` is scratch space.
    #[inline]
    fn append_values(
        &mut self,
        message: &RawMessage<'_>,
        sample: &mut SensorSample,
        values: &mut Vec<f64>,
    ) -> Result<Option<HeaderStamp>, DecodeError> {
        match self {
            Self::Typed(decoder) => {
                let stamp_ns = decoder.append_values(message, values)?;
                Ok(Some(HeaderStamp(stamp_ns)))
            }
            Self::Numbers(decoder) => {
                let has_any = decoder.decode(message, sample)?;
                if has_any {
                    values.extend_from_slice(&sample.values);
                }
                Ok(has_any.then_some(HeaderStamp(sample.header_stamp_ns)))
            }
        }
    }

    /// Merges the results of the decoder of the part that follows.
    fn append(&mut self, next: &mut Self) {
        if let (Self::Numbers(decoder), Self::Numbers(next)) = (self, next) {
            decoder.append(next);
        }
    }

    pub(crate) fn check_found(&self) -> Result<(), BindingError> {
        match self {
            Self::Typed(_) => Ok(()),
            Self::Numbers(decoder) => decoder.check_found(),
        }
    }
}

/// In nanoseconds; `None` if the header has none.
struct HeaderStamp(Option<i64>);

/// Collects the samples of one sensor.
pub(crate) struct Collector {
    pub(crate) topic: TopicId,
    pub(crate) decoder: Decoder,
    pub(crate) times: Times,
    pub(crate) statistics: TopicStatistics,
    pub(crate) undecodable: u64,
    /// Whether it collects a part of the log. Statistics are sequential, so they are updated when
    /// the part is appended.
    is_part: bool,
    order: Vec<u32>,
    values: Vec<f64>,
    width: usize,
    without_value: u64,
    sample: SensorSample,
}

impl Collector {
    pub(crate) fn new(topic: TopicId, decoder: Decoder, width: usize) -> Self {
        Self {
            topic,
            decoder,
            times: Times::default(),
            statistics: TopicStatistics::default(),
            undecodable: 0,
            is_part: false,
            order: Vec::new(),
            values: Vec::new(),
            width,
            without_value: 0,
            sample: SensorSample::default(),
        }
    }

    fn part(&self) -> Self {
        Self {
            is_part: true,
            ..Self::new(self.topic, self.decoder.clone(), self.width)
        }
    }

    /// Reserves memory for the samples that the index counts, so that columns need not be moved as
    /// they grow. The count of a damaged index may be wrong: no more is reserved than the file may
    /// hold.
    pub(crate) fn reserve(&mut self, log: &Log) -> Result<(), Error> {
        const LIKELY_MOST_RATIO: u64 = 16;
        let most = log.bytes().saturating_mul(LIKELY_MOST_RATIO) / size_of::<f64>() as u64;
        let messages = log.topic(self.topic)?.message_count.unwrap_or(0);
        let counted = messages.saturating_mul(self.width as u64).min(most);
        large_columns::reserve(&mut self.values, counted);
        large_columns::reserve(&mut self.order, messages.min(most));
        self.times.reserve(messages.min(most));
        Ok(())
    }

    #[inline]
    fn take(&mut self, message: &RawMessage<'_>, order: u32) {
        let before = self.values.len();
        let stamp = self
            .decoder
            .append_values(message, &mut self.sample, &mut self.values);
        match stamp {
            Ok(Some(HeaderStamp(header))) if self.values.len() == before + self.width => {
                let (publish, log) = (message.publish_time_ns, message.log_time_ns);
                self.times.push(header, publish, log);
                if !self.is_part {
                    self.statistics.push(header, publish, log);
                }
                self.order.push(order);
            }
            Ok(None) => self.without_value += 1,
            _ => {
                self.values.truncate(before);
                self.undecodable += 1;
            }
        }
    }

    fn append(&mut self, next: &mut Self, messages_before: u32) {
        self.decoder.append(&mut next.decoder);
        for (header, publish, log) in next.times.iter() {
            self.statistics.push(header, publish, log);
        }
        self.times.append(&mut next.times);
        let order = next.order.drain(..).map(|order| messages_before + order);
        self.order.extend(order);
        self.values.append(&mut next.values);
        self.undecodable += std::mem::take(&mut next.undecodable);
        self.without_value += std::mem::take(&mut next.without_value);
    }

    /// Puts the samples on the clock of the log and omits those without a stamp.
    pub(crate) fn finish(mut self, name: &str, time_base: &TimeBase) -> SensorRecording {
        let Placed {
            mut stamps_ns,
            clock,
            correction,
            findings,
        } = time_base.place(name, &self.times, &self.statistics);
        let mut log_times_ns = self.times.into_log_ns();
        let unstamped = stamps_ns.iter().filter(|stamp| stamp.is_none()).count();
        if unstamped > 0 {
            let keep: Vec<bool> = stamps_ns.iter().map(Option::is_some).collect();
            keep_where(&mut stamps_ns, &keep, 1);
            keep_where(&mut log_times_ns, &keep, 1);
            keep_where(&mut self.order, &keep, 1);
            keep_where(&mut self.values, &keep, self.width);
        }
        let mut present_ns = Vec::with_capacity(log_times_ns.len());
        present_ns.extend(stamps_ns.into_iter().flatten());
        SensorRecording {
            topic: self.topic,
            clock,
            correction,
            findings,
            time_base: time_base.clone(),
            stamps_ns: present_ns,
            log_times_ns,
            values: self.values,
            width: self.width,
            statistics: self.statistics,
            undecodable: self.undecodable,
            unstamped: unstamped as u64,
            without_value: self.without_value,
            order: self.order,
        }
    }
}

/// Keeps the groups of `width` elements for which `keep` holds.
fn keep_where<T>(elements: &mut Vec<T>, keep: &[bool], width: usize) {
    let mut index = 0;
    elements.retain(|_| {
        index += 1;
        keep[(index - 1) / width]
    });
}

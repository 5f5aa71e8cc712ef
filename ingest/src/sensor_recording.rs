//! All samples of a log's sensors, each sensor a set of columns.

use std::ops::ControlFlow;

use crate::{
    binary::DecodeError,
    binding::BindingError,
    clock::{
        ClockFinding, Placed, StampCorrection, StampDecision, TimeBase, Times, TopicStatistics,
        Treatment,
    },
    error::Error,
    log::Log,
    losses::Losses,
    merged_parts,
    message::Message,
    number_decoder::{NumberDecoder, NumberSample},
    sensor::{SensorDecoder, SensorKind, SensorSample},
    topic::{Topic, TopicId},
};

/// A sensor whose samples are wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorRequest {
    /// Its topic.
    pub topic: TopicId,
    /// What it measures.
    pub kind: SensorKind,
    /// For joint states the joints wanted, in order.
    pub joint_names: Vec<String>,
    /// The numbers that make up a sample, where the messages are not of the usual type.
    pub numbers: Option<NumberSample>,
    /// Parts of a sample that come on topics of their own; what `numbers` leaves absent.
    pub other_parts: Vec<(TopicId, NumberSample)>,
}

/// All samples of one sensor, in the order in which the file has them.
#[derive(Debug, Clone)]
pub struct SensorRecording {
    /// Its topic.
    pub topic: TopicId,
    /// Which of the stamps is used, and why.
    pub clock: StampDecision,
    /// What was done to the stamps to put them on the clock of the log.
    pub correction: StampCorrection,
    /// What is odd about the clocks.
    pub findings: Vec<ClockFinding>,
    /// The clock that all sensors of the log are on.
    pub time_base: TimeBase,
    /// When each sample was measured, by the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// When the recorder received each sample.
    pub log_times_ns: Vec<i64>,
    /// The values, sample after sample: see [`SensorSample`].
    pub values: Vec<f64>,
    /// How many values a sample has.
    pub width: usize,
    /// Rates, gaps and offsets of the stamps.
    pub statistics: TopicStatistics,
    /// Messages that could not be decoded.
    pub undecodable: u64,
    /// Messages without a stamp of that clock: left out.
    pub unstamped: u64,
    /// Messages that have none of the numbers that make up a sample: left out.
    pub without_value: u64,
    /// Place of each sample among all samples of all sensors in the file.
    pub(crate) order: Vec<u32>,
}

/// Reads all samples of the wanted sensors in one pass over the log.
///
/// `progress` is called now and then with the number of bytes left behind.
///
/// # Errors
/// A topic is not what its kind says, or the log cannot be read. Damage is told by the losses.
pub fn record_sensors(
    log: &Log,
    requests: &[SensorRequest],
    progress: &mut dyn FnMut(u64),
) -> Result<(Vec<SensorRecording>, Losses), Error> {
    let mut collectors = Vec::with_capacity(requests.len());
    for request in requests {
        let topic = log.topic(request.topic)?;
        let (kind, joints) = (request.kind, &request.joint_names);
        let decoder = match &request.numbers {
            Some(numbers) => Decoder::numbers(topic, numbers)?,
            None => Decoder::Typed(Box::new(SensorDecoder::new(topic, kind, joints)?)),
        };
        let width = kind.value_count(joints.len());
        collectors.push(Collector::new(request.topic, decoder, width));
        for (topic, numbers) in &request.other_parts {
            let decoder = Decoder::numbers(log.topic(*topic)?, numbers)?;
            collectors.push(Collector::new(*topic, decoder, width));
        }
    }
    let (recordings, losses) = record(log, collectors, None, progress)?;
    let mut recordings = recordings.into_iter();
    let mut merged = Vec::with_capacity(requests.len());
    for request in requests {
        let first = recordings.next();
        let others = recordings.by_ref().take(request.other_parts.len());
        merged.extend(first.map(|first| others.fold(first, merged_parts::join)));
    }
    Ok((merged, losses))
}

/// Reads a log once for all collectors; several may want the same topic. Their samples come to this clock,
/// without one to that which they have in common.
pub(crate) fn record(
    log: &Log,
    mut collectors: Vec<Collector>,
    time_base: Option<&TimeBase>,
    progress: &mut dyn FnMut(u64),
) -> Result<(Vec<SensorRecording>, Losses), Error> {
    let topics: Vec<TopicId> = collectors.iter().map(|collector| collector.topic).collect();
    for collector in &mut collectors {
        collector.reserve(log)?;
    }
    let mut sample = SensorSample::default();
    let mut order = 0;
    let mut losses = log.read_with_progress(
        &topics,
        &mut |message| {
            let wanting = collectors.iter_mut().filter(|c| c.topic == message.topic);
            for collector in wanting {
                match collector.decoder.decode(message, &mut sample) {
                    Ok(true) => collector.take(&sample, order),
                    Ok(false) => collector.without_value += 1,
                    Err(_) => collector.undecodable += 1,
                }
            }
            order += 1;
            ControlFlow::Continue(())
        },
        progress,
    )?;
    for (place, collector) in collectors.iter().enumerate() {
        collector.decoder.check_found()?;
        // a message that two collectors cannot decode is lost once
        if !topics[..place].contains(&collector.topic) {
            for _ in 0..collector.undecodable {
                losses.count_undecodable(&log.topic(collector.topic)?.name);
            }
        }
    }
    let mut names = Vec::with_capacity(collectors.len());
    for collector in &collectors {
        names.push(log.topic(collector.topic)?.name.as_str());
    }
    let clocks: Vec<(&str, &Times, &TopicStatistics)> = (names.iter().zip(&collectors))
        .enumerate()
        // a topic that two collectors want has one clock
        .filter(|(place, (_, collector))| !topics[..*place].contains(&collector.topic))
        .map(|(_, (name, collector))| (*name, &collector.times, &collector.statistics))
        .collect();
    let own = TimeBase::of(log, &clocks);
    let time_base = time_base.unwrap_or(&own);
    let recordings = (names.iter().zip(collectors))
        .map(|(name, collector)| collector.finish(name, time_base))
        .collect();
    Ok((recordings, losses))
}

/// Which sample of which recording arrived when: pairs of indices, sorted by log time, in file order
/// where log times are equal. Of samples from one message that of the first recording is the last, because
/// rows are at its samples and should know what came with them.
pub fn arrival_order(recordings: &[&SensorRecording]) -> Vec<(usize, usize)> {
    let indices = |(recording, of): (usize, &&SensorRecording)| {
        (0..of.stamps_ns.len()).map(move |i| (recording, i))
    };
    let mut order: Vec<(usize, usize)> = recordings.iter().enumerate().flat_map(indices).collect();
    order.sort_by_key(|&(place, sample)| {
        let recording = &recordings[place];
        let within_message = std::cmp::Reverse(place);
        (
            recording.log_times_ns[sample],
            recording.order[sample],
            within_message,
        )
    });
    order
}

impl SensorRecording {
    /// The values of one sample.
    pub fn sample(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..(index + 1) * self.width]
    }

    /// Adds to every stamp (s): what a machine file states of the topic's clock, or what was found.
    pub fn shift(&mut self, seconds: f64) {
        let shift_ns = (seconds * 1e9).round() as i64;
        for stamp in &mut self.stamps_ns {
            *stamp = stamp.saturating_add(shift_ns);
        }
    }

    /// Why the samples of this topic cannot be put on the clock of the log, if they cannot.
    pub fn refusal(&self) -> Option<&ClockFinding> {
        let is_refusal = |finding: &&ClockFinding| finding.treatment == Treatment::Refused;
        self.findings.iter().find(is_refusal)
    }
}

/// Turns messages into samples, by their type or number by number.
pub(crate) enum Decoder {
    Typed(Box<SensorDecoder>),
    Numbers(Box<NumberDecoder>),
}

impl Decoder {
    pub(crate) fn numbers(topic: &Topic, sample: &NumberSample) -> Result<Self, BindingError> {
        Ok(Self::Numbers(Box::new(NumberDecoder::new(topic, sample)?)))
    }

    /// Decodes one message; whether it has anything of the sample.
    fn decode(
        &mut self,
        message: &Message<'_>,
        sample: &mut SensorSample,
    ) -> Result<bool, DecodeError> {
        match self {
            Self::Typed(decoder) => decoder.decode(message, sample).map(|()| true),
            Self::Numbers(decoder) => decoder.decode(message, sample),
        }
    }

    fn check_found(&self) -> Result<(), BindingError> {
        match self {
            Self::Typed(_) => Ok(()),
            Self::Numbers(decoder) => decoder.check_found(),
        }
    }
}

/// Collects the samples of one sensor.
pub(crate) struct Collector {
    topic: TopicId,
    decoder: Decoder,
    times: Times,
    order: Vec<u32>,
    values: Vec<f64>,
    width: usize,
    statistics: TopicStatistics,
    undecodable: u64,
    without_value: u64,
}

impl Collector {
    pub(crate) fn new(topic: TopicId, decoder: Decoder, width: usize) -> Self {
        Self {
            topic,
            decoder,
            times: Times::default(),
            order: Vec::new(),
            values: Vec::new(),
            width,
            statistics: TopicStatistics::default(),
            undecodable: 0,
            without_value: 0,
        }
    }

    /// Makes room for the values of as many samples as the index counts, so that they need not be moved as
    /// they grow. A damaged index counts anything: no more is reserved than such a file may hold.
    fn reserve(&mut self, log: &Log) -> Result<(), Error> {
        const LIKELY_MOST_RATIO: u64 = 16;
        let most = log.bytes().saturating_mul(LIKELY_MOST_RATIO) / size_of::<f64>() as u64;
        let messages = log.topic(self.topic)?.message_count.unwrap_or(0);
        let counted = messages.saturating_mul(self.width as u64).min(most);
        // Without it they grow as they come.
        let _ = self
            .values
            .try_reserve_exact(usize::try_from(counted).unwrap_or(0));
        Ok(())
    }

    fn take(&mut self, sample: &SensorSample, order: u32) {
        if sample.values.len() != self.width {
            self.undecodable += 1;
            return;
        }
        let (publish, log) = (sample.publish_time_ns, sample.log_time_ns);
        self.times.push(sample.header_stamp_ns, publish, log);
        self.statistics.push(sample.header_stamp_ns, publish, log);
        self.order.push(order);
        self.values.extend_from_slice(&sample.values);
    }

    /// Puts the samples on the clock of the log and leaves out what has no stamp of it.
    fn finish(mut self, name: &str, time_base: &TimeBase) -> SensorRecording {
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
        SensorRecording {
            topic: self.topic,
            clock,
            correction,
            findings,
            time_base: time_base.clone(),
            stamps_ns: stamps_ns.into_iter().flatten().collect(),
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

//! Decodes messages one at a time as they arrive, into the samples that reading a whole log gives.

use std::ops::Range;

use super::{
    decoder::{Decoded, Decoder},
    merged_parts::{self, Joiner},
    part::SamplesSlice,
    pass::{Sink, Wanted, pass},
    record_sensors::sensors_of,
    sensor_recording::SensorRequest,
};
use crate::{
    clock::{ClockFinding, MessageTimes, Placement, StampDecision, Treatment},
    decode::{DecodeError, SensorSample},
    log::{CanPass, Log},
    message::{Error, Losses, RawMessage, TopicId},
};

/// Samples of the sensors of a running system.
///
/// A log of its first messages tells what the topics are and on which clocks their stamps are. What was fitted to
/// those messages (the offset of a clock without stamps) is held from then on. The samples are those of
/// [`record_sensors`](crate::record_sensors) of a log of all messages, in the order of their arrival, as far as that
/// does not depend on later messages.
pub struct SampleStream {
    parts: Vec<StreamPart>,
    requests: Vec<StreamRequest>,
    can: Option<CanPass>,
    ready: Vec<ReadySample>,
    clocks: Vec<StreamClock>,
}

/// The clock of one topic of a stream.
#[derive(Debug, Clone)]
pub struct StreamClock {
    /// The topic.
    pub topic: TopicId,
    /// The time source, and why it was chosen.
    pub decision: StampDecision,
    /// Findings about the clock.
    pub findings: Vec<ClockFinding>,
    /// Samples of the topic in the log of the first messages.
    pub samples: usize,
}

/// Refusals of one message: counts by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StreamRefusals {
    /// Sensors that could not decode the message.
    pub undecodable: u32,
    /// Samples without a usable stamp.
    pub unstamped: u32,
    /// Messages without any number of the sample.
    pub without_value: u32,
}

/// The samples that one topic gives.
struct StreamPart {
    topic: TopicId,
    decoder: Decoder,
    width: usize,
    placement: Placement,
    /// Messages so far.
    index: usize,
    scratch: SensorSample,
    values: Vec<f64>,
}

struct StreamRequest {
    parts: Range<usize>,
    joiners: Vec<Joiner>,
}

/// A sample that waits for the others of its message.
struct ReadySample {
    request: usize,
    stamp_ns: i64,
    values: Vec<f64>,
}

/// Counts nothing: only the times of the samples are wanted.
struct NoSink;

impl Sink for NoSink {
    fn take(&mut self, _: usize, _: SamplesSlice<'_>) {}
}

impl SampleStream {
    /// Prepares decoding by a log of the first messages.
    ///
    /// # Errors
    /// A topic does not carry its kind of sensor, or the log cannot be read.
    pub fn new(log: &Log, requests: &[SensorRequest]) -> Result<Self, Error> {
        let wanted = sensors_of(log, requests)?;
        let topics: Vec<TopicId> = wanted.iter().map(|wanted| wanted.topic).collect();
        let passed = pass(log, wanted, &mut NoSink, &mut |_| {})?;
        let mut clocks: Vec<StreamClock> = Vec::new();
        let mut parts = Vec::new();
        for (wanted, sensor) in sensors_of(log, requests)?.into_iter().zip(&passed.sensors) {
            let placed = passed
                .time_base
                .place(&sensor.name, &sensor.times, &sensor.statistics);
            let Wanted {
                topic,
                decoder,
                width,
            } = wanted;
            parts.push(StreamPart {
                topic,
                decoder,
                width,
                placement: placed.placement.held(sensor.times.iter().last()),
                index: 0,
                scratch: SensorSample::default(),
                values: Vec::new(),
            });
            if clocks.iter().all(|clock| clock.topic != topic) {
                clocks.push(StreamClock {
                    topic,
                    decision: placed.clock,
                    findings: placed.findings,
                    samples: sensor.times.len(),
                });
            }
        }
        let mut first = 0;
        let requests = requests.iter().map(|request| {
            let count = 1 + request.other_parts.len();
            let parts = first..first + count;
            first += count;
            let joiners = request.other_parts.iter();
            StreamRequest {
                parts,
                joiners: joiners
                    .map(|(_, sample)| Joiner::new(merged_parts::places_of(sample, request.kind)))
                    .collect(),
            }
        });
        Ok(Self {
            requests: requests.collect(),
            parts,
            can: log.can_pass(&topics)?,
            ready: Vec::new(),
            clocks,
        })
    }

    /// The clock of each topic.
    #[must_use]
    pub fn clocks(&self) -> &[StreamClock] {
        &self.clocks
    }

    /// Returns the first topic whose samples cannot be put on the common clock, with the finding that refuses them.
    #[must_use]
    pub fn refusal(&self) -> Option<(TopicId, &ClockFinding)> {
        self.clocks.iter().find_map(|clock| {
            let refused = |finding: &&ClockFinding| finding.treatment == Treatment::Refused;
            Some((clock.topic, clock.findings.iter().find(refused)?))
        })
    }

    /// Decodes a message and passes every sample that is complete with it to `each`: the index of its request, its
    /// time of measurement (ns) and its values. Of the samples of one message the first request comes last: rows are
    /// computed at its samples and must include the others.
    pub fn take(
        &mut self,
        message: &RawMessage<'_>,
        each: &mut dyn FnMut(usize, i64, &[f64]),
    ) -> StreamRefusals {
        let mut refusals = StreamRefusals::default();
        let (parts, requests, ready) = (&mut self.parts, &mut self.requests, &mut self.ready);
        let mut visit = |message: &RawMessage<'_>| {
            for (place, request) in requests.iter_mut().enumerate() {
                request.take(place, parts, message, ready, &mut refusals);
            }
            ready.sort_by_key(|sample| std::cmp::Reverse(sample.request));
            for sample in ready.drain(..) {
                each(sample.request, sample.stamp_ns, &sample.values);
            }
            std::ops::ControlFlow::Continue(())
        };
        match &mut self.can {
            Some(can) => {
                let _ = can.visit(message, &mut visit);
            }
            None => {
                let _ = visit(message);
            }
        }
        refusals
    }

    /// Reports the frames of CAN buses that did not become numbers so far as losses.
    ///
    /// # Errors
    /// Several senders send one message, and the machine file names none of them.
    pub fn check_can(&self, losses: &mut Losses) -> Result<(), Error> {
        match &self.can {
            Some(can) => Ok(can.tell(losses)?),
            None => Ok(()),
        }
    }
}

impl StreamPart {
    /// The sample of a message of this topic: its time (ns), with the values in `self.values`.
    fn take(&mut self, message: &RawMessage<'_>, refusals: &mut StreamRefusals) -> Option<i64> {
        self.values.clear();
        let index = self.index;
        let decoded = self
            .decoder
            .append_values(message, &mut self.scratch, &mut self.values);
        match decoded {
            Ok(Decoded::Sample { header_stamp_ns }) if self.values.len() == self.width => {
                self.index += 1;
                let times = MessageTimes {
                    header_stamp_ns: header_stamp_ns.filter(|&stamp| stamp != 0),
                    publish_time_ns: message.publish_time_ns,
                    log_time_ns: message.log_time_ns,
                };
                let stamp_ns = self.placement.stamp_ns(index, &times);
                refusals.unstamped += u32::from(stamp_ns.is_none());
                stamp_ns
            }
            Ok(Decoded::WithoutValue) => {
                refusals.without_value += 1;
                None
            }
            Ok(Decoded::OfOtherJoints) | Err(DecodeError::OtherFrame) => None,
            _ => {
                refusals.undecodable += 1;
                None
            }
        }
    }
}

impl StreamRequest {
    fn take(
        &mut self,
        request: usize,
        parts: &mut [StreamPart],
        message: &RawMessage<'_>,
        ready: &mut Vec<ReadySample>,
        refusals: &mut StreamRefusals,
    ) {
        let Some(parts) = parts.get_mut(self.parts.clone()) else {
            return;
        };
        for (place, part) in parts.iter_mut().enumerate() {
            if part.topic != message.topic {
                continue;
            }
            let Some(stamp_ns) = part.take(message, refusals) else {
                continue;
            };
            let mut complete = Vec::new();
            let next = match place.checked_sub(1) {
                None => {
                    complete.push((stamp_ns, part.values.clone()));
                    0
                }
                Some(joiner) => {
                    if let Some(joining) = self.joiners.get_mut(joiner) {
                        joining.part(stamp_ns, &part.values, &mut complete);
                    }
                    joiner + 1
                }
            };
            // through the parts behind
            for joining in self.joiners.iter_mut().skip(next) {
                for (stamp_ns, values) in std::mem::take(&mut complete) {
                    joining.first(stamp_ns, values, &mut complete);
                }
            }
            ready.extend(complete.into_iter().map(|(stamp_ns, values)| ReadySample {
                request,
                stamp_ns,
                values,
            }));
        }
    }
}

//! One pass over a log that decodes the samples of all requested sensors.
//!
//! Threads decode whole chunks into parts. The parts reach the [`Sink`] in file order.

use std::{
    cell::RefCell,
    ops::ControlFlow,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tipwatch_language::say;

use super::{
    decoder::Decoder,
    part::{Part, PartOfSensor, SamplesSlice},
    sensor_reading::SensorReading,
};
use crate::{
    clock::{ClockFit, Placed, TimeBase, Times, TopicStatistics},
    formats::Batch,
    log::Log,
    message::{Error, Losses, RawMessage, TopicId},
};

/// Messages outside batches that are collected before they are handed on.
const LOOSE_MESSAGES: u32 = 1024;
/// Ratio of the messages reserved for a chunk to its share of the file; beyond that, its columns grow: indexes take bytes, too.
const EXPECTED_EXCESS: f64 = 1.3;

/// Receives the samples of each sensor in file order, some at a time.
pub(crate) trait Sink {
    fn take(&mut self, sensor: usize, samples: SamplesSlice<'_>);
}

/// A sensor to be read.
pub(crate) struct Wanted {
    pub(crate) topic: TopicId,
    pub(crate) decoder: Decoder,
    /// The number of values per sample.
    pub(crate) width: usize,
}

/// Result of a pass for one sensor, besides its samples.
pub(crate) struct SensorPass {
    pub(crate) topic: TopicId,
    /// Name of the topic.
    pub(crate) name: String,
    pub(crate) width: usize,
    decoder: Decoder,
    /// The times of all samples.
    pub(crate) times: Times,
    pub(crate) statistics: TopicStatistics,
    /// The fit of its clock, once all times are known.
    pub(crate) fit: Option<ClockFit>,
    pub(crate) undecodable: u64,
    pub(crate) without_value: u64,
    of_other_frames: u64,
}

/// The result of a pass.
pub(crate) struct Passed {
    pub(crate) sensors: Vec<SensorPass>,
    /// The clock that the sensors have in common.
    pub(crate) time_base: TimeBase,
    pub(crate) losses: Losses,
}

/// Reads a log once for all wanted sensors, of which several may use the same topic.
pub(crate) fn pass(
    log: &Log,
    wanted: Vec<Wanted>,
    sink: &mut dyn Sink,
    progress: &mut dyn FnMut(u64),
) -> Result<Passed, Error> {
    let topics: Vec<TopicId> = wanted.iter().map(|wanted| wanted.topic).collect();
    let mut sensors = Vec::with_capacity(wanted.len());
    let mut of_log = Vec::with_capacity(wanted.len());
    for wanted in wanted {
        let mut sensor = SensorPass::new(log, wanted)?;
        // so that they need not be moved as they grow
        let samples = most_samples(log, sensor.topic)?;
        sensor.times.reserve_exact(samples);
        of_log.push(samples);
        sensors.push(sensor);
    }
    let of_log: Arc<[usize]> = of_log.into();
    let empty = || Part::new(sensors.iter().map(SensorPass::part));
    // a part that a batch has delivered and the pass has not yet taken
    let inbox = Arc::new(Mutex::new(empty()));
    let prototypes: Vec<Wanted> = sensors.iter().map(SensorPass::wanted).collect();
    let empty_batch = || -> Box<dyn Batch> {
        Box::new(SensorBatch {
            part: Part::new(prototypes.iter().map(Wanted::part)),
            of_log: Arc::clone(&of_log),
            inbox: Arc::clone(&inbox),
        })
    };
    let loose = empty();
    let pass = RefCell::new(Pass {
        sensors,
        loose,
        messages: 0,
        sink,
    });
    let mut visit = |message: &RawMessage<'_>| {
        pass.borrow_mut().message(message);
        ControlFlow::Continue(())
    };
    let delivered = || {
        let mut pass = pass.borrow_mut();
        pass.loose();
        pass.part(&mut lock(&inbox));
    };
    let mut losses = log.read_in_batches(
        &topics,
        &mut visit,
        progress,
        Some((&empty_batch, &delivered)),
    )?;
    let mut pass = pass.into_inner();
    pass.loose();
    let mut sensors = pass.sensors;
    for (place, sensor) in sensors.iter().enumerate() {
        sensor.decoder.check_found()?;
        if sensor.of_other_frames > 0 {
            losses.note(say!(
                "{} messages of {} are of other sensors than that of header.frame_id {:?}, and were left out",
                sensor.of_other_frames,
                sensor.name,
                sensor.decoder.frame_id()
            ));
        }
        // a message that two sensors cannot decode counts once
        if !topics[..place].contains(&sensor.topic) {
            for _ in 0..sensor.undecodable {
                losses.count_undecodable(&sensor.name);
            }
        }
    }
    // a topic used by two sensors has one clock
    let has_own = |place: usize| !topics[..place].contains(&topics[place]);
    let clocks: Vec<(&str, &Times, &TopicStatistics)> = (sensors.iter().enumerate())
        .filter(|(place, _)| has_own(*place))
        .map(|(_, sensor)| (sensor.name.as_str(), &sensor.times, &sensor.statistics))
        .collect();
    let (time_base, fits) = TimeBase::with_fits(log, &clocks);
    let fitted = (sensors.iter_mut().enumerate()).filter(|(place, _)| has_own(*place));
    for ((_, sensor), fit) in fitted.zip(fits) {
        sensor.fit = fit;
    }
    Ok(Passed {
        sensors,
        time_base,
        losses,
    })
}

struct Pass<'s> {
    sensors: Vec<SensorPass>,
    /// Samples of messages outside batches that have not been handed on.
    loose: Part,
    /// The number of messages handed on.
    messages: u32,
    sink: &'s mut dyn Sink,
}

impl Pass<'_> {
    fn message(&mut self, message: &RawMessage<'_>) {
        self.loose.take(message);
        if self.loose.messages == LOOSE_MESSAGES {
            self.loose();
        }
    }

    fn loose(&mut self) {
        let mut loose = std::mem::replace(&mut self.loose, Part::new(std::iter::empty()));
        self.part(&mut loose);
        self.loose = loose;
    }

    /// Hands on and empties the part that follows.
    fn part(&mut self, part: &mut Part) {
        for (place, (sensor, part)) in self.sensors.iter_mut().zip(&mut part.sensors).enumerate() {
            for order in &mut part.samples.order {
                *order += self.messages;
            }
            let samples = part.samples.as_slice(part.width);
            sensor.statistics.extend(samples.times);
            sensor.times.append(samples.times);
            self.sink.take(place, samples);
            part.samples.clear();
            sensor.decoder.append(&mut part.decoder);
            sensor.undecodable += std::mem::take(&mut part.undecodable);
            sensor.without_value += std::mem::take(&mut part.without_value);
            sensor.of_other_frames += std::mem::take(&mut part.of_other_frames);
        }
        self.messages += std::mem::take(&mut part.messages);
    }
}

impl SensorPass {
    /// Puts the sensor on the clock of the log; returns its reading and the times of its samples. The number of samples without a
    /// usable stamp is left to the caller.
    pub(super) fn place(self, time_base: &TimeBase) -> (SensorReading, Times) {
        let Placed {
            placement,
            clock,
            correction,
            findings,
        } = time_base.place_fitted(&self.name, &self.times, &self.statistics, self.fit);
        let reading = SensorReading {
            topic: self.topic,
            clock,
            correction,
            findings,
            time_base: time_base.clone(),
            placement,
            statistics: self.statistics,
            samples: self.times.len(),
            unstamped: 0,
            undecodable: self.undecodable,
            without_value: self.without_value,
        };
        (reading, self.times)
    }

    fn new(log: &Log, wanted: Wanted) -> Result<Self, Error> {
        Ok(Self {
            topic: wanted.topic,
            name: log.topic(wanted.topic)?.name.clone(),
            width: wanted.width,
            decoder: wanted.decoder,
            times: Times::default(),
            statistics: TopicStatistics::default(),
            fit: None,
            undecodable: 0,
            without_value: 0,
            of_other_frames: 0,
        })
    }

    fn wanted(&self) -> Wanted {
        Wanted {
            topic: self.topic,
            decoder: self.decoder.clone(),
            width: self.width,
        }
    }

    fn part(&self) -> PartOfSensor {
        self.wanted().part()
    }
}

impl Wanted {
    fn part(&self) -> PartOfSensor {
        PartOfSensor::new(self.topic, self.decoder.clone(), self.width)
    }
}

/// The messages of a topic that the index counts. The count of a damaged index may be wrong: no more
/// than the file may hold.
pub(crate) fn most_samples(log: &Log, topic: TopicId) -> Result<usize, Error> {
    const LIKELY_MOST_RATIO: u64 = 16;
    let most = log.bytes().saturating_mul(LIKELY_MOST_RATIO) / size_of::<f64>() as u64;
    let messages = log.topic(topic)?.message_count.unwrap_or(0);
    Ok(usize::try_from(messages.min(most)).unwrap_or(usize::MAX))
}

/// The samples of one chunk.
struct SensorBatch {
    part: Part,
    /// The number of messages of each sensor in the log.
    of_log: Arc<[usize]>,
    inbox: Arc<Mutex<Part>>,
}

impl Batch for SensorBatch {
    fn expect(&mut self, share: f64, most: usize) {
        for (sensor, &of_log) in self.part.sensors.iter_mut().zip(&*self.of_log) {
            let messages = (of_log as f64 * share * EXPECTED_EXCESS) as usize;
            sensor.reserve(messages.min(most));
        }
    }

    fn take(&mut self, message: &RawMessage<'_>) {
        self.part.take(message);
    }

    fn deliver(&mut self) {
        // the part in the inbox has been taken, so that it is empty
        std::mem::swap(&mut self.part, &mut lock(&self.inbox));
    }
}

/// A thread that panics while holding the lock ends the read anyway.
fn lock(part: &Mutex<Part>) -> MutexGuard<'_, Part> {
    part.lock().unwrap_or_else(PoisonError::into_inner)
}

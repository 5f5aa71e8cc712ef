//! All samples of a log's sensors, each sensor a set of columns.

use std::{
    ops::ControlFlow,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use crate::{
    clock::{
        ClockFinding, StampCorrection, StampDecision, TimeBase, Times, TopicStatistics, Treatment,
    },
    error::Error,
    log::Log,
    losses::Losses,
    merged_parts,
    message::Message,
    number_decoder::NumberSample,
    reader::Batch,
    sensor::SensorKind,
    sensor_columns::{Collector, Decoder, SensorColumns},
    topic::TopicId,
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
    /// The values, sample after sample: see [`SensorSample`](crate::SensorSample).
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
            None => Decoder::typed(topic, kind, joints)?,
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
    let columns = Arc::new(Mutex::new(SensorColumns::new(collectors)));
    let prototype = lock(&columns).part();
    let empty_batch = || -> Box<dyn Batch> {
        Box::new(SensorBatch {
            columns: prototype.part(),
            target: Arc::clone(&columns),
        })
    };
    let mut visit = |message: &Message<'_>| {
        lock(&columns).take(message);
        ControlFlow::Continue(())
    };
    let mut losses = log.read_in_batches(&topics, &mut visit, progress, Some(&empty_batch))?;
    let collectors = lock(&columns).take_sensors();
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
    Ok((finish(&names, collectors, time_base), losses))
}

/// Puts all sensors on one clock, on as many threads as there are processors.
fn finish(names: &[&str], sensors: Vec<Collector>, time_base: &TimeBase) -> Vec<SensorRecording> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut waiting: Vec<(usize, Collector)> = sensors.into_iter().enumerate().collect();
    // The largest first, so that no thread is left alone with it at the end.
    waiting.sort_by_key(|(_, sensor)| sensor.times.len());
    let threads = threads.min(waiting.len());
    let waiting = Mutex::new(waiting);
    let next = || waiting.lock().unwrap_or_else(PoisonError::into_inner).pop();
    let work = || {
        let mut done = Vec::new();
        while let Some((place, sensor)) = next() {
            done.push((place, sensor.finish(names[place], time_base)));
        }
        done
    };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut done = work();
        for other in others {
            match other.join() {
                Ok(more) => done.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, recording)| recording).collect()
}

/// The samples of one chunk, which go to those of the log when its turn comes.
struct SensorBatch {
    columns: SensorColumns,
    target: Arc<Mutex<SensorColumns>>,
}

impl Batch for SensorBatch {
    fn take(&mut self, message: &Message<'_>) {
        self.columns.take(message);
    }

    fn deliver(&mut self) {
        lock(&self.target).append(&mut self.columns);
    }
}

/// A thread that panicked with the lock ends the reading anyway.
fn lock(columns: &Mutex<SensorColumns>) -> MutexGuard<'_, SensorColumns> {
    columns.lock().unwrap_or_else(PoisonError::into_inner)
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

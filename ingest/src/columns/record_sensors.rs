//! Reads all samples of a log's sensors in one pass.

use std::{
    ops::ControlFlow,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use super::{
    merged_parts,
    sensor_columns::{Collector, Decoder, SensorColumns},
    sensor_recording::{SensorRecording, SensorRequest},
};
use crate::{
    clock::{TimeBase, Times, TopicStatistics},
    formats::Batch,
    log::Log,
    message::{Error, Losses, RawMessage, TopicId},
};

/// Reads all samples of the wanted sensors in one pass over the log.
///
/// `progress` is called from time to time with the number of bytes read so far.
///
/// # Errors
/// A topic does not carry its kind of sensor, or the log cannot be read. Damage is reported in the
/// losses.
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

/// Reads a log once for all collectors, of which several may use the same topic. Samples are put on
/// `time_base`, or else on the clock that they have in common.
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
    let mut visit = |message: &RawMessage<'_>| {
        lock(&columns).take(message);
        ControlFlow::Continue(())
    };
    let mut losses = log.read_in_batches(&topics, &mut visit, progress, Some(&empty_batch))?;
    let collectors = lock(&columns).take_sensors();
    for (place, collector) in collectors.iter().enumerate() {
        collector.decoder.check_found()?;
        // a message that two collectors cannot decode counts once
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
        // a topic used by two collectors has one clock
        .filter(|(place, (_, collector))| !topics[..*place].contains(&collector.topic))
        .map(|(_, (name, collector))| (*name, &collector.times, &collector.statistics))
        .collect();
    let own = TimeBase::of(log, &clocks);
    let time_base = time_base.unwrap_or(&own);
    Ok((finish(&names, collectors, time_base), losses))
}

/// Puts all sensors on one clock, using all processors.
fn finish(names: &[&str], sensors: Vec<Collector>, time_base: &TimeBase) -> Vec<SensorRecording> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut waiting: Vec<(usize, Collector)> = sensors.into_iter().enumerate().collect();
    // The largest first, so that no thread starts it last.
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

/// The samples of one chunk, appended to those of the log in file order.
struct SensorBatch {
    columns: SensorColumns,
    target: Arc<Mutex<SensorColumns>>,
}

impl Batch for SensorBatch {
    fn take(&mut self, message: &RawMessage<'_>) {
        self.columns.take(message);
    }

    fn deliver(&mut self) {
        lock(&self.target).append(&mut self.columns);
    }
}

/// A thread that panics while holding the lock ends the read anyway.
fn lock(columns: &Mutex<SensorColumns>) -> MutexGuard<'_, SensorColumns> {
    columns.lock().unwrap_or_else(PoisonError::into_inner)
}

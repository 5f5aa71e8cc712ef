//! All samples of a log's sensors as columns.

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use super::{
    part::SamplesSlice,
    pass::{SensorPass, Sink, Wanted, most_samples, pass},
    sensor_recording::SensorRecording,
};
use crate::{
    clock::{Placement, TimeBase},
    log::Log,
    message::{Error, Losses},
};

/// Reads all samples of the wanted sensors. They are put on `time_base`, or else on the clock that
/// they have in common.
pub(crate) fn record(
    log: &Log,
    wanted: Vec<Wanted>,
    time_base: Option<&TimeBase>,
    progress: &mut dyn FnMut(u64),
) -> Result<(Vec<SensorRecording>, Losses), Error> {
    let mut columns = WholeColumns(Vec::with_capacity(wanted.len()));
    for wanted in &wanted {
        let samples = most_samples(log, wanted.topic)?;
        let mut of_sensor = Columns::default();
        of_sensor.reserve(samples, wanted.width);
        columns.0.push(of_sensor);
    }
    let passed = pass(log, wanted, &mut columns, progress)?;
    let time_base = time_base.unwrap_or(&passed.time_base);
    // puts all sensors on one clock, using all processors
    let sensors = passed.sensors.into_par_iter().zip(columns.0);
    let recordings = sensors.map(|(sensor, columns)| columns.finish(sensor, time_base));
    Ok((recordings.collect(), passed.losses))
}

/// The columns of all sensors.
struct WholeColumns(Vec<Columns>);

/// The columns of one sensor, besides its times.
#[derive(Default)]
pub(crate) struct Columns {
    order: Vec<u32>,
    values: Vec<f64>,
}

impl Sink for WholeColumns {
    fn take(&mut self, sensor: usize, samples: SamplesSlice<'_>) {
        self.0[sensor].append(samples);
    }
}

impl Columns {
    /// Reserves memory for so many samples, if it is available, so that columns need not be moved as they grow.
    fn reserve(&mut self, samples: usize, width: usize) {
        let _ = self.values.try_reserve_exact(samples.saturating_mul(width));
        let _ = self.order.try_reserve_exact(samples);
    }

    pub(crate) fn append(&mut self, samples: SamplesSlice<'_>) {
        self.order.extend_from_slice(samples.order);
        self.values.extend_from_slice(samples.values);
    }

    /// Puts the samples on the clock of the log and omits those without a stamp.
    pub(crate) fn finish(mut self, sensor: SensorPass, time_base: &TimeBase) -> SensorRecording {
        let width = sensor.width;
        let (mut reading, times) = sensor.place(time_base);
        let placement = std::mem::replace(&mut reading.placement, Placement::as_stamped());
        let mut unstamped = Vec::new();
        let (stamps_ns, log_times_ns) = placement.apply(times, |at| unstamped.push(at));
        omit(&mut self.order, &unstamped, 1);
        omit(&mut self.values, &unstamped, width);
        reading.samples = stamps_ns.len();
        reading.unstamped = unstamped.len() as u64;
        SensorRecording {
            reading,
            stamps_ns,
            log_times_ns,
            values: self.values,
            width,
            order: self.order,
        }
    }
}

/// Removes groups of `width` elements by their index, in increasing order.
fn omit<T: Copy>(elements: &mut Vec<T>, groups: &[usize], width: usize) {
    let mut to = groups.first().map_or(elements.len(), |first| first * width);
    for (place, group) in groups.iter().enumerate() {
        let from = (group + 1) * width;
        let end = groups
            .get(place + 1)
            .map_or(elements.len(), |next| next * width);
        elements.copy_within(from..end, to);
        to += end - from;
    }
    elements.truncate(to);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_omitted_wherever_they_are() {
        for (omitted, kept) in [
            (vec![], vec![0, 1, 2, 3, 4, 5, 6, 7]),
            (vec![0], vec![2, 3, 4, 5, 6, 7]),
            (vec![1, 2], vec![0, 1, 6, 7]),
            (vec![0, 2, 3], vec![2, 3]),
            (vec![0, 1, 2, 3], vec![]),
        ] {
            let mut elements: Vec<u32> = (0..8).collect();
            omit(&mut elements, &omitted, 2);
            assert_eq!(elements, kept);
        }
    }
}

//! Merges samples whose parts come on separate topics, such as accelerations in one bus message and
//! angular velocities in another.

use std::{collections::VecDeque, ops::Range};

use super::{
    sensor_reading::SensorReading,
    sensor_recording::{SensorRecording, SensorRequest},
};
use crate::{
    decode::{SampleSpec, ValueSource},
    message::SensorKind,
};

/// Longest step between samples of a part that is interpolated (ns).
const LONGEST_STEP_NS: i64 = 250_000_000;
/// Index of the attitude, which is optional.
const ATTITUDE: usize = 6;

/// The samples of a request, of the recordings of its parts, in their order.
pub(super) fn join_all(
    request: &SensorRequest,
    mut parts: impl Iterator<Item = SensorRecording>,
) -> Option<SensorRecording> {
    let first = parts.next()?;
    let others = request.other_parts.iter().zip(parts);
    Some(others.fold(first, |first, ((_, sample), part)| {
        // a part that is never there is absent, and the samples are those of the others
        match part.stamps_ns.is_empty() {
            true => first,
            false => join(first, part, &places_of(sample, request.kind)),
        }
    }))
}

/// Merges a part into the samples of a recording by linear interpolation. Samples at whose time the
/// part is unknown are omitted, unless the part is the attitude.
///
/// A merged sample is available once the later of the two interpolated samples has arrived; that is
/// its log time.
fn join(first: SensorRecording, part: SensorRecording, is_of_part: &[bool]) -> SensorRecording {
    let mut by_stamp: Vec<usize> = (0..part.stamps_ns.len()).collect();
    by_stamp.sort_by_key(|&i| part.stamps_ns[i]);
    let sample = |at: usize| {
        by_stamp.get(at).map(|&i| PartSample {
            stamp_ns: part.stamps_ns[i],
            values: part.sample(i),
        })
    };
    let mut joined = SensorRecording {
        stamps_ns: Vec::new(),
        log_times_ns: Vec::new(),
        values: Vec::new(),
        order: Vec::new(),
        width: first.width,
        reading: SensorReading {
            undecodable: first.reading.undecodable + part.reading.undecodable,
            unstamped: first.reading.unstamped + part.reading.unstamped,
            without_value: first.reading.without_value + part.reading.without_value,
            ..first.reading
        },
    };
    for (i, &stamp_ns) in first.stamps_ns.iter().enumerate() {
        let values = &first.values[i * first.width..(i + 1) * first.width];
        let next = by_stamp.partition_point(|&i| part.stamps_ns[i] < stamp_ns);
        let around = around(next, sample, stamp_ns);
        if !merge(values, is_of_part, around, stamp_ns, &mut joined.values) {
            continue;
        }
        let (mut log_time_ns, mut order) = (first.log_times_ns[i], first.order[i]);
        if around.is_some() {
            log_time_ns = log_time_ns.max(part.log_times_ns[by_stamp[next]]);
            order = order.max(part.order[by_stamp[next]]);
        }
        joined.stamps_ns.push(stamp_ns);
        joined.log_times_ns.push(log_time_ns);
        joined.order.push(order);
    }
    joined.reading.samples = joined.stamps_ns.len();
    joined
}

/// Appends a sample with the values of the part between two of its samples; `false`, and nothing, if one that is needed is
/// unknown.
fn merge(
    values: &[f64],
    is_of_part: &[bool],
    around: Option<[PartSample<'_>; 2]>,
    stamp_ns: i64,
    into: &mut Vec<f64>,
) -> bool {
    let start = into.len();
    into.extend(values.iter().enumerate().map(|(place, &value)| {
        match (is_of_part.get(place), around) {
            (Some(true), Some([a, b])) => a.towards(&b, place, stamp_ns),
            (Some(true), None) => f64::NAN,
            _ => value,
        }
    }));
    let mut needed = into[start..].iter().zip(is_of_part).take(ATTITUDE);
    let is_known = needed.all(|(value, is_of_part)| !is_of_part || value.is_finite());
    if !is_known {
        into.truncate(start);
    }
    is_known
}

/// Flags of the values of a sample that a part on a topic of its own gives.
pub(super) fn places_of(sample: &SampleSpec, kind: SensorKind) -> Vec<bool> {
    let width = kind.value_count(0);
    let is_there = |place: usize| match place < ATTITUDE {
        true => is_given(sample, place),
        // three angles give four numbers
        false => (ATTITUDE..width).any(|place| is_given(sample, place)),
    };
    (0..width).map(is_there).collect()
}

fn is_given(sample: &SampleSpec, place: usize) -> bool {
    let value = sample.values.get(place);
    value.is_some_and(|value| !matches!(value, ValueSource::Absent))
}

/// The samples of the part before and after a time, or the one at that time twice. `next` is the first one not before it.
fn around<'s>(
    next: usize,
    sample: impl Fn(usize) -> Option<PartSample<'s>>,
    stamp_ns: i64,
) -> Option<[PartSample<'s>; 2]> {
    let after = sample(next)?;
    if after.stamp_ns == stamp_ns {
        return Some([after, after]);
    }
    let before = sample(next.checked_sub(1)?)?;
    let step = after.stamp_ns.saturating_sub(before.stamp_ns);
    (step <= LONGEST_STEP_NS).then_some([before, after])
}

/// A sample of a part.
#[derive(Debug, Clone, Copy)]
struct PartSample<'s> {
    stamp_ns: i64,
    values: &'s [f64],
}

impl PartSample<'_> {
    /// A value interpolated between this sample and a later one, or itself.
    fn towards(&self, end: &PartSample<'_>, place: usize, stamp_ns: i64) -> f64 {
        if self.stamp_ns == end.stamp_ns {
            return self.values[place];
        }
        let attitude: Range<usize> = ATTITUDE.min(self.values.len())..self.values.len();
        // a quaternion and its negative are the same attitude
        let is_opposite = place >= ATTITUDE
            && attitude
                .map(|i| self.values[i] * end.values[i])
                .sum::<f64>()
                < 0.0;
        let last = if is_opposite {
            -end.values[place]
        } else {
            end.values[place]
        };
        let (start_ns, end_ns) = (self.stamp_ns, end.stamp_ns);
        let share = (stamp_ns - start_ns) as f64 / (end_ns - start_ns) as f64;
        self.values[place] + share * (last - self.values[place])
    }
}

/// Merges a part sample by sample, as they arrive: as [`join`] does with whole columns.
#[derive(Debug)]
pub(super) struct Joiner {
    is_of_part: Vec<bool>,
    /// Samples of the part that may still be needed, by time.
    part: VecDeque<(i64, Vec<f64>)>,
    /// Samples that wait for the one of the part behind them, in order of arrival.
    waiting: VecDeque<(i64, Vec<f64>)>,
}

/// Samples that complete the merged sample: its time (ns) and its values.
pub(super) type Complete = Vec<(i64, Vec<f64>)>;

/// The most samples of a part that are kept: those of a step at 10 kHz.
const MOST_KEPT: usize = 2500;

impl Joiner {
    pub(super) fn new(is_of_part: Vec<bool>) -> Self {
        Self {
            is_of_part,
            part: VecDeque::new(),
            waiting: VecDeque::new(),
        }
    }

    /// Takes a sample of the first part.
    pub(super) fn first(&mut self, stamp_ns: i64, values: Vec<f64>, complete: &mut Complete) {
        self.waiting.push_back((stamp_ns, values));
        self.settle(complete);
    }

    /// Takes a sample of the part that is merged.
    pub(super) fn part(&mut self, stamp_ns: i64, values: &[f64], complete: &mut Complete) {
        let place = self.part.partition_point(|(stamp, _)| *stamp <= stamp_ns);
        self.part.insert(place, (stamp_ns, values.to_vec()));
        self.settle(complete);
        let oldest = self.waiting.iter().map(|(stamp, _)| *stamp).min();
        let needed = oldest.unwrap_or(stamp_ns).saturating_sub(LONGEST_STEP_NS);
        while self.part.len() > 2
            && (self.part.len() > MOST_KEPT || self.part.get(1).is_some_and(|(s, _)| *s < needed))
        {
            self.part.pop_front();
        }
    }

    /// Passes on every sample whose neighbours in the part are known, or can no longer be close enough.
    fn settle(&mut self, complete: &mut Complete) {
        let newest = self.waiting.iter().map(|(stamp, _)| *stamp).max();
        let last = self.part.back().map(|(stamp, _)| *stamp);
        let is_settled = |stamp: i64| {
            let is_reached = last.is_some_and(|last| last >= stamp);
            let waits_long =
                newest.is_some_and(|newest| newest.saturating_sub(stamp) > LONGEST_STEP_NS);
            is_reached || waits_long
        };
        let mut kept = VecDeque::new();
        for (stamp_ns, values) in std::mem::take(&mut self.waiting) {
            if !is_settled(stamp_ns) {
                kept.push_back((stamp_ns, values));
                continue;
            }
            if let Some(merged) = self.merged(stamp_ns, &values) {
                complete.push((stamp_ns, merged));
            }
        }
        self.waiting = kept;
    }

    /// The merged sample; `None` if a value that is needed is unknown.
    fn merged(&self, stamp_ns: i64, values: &[f64]) -> Option<Vec<f64>> {
        let next = self.part.partition_point(|(stamp, _)| *stamp < stamp_ns);
        let sample = |at: usize| {
            let (stamp_ns, values) = self.part.get(at)?;
            Some(PartSample {
                stamp_ns: *stamp_ns,
                values,
            })
        };
        let mut merged = Vec::with_capacity(values.len());
        let around = around(next, sample, stamp_ns);
        merge(values, &self.is_of_part, around, stamp_ns, &mut merged).then_some(merged)
    }
}

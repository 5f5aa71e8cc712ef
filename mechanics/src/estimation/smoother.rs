//! The smoother: estimates each row from past and future samples of a log.

use super::bias::{BiasEstimator, BiasHistory};
use super::kalman_filter::{ChannelState, History, Matrix, seconds, step};
use super::rows::{RowClock, regular_index, regular_row, regular_stamp};
use super::state_builder::{FilterStatus, Filters, Followed, Reading, StateBuilder};
use crate::estimation::plausibility::{FaultSpan, FaultSpans, Plausibility, SpanWalk};
use crate::machine::Machine;
use crate::state::{
    Credible, Reasons, Sample, SampleError, Sensor, Sensors, State, StateColumns, StreamCounts,
    tilt_is_measured,
};

/// A gap in the joint states longer than this separates recordings, or its stamps are wrong (ns).
const LONGEST_GRID_NS: i64 = 3_600_000_000_000;

/// All samples of one sensor, wherever they are kept.
#[derive(Debug, Clone, Copy)]
pub struct SensorSamples<'a> {
    /// Which sensor.
    pub sensor: Sensor,
    /// Stamps (ns), in any order.
    pub stamps_ns: &'a [i64],
    /// Values of all samples, one sample after another: see [`Sample`].
    pub values: &'a [f64],
}

/// Estimates of all rows.
#[derive(Debug, Clone)]
pub struct SmoothedRows {
    /// Row times (ns).
    pub times_ns: Vec<i64>,
    /// The states; NaN where a gap leaves them unknown.
    pub states: StateColumns,
    /// Why rows are invalid, as far as the signals show.
    pub reasons: Vec<Reasons>,
    /// Number of samples used and not used, by sensor.
    pub counts: Vec<(Sensor, StreamCounts)>,
    /// Implausible spans of the signals, sorted by start.
    pub faults: Vec<FaultSpan>,
}

/// Smooths a whole recording. Samples of a sensor are sorted by stamp; of equal stamps only one is used.
///
/// Rows are at the samples of the first stream of joint states, or at a regular rate.
#[must_use]
pub fn smooth(
    machine: &Machine,
    sensors: &Sensors,
    recordings: &[SensorSamples<'_>],
    clock: RowClock,
) -> SmoothedRows {
    let ordered: Vec<Ordered<'_>> = (recordings.iter())
        .filter_map(|&recording| Ordered::new(recording, sensors))
        .collect();
    let faults = find_faults(machine, sensors, &ordered);
    let bias = find_bias(machine, sensors, &ordered, &faults);
    let mut filters = Filters::new(machine, sensors, true);
    let counts = (ordered.iter())
        .map(|recording| (recording.sensor(), feed(&mut filters, recording, &faults)))
        .collect();
    let histories: Vec<(Followed, History)> = filters
        .list
        .into_iter()
        .map(|(f, filter)| (f, filter.smoothed()))
        .collect();
    let joints = ordered.iter().find(|o| o.sensor() == Sensor::Joints(0));
    let joints = joints.map_or(Vec::new(), Ordered::distinct_stamps_ns);
    let times_ns = row_times(&joints, clock, (machine.estimator().max_gap * 1e9) as i64);
    let mut rows = SmoothedRows {
        states: StateColumns::unknown(machine, times_ns.len()),
        reasons: Vec::with_capacity(times_ns.len()),
        times_ns,
        counts,
        faults,
    };
    fill(machine, sensors, &histories, &bias, &mut rows);
    rows
}

/// The samples of a recording, sorted by stamp.
struct Ordered<'r> {
    recording: SensorSamples<'r>,
    width: usize,
    order: Vec<usize>,
}

impl<'r> Ordered<'r> {
    /// `None` where there is no such sensor.
    fn new(recording: SensorSamples<'r>, sensors: &Sensors) -> Option<Self> {
        let mut order: Vec<usize> = (0..recording.stamps_ns.len()).collect();
        order.sort_by_key(|&i| recording.stamps_ns[i]);
        Some(Self {
            recording,
            width: sensors.value_count(recording.sensor)?,
            order,
        })
    }

    fn sensor(&self) -> Sensor {
        self.recording.sensor
    }

    /// The k-th sample by time.
    fn sample(&self, k: usize) -> Option<Sample<'r>> {
        let &i = self.order.get(k)?;
        Some(Sample {
            sensor: self.recording.sensor,
            stamp_ns: self.recording.stamps_ns[i],
            values: &self.recording.values[i * self.width..(i + 1) * self.width],
        })
    }

    fn distinct_stamps_ns(&self) -> Vec<i64> {
        let stamps = self.order.iter().map(|&i| self.recording.stamps_ns[i]);
        let mut stamps: Vec<i64> = stamps.collect();
        stamps.dedup();
        stamps
    }
}

/// Finds implausible spans, checking all sensors together in stamp order.
fn find_faults(machine: &Machine, sensors: &Sensors, ordered: &[Ordered<'_>]) -> Vec<FaultSpan> {
    let mut plausibility = Plausibility::new(machine, sensors);
    let mut spans = FaultSpans::default();
    for_each_by_stamp(&ordered.iter().collect::<Vec<_>>(), |_, sample| {
        // A repeated or backward stamp is counted where the filter refuses it.
        if plausibility.step(&sample).is_ok() {
            spans.take(sample.sensor, sample.stamp_ns, plausibility.findings());
        }
    });
    spans.finish()
}

/// Visits the samples of several sensors in stamp order, each with the index of its recording.
fn for_each_by_stamp<'r>(recordings: &[&Ordered<'r>], mut visit: impl FnMut(usize, Sample<'r>)) {
    let mut next = vec![0; recordings.len()];
    loop {
        let heads = recordings.iter().zip(&next).enumerate();
        let heads =
            heads.filter_map(|(which, (recording, &k))| Some((which, recording.sample(k)?)));
        let Some((which, sample)) = heads.min_by_key(|(_, sample)| sample.stamp_ns) else {
            break;
        };
        next[which] += 1;
        visit(which, sample);
    }
}

/// Estimates the bias of the accelerometer from all sensors together in stamp order.
fn find_bias(
    machine: &Machine,
    sensors: &Sensors,
    ordered: &[Ordered<'_>],
    faults: &[FaultSpan],
) -> BiasHistory {
    let mut estimator = BiasEstimator::new(machine, sensors, true);
    let used: Vec<&Ordered<'_>> = (ordered.iter())
        .filter(|recording| estimator.uses(recording.sensor()))
        .collect();
    let mut walks: Vec<(SpanWalk<'_>, Option<i64>)> = (used.iter())
        .map(|recording| (SpanWalk::new(faults_of(faults, recording.sensor())), None))
        .collect();
    for_each_by_stamp(&used, |which, sample| {
        let (walk, last_ns) = &mut walks[which];
        if last_ns.replace(sample.stamp_ns) != Some(sample.stamp_ns) {
            estimator.push(&sample, &walk.judgement(sample.stamp_ns));
        }
    });
    estimator.smoothed()
}

fn faults_of(faults: &[FaultSpan], sensor: Sensor) -> impl Iterator<Item = &FaultSpan> {
    faults
        .iter()
        .filter(move |span| span.worst.sensor == sensor)
}

/// Feeds a sensor's samples to its filters, those within faults treated as the fault requires.
fn feed(filters: &mut Filters, recording: &Ordered<'_>, faults: &[FaultSpan]) -> StreamCounts {
    let mut counts = StreamCounts::default();
    let mut walk = SpanWalk::new(faults_of(faults, recording.sensor()));
    let mut last_ns = None;
    if matches!(recording.sensor(), Sensor::Imu | Sensor::Odometry) {
        // known beforehand, unlike to the causal estimator
        let mut samples = (0..).map_while(|k| recording.sample(k));
        filters.has_tilt =
            samples.any(|sample| sample.values.get(6..).is_some_and(tilt_is_measured));
    }
    for sample in (0..).map_while(|k| recording.sample(k)) {
        let is_later = last_ns.replace(sample.stamp_ns) != Some(sample.stamp_ns);
        let judgement = walk.judgement(sample.stamp_ns);
        let taken = match is_later {
            true => filters.push(&sample, &judgement),
            false => Err(SampleError::NotLater),
        };
        let lacks_a_value = walk.lacks_a_value();
        counts.count(match taken {
            Ok(()) if lacks_a_value => Err(SampleError::NotFinite),
            taken => taken.map(|()| Credible(judgement.is_clean())),
        });
    }
    counts
}

/// Row times. A gap in the joint states gets a single row in its middle, so that tables and curves show it.
/// At a regular rate this applies only to gaps longer than [`LONGEST_GRID_NS`].
fn row_times(joint_stamps_ns: &[i64], clock: RowClock, max_gap_ns: i64) -> Vec<i64> {
    let Some(&first) = joint_stamps_ns.first() else {
        return Vec::new();
    };
    let mut times = Vec::with_capacity(joint_stamps_ns.len());
    let (mut before, mut next) = (first, 0);
    for &stamp in joint_stamps_ns {
        let gap_ns = stamp.saturating_sub(before);
        let longest_ns = match clock {
            RowClock::JointStates => max_gap_ns,
            RowClock::Rate(_) => LONGEST_GRID_NS.max(max_gap_ns),
        };
        if gap_ns > longest_ns {
            times.push(before.midpoint(stamp));
        }
        match clock {
            RowClock::JointStates => times.push(stamp),
            RowClock::Rate(hz) => {
                let is_before = |k: u64| regular_stamp(first, k, hz) < stamp;
                if gap_ns > longest_ns {
                    next = regular_index(first, stamp, hz);
                    next += (next..).take_while(|&k| is_before(k)).count() as u64;
                }
                while let Some(time_ns) = regular_row(first, next, hz, stamp) {
                    times.push(time_ns);
                    next += 1;
                }
            }
        }
        before = stamp;
    }
    times
}

fn fill(
    machine: &Machine,
    sensors: &Sensors,
    histories: &[(Followed, History)],
    bias: &BiasHistory,
    rows: &mut SmoothedRows,
) {
    let max_gap_ns = (machine.estimator().max_gap * 1e9) as i64;
    let mut readers: Vec<(Followed, HistoryReader<'_>)> = histories
        .iter()
        .map(|(followed, history)| (*followed, HistoryReader::new(history, max_gap_ns)))
        .collect();
    let faults = std::mem::take(&mut rows.faults);
    let mut walk = SpanWalk::new(faults.iter());
    let mut state_builder = StateBuilder::new(machine, sensors);
    let mut state = State::zero(machine);
    let first_ns = rows.times_ns.first().copied().unwrap_or(0);
    for row in 0..rows.times_ns.len() {
        let time_ns = rows.times_ns[row];
        let mut read = |followed: Followed, jets: &mut [ChannelState]| match readers
            .iter_mut()
            .find(|(f, _)| *f == followed)
        {
            Some((_, reader)) => reader.read(time_ns, jets),
            None => Reading::NOTHING,
        };
        let effect = walk.row_effect(time_ns, machine, sensors.imu);
        let elapsed_s = seconds(time_ns.saturating_sub(first_ns));
        let reasons = state_builder.assemble(
            machine,
            elapsed_s,
            &effect,
            &bias.at(time_ns),
            &mut read,
            &mut state,
        );
        rows.states.set(row, &mut state);
        rows.reasons.push(reasons);
    }
    drop(walk);
    rows.faults = faults;
}

/// Reads a smoothed history at increasing times.
struct HistoryReader<'a> {
    history: &'a History,
    max_gap_ns: i64,
    /// Index of the first sample after the last time read.
    next: usize,
}

impl<'a> HistoryReader<'a> {
    fn new(history: &'a History, max_gap_ns: i64) -> Self {
        Self {
            history,
            max_gap_ns,
            next: 0,
        }
    }

    /// Between two samples of one segment, the expected state is the quintic through both; beyond either end,
    /// for up to half the longest gap, the Taylor series at that end.
    fn read(&mut self, time_ns: i64, jets: &mut [ChannelState]) -> Reading {
        let stamps = &self.history.stamps_ns;
        while self.next < stamps.len() && stamps[self.next] <= time_ns {
            self.next += 1;
        }
        let width = self.history.jets.len() / stamps.len().max(1);
        let at = |k: usize| &self.history.jets[k * width..(k + 1) * width];
        let before = self.next.checked_sub(1);
        let after = Some(self.next).filter(|&k| k < stamps.len());
        let near = |k: usize| stamps[k].abs_diff(time_ns) <= self.max_gap_ns.unsigned_abs() / 2;
        let covariances = &self.history.covariances;
        let covariance = match (before, after) {
            (Some(a), _) if stamps[a] == time_ns => {
                jets.copy_from_slice(at(a));
                covariances[a]
            }
            (Some(a), Some(b)) if stamps[b].saturating_sub(stamps[a]) <= self.max_gap_ns => {
                let weights =
                    Quintic::new(seconds(time_ns - stamps[a]), seconds(stamps[b] - stamps[a]));
                for (jet, (from, to)) in jets.iter_mut().zip(at(a).iter().zip(at(b))) {
                    *jet = weights.blend(from, to);
                }
                between(&covariances[a], &covariances[b], weights.t / weights.h)
            }
            (Some(a), None) if near(a) => {
                extrapolate(jets, at(a), seconds(time_ns - stamps[a]));
                covariances[a]
            }
            (None, Some(b)) if near(b) => {
                extrapolate(jets, at(b), seconds(time_ns - stamps[b]));
                covariances[b]
            }
            _ => return Reading::NOTHING,
        };
        Reading {
            standing: FilterStatus::Known,
            covariance,
        }
    }
}

/// Linear interpolation of the covariance between two samples.
fn between(a: &Matrix, b: &Matrix, share: f64) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + share * (b[i][j] - a[i][j])))
}

fn extrapolate(jets: &mut [ChannelState], from: &[ChannelState], dt: f64) {
    for (jet, from) in jets.iter_mut().zip(from) {
        *jet = step(from, dt);
    }
}

/// The quintic through two position-velocity-acceleration states: the model's mean between two known states.
struct Quintic {
    /// Time since the first jet and between both (s).
    t: f64,
    h: f64,
}

impl Quintic {
    fn new(t: f64, h: f64) -> Self {
        Self { t, h }
    }

    /// The Taylor series of the first state plus c3 s^3 + c4 s^4 + c5 s^5, s = t / h, with coefficients that
    /// meet the second state.
    fn blend(&self, from: &ChannelState, to: &ChannelState) -> ChannelState {
        let (t, h) = (self.t, self.h);
        let ahead = step(from, h);
        let (e0, e1, e2) = (
            to[0] - ahead[0],
            (to[1] - ahead[1]) * h,
            (to[2] - ahead[2]) * h * h,
        );
        let (c3, c4, c5) = (
            10.0 * e0 - 4.0 * e1 + 0.5 * e2,
            -15.0 * e0 + 7.0 * e1 - e2,
            6.0 * e0 - 3.0 * e1 + 0.5 * e2,
        );
        let s = t / h;
        let (s2, taylor) = (s * s, step(from, t));
        [
            taylor[0] + s2 * s * (c3 + s * (c4 + s * c5)),
            taylor[1] + s2 * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)) / h,
            taylor[2] + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)) / (h * h),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quintic_interpolation_reproduces_a_quintic() {
        let jet = |t: f64| {
            [
                t.powi(5) - 2.0 * t.powi(3) + t,
                5.0 * t.powi(4) - 6.0 * t * t + 1.0,
                20.0 * t.powi(3) - 12.0 * t,
            ]
        };
        for t in [0.0, 0.1, 0.25, 0.4] {
            let found = Quintic::new(t, 0.4).blend(&jet(0.3), &jet(0.7));
            for (i, truth) in jet(0.3 + t).iter().enumerate() {
                assert!((found[i] - truth).abs() < 1e-12, "{t}: {found:?}");
            }
        }
    }
}

//! Sparse logs: whether the samples of a sensor are too rare for the estimator.

use crate::estimation::smoother::SampleSource;
use crate::estimation::sorted_stamps::sorted_stamps;
use crate::machine::Machine;
use crate::state::{Sensor, Sensors};

/// Share of its time in gaps from which on a sensor is sparse.
const MOST_IN_GAPS: f64 = 0.5;

/// Fewest gaps of a sensor that records in bursts: a dense recording with one or two holes is not sparse.
const FEWEST_BURST_GAPS: usize = 3;

/// Gaps between the samples of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sparseness {
    /// The sensor.
    pub sensor: Sensor,
    /// Share of its time in gaps that the estimator does not bridge.
    pub gap_share: f64,
    /// Number of such gaps.
    pub gaps: usize,
    /// Whether even the median time between two samples is a gap that the estimator does not bridge.
    pub is_slow: bool,
    /// Median time between two samples (s).
    pub median_s: f64,
}

impl Sparseness {
    /// Whether most of the sensor's time is in gaps, because it is slow or records in bursts.
    #[must_use]
    pub fn is_sparse(&self) -> bool {
        self.gap_share > MOST_IN_GAPS && (self.is_slow || self.gaps >= FEWEST_BURST_GAPS)
    }
}

/// Returns the gaps of each sensor that every row needs: joint states, and the IMU or else odometry. Sensors with fewer than two
/// samples are left out.
pub fn sparseness<S: SampleSource>(
    machine: &Machine,
    sensors: &Sensors,
    sources: &[S],
) -> Vec<Sparseness> {
    let max_gap_ns = (machine.estimator().max_gap * 1e9) as i64;
    let needed = sources.iter().filter(|s| sensors.need(s.sensor()));
    let found = needed.filter_map(|source| {
        let mut steps = steps_ns(source.stamps_ns());
        let gaps = steps.iter().filter(|&&step| step > max_gap_ns);
        let count = gaps.clone().count();
        let gaps_s: f64 = gaps.map(|&step| step as f64).sum();
        let all_s: f64 = steps.iter().map(|&step| step as f64).sum();
        let middle = steps.len() / 2;
        steps.get(middle)?;
        let (_, &mut median, _) = steps.select_nth_unstable(middle);
        Some(Sparseness {
            sensor: source.sensor(),
            gap_share: gaps_s / all_s,
            gaps: count,
            is_slow: median > max_gap_ns,
            median_s: median as f64 * 1e-9,
        })
    });
    found.collect()
}

/// Times between samples of different stamps (ns).
fn steps_ns(stamps_ns: &[i64]) -> Vec<i64> {
    let sorted = sorted_stamps(stamps_ns);
    let mut steps = Vec::with_capacity(sorted.len());
    let apart = sorted.windows(2).map(|p| p[1].saturating_sub(p[0]));
    steps.extend(apart.filter(|&step| step > 0));
    steps
}

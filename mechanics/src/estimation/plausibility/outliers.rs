//! Single samples far from all around them: a disturbed transfer, a flipped bit.
//!
//! A sample that differs from the one before by many times what samples differ, and by more than any filter would even out,
//! is left out. If the next one differs, too, the signal has changed: it counts. So an impact costs one sample, and rows stay
//! valid, because the filters bridge it.

use super::fault::Component;
use super::notice::Notice;
use crate::machine::FaultKind;

/// Weight of a sample in the running mean of the differences.
const WEIGHT: f64 = 1.0 / 32.0;
/// Multiple of the mean difference from which a sample is an outlier.
const TIMES: f64 = 10.0;
/// Multiple of the mean difference of samples up to which a difference changes that mean.
const TEACHES: f64 = 4.0;
/// Fewest differences before anything is called an outlier.
const FEWEST: u32 = 16;

/// Outlier check of one signal with `N` components.
#[derive(Debug, Clone)]
pub(super) struct Outliers<const N: usize> {
    /// A difference that does no harm.
    harmless: f64,
    last: Option<[f64; N]>,
    difference: f64,
    count: u32,
    is_suspect: bool,
}

impl<const N: usize> Outliers<N> {
    pub(super) fn new(harmless: f64) -> Self {
        Self {
            harmless,
            last: None,
            difference: 0.0,
            count: 0,
            is_suspect: false,
        }
    }

    /// A difference that does no harm from now on.
    pub(super) fn allow(&mut self, harmless: f64) {
        self.harmless = harmless;
    }

    /// Starts anew after a gap: the next sample is the first one.
    pub(super) fn restart(&mut self) {
        (self.last, self.is_suspect) = (None, false);
    }

    /// Whether the last sample was an outlier: if the next sample is not, the signal has changed, or is back.
    pub(super) fn is_suspect(&self) -> bool {
        self.is_suspect
    }

    /// Returns the largest difference between two samples in a row that is no outlier.
    pub(super) fn limit(&self) -> f64 {
        TIMES * self.difference + self.harmless
    }

    /// The notice to report if a sample is an outlier. `values` are finite.
    pub(super) fn notice(
        &mut self,
        stamp_ns: i64,
        values: [f64; N],
        component: Component,
    ) -> Option<Notice> {
        let Some(last) = self.last else {
            self.last = Some(values);
            return None;
        };
        let difference = distance(values, last);
        let limit = self.limit();
        let is_far = self.count >= FEWEST && difference > limit;
        if is_far && !self.is_suspect {
            self.is_suspect = true;
            return Some(
                Notice::of(FaultKind::Outlier, stamp_ns)
                    .about(component)
                    .measured(difference, limit)
                    .amount(difference, 0.0),
            );
        }
        self.is_suspect = false;
        self.last = Some(values);
        self.count = self.count.saturating_add(1);
        let teaches = match self.count {
            ..FEWEST => difference,
            _ => difference.min(TEACHES * self.difference + self.harmless),
        };
        let weight = WEIGHT.max(1.0 / f64::from(self.count));
        self.difference += weight * (teaches - self.difference);
        None
    }
}

/// The first samples of a stretch, of which none is known to be right: a knock, or the values of a sensor before it has measured.
#[derive(Debug, Clone)]
pub(super) struct FirstSamples {
    samples: [(i64, [f64; 3]); FIRST],
    count: usize,
}

/// Number of samples by which the first ones are judged, and the largest number of wrong ones among them.
const FIRST: usize = 16;
const MOST_WRONG: usize = FIRST / 4;

/// The first of some samples that are far from those around them.
pub(super) struct Far {
    pub(super) stamp_ns: i64,
    /// Distance of the sample from their median, and the limit of that distance.
    pub(super) distance: f64,
    pub(super) limit: f64,
}

impl FirstSamples {
    pub(super) fn new() -> Self {
        Self {
            samples: [(0, [0.0; 3]); FIRST],
            count: 0,
        }
    }

    /// Starts anew after a gap: the next sample is the first one.
    pub(super) fn restart(&mut self) {
        self.count = 0;
    }

    /// Takes a sample. With the last of the first samples, returns the first one that is far from their median: by many times the
    /// usual difference of neighbours, and by more than does no harm. `None` if the last one is far, too: the signal has changed.
    pub(super) fn take(&mut self, stamp_ns: i64, values: [f64; 3], harmless: f64) -> Option<Far> {
        if self.count >= FIRST {
            return None;
        }
        self.samples[self.count] = (stamp_ns, values);
        self.count += 1;
        if self.count < FIRST {
            return None;
        }
        let median = [0, 1, 2].map(|axis| median_of(self.samples.map(|(_, values)| values[axis])));
        let mut differences = [0.0; FIRST];
        for (place, pair) in self.samples.windows(2).enumerate() {
            differences[place + 1] = distance(pair[0].1, pair[1].1);
        }
        let limit = TIMES * median_of(differences) + harmless;
        let is_far = |(_, values): &&(i64, [f64; 3])| distance(*values, median) > limit;
        let far = self.samples.iter().filter(is_far);
        if far.clone().count() > MOST_WRONG || is_far(&&self.samples[FIRST - 1]) {
            return None;
        }
        far.clone().next().map(|&(stamp_ns, values)| Far {
            stamp_ns,
            distance: distance(values, median),
            limit,
        })
    }
}

fn median_of(mut values: [f64; FIRST]) -> f64 {
    values.sort_by(f64::total_cmp);
    0.5 * (values[FIRST / 2 - 1] + values[FIRST / 2])
}

pub(super) fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    let squares = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the stamp of the first sample that is far from the others, of a signal along one axis.
    fn first_far(value: impl Fn(usize) -> f64) -> Option<i64> {
        let mut first = FirstSamples::new();
        let mut samples = (0..100_usize).map(|k| (k as i64, [0.5, value(k), -9.8]));
        samples.find_map(|(stamp, values)| first.take(stamp, values, 1.0).map(|far| far.stamp_ns))
    }

    #[test]
    fn a_knock_among_the_first_samples_is_far() {
        let knock = |at: std::ops::Range<usize>| {
            move |k| noise(k) + if at.contains(&k) { 20.0 } else { 0.0 }
        };
        assert_eq!(first_far(knock(0..1)), Some(0));
        assert_eq!(first_far(knock(0..3)), Some(0));
        assert_eq!(first_far(knock(7..9)), Some(7));
        // noise, vibration, a ramp, a step that stays: the signal
        assert_eq!(first_far(noise), None);
        assert_eq!(first_far(|k| 50.0 * noise(k)), None);
        assert_eq!(first_far(|k| 0.6 * k as f64), None);
        assert_eq!(first_far(knock(14..100)), None);
        assert_eq!(first_far(knock(0..8)), None);
    }

    fn found(value: impl Fn(usize) -> f64) -> Vec<usize> {
        let mut outliers = Outliers::<1>::new(0.5);
        (0..400)
            .filter(|&k| {
                let notice = outliers.notice(k as i64, [value(k)], Component::Value);
                notice.is_some()
            })
            .collect()
    }

    fn noise(k: usize) -> f64 {
        0.1 * (k as f64 * 12.9898).sin()
    }

    #[test]
    fn single_samples_far_away_are_outliers() {
        let outliers = [100, 150, 152, 399];
        let value = |k: usize| noise(k) + if outliers.contains(&k) { 5.0 } else { 0.0 };
        assert_eq!(found(value), outliers);
    }

    #[test]
    fn a_step_costs_one_sample_and_vibration_none() {
        assert_eq!(found(|k| noise(k) + if k < 200 { 0.0 } else { 5.0 }), [200]);
        assert_eq!(found(|k| 50.0 * noise(k)), [] as [usize; 0]);
        assert_eq!(found(|k| 0.01 * (k * k) as f64), [] as [usize; 0]);
    }
}

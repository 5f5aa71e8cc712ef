//! Single axes of a vector that stick: at the end of the sensor's range, or anywhere.
//!
//! The axes of a sensor are alike: while both others show noise that the sensor resolves, this one does, too. Noise turns
//! back at many samples, which a smooth motion does not. A value that
//! repeats then, although it seldom did before (share p of such samples), has each time the log likelihood ratio `-ln p`
//! for "it sticks". It is summed up
//!
//! - over a run of repeats: the axis is frozen;
//! - over all repeats of its largest and of its least value: the axis is saturated. From then on every sample that shows
//!   this value is, and what lies between two such samples of one stretch.
//!
//! Where nothing shakes the machine, or the sensor does not resolve its noise, values repeat rightly, and nothing is weighed.

use super::notice::{Limits, Notice};
use super::turning::per_repeat;
use crate::machine::FaultKind;

/// Weight of a sample in the running mean of the changes of an axis.
const CHANGE_WEIGHT: f64 = 1.0 / 16.0;
/// Smallest mean change of a shaken axis, as a multiple of the least change, its resolution.
const RESOLVED: f64 = 2.0;
/// Weight of a sample in the share of turning points, and the share from which a signal is noisy: two of three samples of white
/// noise are turning points.
const TURNING_WEIGHT: f64 = 1.0 / 64.0;
const NOISY_SHARE: f64 = 0.25;
/// Fewest changes of an axis from which it is known how seldom its value repeats.
const FEWEST_CHANGES: f64 = 50.0;
/// Saturated samples that are closer belong to one stretch (s).
const STRETCH_S: f64 = 0.1;

/// The checks of three axes.
#[derive(Debug, Clone)]
pub(super) struct AxesWatch {
    axes: [Axis; 3],
    is_begun: bool,
    /// Log likelihood ratio from which an axis sticks.
    threshold: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    last: f64,
    /// The least change so far, and the mean of the last ones.
    resolution: f64,
    change: f64,
    /// The last change that was not zero, and the share of turning points.
    step: f64,
    turning: f64,
    /// Changes and repeats of the axis among samples in which the others were shaken, before the present run.
    changed: f64,
    kept: f64,
    /// The present run of repeats: those while the others were shaken, those while something moved elsewhere, its start.
    run: u32,
    moving: u32,
    run_since_ns: i64,
    /// Least and largest value, with the evidence that it is the end of the range.
    ends: [End; 2],
    /// The stretch of saturated samples: its first and its last.
    saturated_ns: Option<[i64; 2]>,
}

#[derive(Debug, Clone, Copy, Default)]
struct End {
    value: f64,
    evidence: f64,
}

impl Axis {
    fn new() -> Self {
        let end = |value| End {
            value,
            evidence: 0.0,
        };
        Self {
            last: f64::NAN,
            resolution: f64::INFINITY,
            ends: [end(f64::INFINITY), end(f64::NEG_INFINITY)],
            ..Self::default()
        }
    }

    fn is_shaken(&self) -> bool {
        self.change >= RESOLVED * self.resolution && self.turning >= NOISY_SHARE
    }

    /// Log likelihood ratio that one repeated value adds for "the axis sticks".
    fn per_repeat(&self) -> f64 {
        per_repeat(self.changed, self.kept)
    }
}

impl AxesWatch {
    pub(super) fn new(threshold: f64) -> Self {
        Self {
            axes: [Axis::new(); 3],
            is_begun: false,
            threshold,
        }
    }

    /// The notice to report if an axis sticks. `values` are finite; of those that are not measured nothing is asked.
    pub(super) fn notice(
        &mut self,
        stamp_ns: i64,
        values: [f64; 3],
        is_measured: [bool; 3],
        moves_elsewhere: bool,
        limits: &Limits,
    ) -> Option<Notice> {
        // a sample that all axes repeat says nothing of one of them
        let is_new = [0, 1, 2].map(|k: usize| values[k].to_bits() != self.axes[k].last.to_bits());
        let is_shaken = [0, 1, 2].map(|k: usize| is_new[k] && self.axes[k].is_shaken());
        let threshold = self.threshold;
        let mut worst = None;
        let measured = |&i: &usize| is_measured[i];
        for (i, axis) in self
            .axes
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| measured(i))
        {
            let mut others = (0..3).filter(|k| *k != i).filter(measured).peekable();
            let others_are_shaken = others.peek().is_some() && others.all(|k| is_shaken[k]);
            let value = values[i];
            if self.is_begun {
                axis.take(stamp_ns, value, others_are_shaken, moves_elsewhere);
            } else {
                axis.run_since_ns = stamp_ns;
            }
            axis.last = value;
            let found = axis.saturated(stamp_ns, value, threshold, limits);
            let found = found.or_else(|| axis.frozen(stamp_ns, threshold, limits));
            worst = worst.or(found);
        }
        self.is_begun = true;
        worst
    }
}

impl Axis {
    /// Takes a value after the last one.
    fn take(&mut self, stamp_ns: i64, value: f64, is_asked: bool, moves_elsewhere: bool) {
        let step = value - self.last;
        let change = step.abs();
        let turns = f64::from(u8::from(step * self.step < 0.0));
        self.turning += TURNING_WEIGHT * (turns - self.turning);
        if step != 0.0 {
            self.step = step;
        }
        let is_kept = value.to_bits() == self.last.to_bits();
        self.change += CHANGE_WEIGHT * (change - self.change);
        for (end, is_beyond) in (self.ends.iter_mut()).zip([f64::lt, f64::gt]) {
            if is_beyond(&value, &end.value) {
                *end = End {
                    value,
                    evidence: 0.0,
                };
            }
        }
        if !is_kept {
            if change > 0.0 {
                self.resolution = self.resolution.min(change);
            }
            self.kept += f64::from(self.run);
            self.changed += f64::from(u8::from(is_asked));
            (self.run, self.moving, self.run_since_ns) = (0, 0, stamp_ns);
            return;
        }
        if !is_asked {
            return;
        }
        self.run = self.run.saturating_add(1);
        self.moving += u32::from(moves_elsewhere);
        // the end of no range is zero: what is not measured is
        let per_repeat = self.per_repeat();
        if self.changed >= FEWEST_CHANGES && value != 0.0 {
            let at_end = |end: &&mut End| end.value.to_bits() == value.to_bits();
            if let Some(end) = self.ends.iter_mut().find(at_end) {
                end.evidence += per_repeat;
            }
        }
    }

    fn saturated(
        &mut self,
        stamp_ns: i64,
        value: f64,
        threshold: f64,
        limits: &Limits,
    ) -> Option<Notice> {
        let is_at = |end: &&End| end.value.to_bits() == value.to_bits() && end.evidence > 0.0;
        let end = self.ends.iter().find(is_at);
        let is_near = |[_, last_ns]: &[i64; 2]| limits.elapsed_s(*last_ns, stamp_ns) <= STRETCH_S;
        self.saturated_ns = self.saturated_ns.filter(is_near);
        if end.is_some() {
            let begun_ns = if self.run > 0 {
                self.run_since_ns
            } else {
                stamp_ns
            };
            let [since_ns, _] = self.saturated_ns.unwrap_or([begun_ns, stamp_ns]);
            self.saturated_ns = Some([since_ns, stamp_ns]);
        }
        let [since_ns, _] = self.saturated_ns?;
        let stands = |end: &&End| end.evidence >= threshold;
        let end = self.ends.iter().find(stands)?;
        Some(notice(FaultKind::Saturated, since_ns, end.value, end.value))
    }

    fn frozen(&self, stamp_ns: i64, threshold: f64, limits: &Limits) -> Option<Notice> {
        let lasted_s = limits.elapsed_s(self.run_since_ns, stamp_ns);
        let is_long = limits.is_long(self.run, lasted_s);
        let is_known = self.changed >= FEWEST_CHANGES;
        // of an axis that never changed, motion has to show that it should
        let is_proven = f64::from(self.run) * self.per_repeat() >= threshold
            && (is_known || self.moving >= self.run / 2);
        (is_long && is_proven)
            .then(|| notice(FaultKind::Frozen, self.run_since_ns, lasted_s, self.last))
    }
}

fn notice(kind: FaultKind, since_ns: i64, measure: f64, value: f64) -> Notice {
    Notice::of(kind, since_ns)
        .measured(measure, f64::NAN)
        // how far the truth is beyond it, nobody knows
        .amount(value.abs(), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const THRESHOLD: f64 = 25.0;
    /// Stamps count from 1970.
    const START_NS: i64 = 1_780_000_000_000_000_000;

    /// Noise between -1 and 1, of an axis.
    fn noise(k: usize, axis: usize) -> f64 {
        let wave = ((k * 3 + axis) as f64 * 12.9898).sin() * 43_758.545_3;
        2.0 * wave.rem_euclid(1.0) - 1.0
    }

    /// Returns the fault found in samples every ten milliseconds, with its start and end (s).
    fn found(samples: usize, value: impl Fn(usize, usize) -> f64) -> Option<(FaultKind, f64, f64)> {
        found_of([true; 3], samples, value)
    }

    fn found_of(
        is_measured: [bool; 3],
        samples: usize,
        value: impl Fn(usize, usize) -> f64,
    ) -> Option<(FaultKind, f64, f64)> {
        let mut watch = AxesWatch::new(THRESHOLD);
        let mut span: Option<(FaultKind, f64, f64)> = None;
        for k in 0..samples {
            let stamp_ns = START_NS + k as i64 * 10_000_000;
            let values = [0, 1, 2].map(|axis| value(k, axis));
            if let Some(notice) =
                watch.notice(stamp_ns, values, is_measured, true, &Limits::OF_TESTS)
            {
                let [since_s, now_s] =
                    [notice.since_ns, stamp_ns].map(|ns| (ns - START_NS) as f64 * 1e-9);
                let first_s = span.map_or(since_s, |span| span.1.min(since_s));
                span = Some((notice.kind, first_s, now_s));
            }
        }
        span
    }

    #[test]
    fn noise_motion_and_rest_are_sound() {
        assert_eq!(found(20_000, noise), None);
        // a sensor that does not resolve its noise, moved and at rest
        let coarse = |k: usize, axis: usize| {
            let moves = if k % 4000 < 2000 { 20.0 } else { 0.4 };
            (moves * noise(k, axis)).round() * 0.04
        };
        assert_eq!(found(40_000, coarse), None);
        // one without noise: it rises, holds, and falls
        let smooth = |k: usize, axis: usize| match axis {
            0 => (0.01 * k as f64).sin().clamp(-0.5, 0.5),
            1 => (0.013 * k as f64).sin(),
            _ => 9.81,
        };
        assert_eq!(
            found(4000, |k, axis| smooth(k.min(3000), axis)).map(|it| it.0),
            None
        );
    }

    #[test]
    fn an_axis_at_the_end_of_its_range_is_saturated() {
        let clipped = |k: usize, axis: usize| {
            let signal = (0.02 * k as f64).sin() + 0.05 * noise(k, axis);
            if axis == 1 { signal.min(0.8) } else { signal }
        };
        let (kind, since_s, _) = found(600, clipped).unwrap();
        assert_eq!(kind, FaultKind::Saturated);
        // sin(0.02 k) exceeds 0.8 from the sample 361 on, for the second time: then enough is known
        assert!((3.4..4.3).contains(&since_s), "{since_s}");
        // peaks only, one sample each: what lies between them is saturated, too
        let peaks = |k: usize, axis: usize| {
            let signal = 1.5 * noise(k, axis);
            if axis == 2 {
                signal.clamp(-1.0, 1.0)
            } else {
                signal
            }
        };
        assert_eq!(found(2000, peaks).unwrap().0, FaultKind::Saturated);
    }

    #[test]
    fn an_axis_that_sticks_is_frozen_and_those_beside_it_show_it() {
        let sticks = |from: usize| {
            move |k: usize, axis: usize| noise(if axis == 1 { k.min(from) } else { k }, axis)
        };
        let (kind, since_s, last_s) = found(900, sticks(400)).unwrap();
        assert_eq!((kind, since_s, last_s), (FaultKind::Frozen, 4.0, 8.99));
        // from the first sample on
        let (kind, since_s, _) = found(900, sticks(0)).unwrap();
        assert_eq!((kind, since_s), (FaultKind::Frozen, 0.0));
        // a constant of the machine file is no axis that sticks, and hides none
        let constant = |k: usize, axis: usize| if axis == 0 { 0.0 } else { noise(k, axis) };
        assert_eq!(found_of([false, true, true], 900, constant), None);
        let beside = |k: usize, axis: usize| match axis {
            0 => 0.0,
            1 => noise(k.min(400), axis),
            _ => noise(k, axis),
        };
        let (kind, since_s, _) = found_of([false, true, true], 900, beside).unwrap();
        assert_eq!((kind, since_s), (FaultKind::Frozen, 4.0));
        // half a second is no proof
        let short = |k: usize, axis: usize| {
            let is_held = axis == 1 && (400..450).contains(&k);
            noise(if is_held { 400 } else { k }, axis)
        };
        assert_eq!(found(900, short), None);
    }
}

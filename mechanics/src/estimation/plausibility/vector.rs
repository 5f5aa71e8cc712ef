//! Plausibility checks of a vector: specific force, angular velocity, velocity, force, moment.

use super::axes::AxesWatch;
use super::fault::Component;
use super::freeze::Freeze;
use super::notice::{Found, Limits, Notice};
use super::outliers::{FirstSamples, Outliers, distance};
use crate::machine::{FaultKind, NumberSpec};

/// State of the checks of one vector.
#[derive(Debug, Clone)]
pub(super) struct VectorWatch {
    /// Largest norm.
    max: f64,
    /// Fastest change (per second) and its allowance.
    slew: Option<Slew>,
    /// The last credible value, and whether another value agreed with it: the first one is as likely to be wrong.
    good: Option<(i64, [f64; 3])>,
    is_confirmed: bool,
    period_s: f64,
    last_ns: Option<i64>,
    freeze: Freeze,
    outliers: Option<Outliers<3>>,
    /// The first samples, and a difference of them that does no harm.
    first: Option<(FirstSamples, f64)>,
    axes: Option<AxesWatch>,
    /// Whether each component is measured: a constant of the machine file repeats by itself.
    is_measured: [bool; 3],
}

/// Limit on the rate of change of a vector.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slew {
    pub(super) per_second: f64,
    /// Allowance for noise and stamp jitter.
    pub(super) allowance: f64,
}

impl VectorWatch {
    pub(super) fn new(max: f64, slew: Option<Slew>) -> Self {
        Self {
            max,
            slew,
            good: None,
            is_confirmed: false,
            period_s: 0.0,
            last_ns: None,
            freeze: Freeze::new(),
            outliers: None,
            first: None,
            axes: None,
            is_measured: [true; 3],
        }
    }

    /// Returns the checks of a vector whose components are these numbers, if the machine file names them.
    pub(super) fn of_numbers(mut self, numbers: Option<&[NumberSpec; 3]>) -> Self {
        if let Some(numbers) = numbers {
            self.is_measured = numbers.each_ref().map(|number| number.field().is_some());
        }
        self
    }

    /// Returns the checks of a vector that may rest while others move: a constant force is legitimate.
    pub(super) fn may_rest(mut self) -> Self {
        self.freeze = self.freeze.may_rest();
        self
    }

    /// Returns the checks of a number: the first component alone, which may rest as `freeze` says.
    pub(super) fn of_one_number(mut self, freeze: Freeze) -> Self {
        (self.is_measured, self.freeze) = ([true, false, false], freeze);
        self
    }

    /// Returns the checks with those for outliers, where a difference of samples up to `harmless` does no harm.
    pub(super) fn with_outliers(mut self, harmless: f64) -> Self {
        self.outliers = Some(Outliers::new(harmless));
        self
    }

    /// Judges the first samples by the later ones from now on, where a difference up to `harmless` does no harm: for a signal
    /// without a fastest change.
    pub(super) fn judge_first_samples(&mut self, harmless: f64) {
        self.first = Some((FirstSamples::new(), harmless));
    }

    /// Returns the checks with those for single axes that stick, from this log likelihood ratio on.
    pub(super) fn with_axes(mut self, threshold: f64) -> Self {
        self.axes = Some(AxesWatch::new(threshold));
        self
    }

    /// Whether no sample has contained the vector so far.
    pub(super) fn was_never_given(&self) -> bool {
        self.last_ns.is_none()
    }

    /// Returns the check for repeats of the vector.
    pub(super) fn freeze(&self) -> &Freeze {
        &self.freeze
    }

    /// Reports faults of a sample to `found`; returns whether it is credible by itself.
    pub(super) fn check(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limits: &Limits,
        found: &mut Found<'_>,
    ) -> bool {
        let &[x, y, z] = values else { return false };
        if !values.iter().all(|v| v.is_finite()) {
            found(Notice::not_finite(stamp_ns, Component::Value));
            return false;
        }
        self.follow_period(stamp_ns, limits);
        let length = length([x, y, z]);
        let doubt = self
            .good
            .map_or(length, |(_, good)| distance(good, [x, y, z]));
        if length > self.max {
            found(
                Notice::of(FaultKind::OutOfRange, stamp_ns)
                    .measured(length, self.max)
                    .amount(doubt.max(length - self.max), 0.0),
            );
            return false;
        }
        if let (Some(slew), Some((good_ns, good))) = (self.slew, self.good) {
            let elapsed_s = limits.elapsed_s(good_ns, stamp_ns).max(self.period_s);
            let change = distance(good, [x, y, z]);
            if change > slew.per_second * elapsed_s + slew.allowance {
                let since_ns = if self.is_confirmed { stamp_ns } else { good_ns };
                if !self.is_confirmed {
                    self.good = Some((stamp_ns, [x, y, z]));
                }
                found(
                    Notice::of(FaultKind::ImpossibleRate, since_ns)
                        .measured(change / elapsed_s, slew.per_second)
                        .amount(change, change / elapsed_s),
                );
                return false;
            }
        }
        let first = self.first.as_mut();
        if let Some(far) =
            first.and_then(|(first, harmless)| first.take(stamp_ns, [x, y, z], *harmless))
        {
            // from one sample to the next
            let per_second = 1.0 / self.period_s.max(f64::MIN_POSITIVE);
            found(
                Notice::of(FaultKind::ImpossibleRate, far.stamp_ns)
                    .measured(far.distance * per_second, far.limit * per_second)
                    .amount(far.distance, far.distance * per_second),
            );
            return false;
        }
        let outliers = self.outliers.as_mut();
        if let Some(notice) =
            outliers.and_then(|it| it.notice(stamp_ns, [x, y, z], Component::Value))
        {
            found(notice);
            return false;
        }
        self.is_confirmed = self.good.is_some();
        self.good = Some((stamp_ns, [x, y, z]));
        let is_measured = self.is_measured;
        if is_measured == [false; 3] {
            return true;
        }
        // what is constant beside them is no rest of theirs
        let (mut measured, mut count) = ([0.0; 3], 0);
        for (&value, _) in values.iter().zip(is_measured).filter(|(_, it)| *it) {
            measured[count] = value;
            count += 1;
        }
        let frozen = (self.freeze).notice(stamp_ns, &measured[..count], moves_elsewhere, limits);
        let axes = self.axes.as_mut();
        let sticks = axes.and_then(|axes| {
            axes.notice(stamp_ns, [x, y, z], is_measured, moves_elsewhere, limits)
        });
        let is_whole = sticks.is_none();
        if let Some(notice) = frozen.or(sticks) {
            found(notice);
        }
        is_whole
    }

    /// Tracks the usual sampling interval, so that bunched stamps do not look like fast changes.
    fn follow_period(&mut self, stamp_ns: i64, limits: &Limits) {
        if let Some(last_ns) = self.last_ns.replace(stamp_ns) {
            let step_s = limits.elapsed_s(last_ns, stamp_ns);
            if step_s > limits.max_gap_s {
                self.good = None;
                if let Some(outliers) = &mut self.outliers {
                    outliers.restart();
                }
                if let Some((first, _)) = &mut self.first {
                    first.restart();
                }
            } else {
                self.period_s += 0.1 * (step_s - self.period_s);
            }
        }
    }
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

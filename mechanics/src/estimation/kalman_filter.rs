//! Kalman filter of the channels that one sensor measures together.
//!
//! Each channel has a position-velocity-acceleration state, driven by white jerk of spectral density q.
//! With F(dt) the Taylor step:
//!
//! ```text
//!     predict:  x = F x,  P = F P F' + Q(dt)
//!     update:   K = P h / (h' P h + r),  x = x + K (z - h' x),  P = P - K h' P
//! ```
//! The covariance P depends only on the stamps and on the noise that all channels together show
//! ([`Adaptation`]), so all channels share it and the gains.

use super::adaptation::{Adaptation, Factors};
use super::faster;
use super::history::History;
use super::lag::MeanAccelerations;
use super::misfit::{self, Misfit};
use super::onset::Onset;
use super::reading::FilterStatus;
use super::white_jerk::{
    Channel, ChannelState, Matrix, predicted, seconds, smoother_gain, step, symmetric,
};
use crate::state::SampleError;

/// Initial standard deviation of a channel's derivatives, as multiples of the process noise.
const INITIAL_SPREAD: f64 = 10.0;

/// Variance added to one sample because it is less credible.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Doubt {
    pub(crate) value_variance: f64,
    pub(crate) rate_variance: f64,
}

/// Model of a group of channels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FilterModel {
    /// Variance of a measured value.
    pub(crate) value_variance: f64,
    /// Variance of a measured velocity.
    pub(crate) rate_variance: f64,
    /// Spectral density q of the jerk: growth of the acceleration's variance per second.
    pub(crate) density: f64,
    /// Samples further apart than this belong to different segments (ns).
    pub(crate) max_gap_ns: i64,
}

/// The filter, and its steps where a smoother needs them.
#[derive(Debug, Clone)]
pub(crate) struct KalmanFilter {
    model: FilterModel,
    state: FilterState,
    history: Option<History>,
    /// Mean accelerations, which show the filter's lag; `None` where a smoother takes the lag away.
    means: Option<MeanAccelerations>,
    /// The covariance by the size of the innovations; `None` where it stays that of the noise.
    misfit: Option<Misfit>,
    /// The covariance of a motion that begins; `None` where a smoother knows the later samples.
    onset: Option<Onset>,
    /// Filter for motion that this one is too slow for.
    faster: Option<Box<KalmanFilter>>,
}

/// State of the filter after a sample: continued from it, the filter gives the same bits for later samples.
#[derive(Debug, Clone)]
pub(super) struct FilterState {
    covariance: Matrix,
    jets: Vec<ChannelState>,
    last_ns: Option<i64>,
    started_ns: i64,
    /// Estimate of the noise from the innovations; `None` where the noise stays as stated.
    adaptation: Option<Adaptation>,
}

impl FilterState {
    fn factors(&self) -> Factors {
        (self.adaptation.as_ref()).map_or(Factors::STATED, Adaptation::factors)
    }

    /// Takes the innovations of a measurement that is not doubted.
    fn learn<const MEASURED: usize>(&mut self, values: &[f64], variance: f64, doubt: f64) {
        if let Some(adaptation) = self.adaptation.as_mut().filter(|_| doubt == 0.0) {
            let jets = self.jets.iter().zip(values);
            adaptation.take::<MEASURED>(jets.map(|(jet, value)| value - jet[MEASURED]), variance);
        }
    }
}

impl KalmanFilter {
    pub(crate) fn new(model: FilterModel, channels: usize, keeps_history: bool) -> Self {
        Self {
            model,
            state: FilterState {
                covariance: [[0.0; 3]; 3],
                jets: vec![[0.0; 3]; channels],
                last_ns: None,
                started_ns: i64::MIN,
                adaptation: None,
            },
            history: keeps_history.then(|| History::new(channels)),
            means: (!keeps_history).then(|| MeanAccelerations::new(channels)),
            misfit: None,
            onset: None,
            faster: None,
        }
    }

    /// Returns the filter with a covariance that allows for a motion which its newest innovations show to begin, in the channels
    /// that count.
    pub(super) fn weighing_onsets(mut self, counts: impl Iterator<Item = bool>) -> Self {
        self.onset = Some(Onset::new(counts));
        self
    }

    /// Returns the filter with noise that its innovations correct.
    pub(super) fn adapting(mut self, adaptation: Adaptation) -> Self {
        self.state.adaptation = Some(adaptation);
        self
    }

    /// Returns the filter with a covariance as large as its innovations show, in the channels that count.
    pub(super) fn weighing_misfit(mut self, counts: impl Iterator<Item = bool>) -> Self {
        self.misfit = Some(Misfit::new(misfit::MEMORY_S, counts));
        self
    }

    /// Returns the filter beside a [`faster`] one of the same samples.
    pub(super) fn beside_faster(mut self) -> Self {
        let density = self.model.density * faster::RATIO.powi(6);
        let model = FilterModel {
            density,
            ..self.model
        };
        let mut filter = Self::new(model, self.channels(), false);
        let counts = (0..self.channels()).map(|_| true);
        filter.misfit = Some(Misfit::new(faster::MEMORY_S, counts));
        self.faster = Some(Box::new(filter));
        self
    }

    /// Returns the mean factors on the stated noise over all samples so far; `None` where the noise stays as stated.
    pub(super) fn shown_noise(&self) -> Option<Factors> {
        self.state.adaptation.as_ref()?.mean()
    }

    /// Returns the spectral density q of the jerk, as corrected so far.
    fn density(&self) -> f64 {
        self.model.density * self.state.factors().density
    }

    pub(super) fn channels(&self) -> usize {
        self.state.jets.len()
    }

    /// Stamp of the last sample.
    pub(super) fn last_ns(&self) -> Option<i64> {
        self.state.last_ns
    }

    /// Stamp of the first sample after the start or the last gap.
    pub(super) fn started_ns(&self) -> i64 {
        self.state.started_ns
    }

    /// Whether the filter's last sample is within `max_gap_ns` of a stamp.
    pub(super) fn is_near(&self, stamp_ns: i64, max_gap_ns: i64) -> bool {
        let apart = |last: i64| last.abs_diff(stamp_ns);
        (self.last_ns()).is_some_and(|last| apart(last) <= max_gap_ns.unsigned_abs())
    }

    /// Returns whether the filter has warmed up at a stamp: known from `settle_ns` after its first sample on, settling before.
    pub(super) fn status(&self, stamp_ns: i64, settle_ns: i64) -> FilterStatus {
        match stamp_ns.saturating_sub(self.started_ns()) >= settle_ns {
            true => FilterStatus::Known,
            false => FilterStatus::Settling,
        }
    }

    /// Takes over a motion from another filter that did not follow it well: this filter counts as warmed up with the other one.
    pub(super) fn take_over(&mut self, from: &Self) {
        self.state.started_ns = from.state.started_ns;
    }

    /// Excludes a channel from the noise of the others: its noise differs, and the noise learnt with it is forgotten.
    pub(super) fn disregard(&mut self, channel: usize) {
        if let Some(adaptation) = &mut self.state.adaptation {
            adaptation.disregard(channel);
        }
        if let Some(misfit) = &mut self.misfit {
            misfit.disregard(channel);
        }
        if let Some(onset) = &mut self.onset {
            onset.disregard(channel);
        }
    }

    pub(super) fn state(&self) -> &FilterState {
        &self.state
    }

    /// Continues from an earlier state. Its history begins there, with room for `steps`; the estimates up to `wanted_ns`
    /// are wanted of it.
    pub(super) fn restart(&mut self, from: &FilterState, wanted_ns: i64, steps: usize) {
        self.state.clone_from(from);
        if let Some(history) = &mut self.history {
            history.restart(wanted_ns, steps);
            if let Some(last_ns) = from.last_ns {
                history.push(last_ns, &from.jets, &from.covariance);
            }
        }
    }

    /// Whether no sample from this stamp on, later than all before, changes the estimates wanted of the history.
    pub(super) fn is_past(&self, stamp_ns: i64) -> bool {
        let Some(history) = &self.history else {
            return false;
        };
        let wanted_ns = history.wanted_ns();
        // After a gap the filter starts anew. Before its first sample, estimates are those extrapolated back from it.
        let since_ns = self.state.last_ns.unwrap_or(wanted_ns);
        let is_after_gap = stamp_ns.saturating_sub(since_ns) > self.model.max_gap_ns;
        history.is_complete() || (stamp_ns > wanted_ns && is_after_gap)
    }

    /// Smooths the history.
    pub(super) fn smooth(&mut self) {
        if let Some(history) = &mut self.history {
            history.smooth();
        }
    }

    pub(super) fn history(&self) -> Option<&History> {
        self.history.as_ref()
    }

    /// Updates the filter with a sample, `doubt` added to the variances of its values and velocities. `rates`
    /// are used only if all are finite.
    pub(crate) fn push(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        rates: Option<&[f64]>,
        doubt: Doubt,
    ) -> Result<(), SampleError> {
        if self.state.last_ns.is_some_and(|last| stamp_ns <= last) {
            return Err(SampleError::NotLater);
        }
        if !values.iter().all(|v| v.is_finite()) {
            return Err(SampleError::NotFinite);
        }
        if self.history.as_ref().is_some_and(History::is_complete) {
            return Ok(());
        }
        let rates = rates.filter(|rates| rates.iter().all(|r| r.is_finite()));
        match self
            .state
            .last_ns
            .map(|last| stamp_ns.saturating_sub(last))
            .filter(|&step| step <= self.model.max_gap_ns)
        {
            Some(step_ns) => self.follow(step_ns, values, rates, doubt),
            None => self.start(stamp_ns, values, rates, doubt),
        }
        self.state.last_ns = Some(stamp_ns);
        if let Some(adaptation) = &mut self.state.adaptation {
            adaptation.step(stamp_ns);
        }
        if let Some(history) = &mut self.history {
            history.push(stamp_ns, &self.state.jets, &self.state.covariance);
        }
        match &mut self.faster {
            Some(faster) => faster.push(stamp_ns, values, rates, doubt),
            None => Ok(()),
        }
    }

    /// Covariance predicted to a stamp close to the last sample, as large as the innovations show it to be.
    pub(crate) fn covariance_at(&self, stamp_ns: i64) -> Matrix {
        let learnt = self.covariance_by_learnt_noise(stamp_ns);
        match self.onset.as_ref().map(Onset::added) {
            Some(added) => {
                std::array::from_fn(|i| std::array::from_fn(|j| learnt[i][j] + added[i][j]))
            }
            None => learnt,
        }
    }

    /// Returns the covariance by the noise learnt so far, whatever the newest innovations show.
    fn covariance_by_learnt_noise(&self, stamp_ns: i64) -> Matrix {
        let ahead = stamp_ns.saturating_sub(self.state.last_ns.unwrap_or(stamp_ns));
        let stated = predicted(&self.state.covariance, seconds(ahead), self.density());
        let factor = self.misfit_factor();
        stated.map(|row| row.map(|p| p * factor))
    }

    /// Returns the factor (1 or more) by which the covariance of the estimates exceeds the one by the filter's noise: see
    /// [`misfit`](super::misfit).
    pub(super) fn misfit_factor(&self) -> f64 {
        self.misfit.as_ref().map_or(1.0, Misfit::factor)
    }

    /// Returns the lag of a channel's value, velocity and acceleration behind a motion that changes fast, at a stamp close to the
    /// last sample; zero without a lag model.
    pub(super) fn lag_at(&self, channel: usize, stamp_ns: i64) -> ChannelState {
        let acceleration = self.state.jets[channel][2];
        let means = self.means.as_ref();
        means.map_or([0.0; 3], |means| {
            let ahead = self.covariance_by_learnt_noise(stamp_ns);
            let p22 = self.state.covariance[2][2] * self.misfit_factor();
            means.lag(channel, acceleration, p22, &ahead)
        })
    }

    /// Writes the estimates of the channels at a stamp close to the last sample, with this share of the [`faster`] filter where
    /// there is one; returns their covariance.
    pub(super) fn read(&self, stamp_ns: i64, share: f64, channels: &mut [Channel]) -> Matrix {
        let covariance = self.covariance_at(stamp_ns);
        let of_channel = |k: usize| Channel {
            jet: self.at(k, stamp_ns),
            lag: self.lag_at(k, stamp_ns),
        };
        let channels = &mut channels[..self.channels()];
        let faster = self.faster.as_deref().filter(|_| share > 0.0);
        let Some(faster) = faster else {
            let places = channels.iter_mut().enumerate();
            places.for_each(|(k, channel)| *channel = of_channel(k));
            return covariance;
        };
        let of_faster = faster.read(stamp_ns, 0.0, channels);
        for (k, channel) in channels.iter_mut().enumerate() {
            *channel = of_channel(k).towards(channel, share);
        }
        faster::towards(&covariance, &of_faster, share)
    }

    /// Squared distance of the [`faster`] filter in the component `ESTIMATED` of the channels' states over its variance, on
    /// average over the channels; `None` where there is no such filter, or no sample yet.
    pub(super) fn distance_of_faster<const ESTIMATED: usize>(&self, stamp_ns: i64) -> Option<f64> {
        let faster = self.faster.as_deref().filter(|it| it.last_ns().is_some())?;
        let channels = 0..self.channels();
        let squares = channels.map(|k| {
            let [own, its] = [self, faster].map(|filter| filter.at(k, stamp_ns)[ESTIMATED]);
            (its - own).powi(2)
        });
        let variance = faster.covariance_at(stamp_ns)[ESTIMATED][ESTIMATED];
        Some(squares.sum::<f64>() / (self.channels() as f64 * variance))
    }

    /// State of a channel extrapolated to a stamp close to the last sample, by its Taylor series.
    pub(crate) fn at(&self, channel: usize, stamp_ns: i64) -> ChannelState {
        let last = self.state.last_ns.unwrap_or(stamp_ns);
        step(
            &self.state.jets[channel],
            seconds(stamp_ns.saturating_sub(last)),
        )
    }

    /// The value that a channel should have at a stamp; `None` before the first sample and after a gap.
    pub(super) fn expected(&self, channel: usize, stamp_ns: i64) -> Option<f64> {
        let step_ns = stamp_ns.saturating_sub(self.state.last_ns?);
        (step_ns <= self.model.max_gap_ns).then(|| self.at(channel, stamp_ns)[0])
    }

    fn start(&mut self, stamp_ns: i64, values: &[f64], rates: Option<&[f64]>, doubt: Doubt) {
        self.state.started_ns = stamp_ns;
        if let Some(adaptation) = &mut self.state.adaptation {
            adaptation.restart();
        }
        if let Some(means) = &mut self.means {
            means.restart();
        }
        if let Some(misfit) = &mut self.misfit {
            misfit.restart();
        }
        if let Some(onset) = &mut self.onset {
            onset.restart();
        }
        let factors = self.state.factors();
        let spread = INITIAL_SPREAD * INITIAL_SPREAD * self.density();
        let value_variance = self.model.value_variance * factors.value;
        let rate_variance = if rates.is_some() {
            self.model.rate_variance * factors.rate + doubt.rate_variance
        } else {
            spread
        };
        self.state.covariance = [
            [value_variance + doubt.value_variance, 0.0, 0.0],
            [0.0, rate_variance, 0.0],
            [0.0, 0.0, spread],
        ];
        for (channel, jet) in self.state.jets.iter_mut().enumerate() {
            *jet = [
                values[channel],
                rates.map_or(0.0, |rates| rates[channel]),
                0.0,
            ];
        }
    }

    fn follow(&mut self, step_ns: i64, values: &[f64], rates: Option<&[f64]>, doubt: Doubt) {
        let dt = seconds(step_ns);
        let (factors, density) = (self.state.factors(), self.density());
        let filtered = self.state.covariance;
        self.state.covariance = predicted(&filtered, dt, density);
        if let Some(history) = &mut self.history {
            history.link(
                smoother_gain(&filtered, &self.state.covariance, dt),
                density,
            );
        }
        for jet in &mut self.state.jets {
            *jet = step(jet, dt);
        }
        let variance = self.model.value_variance * factors.value;
        if let Some(misfit) = self.misfit.as_mut().filter(|_| doubt.value_variance == 0.0) {
            let jets = &self.state.jets;
            let squares = jets.iter().zip(values).map(|(jet, z)| (z - jet[0]).powi(2));
            misfit.step(squares, self.state.covariance[0][0] + variance, dt);
        }
        self.update::<0>(variance, doubt.value_variance, values);
        if let Some(rates) = rates {
            let variance = self.model.rate_variance * factors.rate;
            self.update::<1>(variance, doubt.rate_variance, rates);
        }
        if let Some(onset) = &mut self.onset {
            onset.step(dt);
        }
        if let Some(means) = &mut self.means {
            means.step(&self.state.jets, &self.state.covariance, density, dt);
        }
    }

    /// Updates every channel with a measurement of the component `MEASURED` of its state.
    fn update<const MEASURED: usize>(&mut self, variance: f64, doubt: f64, values: &[f64]) {
        let row = self.state.covariance[MEASURED];
        let innovation_variance = row[MEASURED] + (variance + doubt);
        self.state
            .learn::<MEASURED>(values, innovation_variance, doubt);
        let is_rate = MEASURED == 1;
        if let Some(onset) = self.onset.as_mut().filter(|_| is_rate && doubt == 0.0) {
            let jets = self.state.jets.iter().zip(values);
            onset.take(
                jets.map(|(jet, value)| value - jet[MEASURED]),
                innovation_variance,
            );
        }
        let gain = row.map(|p| p / innovation_variance);
        let before = self.state.covariance;
        self.state.covariance = symmetric(|i, j| before[i][j] - gain[i] * row[j]);
        for (jet, value) in self.state.jets.iter_mut().zip(values) {
            let innovation = value - jet[MEASURED];
            for i in 0..3 {
                jet[i] += gain[i] * innovation;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: FilterModel = FilterModel {
        value_variance: 1e-6,
        rate_variance: 1e-6,
        density: 1.0,
        max_gap_ns: 100_000_000,
    };

    fn parabola(t: f64) -> ChannelState {
        [1.0 + 2.0 * t - 1.5 * t * t, 2.0 - 3.0 * t, -3.0]
    }

    /// Filter of a jerk-free motion, sampled with jitter.
    fn parabolic_filter(keeps_history: bool) -> KalmanFilter {
        let mut filter = KalmanFilter::new(MODEL, 1, keeps_history);
        for k in 0..400_i64 {
            let stamp = k * 10_000_000 + (k * 7919 % 13) * 200_000;
            filter
                .push(
                    stamp,
                    &[parabola(seconds(stamp))[0]],
                    None,
                    Doubt::default(),
                )
                .unwrap();
        }
        filter
    }

    #[test]
    fn filter_follows_parabola_without_lag() {
        let filter = parabolic_filter(false);
        let stamp = filter.last_ns().unwrap() + 3_000_000;
        let (found, truth) = (filter.at(0, stamp), parabola(seconds(stamp)));
        for i in 0..3 {
            assert!((found[i] - truth[i]).abs() < 1e-4, "{found:?} {truth:?}");
        }
    }

    #[test]
    fn smoother_reproduces_parabola_exactly() {
        let mut filter = parabolic_filter(true);
        filter.smooth();
        let history = filter.history().unwrap();
        for (k, &stamp) in history.stamps_ns().iter().enumerate() {
            let jet = history.jets(k)[0];
            let truth = parabola(seconds(stamp));
            for i in 0..3 {
                assert!(
                    (jet[i] - truth[i]).abs() < 1e-3 * (1 + i) as f64,
                    "{stamp}: {jet:?} {truth:?}"
                );
            }
        }
    }

    #[test]
    fn velocities_are_used_only_if_all_are_finite() {
        let mut filter = KalmanFilter::new(MODEL, 2, false);
        filter
            .push(0, &[0.0, 0.0], Some(&[1.0, f64::NAN]), Doubt::default())
            .unwrap();
        assert_eq!(filter.state.jets[0][1], 0.0);
        assert_eq!(
            filter.push(0, &[0.0, 0.0], None, Doubt::default()),
            Err(SampleError::NotLater)
        );
        assert_eq!(
            filter.push(1, &[0.0, f64::INFINITY], None, Doubt::default()),
            Err(SampleError::NotFinite)
        );
    }

    /// The covariance after so many samples, which repeat every minute to the nanosecond.
    fn covariance_after(minutes: i64) -> Matrix {
        let mut filter = KalmanFilter::new(MODEL, 1, false);
        for k in 0..minutes * 6000 {
            let stamp = k * 10_000_000 + (k % 6000 * 7919 % 13) * 200_000;
            filter.push(stamp, &[0.0], None, Doubt::default()).unwrap();
        }
        filter.state.covariance
    }

    #[test]
    fn covariance_of_a_day_is_that_of_a_minute() {
        let (minute, day) = (covariance_after(1), covariance_after(24 * 60));
        for i in 0..3 {
            for j in 0..3 {
                let apart = day[i][j] / minute[i][j] - 1.0;
                assert!(apart.abs() < 1e-12, "{i} {j}: {minute:?} {day:?}");
            }
        }
    }

    #[test]
    fn smoother_does_not_cross_gaps() {
        let mut filter = KalmanFilter::new(MODEL, 1, true);
        for k in 0..20 {
            filter
                .push(k * 10_000_000, &[0.0], None, Doubt::default())
                .unwrap();
        }
        for k in 0..20 {
            filter
                .push(
                    1_000_000_000 + k * 10_000_000,
                    &[5.0],
                    None,
                    Doubt::default(),
                )
                .unwrap();
        }
        assert_eq!(filter.started_ns(), 1_000_000_000);
        filter.smooth();
        let history = filter.history().unwrap();
        let [before, after] = [19, 20].map(|k| history.jets(k)[0][0]);
        assert!(before.abs() < 1e-9 && (after - 5.0).abs() < 1e-9);
    }
}

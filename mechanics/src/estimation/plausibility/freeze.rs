//! Detection of frozen signals, which repeat bit for bit.

use super::notice::{Limits, Notice, Rules};
use super::turning::{noise_against_motion, per_repeat};
use crate::machine::{FaultKind, Machine};

/// Largest evidence of noise or of a motion, as a multiple of the threshold, so that a state that ends is forgotten.
const LARGEST: f64 = 2.0;
/// Weight of a change in the mean change, and of a sample in the share of repeats.
const STEP_WEIGHT: f64 = 1.0 / 32.0;
/// Smallest mean change of a sensor that resolves its noise, as a multiple of the least change. Of three values that go to and
/// fro between neighbouring steps, the mean change is up to 1.4 least ones; of noise as wide as a step it is 2.4.
const RESOLVED: f64 = 1.75;
/// Changes from which on that is known for good, and the share of repeats between changes by steps: a smooth signal changes as
/// evenly, but at every sample.
const FEWEST_CHANGES: u64 = 64;
const LEAST_REPEATS: f64 = 0.03;
/// Shortest duration of a run of repeats that shows nothing more with fewer samples than usual (ns), and the fewest samples of
/// it.
const LONG_NS: f64 = 1e9;
const FEWEST_REPEATS: u32 = 10;
/// Number of last samples by which the share of repeats of a signal is judged: a longer rest, as of a crane that stood for an
/// hour, says no more of it.
const REMEMBERED: f64 = 4096.0;
/// A step is at least this share of the signal's spread. At rest, a number without noise flickers by its last bit.
const LEAST_STEP: f64 = 1e-3;

/// Detects a frozen part with at most four values.
///
/// A sensor at rest may repeat itself legitimately: one simulated without noise, or one of coarse resolution.
/// Repetition therefore counts only if the signal was noisy before (judged by how often it turned back, which is independent of the
/// noise amplitude) and so seldom repeated itself that chance does not explain it, or while another signal detects motion. That of a
/// sensor whose step is wider than its noise never counts: a motion elsewhere may move it by less than a step.
///
/// Of a signal that may rest while others move, as a force or a mass, motion elsewhere is no proof that it is frozen. But for as long
/// as it rests, nothing shows that it is measured, and neither does anything of one that stopped before it has shown whether it has
/// noise: see [`Freeze::is_silent`].
#[derive(Debug, Clone, Default)]
pub(super) struct Freeze {
    last: [f64; 4],
    step: [f64; 4],
    samples: u64,
    run: u32,
    run_since_ns: i64,
    /// Number of repeated samples during which motion was detected elsewhere.
    moving: u32,
    /// Changes, and repeats before the present run, while it was measured: since its first change, off its stop, and of the last
    /// `REMEMBERED` samples or so.
    changed: f64,
    repeated: f64,
    /// The evidence of noise against a motion by its changes, as a log likelihood ratio, from the change on that serves either most.
    noise: f64,
    /// The evidence of noise by changes while nothing moved elsewhere: the signal's own noise, which no motion drowns or makes.
    noise_at_rest: f64,
    /// Whether the present run of repeats shows that the signal is not measured.
    is_missed: bool,
    /// Running mean and sum of squared deviations, for the spread of the signal.
    mean: [f64; 4],
    squares: [f64; 4],
    /// Least change and running mean of the changes, as lengths, and running share of repeats.
    resolution: f64,
    change: f64,
    repeats: f64,
    /// Whether the signal may rest while others move, so that motion elsewhere does not show that it is frozen.
    may_rest: bool,
    /// Whether the signal is exactly zero where there is nothing to measure.
    has_stop: bool,
    is_silent: bool,
    /// Whether the sensor went from step to step by the last changes, and by enough of them at some time.
    steps: bool,
    is_coarse: bool,
}

impl Freeze {
    pub(super) fn new() -> Self {
        Self {
            last: [f64::NAN; 4],
            resolution: f64::INFINITY,
            ..Self::default()
        }
    }

    /// Returns the check of a signal that may rest while others move.
    pub(super) fn may_rest(mut self) -> Self {
        self.may_rest = true;
        self
    }

    /// Returns the check of a signal that may rest while others move, and is exactly zero where there is nothing to measure: a
    /// scale that finds its zero, a load of a support that cannot pull.
    pub(super) fn may_rest_at_zero(self) -> Self {
        let mut freeze = self.may_rest();
        freeze.has_stop = true;
        freeze
    }

    /// Whether the signal has repeated itself for so long that nothing shows any more that it is measured: its own noise is
    /// missing, or it should have answered to motion elsewhere.
    pub(super) fn is_silent(&self) -> bool {
        self.is_silent
    }

    /// Whether the present value says nothing of the measured quantity: the signal has never had another value, or is silent.
    /// Zero hides nothing, as the load of a foot or as a pressure, and a signal of coarse resolution rests within a step.
    pub(super) fn says_nothing(&self) -> bool {
        let is_zero = self.last[0] == 0.0;
        !is_zero && !self.is_coarse() && (self.is_silent || !self.has_changed())
    }

    /// Whether the signal has had a value.
    pub(super) fn was_given(&self) -> bool {
        self.samples > 0
    }

    /// Whether the signal has had two different values.
    pub(super) fn has_changed(&self) -> bool {
        self.samples > 1
    }

    /// The notice to report if the signal is frozen. `values` are finite.
    pub(super) fn notice(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limits: &Limits,
    ) -> Option<Notice> {
        let since_ns = self.since(stamp_ns, values, moves_elsewhere, limits)?;
        Some(
            Notice::of(FaultKind::Frozen, since_ns)
                .measured(limits.elapsed_s(since_ns, stamp_ns), f64::NAN)
                .amount(self.spread(), 0.0),
        )
    }

    /// Time since which the signal has been frozen, if it is. `values` are finite.
    fn since(
        &mut self,
        stamp_ns: i64,
        values: &[f64],
        moves_elsewhere: bool,
        limits: &Limits,
    ) -> Option<i64> {
        let is_same = values
            .iter()
            .zip(&self.last)
            .all(|(a, b)| a.to_bits() == b.to_bits());
        if is_same {
            self.run = self.run.saturating_add(1);
            self.moving += u32::from(moves_elsewhere);
            self.repeats += STEP_WEIGHT * (1.0 - self.repeats);
        } else {
            self.remember_run();
            self.see(values, moves_elsewhere, LARGEST * limits.sticks);
            (self.run, self.run_since_ns, self.moving) = (1, stamp_ns, 0);
            (self.is_silent, self.is_missed) = (false, false);
        }
        let is_noise = |evidence: f64| evidence >= limits.sticks;
        let moves = self.moving >= self.run / 2;
        let was_noisy = match self.may_rest {
            false => is_noise(self.noise),
            // what shook a force or a mass may have ended
            true => is_noise(self.noise_at_rest) || (moves && is_noise(self.noise)),
        };
        // one that moved and has no noise rests rightly, and so may one that was shaken
        let is_open = self.has_changed() && self.noise.abs() < limits.sticks;
        let lasted_ns = stamp_ns.saturating_sub(self.run_since_ns);
        let limit = limits.frozen_samples;
        let is_long = |run: u32, ns: f64| run >= limit || (run >= FEWEST_REPEATS && ns >= LONG_NS);
        let (run_ns, moving) = (lasted_ns as f64, self.moving);
        let moved_ns = run_ns * f64::from(moving) / f64::from(self.run);
        let repeats = f64::from(self.run - 1);
        let is_no_chance = repeats * per_repeat(self.changed, self.repeated) >= limits.sticks;
        let is_asked = is_no_chance && !self.is_coarse() && !self.is_at_stop();
        let is_missed = was_noisy && is_asked;
        let has_stopped = is_missed || (is_open && is_asked);
        self.is_missed |= has_stopped;
        let says_nothing = (has_stopped && is_long(self.run, run_ns)) || is_long(moving, moved_ns);
        // a rest after it shows nothing either
        self.is_silent |= self.may_rest && says_nothing;
        let counts = is_missed || (moves && !self.may_rest && !self.is_coarse());
        (self.run >= limit && counts).then_some(self.run_since_ns)
    }

    /// Whether the last value is exactly zero, the stop below which there is nothing to measure.
    fn is_at_stop(&self) -> bool {
        self.has_stop && self.last[0] == 0.0
    }

    /// Takes the run that ends with a change into account.
    fn remember_run(&mut self) {
        if !self.has_changed() {
            self.changed += f64::from(u8::from(self.was_given()));
            return;
        }
        self.changed += 1.0;
        if !self.is_missed && !self.is_at_stop() {
            self.repeated += f64::from(self.run.saturating_sub(1));
        }
        let kept = (REMEMBERED / (self.changed + self.repeated)).min(1.0);
        self.changed *= kept;
        self.repeated *= kept;
    }

    /// Whether the sensor does not resolve its own noise, as far as is known.
    fn is_coarse(&self) -> bool {
        let steps = self.is_coarse || (self.steps && self.samples < FEWEST_CHANGES);
        steps && self.resolution >= LEAST_STEP * self.spread()
    }

    /// Largest standard deviation of any channel so far.
    fn spread(&self) -> f64 {
        let count = self.samples.max(1) as f64;
        self.squares.iter().copied().fold(0.0, f64::max).sqrt() / count.sqrt()
    }

    /// Takes a change; `largest`: the largest evidence of noise.
    fn see(&mut self, values: &[f64], moves_elsewhere: bool, largest: f64) {
        self.samples += 1;
        let count = self.samples as f64;
        let mut turns = 0.0;
        let pairs = values.iter().zip(&self.last);
        let change = pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        for (i, &value) in values.iter().enumerate() {
            let step = value - self.last[i];
            turns += f64::from(u8::from(step * self.step[i] < 0.0));
            self.step[i] = step;
            self.last[i] = value;
            let apart = value - self.mean[i];
            self.mean[i] += apart / count;
            self.squares[i] += apart * (value - self.mean[i]);
        }
        // NaN: the first one
        if change > 0.0 {
            self.follow_steps(change);
        }
        // two changes tell whether the last one goes back
        if self.samples > 2 {
            let share = turns / values.len() as f64;
            let ratio = noise_against_motion(share, 1.0 - share);
            let add = |evidence: f64| (evidence + ratio).clamp(-largest, largest);
            self.noise = add(self.noise);
            if !moves_elsewhere {
                self.noise_at_rest = add(self.noise_at_rest);
            }
        }
    }

    fn follow_steps(&mut self, change: f64) {
        // the first sample is no change
        let weight = STEP_WEIGHT.max(1.0 / (self.samples - 1) as f64);
        self.change += weight * (change - self.change);
        self.resolution = self.resolution.min(change);
        self.steps = self.change < RESOLVED * self.resolution && self.repeats >= LEAST_REPEATS;
        self.repeats -= STEP_WEIGHT * self.repeats;
        self.is_coarse |= self.steps && self.samples >= FEWEST_CHANGES;
    }
}

/// Returns for each load of a support (ns, N), in stamp order, whether anything shows that it is measured, by the rule for the split of
/// the load: it has had another value before, has not repeated this one for too long, or is zero.
#[must_use]
pub fn are_shown_to_be_measured(machine: &Machine, loads: &[(i64, f64)]) -> Vec<bool> {
    let limits = Rules::of(machine).limits;
    let mut freeze = Freeze::new().may_rest_at_zero();
    let mut is_shown = |&(stamp_ns, load): &(i64, f64)| {
        let is_known = load.is_finite();
        if is_known {
            freeze.since(stamp_ns, &[load], false, &limits);
        }
        is_known && !freeze.says_nothing()
    };
    loads.iter().map(&mut is_shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frozen(before: impl Fn(usize) -> f64, moves: bool) -> Option<usize> {
        frozen_of(&mut Freeze::new(), before, moves)
    }

    fn frozen_of(freeze: &mut Freeze, before: impl Fn(usize) -> f64, moves: bool) -> Option<usize> {
        (0..800_usize).find(|&k| {
            let value = before(k.min(400));
            freeze
                .since(
                    k as i64,
                    &[value, -value, 0.5 * value],
                    moves && k > 400,
                    &Limits::OF_TESTS,
                )
                .is_some()
        })
    }

    fn noise(k: usize) -> f64 {
        ((k as f64 * 12.9898).sin() * 43_758.545_3).fract()
    }

    #[test]
    fn vanishing_noise_is_frozen_after_the_sample_limit() {
        assert_eq!(frozen(noise, false), Some(499));
    }

    /// Returns the reading of a sensor that resolves whole numbers only.
    fn in_steps(value: f64) -> f64 {
        value.round()
    }

    #[test]
    fn a_coarse_sensor_may_rest_while_something_moves() {
        // to and fro between two steps in one posture, still in the next
        let rests = |k: usize| {
            let posture = if k < 400 { 7.5 } else { 7.0 };
            in_steps(posture + 0.6 * (noise(k) - 0.5))
        };
        assert_eq!(frozen(rests, true), None);
        // from step to step by itself, and few steps at that
        let leans = |k: usize| in_steps(0.02 * k as f64);
        assert_eq!(frozen(leans, true), None);
        // shaken on its way, and still after it
        let stops = |k: usize| match k {
            0..300 => rests(k),
            300..400 => in_steps(20.0 * noise(k)),
            _ => 7.0,
        };
        assert_eq!(frozen(stops, false), None);
        assert_eq!(frozen(stops, true), None);
    }

    #[test]
    fn a_signal_that_may_rest_is_silent_while_something_moves() {
        // how it was before, whether something moves, and whether it is frozen and silent then
        type Before = fn(usize) -> f64;
        let smooth: Before = |k| (k as f64 * 0.01).sin();
        let coarse: Before = |k| in_steps(7.5 + 0.6 * (noise(k) - 0.5));
        for (before, moves, expected) in [
            (smooth, false, [false, false]),
            (smooth, true, [false, true]),
            (coarse, false, [false, false]),
            (coarse, true, [false, true]),
            (noise as Before, false, [true, true]),
        ] {
            let mut freeze = Freeze::new().may_rest();
            let is_frozen = frozen_of(&mut freeze, before, moves).is_some();
            assert_eq!([is_frozen, freeze.is_silent()], expected);
            // whatever moves or rests afterwards
            let last = freeze.last;
            (800..2000).for_each(|k| _ = freeze.since(k, &last[..3], false, &Limits::OF_TESTS));
            assert_eq!(freeze.is_silent(), expected[1]);
            // until it shows that it is measured
            let _ = freeze.since(2000, &[9.0, -9.0, 4.5], moves, &Limits::OF_TESTS);
            assert!(!freeze.is_silent());
        }
    }

    #[test]
    fn noise_of_a_force_counts_for_as_long_as_what_makes_it() {
        // noise at rest, then a motion that drowns it, or that makes it
        let drowned = |k: usize| match k {
            0..200 => noise(k),
            k => noise(200) + 10.0 * (k - 200) as f64,
        };
        let shaken = |k: usize| in_steps(5.0 * noise(k));
        let is_frozen = |before: &dyn Fn(usize) -> f64, moved: bool, moves: bool| {
            let mut freeze = Freeze::new().may_rest();
            (0..600_usize).any(|k| {
                let moves = match k {
                    0..200 => moved,
                    200..400 => true,
                    _ => moves,
                };
                let value = [before(k.min(400))];
                freeze
                    .since(k as i64, &value, moves, &Limits::OF_TESTS)
                    .is_some()
            })
        };
        assert!(is_frozen(&drowned, false, false));
        assert!(!is_frozen(&shaken, true, false), "the motion is over");
        assert!(is_frozen(&shaken, true, true));
    }

    /// A jack that hung over the ground for hours, and a crane that stood as long, must not need minutes to be found.
    #[test]
    fn a_long_rest_says_little_of_how_often_a_signal_repeats_itself() {
        let hour = 360_000;
        for (first, has_stop) in [(0.0, true), (9.0, false), (9.0, true)] {
            let mut freeze = match has_stop {
                true => Freeze::new().may_rest_at_zero(),
                false => Freeze::new().may_rest(),
            };
            // before its first change, and after some
            let before = |k: usize| match k {
                k if k < hour => first,
                k if k < hour + 200 => noise(k),
                _ => first,
            };
            let mut k = 0;
            let mut next = |value: f64| {
                k += 1;
                freeze
                    .since(k, &[value], false, &Limits::OF_TESTS)
                    .is_some()
            };
            (0..2 * hour).for_each(|k| _ = next(before(k)));
            (0..1000).for_each(|k| _ = next(noise(k)));
            let stopped = noise(999);
            let found = (1..1000).find(|_| next(stopped));
            assert!(
                found.is_some_and(|samples| samples <= 200),
                "{first}: {found:?}"
            );
        }
    }

    #[test]
    fn zero_is_where_a_load_rests() {
        let lifted = |k: usize| if k < 400 { noise(k) } else { 0.0 };
        for moves in [false, true] {
            let mut freeze = Freeze::new().may_rest_at_zero();
            assert_eq!(frozen_of(&mut freeze, lifted, moves), None);
            assert_eq!(freeze.is_silent(), moves);
        }
        let mut freeze = Freeze::new().may_rest_at_zero();
        assert_eq!(frozen_of(&mut freeze, noise, false), Some(499));
    }

    #[test]
    fn noise_wider_than_a_step_that_vanishes_is_frozen() {
        let resolved = |k: usize| in_steps(5.0 * noise(k));
        assert!(frozen(resolved, false).is_some());
        // each value twice, as of a sensor that is read too often
        let held = |k: usize| noise(k / 2);
        assert!(frozen(held, false).is_some());
    }

    #[test]
    fn smooth_signal_may_rest_unless_motion_is_detected() {
        let smooth = |k: usize| (k as f64 * 0.01).sin();
        assert_eq!(frozen(smooth, false), None);
        assert_eq!(frozen(smooth, true), Some(499));
    }
}

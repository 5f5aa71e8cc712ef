//! An encoder that flickers at rest, and stops to.
//!
//! A position at rest may repeat for hours. But one that is finer than its own noise hardly ever repeats, in any posture: of the
//! samples at rest the share p. So many repeats on end while the machine works say with the log likelihood ratio `-ln p` each
//! that the position is not measured any more. It works while something else moves, or another joint of the message flickers: what
//! shakes one, or reads one, does so with all of them.
//!
//! A joint that moves slowly and has no noise may rest then: the changes at rest say which of both it is, see [`super::turning`].

use super::notice::Limits;
use super::turning::{noise_against_motion, per_repeat};

/// Weight of a sample at rest in the mean of the changes.
const CHANGE_WEIGHT: f64 = 1.0 / 64.0;
/// The noise is resolved where the mean change is so many times the least one. A position between two steps of a coarse
/// encoder flickers by one of them, and rests in another posture.
const RESOLVED: f64 = 1.5;
/// A run of fewer samples than usual counts where it lasts so long (s), with at least so many samples.
const LONG_S: f64 = 1.0;
const FEWEST_REPEATS: u32 = 10;

/// What is known of the flicker of a position.
#[derive(Debug, Clone)]
pub(super) struct Flicker {
    threshold: f64,
    last: f64,
    /// The last change of the position.
    step: f64,
    resolution: f64,
    /// Mean change at rest, before the present run: it fades with every repeat.
    change: f64,
    /// Sum and number of all changes that went back.
    back_sum: f64,
    back_count: f64,
    /// Changes at rest, and those that went back.
    changes: f64,
    changed: f64,
    kept: f64,
    run: u32,
    works: u32,
    run_since_ns: i64,
}

impl Flicker {
    /// That stops from this log likelihood ratio on.
    pub(super) fn new(threshold: f64) -> Self {
        Self {
            threshold,
            last: f64::NAN,
            step: 0.0,
            resolution: f64::INFINITY,
            change: 0.0,
            back_sum: 0.0,
            back_count: 0.0,
            changes: 0.0,
            changed: 0.0,
            kept: 0.0,
            run: 0,
            works: 0,
            run_since_ns: 0,
        }
    }

    /// Whether the position was measured anew with the last sample, with noise of its own.
    pub(super) fn flickers(&self) -> bool {
        self.run == 0 && self.is_fine()
    }

    /// Mean of all changes that went back: what noise changes.
    pub(super) fn noise(&self) -> f64 {
        self.back_sum / self.back_count.max(1.0)
    }

    /// How often the position repeated itself between two changes at rest.
    pub(super) fn repeats(&self) -> f64 {
        self.kept / self.changed.max(1.0)
    }

    /// Whether the position is known to be finer than its noise.
    fn is_fine(&self) -> bool {
        let noise = noise_against_motion(self.changed, self.changes - self.changed);
        noise >= self.threshold && self.change >= RESOLVED * self.resolution
    }

    /// Takes a position, whether the joint rests by its velocity, and whether the machine works. Returns since when it
    /// has not flickered, if it should have.
    pub(super) fn stopped_ns(
        &mut self,
        stamp_ns: i64,
        position: f64,
        rests: bool,
        works: bool,
        limits: &Limits,
    ) -> Option<i64> {
        let step = position - self.last;
        let change = step.abs();
        self.last = position;
        // NaN: the first one
        if change == 0.0 {
            self.run = self.run.saturating_add(1);
            self.works += u32::from(works);
        } else {
            if change > 0.0 {
                self.resolution = self.resolution.min(change);
            }
            self.changes += f64::from(u8::from(rests));
            let turns_back = step * std::mem::replace(&mut self.step, step) < 0.0;
            if turns_back {
                self.back_sum += change;
                self.back_count += 1.0;
            }
            if rests && turns_back {
                self.kept += f64::from(self.run);
                self.changed += 1.0;
                let kept = (1.0 - CHANGE_WEIGHT).powi(self.run.min(10_000) as i32);
                self.change = self.change * kept * (1.0 - CHANGE_WEIGHT) + CHANGE_WEIGHT * change;
            }
            (self.run, self.works, self.run_since_ns) = (0, 0, stamp_ns);
        }
        let lasted_s = limits.elapsed_s(self.run_since_ns, stamp_ns);
        let is_long =
            self.run >= limits.frozen_samples || (self.run >= FEWEST_REPEATS && lasted_s >= LONG_S);
        let per_repeat = per_repeat(self.changed, self.kept);
        let is_proven = f64::from(self.run) * per_repeat >= self.threshold;
        let is_asked = self.works >= self.run / 2;
        (is_long && self.is_fine() && is_proven && is_asked).then_some(self.run_since_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Since when a position that is read every ten milliseconds does not flicker any more (s).
    fn stopped_s(resolution: f64, works: bool, position: impl Fn(usize) -> f64) -> Option<f64> {
        let mut flicker = Flicker::new(25.0);
        (0..2000).find_map(|k: usize| {
            let read = (position(k) / resolution).round() * resolution;
            let stamp_ns = k as i64 * 10_000_000;
            let since = flicker.stopped_ns(stamp_ns, read, true, works, &Limits::OF_TESTS);
            since.map(|ns| ns as f64 * 1e-9)
        })
    }

    /// Noise between -1 and 1.
    fn noise(k: usize) -> f64 {
        let wave = ((k as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        2.0 * wave - 1.0
    }

    #[test]
    fn a_fine_encoder_that_stops_to_flicker_is_frozen_while_the_machine_works() {
        let stops = |k: usize| 1e-3 * noise(k.min(600));
        assert_eq!(stopped_s(1e-4, true, stops), Some(6.0));
        assert_eq!(stopped_s(1e-4, false, stops), None);
        assert_eq!(stopped_s(1e-4, true, |k| 1e-3 * noise(k)), None);
    }

    #[test]
    fn half_a_second_of_flicker_is_enough_to_miss_it() {
        let stops = |k: usize| 1e-3 * noise(k.min(50));
        assert_eq!(stopped_s(1e-4, true, stops), Some(0.5));
        // a position between two steps is known by nothing else
        let coarse = |k: usize| 5e-5 + 2e-5 * noise(k.min(50));
        assert_eq!(stopped_s(1e-4, true, coarse), None);
    }

    /// Most changes of wide noise look like a motion.
    #[test]
    fn noise_is_the_mean_of_all_changes_that_go_back() {
        let mut flicker = Flicker::new(25.0);
        let largest_at_rest = 5e-4;
        for k in 1..600_usize {
            let [before, position] = [k - 1, k].map(|k| 1e-3 * noise(k / 5));
            let rests = (position - before).abs() < largest_at_rest;
            let stamp_ns = k as i64 * 10_000_000;
            flicker.stopped_ns(stamp_ns, position, rests, true, &Limits::OF_TESTS);
        }
        assert!((largest_at_rest..1.2e-3).contains(&flicker.noise()));
    }

    #[test]
    fn a_joint_without_noise_may_creep_and_rest() {
        for pace in [5e-5, 2e-4, 1.5e-3] {
            let creeps = |k: usize| pace * k.min(600) as f64;
            assert_eq!(stopped_s(1e-4, true, creeps), None, "{pace}");
            // there and back, some times
            let swings = |k: usize| 100.0 * pace * (k.min(1200) as f64 * 0.02).sin();
            assert_eq!(stopped_s(1e-4, true, swings), None, "{pace}");
        }
    }

    #[test]
    fn a_coarse_encoder_may_rest_in_one_posture_and_flicker_in_another() {
        let posture = |k: usize| if k < 800 { 0.0005 } else { 0.001 };
        assert_eq!(
            stopped_s(1e-3, true, |k| posture(k) + 1e-4 * noise(k)),
            None
        );
    }
}

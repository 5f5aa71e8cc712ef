//! An encoder that flickers at rest, and stops to.
//!
//! A position at rest may repeat for hours. But one that is finer than its own noise hardly ever repeats, in any posture: of the
//! samples at rest the share p. So many repeats on end while the machine works say with the log likelihood ratio `-ln p` each
//! that the position is not measured any more. It works while something else moves, or another joint of the message flickers: what
//! shakes one, or reads one, does so with all of them.
//!
//! A joint that moves slowly and has no noise may rest then: the changes at rest say which of both it is, see [`super::turning`]. They do
//! so from the change on that shows noise best, and for good: what moves slowly afterwards has its noise still.

use super::notice::Limits;
use super::turning::{noise_against_motion, per_repeat};

/// Weight of a sample at rest in the mean of the changes.
const CHANGE_WEIGHT: f64 = 1.0 / 64.0;
/// Smallest mean change of a position that resolves its noise, as a multiple of the least change. A position between two steps of
/// a coarse encoder flickers by one of them, and rests in another posture.
const RESOLVED: f64 = 1.5;
/// Fewest runs of repeats that show how often a position is read.
const FEWEST_RUNS: u32 = 8;

/// Statistics of the flicker of a joint's position, and of the present run of repeats.
#[derive(Debug, Clone, Default)]
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
    /// The evidence of noise against a motion by the changes at rest, from the change on that makes it largest, and whether that has
    /// exceeded the threshold.
    evidence: f64,
    is_noisy: bool,
    /// Changes at rest that went back.
    changed: f64,
    kept: f64,
    run: u32,
    works: u32,
    run_since_ns: i64,
    reads: Reads,
}

/// How often a position is read. Of one that is read less often than it is sent, most runs of repeats have the same length, or are
/// longer by one: reads and messages do not keep step. Of one that rests they have any length.
#[derive(Debug, Clone, Default)]
struct Reads {
    /// The fewest repeats of a run.
    fewest: u32,
    /// Number of runs since there were so few, and of those that are alike.
    runs: u32,
    alike: u32,
}

impl Reads {
    fn take(&mut self, repeats: u32) {
        if self.runs == 0 || repeats < self.fewest {
            *self = Self {
                fewest: repeats,
                ..Self::default()
            };
        }
        self.runs = self.runs.saturating_add(1);
        let is_alike = repeats <= self.fewest.saturating_add(1);
        self.alike = self.alike.saturating_add(u32::from(is_alike));
    }

    /// Returns the most repeats of a position that is not read anew; zero of one that is read for each message, and of one whose few
    /// runs do not show it.
    fn most(&self) -> u32 {
        let is_shown = self.runs >= FEWEST_RUNS && self.alike > self.runs / 2;
        match self.fewest > 0 && is_shown {
            true => self.fewest.saturating_add(1),
            false => 0,
        }
    }
}

impl Flicker {
    /// Creates a flicker that counts as stopped from this log likelihood ratio on.
    pub(super) fn new(threshold: f64) -> Self {
        Self {
            threshold,
            last: f64::NAN,
            resolution: f64::INFINITY,
            ..Self::default()
        }
    }

    /// Whether the position was measured anew with the last sample, with noise of its own.
    pub(super) fn flickers(&self) -> bool {
        self.run == 0 && self.is_fine()
    }

    /// Returns the mean of all changes that went back: the change by noise.
    pub(super) fn noise(&self) -> f64 {
        self.back_sum / self.back_count.max(1.0)
    }

    /// Returns the mean number of repeats between two changes of the position at rest.
    pub(super) fn repeats(&self) -> f64 {
        self.kept / self.changed.max(1.0)
    }

    /// Returns the age of a position when its sample came (s): of an encoder that is read less often than it is sent, which repeats
    /// itself however fast it moves.
    pub(super) fn age_s(&self, stamp_ns: i64, period_s: f64, limits: &Limits) -> f64 {
        let repeated_s = limits.elapsed_s(self.run_since_ns, stamp_ns);
        let longest_s = f64::from(self.reads.most()) * period_s;
        repeated_s.clamp(0.0, longest_s.min(limits.max_gap_s))
    }

    /// Whether a position that repeats itself once more need not have been read anew.
    pub(super) fn may_repeat(&self) -> bool {
        self.run < self.reads.most()
    }

    /// Whether the position is known to be finer than its noise.
    fn is_fine(&self) -> bool {
        self.is_noisy && self.change >= RESOLVED * self.resolution
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
            let before = std::mem::replace(&mut self.step, step);
            let turns_back = step * before < 0.0;
            if rests {
                let back = f64::from(u8::from(turns_back));
                let ratio = noise_against_motion(back, 1.0 - back);
                self.evidence = (self.evidence + ratio).max(0.0);
                self.is_noisy |= self.evidence >= self.threshold;
            }
            // the first run may have begun before the first sample
            if change > 0.0 && before.is_finite() {
                self.reads.take(self.run);
            }
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
        let is_long = limits.is_long(self.run, lasted_s);
        let per_repeat = per_repeat(self.changed, self.kept);
        let is_proven = f64::from(self.run) * per_repeat >= self.threshold;
        let is_asked = self.works >= self.run / 2;
        (is_long && self.is_fine() && is_proven && is_asked).then_some(self.run_since_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the time since which a position that is read every ten milliseconds does not flicker any more (s).
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
    fn a_fine_encoder_that_moved_slowly_before_it_stops_is_frozen() {
        // slower than what counts as a motion, and faster than its noise
        let slowly = |k: usize| 7e-4 * k.clamp(300, 900) as f64;
        let stops = |k: usize| slowly(k) + 3e-4 * noise(k.min(900));
        assert_eq!(stopped_s(1e-4, true, stops), Some(9.0));
        // without noise it may rest
        assert_eq!(stopped_s(1e-4, true, slowly), None);
    }

    #[test]
    fn a_position_that_is_read_less_often_than_it_is_sent_has_an_age() {
        let age_s = |repeats: fn(usize) -> usize| {
            let mut flicker = Flicker::new(25.0);
            let mut stamp_ns = 0;
            for read in 0..200 {
                for _ in 0..=repeats(read) {
                    stamp_ns += 10_000_000;
                    let position = 1e-3 * noise(read);
                    flicker.stopped_ns(stamp_ns, position, true, true, &Limits::OF_TESTS);
                }
            }
            flicker.age_s(stamp_ns, 0.01, &Limits::OF_TESTS)
        };
        assert_eq!(age_s(|_| 0), 0.0);
        assert_eq!(age_s(|_| 2), 0.02);
        // reads and messages do not keep step
        assert!(age_s(|read| 2 + read % 2) > 0.0);
        // one that rests between two steps repeats itself as long as it likes
        assert_eq!(age_s(|read| 3 + 7 * (read % 5)), 0.0);
    }

    #[test]
    fn few_ticks_of_a_joint_at_rest_show_nothing_of_how_often_it_is_read() {
        let mut flicker = Flicker::new(25.0);
        let position = |k: usize| 1e-3 * f64::from(u8::from(k >= 300) + u8::from(k >= 800));
        for k in 0..1100 {
            let stamp_ns = k as i64 * 10_000_000;
            flicker.stopped_ns(stamp_ns, position(k), true, true, &Limits::OF_TESTS);
        }
        let next_ns = 1100 * 10_000_000;
        assert_eq!(flicker.age_s(next_ns, 0.01, &Limits::OF_TESTS), 0.0);
        assert!(!flicker.may_repeat());
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

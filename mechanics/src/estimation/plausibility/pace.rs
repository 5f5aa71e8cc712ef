//! Speed of a joint by its positions, as far as noise does not hide it, and whether the joint still moves.

use super::notice::Limits;

/// Least time over which a motion is measured (s), and between two places that are kept.
const LEAST_S: f64 = 0.2;
const APART_S: f64 = 0.008;
const PLACES: usize = 32;
/// Multiples of the noise from which the speed of the joint is known, and from which the joint counts as moving on: the latter
/// shows in half the time.
const KNOWN: f64 = 4.0;
const SEEN: f64 = 2.0;
/// The share of its pace that a joint has at the last place if it moves on: one that comes to rest has less.
const MOVES_ON: f64 = 0.75;

/// The motion up to the last change of a position.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Stamps (ns) and ways (rad or m) of the last places, the newest first.
    places: [(i64, f64); PLACES],
    count: usize,
    /// Stamp (ns) and way (rad or m) of the last change, and the position after it.
    last: (i64, f64),
    position: f64,
    restarts: bool,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self {
            places: [(0, 0.0); PLACES],
            count: 0,
            last: (0, 0.0),
            position: f64::NAN,
            restarts: true,
        }
    }

    /// Takes a position; `step` is the way from one to another. One that repeats itself says nothing.
    pub(super) fn take(
        &mut self,
        stamp_ns: i64,
        position: f64,
        limits: &Limits,
        step: impl Fn(f64, f64) -> f64,
    ) {
        let before = std::mem::replace(&mut self.position, position);
        if position == before {
            return;
        }
        let way = match std::mem::take(&mut self.restarts) {
            true => {
                self.count = 0;
                0.0
            }
            false => self.last.1 + step(before, position),
        };
        self.last = (stamp_ns, way);
        let is_apart = limits.elapsed_s(self.places[0].0, stamp_ns) >= APART_S;
        if self.count == 0 || is_apart {
            self.places.copy_within(..PLACES - 1, 1);
            self.places[0] = self.last;
            self.count = PLACES.min(self.count + 1);
        }
    }

    /// Starts anew: no motion leads to the next positions. The known motion stays until the position changes.
    pub(super) fn restart(&mut self) {
        self.restarts = true;
    }

    /// The velocity (rad/s or m/s); zero where the motion is hardly larger than `noise`, or was coming to an end at the last change, as
    /// far as noise does not hide that.
    pub(super) fn beyond(&self, noise: f64, limits: &Limits) -> f64 {
        let over = |least_s: f64| {
            let places = self.places[..self.count].iter();
            let mut motions = places.map(|&(since_ns, from)| {
                let time_s = limits.elapsed_s(since_ns, self.last.0);
                (time_s, self.last.1 - from)
            });
            motions.find(|(time_s, _)| *time_s > 0.0 && *time_s >= least_s)
        };
        let is_known = |(_, moved): &(f64, f64)| moved.abs() > KNOWN * noise;
        let Some((time_s, moved)) = over(LEAST_S).filter(is_known) else {
            return 0.0;
        };
        let pace = moved / time_s;
        let recent = over(SEEN * noise / pace.abs());
        let recent = recent.map_or(0.0, |(time_s, moved)| moved / time_s);
        match recent / pace >= MOVES_ON {
            true => pace,
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: f64 = 1e-3;

    fn take(pace: &mut Pace, sample: i64, position: f64) -> f64 {
        let limits = &Limits::OF_TESTS;
        pace.take(sample * 10_000_000, position, limits, |a, b| b - a);
        pace.beyond(NOISE, limits)
    }

    #[test]
    fn a_motion_is_known_after_a_moment_and_forgotten_at_once() {
        let mut pace = Pace::new();
        let mut paces = (0..50).map(|sample| take(&mut pace, sample, 5e-3 * sample as f64));
        assert!(paces.by_ref().take(20).all(|pace| pace == 0.0));
        assert!(paces.all(|pace| (pace - 0.5).abs() < 1e-9));
        // what repeats itself says nothing, over a hole either
        pace.restart();
        assert!((take(&mut pace, 90, 0.245) - 0.5).abs() < 1e-9);
        // what it did in the hole is not known
        assert_eq!(take(&mut pace, 91, 3.0), 0.0);
    }

    #[test]
    fn what_comes_to_rest_does_not_move_on() {
        for braking in [0.01, 0.1, 0.2] {
            let mut pace = Pace::new();
            let is_at = |sample: i64| {
                let time_s = 0.01 * sample as f64;
                let left_s = (1.0 + braking - time_s).clamp(0.0, braking);
                let noise = 1e-4 * (sample % 2) as f64;
                noise + 0.5 * (time_s.min(1.0) + 0.5 * (braking - left_s * left_s / braking))
            };
            let paces: Vec<f64> = (0..160)
                .map(|sample| take(&mut pace, sample, is_at(sample)))
                .collect();
            assert!((paces[99] - 0.5).abs() < 1e-2, "{braking}");
            let rests = (100.0 * (1.0 + braking)).round() as usize;
            let found = paces[rests..].iter().find(|&&pace| pace != 0.0);
            assert_eq!(found, None, "{braking}");
        }
    }
}

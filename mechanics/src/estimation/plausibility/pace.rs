//! How fast a joint moves by its positions, over a time in which noise hardly shows.

use super::notice::Limits;

/// Least time over which a motion is measured (s); it is at most twice as long while the position changes.
const LEAST_S: f64 = 0.2;

/// The motion up to the last change of a position.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// Stamps (ns) and positions, so far apart.
    older: Option<(i64, f64)>,
    newer: Option<(i64, f64)>,
    /// Motion since `older` (rad or m), and its time (s).
    moved: f64,
    time_s: f64,
}

impl Pace {
    /// Takes a position that is another than the one before; `step` is the way from one to another.
    pub(super) fn take(
        &mut self,
        stamp_ns: i64,
        position: f64,
        limits: &Limits,
        step: impl Fn(f64, f64) -> f64,
    ) {
        let elapsed_s = |since_ns: i64| limits.elapsed_s(since_ns, stamp_ns);
        if (self.newer).is_none_or(|(since_ns, _)| elapsed_s(since_ns) >= LEAST_S) {
            self.older = self.newer.replace((stamp_ns, position));
        }
        (self.moved, self.time_s) = self.older.map_or((0.0, 0.0), |(since_ns, from)| {
            (step(from, position), elapsed_s(since_ns))
        });
    }

    /// No motion leads to what follows. What is known stays until the position changes.
    pub(super) fn restart(&mut self) {
        (self.older, self.newer) = (None, None);
    }

    /// The velocity (rad/s or m/s); zero where the motion is not larger than `noise`.
    pub(super) fn beyond(&self, noise: f64) -> f64 {
        match self.moved.abs() > noise {
            true => self.moved / self.time_s,
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_known_after_a_moment_and_forgotten_as_fast() {
        let mut pace = Pace::default();
        let mut take = |sample: i64, position: f64| {
            pace.take(sample * 10_000_000, position, &Limits::OF_TESTS, |a, b| {
                b - a
            });
            pace.beyond(1e-3)
        };
        let mut paces = (0..50).map(|sample| take(sample, 5e-3 * sample as f64));
        assert!(paces.by_ref().take(20).all(|pace| pace == 0.0));
        assert!(paces.all(|pace| (pace - 0.5).abs() < 1e-9));
        let rests: Vec<f64> = (50..100)
            .map(|sample| take(sample, 0.245 + 1e-5 * (sample % 2) as f64))
            .collect();
        assert!(rests[0] > 0.4 && rests[41..].iter().all(|&pace| pace == 0.0));
        // a hole: what it did in it is not known
        pace.restart();
        pace.take(5_000_000_000, 3.0, &Limits::OF_TESTS, |a, b| b - a);
        assert_eq!(pace.beyond(1e-3), 0.0);
    }
}

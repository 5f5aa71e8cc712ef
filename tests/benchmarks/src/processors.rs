//! Share of the computer's processors that a measurement gets.

use std::hint::black_box;
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

/// Duration of one measurement of a thread's work.
const WATCHED: Duration = Duration::from_millis(200);
/// Number of measurements of one thread alone: the best counts.
const WATCHED_ALONE: usize = 3;
/// Steps between two looks at the clock.
const STEPS: usize = 10_000;

/// The computer's processors.
#[derive(Debug, Default)]
pub struct Processors {
    /// Largest work a second by a thread alone so far.
    alone: f64,
}

impl Processors {
    /// Share of the processors that is free now, from 0 to 1: the work of one thread per processor, relative to that of a
    /// thread alone times their number. It is also lower where processors slow down when all of them work.
    ///
    /// Every step waits for the last one, so two threads that share a core do not slow each other down.
    pub fn free_share(&mut self) -> f64 {
        for _ in 0..WATCHED_ALONE {
            self.alone = self.alone.max(work_a_second());
        }
        let count = thread::available_parallelism().map_or(1, usize::from);
        let together: Vec<f64> = thread::scope(|scope| {
            let threads: Vec<_> = (0..count).map(|_| scope.spawn(work_a_second)).collect();
            let done = threads.into_iter().map(ScopedJoinHandle::join);
            done.map(|work| work.expect("work does not panic"))
                .collect()
        });
        share(self.alone, &together)
    }
}

/// Whether the processors have instructions for SHA-256, as those had on which the ratios of whole logs were recorded. Every
/// analysis hashes its log and the program's own file: without them that is half of the time of a short log.
#[must_use]
pub fn have_sha256() -> bool {
    #[cfg(target_arch = "x86_64")]
    let have = std::arch::is_x86_feature_detected!("sha");
    #[cfg(target_arch = "aarch64")]
    let have = std::arch::is_aarch64_feature_detected!("sha2");
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let have = false;
    have
}

/// Returns the work of several threads, relative to that of as many threads that each do the work of one alone.
fn share(alone: f64, together: &[f64]) -> f64 {
    let expected = alone * together.len() as f64;
    (together.iter().sum::<f64>() / expected).min(1.0)
}

/// Rounds of work that this thread does a second.
fn work_a_second() -> f64 {
    let start = Instant::now();
    let (mut rounds, mut number) = (0.0, 1_u64);
    loop {
        for _ in 0..STEPS {
            number = black_box(number.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(31));
        }
        rounds += 1.0;
        let passed = start.elapsed();
        if passed >= WATCHED {
            return rounds / passed.as_secs_f64();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_do_what_one_does_alone_have_free_processors() {
        assert_eq!(share(8.0, &[8.0, 8.0]), 1.0);
        assert_eq!(share(8.0, &[8.0, 0.0]), 0.5);
        assert_eq!(share(8.0, &[2.0, 2.0, 2.0, 2.0]), 0.25);
        // others disturbed the thread alone
        assert_eq!(share(4.0, &[8.0, 8.0]), 1.0);
    }

    #[test]
    fn some_of_the_processors_is_free() {
        let found = Processors::default().free_share();
        assert!(0.0 < found && found <= 1.0, "{found}");
    }
}

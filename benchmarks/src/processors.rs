//! How much of the computer's processors a measurement gets.

use std::hint::black_box;
use std::num::NonZero;
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

/// How long a thread is watched.
const WATCHED: Duration = Duration::from_millis(200);
/// How often one thread alone is watched: the best counts.
const WATCHED_ALONE: usize = 3;
/// Steps between two looks at the clock.
const STEPS: usize = 10_000;

/// The computer's processors.
#[derive(Debug, Default)]
pub struct Processors {
    /// Most work a second that a thread alone has done so far.
    alone: f64,
}

impl Processors {
    /// The share of them that is free now, from 0 to 1: the work of one thread for each, of what as many threads would do
    /// if each had a processor of its own.
    ///
    /// Every step waits for the last one, so two threads that share a core do not slow each other down.
    pub fn free_share(&mut self) -> f64 {
        for _ in 0..WATCHED_ALONE {
            self.alone = self.alone.max(work_a_second());
        }
        let count = thread::available_parallelism().map_or(1, NonZero::get);
        let together: f64 = thread::scope(|scope| {
            let threads: Vec<_> = (0..count).map(|_| scope.spawn(work_a_second)).collect();
            let done = threads.into_iter().map(ScopedJoinHandle::join);
            done.map(|work| work.expect("work does not panic")).sum()
        });
        (together / (self.alone * count as f64)).min(1.0)
    }
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
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;

    #[test]
    fn busy_processors_are_not_free() {
        let mut processors = Processors::default();
        let before = processors.free_share();
        assert!(0.0 < before && before <= 1.0, "{before}");
        let count = thread::available_parallelism().map_or(1, NonZero::get);
        let done = AtomicBool::new(false);
        let busy = thread::scope(|scope| {
            for _ in 0..3 * count {
                scope.spawn(|| {
                    while !done.load(Ordering::Relaxed) {
                        black_box(1);
                    }
                });
            }
            let busy = processors.free_share();
            done.store(true, Ordering::Relaxed);
            busy
        });
        // a quarter, if nothing else ran before
        assert!(busy < 0.8, "{busy}");
    }
}

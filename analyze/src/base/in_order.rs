//! Work that is done on all cores and taken in order.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use rayon::Yield;

/// Time for which a thread without work waits for a result before it looks for work again.
const UNTIL_OTHER_WORK: Duration = Duration::from_micros(200);

/// Most results that wait besides one in work on each core: their number bounds the memory. With fewer, cores wait for a `take`
/// that takes long now and then.
const MOST_WAITING: usize = 4;

/// Computes something of each of `inputs` on all cores; `take` receives the results in order while the next ones are
/// computed.
///
/// # Errors
/// The first error of `take`; nothing is taken after it.
pub(super) fn in_order<I, O, E>(
    inputs: impl Iterator<Item = I> + Send,
    compute: impl Fn(I) -> O + Sync,
    mut take: impl FnMut(O) -> Result<(), E> + Send,
) -> Result<(), E>
where
    I: Send,
    O: Send,
    E: Send,
{
    let most_ahead = rayon::current_num_threads() + MOST_WAITING;
    let compute = &compute;
    rayon::scope_fifo(|scope| {
        let mut computed: VecDeque<Receiver<O>> = VecDeque::new();
        let mut inputs = inputs.fuse();
        loop {
            while computed.len() < most_ahead
                && let Some(input) = inputs.next()
            {
                let (sender, receiver) = sync_channel(1);
                computed.push_back(receiver);
                // whoever no longer waits has met an error
                scope.spawn_fifo(move |_| drop(sender.send(compute(input))));
            }
            let Some(next) = computed.pop_front() else {
                return Ok(());
            };
            match wait_for(&next) {
                Some(output) => take(output)?,
                // the scope passes the panic on
                None => return Ok(()),
            }
        }
    })
}

/// Helps the other threads until a result is there; `None` if there will be none because its computation panicked.
fn wait_for<T>(result: &Receiver<T>) -> Option<T> {
    let mut wait = Duration::ZERO;
    loop {
        match result.recv_timeout(wait) {
            Ok(result) => return Some(result),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {}
        }
        wait = match rayon::yield_now() {
            Some(Yield::Executed) => Duration::ZERO,
            _ => UNTIL_OTHER_WORK,
        };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    fn on_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(run)
    }

    #[test]
    fn results_arrive_in_order_and_few_wait() {
        for threads in [1, 2, 5] {
            let (started, mut taken) = (AtomicUsize::new(0), Vec::new());
            let compute = |k: usize| {
                started.fetch_add(1, Ordering::SeqCst);
                // later ones are often done first
                std::thread::sleep(Duration::from_micros(200 * (k as u64 % 3)));
                k * k
            };
            let take = |square| -> Result<(), ()> {
                taken.push(square);
                let ahead = started.load(Ordering::SeqCst) - taken.len();
                assert!(
                    ahead <= threads + MOST_WAITING,
                    "{ahead} on {threads} threads"
                );
                Ok(())
            };
            on_threads(threads, || in_order(0..100, compute, take)).unwrap();
            assert_eq!(taken, (0..100).map(|k| k * k).collect::<Vec<_>>());
        }
    }

    #[test]
    fn nothing_is_taken_after_an_error() {
        let mut taken = 0;
        let take = |k: usize| {
            taken += 1;
            if k == 3 { Err(k) } else { Ok(()) }
        };
        let found = on_threads(2, || in_order(0..100, |k| k, take));
        assert_eq!((found, taken), (Err(3), 4));
    }

    #[test]
    #[should_panic(expected = "broken")]
    fn a_panic_is_passed_on() {
        let compute = |k: usize| assert!(k < 5, "broken");
        on_threads(2, || in_order(0..100, compute, |()| Ok::<(), ()>(()))).unwrap();
    }
}

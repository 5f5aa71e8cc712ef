//! Those who speak are served in turn.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use tipwatch_language::{Language, chosen, speak};

/// Callers of one language who always overlap.
const CALLERS: usize = 4;
/// Most calls of each.
const MOST_CALLS: usize = 1000;

/// They keep a caller of another language waiting for one call of each, not for ever.
#[test]
fn another_language_has_its_turn() {
    let is_served = AtomicBool::new(false);
    let calls = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..CALLERS {
            scope.spawn(|| {
                for _ in 0..MOST_CALLS {
                    if is_served.load(Ordering::Relaxed) {
                        break;
                    }
                    let speaking = speak(Language::English);
                    assert_eq!(chosen(), Language::English);
                    calls.fetch_add(1, Ordering::Relaxed);
                    thread::sleep(Duration::from_millis(5));
                    drop(speaking);
                }
            });
        }
        while calls.load(Ordering::Relaxed) < 2 * CALLERS {
            thread::yield_now();
        }
        let speaking = speak(Language::German);
        assert_eq!(chosen(), Language::German);
        is_served.store(true, Ordering::Relaxed);
        drop(speaking);
    });
    let calls = calls.into_inner();
    assert!(calls < CALLERS * MOST_CALLS, "{calls}");
}

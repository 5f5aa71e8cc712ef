//! Tells what happens on stderr, each thing once and then rarely: a fault that repeats a thousand times a second must
//! not hide the others.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A repeated message is told again after this time, with the number of repetitions.
const AGAIN: Duration = Duration::from_secs(10);
/// Different messages remembered.
const MOST: usize = 1000;

/// Tells on stderr.
#[derive(Debug, Clone, Default)]
pub struct Teller {
    told: Arc<Mutex<BTreeMap<String, LastTold>>>,
}

#[derive(Debug)]
struct LastTold {
    at: Instant,
    repeats: u64,
}

impl Teller {
    /// Tells a fact that happens once.
    pub fn say(&self, text: &str) {
        eprintln!("bridge: {text}");
    }

    /// Tells a fault; the same `key` again only after ten seconds.
    pub fn fault(&self, key: &str, text: &str) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.len() >= MOST {
            told.clear();
        }
        match told.get_mut(key) {
            Some(before) if before.at.elapsed() < AGAIN => before.repeats += 1,
            Some(before) => {
                let times = before.repeats + 1;
                *before = LastTold {
                    at: Instant::now(),
                    repeats: 0,
                };
                eprintln!("bridge: {text} ({times} times more)");
            }
            None => {
                let now = LastTold {
                    at: Instant::now(),
                    repeats: 0,
                };
                told.insert(key.to_owned(), now);
                eprintln!("bridge: {text}");
            }
        }
    }

    /// The fault is over: the next one is told at once.
    pub fn over(&self, key: &str, text: &str) {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        if told.remove(key).is_some() {
            eprintln!("bridge: {text}");
        }
    }
}

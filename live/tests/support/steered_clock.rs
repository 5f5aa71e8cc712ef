//! A clock that a test steers.

use std::cell::Cell;

use tipwatch_live::system::clock::Clock;

#[derive(Debug)]
pub struct SteeredClock {
    pub now_ns: Cell<i64>,
    /// Time from one look at the clock to the next (ns).
    pub look_ns: Cell<i64>,
}

impl Clock for SteeredClock {
    fn now_ns(&self) -> i64 {
        self.now_ns.set(self.now_ns.get() + self.look_ns.get());
        self.now_ns.get()
    }
}

impl SteeredClock {
    /// Returns a clock that stands at this time.
    pub fn at(now_ns: i64) -> Self {
        Self {
            now_ns: Cell::new(now_ns),
            look_ns: Cell::new(0),
        }
    }
}

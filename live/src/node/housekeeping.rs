//! A thread next to the loop of monitor or control: it removes the nodes of dead processes and notifies
//! systemd's watchdog.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::Result;

use super::live_node::{LiveNode, ServiceAddress};
use crate::safety_limits::{DEAD_NODE_CHECK, DEAD_NODE_SHARE, MAX_DEAD_NODE_CHECK};
use crate::system::clock::of_thread_ns;
use crate::system::supervisor::Supervisor;

/// The thread. It ends when this is dropped.
#[derive(Debug)]
pub struct Housekeeping {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// Cycles that the loop has completed.
    cycles: AtomicU64,
    ends: AtomicBool,
}

impl Housekeeping {
    /// Starts the thread. It tells the supervisor of the environment, if there is one, of the loop's cycles.
    ///
    /// # Errors
    /// The thread cannot be created.
    pub fn start(address: &ServiceAddress) -> Result<Self> {
        Self::supervised(address, Supervisor::from_environment())
    }

    /// As [`Self::start`], with this supervisor.
    ///
    /// # Errors
    /// The thread cannot be created.
    pub fn supervised(address: &ServiceAddress, supervisor: Option<Supervisor>) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let thread = {
            // ports of iceoryx2 must stay in the thread that created them
            let (address, shared) = (address.clone(), Arc::clone(&shared));
            std::thread::Builder::new()
                .name("housekeeping".into())
                .spawn(move || watch(&address, &shared, supervisor))?
        };
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// The loop has completed a cycle.
    pub fn cycle_completed(&self) {
        self.shared.cycles.fetch_add(1, Ordering::Relaxed);
    }
}

impl Drop for Housekeeping {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn watch(address: &ServiceAddress, shared: &Shared, mut supervisor: Option<Supervisor>) {
    let node = LiveNode::new(address, "tipwatch-housekeeping");
    let mut seen = 0;
    let (mut rested, mut rest) = (Duration::ZERO, DEAD_NODE_CHECK);
    while !shared.ends.load(Ordering::Relaxed) {
        std::thread::sleep(DEAD_NODE_CHECK);
        rested += DEAD_NODE_CHECK;
        if rested >= rest
            && let Ok(node) = &node
        {
            let before_ns = of_thread_ns();
            node.remove_dead_nodes();
            let taken_ns = of_thread_ns().saturating_sub(before_ns);
            rest = rest_after(Duration::from_nanos(taken_ns.unsigned_abs()));
            rested = Duration::ZERO;
        }
        let cycles = shared.cycles.load(Ordering::Relaxed);
        // a loop that hangs completes no cycle: systemd hears nothing, and restarts it
        if cycles != seen
            && let Some(supervisor) = &mut supervisor
        {
            seen = cycles;
            supervisor.cycle_completed();
        }
    }
}

/// The time from one search for dead nodes to the next, after one that has taken so much of the processor.
fn rest_after(taken: Duration) -> Duration {
    let rest = taken.saturating_mul(DEAD_NODE_SHARE);
    rest.clamp(DEAD_NODE_CHECK, MAX_DEAD_NODE_CHECK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_search_comes_less_often_and_within_a_second_at_least() {
        for (taken_us, rest_ms) in [(0, 100), (300, 100), (7000, 700), (500_000, 1000)] {
            let rest = rest_after(Duration::from_micros(taken_us));
            assert_eq!(rest, Duration::from_millis(rest_ms), "{taken_us}");
        }
    }
}

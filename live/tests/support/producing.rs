//! A producer that goes on beside a test, over the same log again and again.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};
use std::thread::JoinHandle;

use tipwatch_live::node::{LiveNode, ServiceAddress};
use tipwatch_live::system::clock::monotonic_ns;

use super::feed::{Feed, RealTime};

/// Ends with this.
pub struct Producing {
    pub shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
pub struct Shared {
    ends: AtomicBool,
    /// Number of samples that were sent.
    pub sent: AtomicU64,
    /// The longest that sending one took (ns).
    pub slowest_ns: AtomicI64,
}

impl Producing {
    pub fn start(place: &ServiceAddress, name: &'static str) -> Self {
        let shared = Arc::new(Shared::default());
        let thread = {
            let (place, shared) = (place.clone(), Arc::clone(&shared));
            std::thread::spawn(move || {
                let node = LiveNode::new(&place, "producer").unwrap();
                let mut feed = Feed::new(&node, name, RealTime);
                while !shared.ends.load(Ordering::Relaxed) {
                    feed.wait();
                    let sample = feed.peek();
                    let start_ns = monotonic_ns();
                    feed.raw(&sample);
                    let took_ns = monotonic_ns() - start_ns;
                    feed.next += 1;
                    feed.producer.update_connections().unwrap();
                    shared.slowest_ns.fetch_max(took_ns, Ordering::Relaxed);
                    shared.sent.store(feed.next as u64, Ordering::Release);
                }
                feed.end();
                // the memory lives until readers have read the end
                std::thread::sleep(std::time::Duration::from_millis(300));
            })
        };
        Self {
            shared,
            thread: Some(thread),
        }
    }

    pub fn sent(&self) -> u64 {
        self.shared.sent.load(Ordering::Acquire)
    }

    pub fn end(mut self) {
        self.stop();
    }

    fn stop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Drop for Producing {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
    }
}

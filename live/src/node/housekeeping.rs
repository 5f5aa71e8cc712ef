//! A thread next to the loop of monitor or control: it removes the nodes of dead processes and notifies
//! systemd's watchdog.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::live_node::{LiveNode, ServiceAddress};
use crate::safety_limits::DEAD_NODE_CHECK;

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
    /// Starts the thread.
    ///
    /// # Errors
    /// The thread cannot be created.
    pub fn start(address: &ServiceAddress) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let thread = {
            // ports of iceoryx2 must stay in the thread that created them
            let (address, shared) = (address.clone(), Arc::clone(&shared));
            std::thread::Builder::new()
                .name("housekeeping".into())
                .spawn(move || watch(&address, &shared))?
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

fn watch(address: &ServiceAddress, shared: &Shared) {
    let node = LiveNode::new(address, "tipwatch-housekeeping");
    let supervisor = Supervisor::from_environment();
    if let Some(supervisor) = &supervisor {
        supervisor.notify("READY=1");
    }
    let (mut seen, mut notified) = (0, Instant::now());
    while !shared.ends.load(Ordering::Relaxed) {
        std::thread::sleep(DEAD_NODE_CHECK);
        if let Ok(node) = &node {
            node.remove_dead_nodes();
        }
        let cycles = shared.cycles.load(Ordering::Relaxed);
        if let Some(supervisor) = &supervisor
            && cycles != seen
            && supervisor.is_due(notified)
        {
            (seen, notified) = (cycles, Instant::now());
            supervisor.notify("WATCHDOG=1");
        }
    }
}

/// systemd, if it started this program as a service with a watchdog.
struct Supervisor {
    socket: UnixDatagram,
    address: SocketAddr,
    /// Half of WatchdogSec; `None` without a watchdog.
    period: Option<Duration>,
}

impl Supervisor {
    fn from_environment() -> Option<Self> {
        let path = std::env::var("NOTIFY_SOCKET").ok()?;
        let address = match path.strip_prefix('@') {
            Some(name) => SocketAddr::from_abstract_name(name),
            None => SocketAddr::from_pathname(&path),
        };
        let period = std::env::var("WATCHDOG_USEC").ok();
        Some(Self {
            socket: UnixDatagram::unbound().ok()?,
            address: address.ok()?,
            period: period
                .and_then(|us| us.parse().ok())
                .map(|us: u64| Duration::from_micros(us / 2)),
        })
    }

    fn is_due(&self, notified: Instant) -> bool {
        self.period
            .is_some_and(|period| notified.elapsed() >= period)
    }

    /// Sends a state. Errors are ignored: a supervisor that does not receive it restarts the program.
    fn notify(&self, state: &str) {
        let _ = self.socket.send_to_addr(state.as_bytes(), &self.address);
    }
}

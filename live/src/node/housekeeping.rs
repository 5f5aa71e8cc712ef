//! Beside the monitor's loop: removes what dead processes left, and tells systemd that it works.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::Result;

use super::live_node::{LiveNode, ServiceAddress};

/// How often dead processes are looked for.
const DEAD_CHECK_PERIOD: Duration = Duration::from_millis(100);

/// A thread beside the loop; it ends with this.
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
    /// Starts.
    ///
    /// # Errors
    /// The shared memory cannot be joined.
    pub fn start(place: &ServiceAddress) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let joined = {
            // the ports of iceoryx2 stay in the thread that made them
            let (place, shared) = (place.clone(), Arc::clone(&shared));
            std::thread::Builder::new()
                .name("watch-over".into())
                .spawn(move || watch(&place, &shared))?
        };
        Ok(Self {
            shared,
            thread: Some(joined),
        })
    }

    /// The loop has looked for messages, and dealt with them.
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

fn watch(place: &ServiceAddress, shared: &Shared) {
    let joined = LiveNode::new(place, "tipwatch-watch-over");
    let supervisor = Supervisor::from_environment();
    if let Some(supervisor) = &supervisor {
        supervisor.tell("READY=1");
    }
    let (mut seen, mut told) = (0, Instant::now());
    while !shared.ends.load(Ordering::Relaxed) {
        std::thread::sleep(DEAD_CHECK_PERIOD);
        if let Ok(joined) = &joined {
            joined.remove_dead_nodes();
        }
        let cycles = shared.cycles.load(Ordering::Relaxed);
        if let Some(supervisor) = &supervisor
            && cycles != seen
            && supervisor.is_due(told)
        {
            (seen, told) = (cycles, Instant::now());
            supervisor.tell("WATCHDOG=1");
        }
    }
}

/// systemd, where it started this program as a service with a watchdog.
struct Supervisor {
    socket: UnixDatagram,
    address: SocketAddr,
    /// Half of WatchdogSec; `None` without.
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

    fn is_due(&self, told: Instant) -> bool {
        self.period.is_some_and(|period| told.elapsed() >= period)
    }

    /// A supervisor that does not listen restarts the program: that is its business.
    fn tell(&self, what: &str) {
        let _ = self.socket.send_to_addr(what.as_bytes(), &self.address);
    }
}

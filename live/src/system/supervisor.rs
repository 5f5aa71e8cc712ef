//! systemd as the supervisor of a service (`Type=notify`, `WatchdogSec=`): it is told when the program is ready, that
//! its loop still works, and that it is about to end.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::time::{Duration, Instant};

/// The socket on which systemd listens, if it started this program.
#[derive(Debug)]
pub struct Supervisor {
    socket: UnixDatagram,
    address: SocketAddr,
    /// Half of WatchdogSec; `None` without a watchdog.
    period: Option<Duration>,
    is_ready: bool,
    /// Time at which the watchdog was last served.
    served: Option<Instant>,
}

impl Supervisor {
    /// The supervisor that the environment names; `None` if this program is no service of one.
    #[must_use]
    pub fn from_environment() -> Option<Self> {
        let variable = |name: &str| std::env::var(name).ok();
        Self::new(
            &variable("NOTIFY_SOCKET")?,
            watchdog(
                variable("WATCHDOG_USEC").as_deref(),
                variable("WATCHDOG_PID").as_deref(),
                std::process::id(),
            ),
        )
    }

    /// The supervisor on this socket, a path or `@` and an abstract name, with this time limit of its watchdog. `None`
    /// if there can be no such socket.
    #[must_use]
    pub fn new(path: &str, watchdog: Option<Duration>) -> Option<Self> {
        let address = match path.strip_prefix('@') {
            Some(name) => SocketAddr::from_abstract_name(name),
            None => SocketAddr::from_pathname(path),
        };
        let socket = UnixDatagram::unbound().ok()?;
        // a supervisor that does not read must not hold up who tells it
        socket.set_nonblocking(true).ok()?;
        Some(Self {
            socket,
            address: address.ok()?,
            period: watchdog.map(|limit| limit / 2),
            is_ready: false,
            served: None,
        })
    }

    /// The loop has completed a cycle: the first one makes the service ready, later ones serve the watchdog when it is
    /// due.
    pub fn cycle_completed(&mut self) {
        if !self.is_ready {
            self.is_ready = true;
            self.notify("READY=1");
        }
        let Some(period) = self.period else {
            return;
        };
        if self.served.is_none_or(|served| served.elapsed() >= period) {
            self.served = Some(Instant::now());
            self.notify("WATCHDOG=1");
        }
    }

    /// Sends a state. Errors are ignored: a supervisor that does not receive it restarts the program.
    fn notify(&self, state: &str) {
        let _ = self.socket.send_to_addr(state.as_bytes(), &self.address);
    }
}

impl Drop for Supervisor {
    fn drop(&mut self) {
        self.notify("STOPPING=1");
    }
}

/// The time limit of the watchdog, if it is meant for this process.
fn watchdog(microseconds: Option<&str>, process: Option<&str>, own: u32) -> Option<Duration> {
    if process.is_some_and(|id| id.parse() != Ok(own)) {
        return None;
    }
    let limit: u64 = microseconds?.parse().ok()?;
    (limit > 0).then(|| Duration::from_micros(limit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn received(socket: &UnixDatagram) -> Vec<String> {
        let mut bytes = [0; 256];
        let mut texts = Vec::new();
        while let Ok(count) = socket.recv(&mut bytes) {
            texts.push(String::from_utf8(bytes[..count].to_vec()).unwrap());
        }
        texts
    }

    // requirement: TW-EVIDENCE-03
    #[test]
    fn the_first_cycle_is_ready_and_the_watchdog_is_served_by_cycles_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let socket = UnixDatagram::bind(&path).unwrap();
        socket.set_nonblocking(true).unwrap();
        let limit = Duration::from_millis(40);
        let mut supervisor = Supervisor::new(path.to_str().unwrap(), Some(limit)).unwrap();
        assert_eq!(received(&socket), Vec::<String>::new());
        supervisor.cycle_completed();
        assert_eq!(received(&socket), ["READY=1", "WATCHDOG=1"]);
        // not more often than half the limit
        supervisor.served = Some(Instant::now() + limit);
        supervisor.cycle_completed();
        assert_eq!(received(&socket), Vec::<String>::new());
        supervisor.served = Instant::now().checked_sub(limit);
        supervisor.cycle_completed();
        assert_eq!(received(&socket), ["WATCHDOG=1"]);
        drop(supervisor);
        assert_eq!(received(&socket), ["STOPPING=1"]);
    }

    #[test]
    fn a_watchdog_of_another_process_is_not_served() {
        let second = Some(Duration::from_secs(1));
        assert_eq!(watchdog(Some("1000000"), None, 7), second);
        assert_eq!(watchdog(Some("1000000"), Some("7"), 7), second);
        assert_eq!(watchdog(Some("1000000"), Some("8"), 7), None);
        assert_eq!(watchdog(Some("1000000"), Some("x"), 7), None);
        assert_eq!(watchdog(Some("0"), None, 7), None);
        assert_eq!(watchdog(Some("-1"), None, 7), None);
        assert_eq!(watchdog(None, None, 7), None);
    }

    #[test]
    fn a_supervisor_without_socket_is_none_and_one_that_is_gone_disturbs_nobody() {
        assert!(Supervisor::new(&"x".repeat(400), None).is_none());
        let mut gone = Supervisor::new("/nonexistent/notify", None).unwrap();
        gone.cycle_completed();
        let _abstract = Supervisor::new("@tipwatch-none", None).unwrap();
    }
}

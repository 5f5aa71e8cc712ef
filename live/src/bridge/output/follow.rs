//! Follows the verdict and shows it to everything that hangs on it. A verdict that is past its validity is none.

use std::time::Duration;

use anyhow::Result;

use super::view::View;
use crate::node::{EventListener, LiveNode, Receiver, ServiceAddress};
use crate::system::clock::monotonic_ns;
use crate::wire::names::Names;
use crate::wire::topics::{Wire, WireMachine, WireVerdict};

/// Longest wait for a verdict: expiry must be seen soon.
const LONGEST: Duration = Duration::from_millis(10);

/// Something that shows the verdict.
pub trait VerdictSink {
    /// Takes the verdict: after each new one, and at least every 20 ms. It must not wait for anybody.
    fn show(&mut self, view: &View<'_>);
    /// No verdict follows.
    fn end(&mut self) {}
}

/// Reads verdicts.
#[derive(Debug)]
pub struct Follower {
    _node: LiveNode,
    verdicts: Receiver<WireVerdict>,
    machines: Receiver<WireMachine>,
    listener: EventListener,
    last: Option<WireVerdict>,
    names: Names,
}

impl Follower {
    /// Opens the services. The ports stay in the thread that calls this.
    ///
    /// # Errors
    /// The shared memory cannot be used.
    pub fn new(address: &ServiceAddress) -> Result<Self> {
        let node = LiveNode::new(address, "tipwatch-bridge-out")?;
        Ok(Self {
            verdicts: node.receiver()?,
            machines: node.receiver()?,
            listener: node.event_listener::<WireVerdict>()?,
            last: None,
            names: Names::default(),
            _node: node,
        })
    }

    /// Waits for a verdict, no longer than 10 ms, and shows what is current.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn step(&mut self, sinks: &mut [Box<dyn VerdictSink>]) -> Result<()> {
        self.listener.wait(LONGEST);
        let names = &mut self.names;
        self.machines.receive(|wire| {
            if wire.is_whole()
                && let Ok(found) = Names::try_from(wire)
            {
                *names = found;
            }
        })?;
        let last = &mut self.last;
        self.verdicts.receive_all(|wire| {
            if wire.is_whole() {
                *last = Some(*wire);
            }
        })?;
        let now_ns = monotonic_ns();
        let is_current = |verdict: &&WireVerdict| now_ns <= verdict.valid_until_ns;
        let view = View {
            verdict: self.last.as_ref().filter(is_current),
            names: &self.names,
            now_ns,
        };
        for sink in sinks {
            sink.show(&view);
        }
        Ok(())
    }
}

//! Finds the services of one machine among those of several.

use std::time::Duration;

use anyhow::{Context, Result, bail};

use super::live_node::{LiveNode, ServiceAddress, pause};
use crate::safety_limits::HEARTBEAT_NS;
use crate::wire::topics::{Wire, WireVerdict};

/// Verdicts come at least that often, and a monitor that is busy may miss some.
const HEARTBEATS: usize = 10;

impl ServiceAddress {
    /// The services, of this prefix and whatever their name, on which the monitor of a machine sends verdicts now. `role` is what asks.
    ///
    /// # Errors
    /// No monitor of this machine runs, or several do, or the shared memory fails.
    pub fn of_machine(&self, machine_hash: u64, role: &str) -> Result<Self> {
        let names = LiveNode::new(self, role)?.services_with::<WireVerdict>()?;
        let (mut found, mut failed) = (Vec::new(), None);
        for service in &names {
            let address = Self {
                service: service.clone(),
                ..self.clone()
            };
            // a service of another version, or without a place for a reader, may be another machine's
            match address.sends_verdicts_of(machine_hash, role) {
                Ok(true) => found.push(address),
                Ok(false) => {}
                Err(error) => failed = Some(error.context(format!("service {service}"))),
            }
        }
        match (found.pop(), &found[..], failed) {
            (Some(address), [], _) => Ok(address),
            (None, _, Some(error)) => Err(error),
            (None, _, None) => bail!(
                "expected a running monitor of this machine file, hash {machine_hash:016x}, found none among the services {}",
                match names.is_empty() {
                    true => "(none)".into(),
                    false => names.join(", "),
                }
            ),
            (Some(last), others, _) => bail!(
                "expected one running monitor of this machine file, found {}: name one by --service {}",
                others.len() + 1,
                last.service
            ),
        }
    }

    /// Whether a monitor of this machine sends verdicts at this address, as it does in every heartbeat.
    fn sends_verdicts_of(&self, machine_hash: u64, role: &str) -> Result<bool> {
        let node = LiveNode::new(self, role)?;
        let verdicts = node.receiver::<WireVerdict>()?;
        for _ in 0..HEARTBEATS {
            let paused = pause(Duration::from_nanos(HEARTBEAT_NS as u64));
            paused.ok().context("stopped by a signal")?;
            while let Some(verdict) = verdicts.receive(|verdict| *verdict)? {
                if verdict.is_whole() {
                    return Ok(verdict.machine_hash == machine_hash);
                }
            }
        }
        Ok(false)
    }
}

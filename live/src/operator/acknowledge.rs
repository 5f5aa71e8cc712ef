//! Acknowledges the monitor's alarm.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::node::{LiveNode, ServiceAddress, pause};
use crate::wire::identity::new_identity;
use crate::wire::topics::{Wire, WireAcknowledge, WireVerdict};

/// How long to wait for a verdict.
const LIMIT: Duration = Duration::from_secs(1);
/// How long the message stays in shared memory for the monitor: many of its cycles.
const DELIVERY: Duration = Duration::from_millis(200);

/// Acknowledges the monitor's current verdict.
///
/// # Errors
/// There is no monitor, or the shared memory fails.
pub fn acknowledge(address: &ServiceAddress) -> Result<()> {
    let node = LiveNode::new(address, "tipwatch-acknowledge")?;
    let verdicts = node.receiver::<WireVerdict>()?;
    let mut sender = node.sender::<WireAcknowledge>(new_identity(0), 0)?;
    let start = Instant::now();
    loop {
        if let Some(Some(sequence)) =
            verdicts.receive(|verdict| verdict.is_whole().then_some(verdict.sequence))?
        {
            sender.send(&mut WireAcknowledge {
                verdict_sequence: sequence,
                ..WireAcknowledge::blank()
            })?;
            // an undelivered message is lost when this process ends
            let _ = pause(DELIVERY);
            return Ok(());
        }
        if start.elapsed() >= LIMIT || pause(Duration::from_millis(1)).is_err() {
            bail!(
                "expected a verdict within {} s, found none; is a monitor running?",
                LIMIT.as_secs()
            );
        }
    }
}

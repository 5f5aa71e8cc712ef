//! Tells the monitor that somebody has seen its alarm.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::node::{LiveNode, ServiceAddress, pause};
use crate::wire::identity::new_identity;
use crate::wire::topics::{Wire, WireAcknowledge, WireVerdict};

/// How long a verdict may take to come.
const LIMIT: Duration = Duration::from_secs(1);
/// How long the monitor may take to look: many of its cycles.
const ATTACHING: Duration = Duration::from_millis(200);

/// Acknowledges the verdict that the monitor gives now.
///
/// # Errors
/// There is no monitor, or the shared memory fails.
pub fn acknowledge(place: &ServiceAddress) -> Result<()> {
    let joined = LiveNode::new(place, "tipwatch-acknowledge")?;
    let verdicts = joined.receiver::<WireVerdict>()?;
    let mut sender = joined.sender::<WireAcknowledge>(new_identity(0), 0)?;
    let start = Instant::now();
    loop {
        if let Some(Some(sequence)) =
            verdicts.receive(|verdict| verdict.is_whole().then_some(verdict.sequence))?
        {
            sender.send(&mut WireAcknowledge {
                verdict_sequence: sequence,
                ..WireAcknowledge::blank()
            })?;
            // what nobody has attached to goes with this process
            let _ = pause(ATTACHING);
            return Ok(());
        }
        if start.elapsed() >= LIMIT || pause(Duration::from_millis(1)).is_err() {
            bail!(
                "expected a verdict within {} s, found none: is a monitor running?",
                LIMIT.as_secs()
            );
        }
    }
}

//! Acknowledges the monitor's alarm.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::node::{LiveNode, Receiver, ServiceAddress, pause};
use crate::wire::identity::new_identity;
use crate::wire::topics::{Wire, WireAcknowledge, WireVerdict};

/// How long to wait for a verdict.
const LIMIT: Duration = Duration::from_secs(1);
/// How long the message stays in shared memory for the monitor: many of its cycles.
const DELIVERY: Duration = Duration::from_millis(200);

/// Acknowledges the monitor's current verdict, and waits until the monitor confirms it; returns what became of the
/// alarm, as a sentence.
///
/// # Errors
/// There is no monitor, it does not accept the acknowledgement, or the shared memory fails.
pub fn acknowledge(address: &ServiceAddress) -> Result<&'static str> {
    let node = LiveNode::new(address, "tipwatch-acknowledge")?;
    let verdicts = node.receiver::<WireVerdict>()?;
    let mut sender = node.sender::<WireAcknowledge>(new_identity(0), 0)?;
    let Some(seen) = wait_for(&verdicts, |_| true)? else {
        bail!(
            "expected a verdict within {} s, found none; is a monitor running?",
            LIMIT.as_secs()
        );
    };
    // a control whose rod was stuck takes the acknowledgement too
    sender.send_for(seen.machine_hash, &mut WireAcknowledge::of(&seen))?;
    if seen.alarm == 0 {
        // an undelivered message is lost when this process ends
        let _ = pause(DELIVERY);
        return Ok("the monitor has no alarm");
    }
    let confirms = |verdict: &WireVerdict| {
        verdict.sequence > seen.sequence && (verdict.alarm == 0 || verdict.alarm_acknowledged != 0)
    };
    match wait_for(&verdicts, confirms)? {
        Some(verdict) if verdict.alarm == 0 => Ok("acknowledged; the alarm is over"),
        Some(_) => Ok("acknowledged; the alarm stays until it is over"),
        None => bail!("the monitor has not accepted the acknowledgement; has the alarm changed?"),
    }
}

/// The first undamaged verdict for which `is_it` holds; `None` if there is none in time.
fn wait_for(
    verdicts: &Receiver<WireVerdict>,
    is_it: impl Fn(&WireVerdict) -> bool,
) -> Result<Option<WireVerdict>> {
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        match verdicts.receive(|verdict| *verdict)? {
            Some(verdict) if verdict.is_whole() && is_it(&verdict) => return Ok(Some(verdict)),
            Some(_) => {}
            None if pause(Duration::from_millis(1)).is_err() => break,
            None => {}
        }
    }
    Ok(None)
}

//! Acknowledges the monitor's alarm, and the control's rod that does not obey.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::node::{LiveNode, Receiver, ServiceAddress, pause};
use crate::safety_limits::HEARTBEAT_NS;
use crate::wire::identity::new_identity;
use crate::wire::topics::{Topic, WireAcknowledge, WireCommand, WireVerdict};

/// How long to wait for a verdict.
const LIMIT: Duration = Duration::from_secs(1);
/// How long the message stays in shared memory for the monitor: many of its cycles.
const DELIVERY: Duration = Duration::from_millis(200);

/// How long to wait for a command: a control sends one at least every 20 ms.
const COMMAND_LIMIT: Duration = Duration::from_nanos(10 * HEARTBEAT_NS as u64);

/// Acknowledges the monitor's current verdict, and the control's current command if that tells of a rod that does not
/// obey, and waits until the monitor confirms it; returns what became of the
/// alarm, as a sentence.
///
/// # Errors
/// There is no monitor, it does not accept the acknowledgement, or the shared memory fails.
pub fn acknowledge(address: &ServiceAddress) -> Result<&'static str> {
    let node = LiveNode::new(address, "tipwatch-acknowledge")?;
    let verdicts = node.receiver::<WireVerdict>()?;
    let commands = node.receiver::<WireCommand>()?;
    let mut sender = node.sender::<WireAcknowledge>(new_identity(0), 0)?;
    let Some(seen) = wait_for(&verdicts, LIMIT, |_| true)? else {
        bail!(
            "expected a verdict within {} s, found none; is a monitor running?",
            LIMIT.as_secs()
        );
    };
    let command = wait_for(&commands, COMMAND_LIMIT, |_| true)?;
    if let Some(command) = command.filter(WireCommand::has_rod_fault) {
        let mut message = WireAcknowledge::of_command(&command);
        sender.send_for(command.machine_hash, &mut message)?;
    }
    sender.send_for(seen.machine_hash, &mut WireAcknowledge::of(&seen))?;
    if seen.alarm == 0 {
        // an undelivered message is lost when this process ends
        let _ = pause(DELIVERY);
        return Ok("the monitor has no alarm");
    }
    let confirms = |verdict: &WireVerdict| {
        verdict.sequence > seen.sequence && (verdict.alarm == 0 || verdict.alarm_acknowledged != 0)
    };
    match wait_for(&verdicts, LIMIT, confirms)? {
        Some(verdict) if verdict.alarm == 0 => Ok("acknowledged; the alarm is over"),
        Some(_) => Ok("acknowledged; the alarm stays until it is over"),
        None => bail!("the monitor has not accepted the acknowledgement; has the alarm changed?"),
    }
}

/// The first undamaged message for which `is_it` holds; `None` if there is none in time.
fn wait_for<T: Topic>(
    messages: &Receiver<T>,
    limit: Duration,
    is_it: impl Fn(&T) -> bool,
) -> Result<Option<T>> {
    let start = Instant::now();
    while start.elapsed() < limit {
        match messages.receive(|message| *message)? {
            Some(message) if message.is_whole() && is_it(&message) => return Ok(Some(message)),
            Some(_) => {}
            None if pause(Duration::from_millis(1)).is_err() => break,
            None => {}
        }
    }
    Ok(None)
}

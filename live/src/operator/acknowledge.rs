//! Acknowledges the monitor's alarm, a signal that is doubted, and the control's rod that does not obey.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use tipwatch_mechanics::machine::Proofs;
use tipwatch_mechanics::verdict::InputFault;

use crate::node::{LiveNode, Receiver, ServiceAddress, pause};
use crate::safety_limits::HEARTBEAT_NS;
use crate::wire::identity::new_identity;
use crate::wire::names::Names;
use crate::wire::topics::{Topic, WireAcknowledge, WireCommand, WireMachine, WireVerdict};

/// Longest wait for a verdict.
const LIMIT: Duration = Duration::from_secs(1);
/// Time that the message stays in shared memory for the monitor: many of its cycles.
const DELIVERY: Duration = Duration::from_millis(200);

/// Longest wait for a command: a control sends one at least every 20 ms.
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
    let seen = seen(&verdicts)?;
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

/// Trusts a signal again that is doubted since it failed visibly, as it is now, and waits until the monitor confirms it; returns
/// what became of it, as a sentence. `name`: as in the verdicts' `doubted`; of a joint, its own name suffices.
///
/// # Errors
/// There is no monitor that follows a session, it does not doubt the signal or does not accept the acknowledgement, or the shared
/// memory fails.
pub fn acknowledge_signal(address: &ServiceAddress, name: &str) -> Result<String> {
    let node = LiveNode::new(address, "tipwatch-acknowledge")?;
    let verdicts = node.receiver::<WireVerdict>()?;
    let machines = node.receiver::<WireMachine>()?;
    let mut sender = node.sender::<WireAcknowledge>(new_identity(0), 0)?;
    let seen = seen(&verdicts)?;
    let is_followed = |machine: &WireMachine| machine.session == seen.session;
    let Some(machine) = wait_for(&machines, LIMIT, is_followed)? else {
        bail!("expected a monitor that follows a session: without one, no signal is doubted");
    };
    let names = Names::try_from(&machine)?;
    let doubted = || match names.doubted(&seen) {
        doubted if doubted.is_empty() => "none".to_owned(),
        doubted => doubted.join(", "),
    };
    let is_doubted = |verdict: &WireVerdict, signal| Proofs::from_bits(verdict.doubted).has(signal);
    let signal = names
        .signal(name)
        .filter(|&signal| is_doubted(&seen, signal));
    let Some(signal) = signal else {
        bail!(
            "{name}: expected a signal that is doubted, found these: {}",
            doubted()
        );
    };
    let mut message = WireAcknowledge::of_signals(&seen, [signal].into_iter().collect());
    sender.send_for(seen.machine_hash, &mut message)?;
    let confirms =
        |verdict: &WireVerdict| verdict.sequence > seen.sequence && !is_doubted(verdict, signal);
    match wait_for(&verdicts, LIMIT, confirms)? {
        Some(_) => Ok(format!("{name} is trusted as it is now")),
        None if repeats(&seen) => bail!(
            "{name}: expected a signal that is measured again, found one that may still repeat one value (frozen): mend its sensor, \
             move what it measures, and acknowledge it then"
        ),
        None => bail!(
            "{name}: the monitor has not accepted the acknowledgement within {} s; do its sensors still send?",
            LIMIT.as_secs()
        ),
    }
}

/// Whether a verdict reports a frozen signal, as a fault or as a caution.
fn repeats(verdict: &WireVerdict) -> bool {
    let held = verdict.verdict().held;
    held.faults.has(InputFault::Frozen) || held.cautions.has(InputFault::Frozen)
}

/// The next verdict.
fn seen(verdicts: &Receiver<WireVerdict>) -> Result<WireVerdict> {
    let Some(seen) = wait_for(verdicts, LIMIT, |_| true)? else {
        bail!(
            "expected a verdict within {} s, found none; is a monitor running?",
            LIMIT.as_secs()
        );
    };
    Ok(seen)
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

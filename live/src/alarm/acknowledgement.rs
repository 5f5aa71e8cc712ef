//! Rules by which acknowledgements count: those of somebody who has seen the alarm, or the doubt of a signal.

use tipwatch_mechanics::machine::{Proof, Proofs};

use crate::wire::command::HoldReason;
use crate::wire::topics::{ALARM_BEGINS, Wire, WireAcknowledge, WireCommand, WireVerdict};

/// Subject of an acknowledgement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledged {
    /// The latched alarm.
    Alarm,
    /// These signals, which are doubted.
    Signals(Proofs),
}

/// The published verdicts, or commands, that carry the latched alarm, and the doubt of each signal.
#[derive(Debug, Clone, Copy)]
pub struct AlarmSeen {
    source: u64,
    machine_hash: u64,
    /// The first of them.
    first: Option<u64>,
    /// The first that doubts each signal, by its bit.
    first_doubting: [Option<u64>; u64::BITS as usize],
}

impl AlarmSeen {
    /// No verdict of this source was published yet.
    #[must_use]
    pub fn new(source: u64, machine_hash: u64) -> Self {
        Self {
            source,
            machine_hash,
            first: None,
            first_doubting: [None; u64::BITS as usize],
        }
    }

    /// Tells in a verdict which of them is the first; `sequence` is its own number.
    pub fn publish(&mut self, verdict: &mut WireVerdict, sequence: u64) {
        if verdict.alarm == 0 {
            self.first = None;
        } else if verdict.alarm_sequence == ALARM_BEGINS {
            self.first = Some(sequence);
        }
        verdict.alarm_sequence = match verdict.alarm {
            0 => 0,
            _ => *self.first.get_or_insert(sequence),
        };
        for (place, first) in self.first_doubting.iter_mut().enumerate() {
            *first = match verdict.doubted >> place & 1 {
                0 => None,
                _ => first.or(Some(sequence)),
            };
        }
    }

    /// A doubted signal has failed once more: who has seen verdicts up to now, `sequence` is the number of the next, has not seen
    /// that.
    pub fn fails_again(&mut self, signal: Proof, sequence: u64) {
        self.first_doubting[signal.place() as usize] = Some(sequence);
    }

    /// Tells of a command whether it carries an alarm, a rod that does not obey; `sequence` is its own number.
    pub fn publish_command(&mut self, command: &WireCommand, sequence: u64) {
        self.first = match command.has_rod_fault() {
            true => self.first.or(Some(sequence)),
            false => None,
        };
    }

    /// Returns the subject of an acknowledgement; `None` if the message that it names did not carry that alarm or doubt. `next`
    /// is the sequence number of the next message.
    #[must_use]
    pub fn acknowledged(&self, by: &WireAcknowledge, next: u64) -> Option<Acknowledged> {
        if !by.is_for(self.machine_hash) || by.verdict_source != self.source {
            return None;
        }
        let is_seen = |first: &u64| (*first..next).contains(&by.verdict_sequence);
        if by.signals == 0 {
            return (self.first.as_ref().is_some_and(is_seen)).then_some(Acknowledged::Alarm);
        }
        let places = self.first_doubting.iter().enumerate();
        let seen = places.filter(|(_, first)| first.as_ref().is_some_and(is_seen));
        let seen = seen.fold(0, |bits, (place, _)| bits | 1 << place) & by.signals;
        (seen != 0).then_some(Acknowledged::Signals(Proofs::from_bits(seen)))
    }
}

impl WireAcknowledge {
    /// The acknowledgement of this verdict, without head.
    #[must_use]
    pub fn of(verdict: &WireVerdict) -> Self {
        Self {
            verdict_source: verdict.source,
            verdict_sequence: verdict.sequence,
            ..Self::blank()
        }
    }

    /// The acknowledgement of signals that this verdict doubts, without head.
    #[must_use]
    pub fn of_signals(verdict: &WireVerdict, signals: Proofs) -> Self {
        Self {
            signals: signals.bits(),
            ..Self::of(verdict)
        }
    }

    /// The acknowledgement of this command, without head.
    #[must_use]
    pub fn of_command(command: &WireCommand) -> Self {
        Self {
            verdict_source: command.source,
            verdict_sequence: command.sequence,
            ..Self::blank()
        }
    }

    /// Whether the message is undamaged, of this version, and meant for this machine.
    #[must_use]
    pub fn is_for(&self, machine_hash: u64) -> bool {
        self.is_whole() && self.machine_hash == machine_hash
    }
}

impl WireCommand {
    /// Whether the command reports a rod that does not obey its valve.
    #[must_use]
    pub fn has_rod_fault(&self) -> bool {
        let reasons = self.reasons();
        reasons.has(HoldReason::NotFollowing) || reasons.has(HoldReason::WrongWay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::command::HoldReasons;
    use crate::wire::topics::Head;

    fn acknowledgement(source: u64, sequence: u64) -> WireAcknowledge {
        let mut message = WireAcknowledge {
            verdict_source: source,
            verdict_sequence: sequence,
            ..WireAcknowledge::blank()
        };
        message.seal(Head {
            machine_hash: 9,
            ..Head::default()
        });
        message
    }

    fn published(seen: &mut AlarmSeen, alarm: u32, alarm_sequence: u64, sequence: u64) -> u64 {
        let mut verdict = WireVerdict {
            alarm,
            alarm_sequence,
            ..WireVerdict::blank()
        };
        seen.publish(&mut verdict, sequence);
        verdict.alarm_sequence
    }

    // requirement: TW-VERDICT-21
    #[test]
    fn only_verdicts_with_the_alarm_can_be_acknowledged() {
        let mut seen = AlarmSeen::new(5, 9);
        published(&mut seen, 0, 0, 10);
        assert_eq!(seen.acknowledged(&acknowledgement(5, 10), 11), None);
        assert_eq!(published(&mut seen, 4, ALARM_BEGINS, 11), 11);
        assert_eq!(published(&mut seen, 4, 11, 12), 11);
        let counts =
            |message: &WireAcknowledge| seen.acknowledged(message, 13) == Some(Acknowledged::Alarm);
        assert!(counts(&acknowledgement(5, 11)) && counts(&acknowledgement(5, 12)));
        assert!(!counts(&acknowledgement(5, 10)), "before the alarm");
        assert!(!counts(&acknowledgement(5, 13)), "not published yet");
        assert!(!counts(&acknowledgement(4, 11)), "another monitor");
        assert!(!counts(&WireAcknowledge::blank()), "zeros");
        let mut damaged = acknowledgement(5, 11);
        damaged.checksum ^= 1;
        assert!(!counts(&damaged), "checksum");
        let mut foreign = acknowledgement(5, 11);
        foreign.seal(Head::default());
        assert!(!counts(&foreign), "another machine");
        // the next alarm
        assert_eq!(published(&mut seen, 4, ALARM_BEGINS, 20), 20);
        assert_eq!(seen.acknowledged(&acknowledgement(5, 12), 21), None);
    }

    // requirement: TW-VERDICT-21, TW-VERDICT-31
    #[test]
    fn signals_are_acknowledged_by_who_has_seen_that_they_are_doubted() {
        let signals =
            |joints: &[usize]| -> Proofs { joints.iter().copied().map(Proof::Joint).collect() };
        let mut seen = AlarmSeen::new(5, 9);
        for (sequence, joints) in [(10, &[][..]), (11, &[1]), (12, &[1, 2]), (13, &[2])] {
            let mut verdict = WireVerdict {
                doubted: signals(joints).bits(),
                ..WireVerdict::blank()
            };
            seen.publish(&mut verdict, sequence);
        }
        let taken = |sequence, joints: &[usize]| {
            let verdict = WireVerdict {
                source: 5,
                sequence,
                ..WireVerdict::blank()
            };
            let mut message = WireAcknowledge::of_signals(&verdict, signals(joints));
            message.seal(Head {
                machine_hash: 9,
                ..Head::default()
            });
            seen.acknowledged(&message, 14)
        };
        let both = Some(Acknowledged::Signals(signals(&[2])));
        assert_eq!(taken(12, &[1, 2]), both, "the other one is back");
        assert_eq!(taken(13, &[2]), both);
        assert_eq!(taken(11, &[2]), None, "before it was doubted");
        assert_eq!(taken(13, &[1, 3]), None, "nobody doubts them");
        assert_eq!(taken(13, &[]), None, "there is no alarm");
    }

    // requirement: TW-VERDICT-21
    #[test]
    fn only_commands_with_the_fault_of_a_rod_can_be_acknowledged() {
        let mut seen = AlarmSeen::new(5, 9);
        let command = |has_fault: bool| {
            let mut reasons = HoldReasons::default();
            reasons.note(HoldReason::NoVerdict, true);
            reasons.note(HoldReason::WrongWay, has_fault);
            WireCommand {
                reasons: reasons.bits(),
                ..WireCommand::blank()
            }
        };
        seen.publish_command(&command(false), 10);
        seen.publish_command(&command(true), 11);
        seen.publish_command(&command(true), 12);
        let counts = |source, sequence| {
            let message = acknowledgement(source, sequence);
            seen.acknowledged(&message, 13).is_some()
        };
        assert!(counts(5, 11) && counts(5, 12));
        assert!(!counts(5, 10), "before the fault");
        assert!(!counts(5, 13), "not published yet");
        assert!(!counts(4, 11), "a verdict, or another control");
        seen.publish_command(&command(false), 13);
        let over = seen.acknowledged(&acknowledgement(5, 12), 14);
        assert_eq!(over, None, "it is over");
    }
}

//! Which acknowledgements count: those of somebody who has seen the alarm.

use crate::wire::topics::{ALARM_BEGINS, Wire, WireAcknowledge, WireVerdict};

/// The published verdicts that carry the latched alarm.
#[derive(Debug, Clone, Copy)]
pub struct AlarmSeen {
    source: u64,
    machine_hash: u64,
    /// The first of them.
    first: Option<u64>,
}

impl AlarmSeen {
    /// No verdict of this source was published yet.
    #[must_use]
    pub fn new(source: u64, machine_hash: u64) -> Self {
        Self {
            source,
            machine_hash,
            first: None,
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
    }

    /// Whether this acknowledgement is of a verdict that carried the alarm; `next` is the number of the next verdict.
    #[must_use]
    pub fn is_acknowledged(&self, by: &WireAcknowledge, next: u64) -> bool {
        by.is_for(self.machine_hash)
            && by.verdict_source == self.source
            && self
                .first
                .is_some_and(|first| (first..next).contains(&by.verdict_sequence))
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

    /// Whether it is undamaged, of this version, and meant for this machine.
    #[must_use]
    pub fn is_for(&self, machine_hash: u64) -> bool {
        self.is_whole() && self.machine_hash == machine_hash
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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

    #[test]
    fn only_verdicts_with_the_alarm_can_be_acknowledged() {
        let mut seen = AlarmSeen::new(5, 9);
        published(&mut seen, 0, 0, 10);
        assert!(!seen.is_acknowledged(&acknowledgement(5, 10), 11));
        assert_eq!(published(&mut seen, 4, ALARM_BEGINS, 11), 11);
        assert_eq!(published(&mut seen, 4, 11, 12), 11);
        let counts = |message: &WireAcknowledge| seen.is_acknowledged(message, 13);
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
        assert!(!seen.is_acknowledged(&acknowledgement(5, 12), 21));
    }
}

//! Who publishes a topic. Samples of one publisher only: two would mix their measurements.

/// A publisher that was silent for so long is gone, and another one may take its place (ns).
const GONE_NS: i64 = 1_000_000_000;
/// Losses in one gap that are told; a counter that jumps further has restarted.
const MOST_LOST: u64 = 1_000_000;

/// The publishers of one topic.
#[derive(Debug, Clone, Default)]
pub struct Publishers {
    owner: Option<Owner>,
    /// Until when a second publisher counts as active (ns).
    second_until_ns: Option<i64>,
}

#[derive(Debug, Clone, Copy)]
struct Owner {
    publisher: u128,
    sequence: Option<u64>,
    last_ns: i64,
}

/// Why a message is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Two publishers send on the topic.
    TwoPublishers,
    /// It came before.
    Repeated,
}

/// What to do with a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// It is used; so many before it were lost.
    Used {
        /// Messages lost.
        lost: u64,
    },
    /// It is left out.
    Refused(Refused),
    /// It is of another publisher, after the one before has gone: a restart.
    Restarted,
}

impl Publishers {
    /// Judges a message that arrived at `now_ns`.
    pub fn admit(&mut self, publisher: u128, sequence: Option<u64>, now_ns: i64) -> Admission {
        let Some(owner) = &mut self.owner else {
            self.owner = Some(Owner {
                publisher,
                sequence,
                last_ns: now_ns,
            });
            return Admission::Used { lost: 0 };
        };
        if owner.publisher != publisher {
            if now_ns.saturating_sub(owner.last_ns) > GONE_NS {
                self.owner = Some(Owner {
                    publisher,
                    sequence,
                    last_ns: now_ns,
                });
                self.second_until_ns = None;
                return Admission::Restarted;
            }
            self.second_until_ns = Some(now_ns.saturating_add(GONE_NS));
            return Admission::Refused(Refused::TwoPublishers);
        }
        owner.last_ns = now_ns;
        let before = owner.sequence;
        owner.sequence = sequence.max(before);
        if self.second_until_ns.is_some_and(|until| now_ns <= until) {
            return Admission::Refused(Refused::TwoPublishers);
        }
        self.second_until_ns = None;
        match before.zip(sequence) {
            Some((before, now)) if now <= before => Admission::Refused(Refused::Repeated),
            Some((before, now)) => Admission::Used {
                lost: (now - before - 1).min(MOST_LOST),
            },
            None => Admission::Used { lost: 0 },
        }
    }

    /// Whether two publishers are active.
    #[must_use]
    pub fn are_two(&self) -> bool {
        self.second_until_ns.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn losses_and_repetitions_follow_from_the_counter() {
        let mut publishers = Publishers::default();
        let mut admit = |sequence| publishers.admit(1, Some(sequence), 0);
        assert_eq!(admit(5), Admission::Used { lost: 0 });
        assert_eq!(admit(6), Admission::Used { lost: 0 });
        assert_eq!(admit(9), Admission::Used { lost: 2 });
        assert_eq!(admit(9), Admission::Refused(Refused::Repeated));
        assert_eq!(admit(8), Admission::Refused(Refused::Repeated));
        assert_eq!(admit(10), Admission::Used { lost: 0 });
    }

    #[test]
    fn while_two_publish_nothing_is_used_and_afterwards_the_one_that_stays() {
        let mut publishers = Publishers::default();
        let mut used = Vec::new();
        for at in 0..300_i64 {
            let now = at * 10 * MS;
            let first = publishers.admit(1, Some(at as u64), now);
            if (100..150).contains(&at) {
                let second = publishers.admit(2, Some(at as u64), now + MS);
                assert_eq!(second, Admission::Refused(Refused::TwoPublishers));
            }
            if matches!(first, Admission::Used { .. }) {
                used.push(at);
            }
        }
        // from the second's first message until a second after its last one
        let expected: Vec<i64> = (0..101).chain(250..300).collect();
        assert_eq!(used, expected);
    }

    #[test]
    fn a_publisher_that_comes_back_under_another_name_is_a_restart() {
        let mut publishers = Publishers::default();
        publishers.admit(1, Some(7), 0);
        assert_eq!(
            publishers.admit(2, Some(1), 900 * MS),
            Admission::Refused(Refused::TwoPublishers)
        );
        assert_eq!(
            publishers.admit(2, Some(2), 1001 * MS),
            Admission::Restarted
        );
        assert_eq!(
            publishers.admit(2, Some(3), 1010 * MS),
            Admission::Used { lost: 0 }
        );
    }
}

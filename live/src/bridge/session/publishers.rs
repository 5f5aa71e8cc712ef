//! Who publishes a topic. Samples of one publisher only: two would mix their measurements. Publishers of joint states
//! may share a topic if each has joints of its own.

use super::joint_names::joint_names;

/// A publisher that was silent for so long is gone, and another one may take its place (ns).
const GONE_NS: i64 = 1_000_000_000;
/// Losses in one gap that are told; a counter that jumps further has restarted.
const MOST_LOST: u64 = 1_000_000;

/// Fewest messages by which a counter is seen to have begun anew.
const FEWEST_OF_A_RESTART: u32 = 3;

/// The publishers of one topic.
#[derive(Debug, Clone, Default)]
pub struct Publishers {
    /// Shares of the publishers: one of the whole topic, or one for each part of the joints.
    shares: Vec<Share>,
}

/// Share of one publisher in a topic.
#[derive(Debug, Clone)]
struct Share {
    owner: Owner,
    /// The joints that it has named; none for other messages than joint states.
    joints: Vec<Vec<u8>>,
    /// Time until which a second publisher counts as active (ns); `None` if there is none.
    second_until_ns: Option<i64>,
}

#[derive(Debug, Clone, Copy)]
struct Owner {
    publisher: u128,
    sequence: Option<u64>,
    last_ns: i64,
    /// Messages that count as repeated, with no new one between them and each with a larger counter than the one before.
    again: Option<Again>,
}

/// Such messages: their last counter, the time of the first (ns), and how many there are.
#[derive(Debug, Clone, Copy)]
struct Again {
    sequence: u64,
    since_ns: i64,
    count: u32,
}

/// Reason for which a message is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Two publishers send on the topic.
    TwoPublishers,
    /// The message came before.
    Repeated,
}

/// Decision on a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// The message is used; `lost` messages before it are missing.
    Used {
        /// Messages lost.
        lost: u64,
    },
    /// The message is left out.
    Refused(Refused),
    /// The message is of another publisher, after the one before has gone, or of one whose counter has begun anew: a restart.
    Restarted,
}

impl Publishers {
    /// Judges a message that arrived at `now_ns`. `joint_states` is the message, if it is one of joint states.
    pub fn admit(
        &mut self,
        publisher: u128,
        joint_states: Option<&[u8]>,
        sequence: Option<u64>,
        now_ns: i64,
    ) -> Admission {
        let joints = joint_states.and_then(joint_names).unwrap_or_default();
        let own = self.share_of(publisher, &joints);
        let Some(own) = own else {
            self.shares.push(Share {
                owner: Owner {
                    publisher,
                    sequence,
                    last_ns: now_ns,
                    again: None,
                },
                joints: joints.into_iter().map(<[u8]>::to_vec).collect(),
                second_until_ns: None,
            });
            return Admission::Used { lost: 0 };
        };
        let until_ns = now_ns.saturating_add(GONE_NS);
        for (place, share) in self.shares.iter_mut().enumerate() {
            let is_active = now_ns.saturating_sub(share.owner.last_ns) <= GONE_NS;
            if place != own && is_active && share.shares(&joints) {
                // it has named a joint of another one only now
                share.second_until_ns = Some(until_ns);
                self.shares[own].owner.last_ns = now_ns;
                return Admission::Refused(Refused::TwoPublishers);
            }
        }
        self.shares[own].admit(publisher, &joints, sequence, now_ns)
    }

    /// The share of a publisher, or else the one that has one of its joints.
    fn share_of(&self, publisher: u128, joints: &[&[u8]]) -> Option<usize> {
        let shares = || self.shares.iter();
        let own = shares().position(|share| share.owner.publisher == publisher);
        own.or_else(|| shares().position(|share| share.shares(joints)))
    }

    /// Whether two publishers of the same topic or joints are active.
    #[must_use]
    pub fn are_two(&self) -> bool {
        (self.shares.iter()).any(|share| share.second_until_ns.is_some())
    }
}

impl Again {
    /// Whether the counter has begun anew: messages that were sent again are fewer, or come among new ones.
    fn is_restart(self, now_ns: i64) -> bool {
        self.count >= FEWEST_OF_A_RESTART && now_ns.saturating_sub(self.since_ns) > GONE_NS
    }
}

impl Share {
    /// Whether messages with these joints overlap with those of this publisher; messages without joints overlap with all.
    fn shares(&self, joints: &[&[u8]]) -> bool {
        let is_known = |joint: &&[u8]| self.joints.iter().any(|known| known == joint);
        joints.is_empty() || self.joints.is_empty() || joints.iter().any(is_known)
    }

    fn admit(
        &mut self,
        publisher: u128,
        joints: &[&[u8]],
        sequence: Option<u64>,
        now_ns: i64,
    ) -> Admission {
        let owner = &mut self.owner;
        if owner.publisher != publisher {
            if now_ns.saturating_sub(owner.last_ns) > GONE_NS {
                *owner = Owner {
                    publisher,
                    sequence,
                    last_ns: now_ns,
                    again: None,
                };
                self.joints = joints.iter().map(|joint| joint.to_vec()).collect();
                self.second_until_ns = None;
                return Admission::Restarted;
            }
            self.second_until_ns = Some(now_ns.saturating_add(GONE_NS));
            return Admission::Refused(Refused::TwoPublishers);
        }
        for joint in joints {
            if !self.joints.iter().any(|known| known == joint) {
                self.joints.push(joint.to_vec());
            }
        }
        owner.last_ns = now_ns;
        let before = owner.sequence;
        let repeated = sequence.filter(|now| before.is_some_and(|before| *now <= before));
        owner.again = repeated.map(|sequence| {
            let goes_on = owner.again.filter(|again| again.sequence < sequence);
            Again {
                sequence,
                since_ns: goes_on.map_or(now_ns, |again| again.since_ns),
                count: goes_on.map_or(1, |again| again.count.saturating_add(1)),
            }
        });
        if owner.again.is_some_and(|again| again.is_restart(now_ns)) {
            (owner.sequence, owner.again) = (sequence, None);
            return Admission::Restarted;
        }
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
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    #[test]
    fn losses_and_repetitions_follow_from_the_counter() {
        let mut publishers = Publishers::default();
        let mut admit = |sequence| publishers.admit(1, None, Some(sequence), 0);
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
            let first = publishers.admit(1, None, Some(at as u64), now);
            if (100..150).contains(&at) {
                let second = publishers.admit(2, None, Some(at as u64), now + MS);
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
        publishers.admit(1, None, Some(7), 0);
        assert_eq!(
            publishers.admit(2, None, Some(1), 900 * MS),
            Admission::Refused(Refused::TwoPublishers)
        );
        assert_eq!(
            publishers.admit(2, None, Some(2), 1001 * MS),
            Admission::Restarted
        );
        assert_eq!(
            publishers.admit(2, None, Some(3), 1010 * MS),
            Admission::Used { lost: 0 }
        );
    }

    #[test]
    fn a_counter_that_begins_anew_is_a_restart_and_no_repetition_for_ever() {
        let mut publishers = Publishers::default();
        let mut admit = |at: i64, sequence| publishers.admit(1, None, Some(sequence), at * 10 * MS);
        for at in 0..100 {
            assert_eq!(admit(at, 500 + at as u64), Admission::Used { lost: 0 });
        }
        // a single message may come again
        assert_eq!(admit(100, 550), Admission::Refused(Refused::Repeated));
        assert_eq!(admit(101, 600), Admission::Used { lost: 0 });
        let admitted: Vec<_> = (0..200).map(|k| admit(102 + k, 1 + k as u64)).collect();
        let repeated = Admission::Refused(Refused::Repeated);
        let place = admitted.iter().position(|it| *it == Admission::Restarted);
        let place = place.unwrap();
        assert!((100..103).contains(&place), "{place}");
        assert!(admitted[..place].iter().all(|it| *it == repeated));
        let used = Admission::Used { lost: 0 };
        assert!(admitted[place + 1..].iter().all(|it| *it == used));
        // nor do messages of a slow topic that come again
        let mut slow = Publishers::default();
        for (at_s, sequence, admission) in [
            (0, 1, used),
            (2, 2, used),
            (4, 1, repeated),
            (6, 2, repeated),
            (8, 3, used),
            (10, 3, repeated),
            (12, 3, repeated),
            (14, 3, repeated),
        ] {
            let found = slow.admit(1, None, Some(sequence), at_s * 1000 * MS);
            assert_eq!(found, admission, "{at_s}");
        }
    }

    /// A message of joint states: no stamp, no frame.
    fn joint_states(names: &[&str]) -> Vec<u8> {
        let mut data = vec![0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let number = |data: &mut Vec<u8>, number: usize| {
            data.resize(data.len().next_multiple_of(4), 0);
            data.extend((number as u32).to_le_bytes());
        };
        number(&mut data, 0);
        number(&mut data, names.len());
        for name in names {
            number(&mut data, name.len());
            data.extend(name.as_bytes());
        }
        data
    }

    #[test]
    fn publishers_with_joints_of_their_own_share_a_topic() {
        let mut publishers = Publishers::default();
        let (arm, wheels) = (joint_states(&["boom", "stick"]), joint_states(&["left"]));
        for at in 0..100_u64 {
            let now = at as i64 * 10 * MS;
            for (publisher, message) in [(1, &arm), (2, &wheels)] {
                let admission = publishers.admit(publisher, Some(message), Some(at), now);
                assert_eq!(admission, Admission::Used { lost: 0 });
            }
        }
        assert!(!publishers.are_two());
        // each has a counter of its own
        let lost = publishers.admit(2, Some(&wheels), Some(105), 1000 * MS);
        assert_eq!(lost, Admission::Used { lost: 5 });
        // a third one contradicts the first, and the second goes on
        let two = Admission::Refused(Refused::TwoPublishers);
        let boom = joint_states(&["bucket", "boom"]);
        assert_eq!(publishers.admit(3, Some(&boom), Some(0), 1001 * MS), two);
        assert_eq!(publishers.admit(1, Some(&arm), Some(100), 1002 * MS), two);
        let used = publishers.admit(2, Some(&wheels), Some(106), 1003 * MS);
        assert_eq!(used, Admission::Used { lost: 0 });
        // so does one that names another's joint only later
        let both = joint_states(&["left", "boom"]);
        assert_eq!(publishers.admit(2, Some(&both), Some(107), 1004 * MS), two);
    }
}

//! The queue of messages between the networks and the session. It never blocks a network, never grows without bound,
//! and no topic can fill it for the others; what it has no room for counts as lost.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tipwatch_ingest::SensorKind;

use super::tell::Teller;

/// Messages in the queue.
const ROOM: usize = 4096;
/// Messages of one topic that are taken per second, far above any sensor; and those that may come at once.
const MOST_PER_S: f64 = 2000.0;
/// Frames of a bus that are taken per second: above what 1 Mbit/s carries.
const MOST_FRAMES_PER_S: f64 = 20_000.0;
const BURST_S: f64 = 0.25;
/// Largest message of a sensor (bytes).
const MOST_BYTES: usize = 1 << 18;

/// Identifies a topic of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LaneId(pub usize);

/// A message as it arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrival {
    /// Its topic.
    pub lane: LaneId,
    /// Time of arrival (ns), by CLOCK_MONOTONIC.
    pub host_ns: i64,
    /// Log time (ns), as a recorder would have noted it: Unix time of arrival, or the time that a bus logger wrote.
    pub log_ns: i64,
    /// Time of sending (ns), if the network tells it.
    pub sent_ns: Option<i64>,
    /// Its publisher; 0 for a bus, which names none.
    pub publisher: u128,
    /// The publisher's counter, if the network has one.
    pub sequence: Option<u64>,
    /// Messages of this topic that were refused since the one before, because there was no room.
    pub missed: u64,
    /// The message: CDR with its encapsulation.
    pub data: Vec<u8>,
}

/// A topic of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lane {
    /// Its name, as in a log.
    pub name: String,
    /// Type of its messages.
    pub type_name: String,
    /// Their definition.
    pub definition: String,
    /// Whether the topic carries frames of a bus.
    pub is_bus: bool,
}

impl Lane {
    /// Whether the topic carries joint states: several publishers may share the topic, each with joints of its own.
    #[must_use]
    pub fn has_joint_states(&self) -> bool {
        SensorKind::JointStates.is_type(&self.type_name)
    }
}

/// Counts of the messages of a topic at the queue: received, and refused by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LaneCounts {
    /// Messages that came.
    pub received: u64,
    /// Messages refused because too many came.
    pub flooded: u64,
    /// Messages refused because the queue was full.
    pub without_room: u64,
    /// Messages refused because of their size.
    pub oversized: u64,
}

/// The entrance of the queue, for any thread.
#[derive(Debug, Clone)]
pub struct Intake {
    lanes: Arc<Mutex<Vec<LaneState>>>,
    queue: SyncSender<Arrival>,
    /// Tells on stderr.
    pub teller: Teller,
}

#[derive(Debug)]
struct LaneState {
    lane: Lane,
    counts: LaneCounts,
    missed: u64,
    tokens: f64,
    filled: Instant,
}

/// The exit of the queue.
#[derive(Debug)]
pub struct Arrivals {
    lanes: Arc<Mutex<Vec<LaneState>>>,
    queue: Receiver<Arrival>,
}

impl Intake {
    /// A queue.
    #[must_use]
    pub fn new(teller: Teller) -> (Self, Arrivals) {
        let (sender, receiver) = sync_channel(ROOM);
        let lanes = Arc::new(Mutex::new(Vec::new()));
        let intake = Self {
            lanes: Arc::clone(&lanes),
            queue: sender,
            teller,
        };
        (
            intake,
            Arrivals {
                lanes,
                queue: receiver,
            },
        )
    }

    /// The topic of this name and type, which is added if it is new.
    #[must_use]
    pub fn lane(&self, lane: &Lane) -> LaneId {
        let mut lanes = lock(&self.lanes);
        let known = lanes.iter().position(|known| {
            known.lane.name == lane.name && known.lane.type_name == lane.type_name
        });
        LaneId(known.unwrap_or_else(|| {
            lanes.push(LaneState {
                lane: lane.clone(),
                counts: LaneCounts::default(),
                missed: 0,
                tokens: BURST_S * MOST_FRAMES_PER_S,
                filled: Instant::now(),
            });
            lanes.len() - 1
        }))
    }

    /// Puts a message into the queue, or counts it as missed. `false` when nobody reads any more.
    pub fn offer(&self, mut arrival: Arrival) -> bool {
        let mut lanes = lock(&self.lanes);
        let Some(state) = lanes.get_mut(arrival.lane.0) else {
            return true;
        };
        state.counts.received += 1;
        let problem = if arrival.data.len() > MOST_BYTES {
            state.counts.oversized += 1;
            Some((
                "size",
                format!(
                    "{}: expected messages of up to {MOST_BYTES} bytes, found {}: left out",
                    state.lane.name,
                    arrival.data.len()
                ),
            ))
        } else if !state.has_token() {
            state.counts.flooded += 1;
            Some((
                "flood",
                format!(
                    "{}: more than {:.0} messages per second: the others are left out and count as lost",
                    state.lane.name,
                    state.most_per_s()
                ),
            ))
        } else {
            None
        };
        if let Some((key, text)) = problem {
            state.missed += 1;
            let key = format!("{key} {}", state.lane.name);
            drop(lanes);
            self.teller.fault(&key, &text);
            return true;
        }
        arrival.missed += state.missed;
        let missed = arrival.missed;
        match self.queue.try_send(arrival) {
            Ok(()) => {
                state.missed = 0;
                true
            }
            Err(TrySendError::Full(_)) => {
                state.missed = missed + 1;
                state.counts.without_room += 1;
                let name = state.lane.name.clone();
                drop(lanes);
                let text = format!(
                    "{name}: the bridge cannot keep up; messages are left out and count as lost"
                );
                self.teller.fault(&format!("room {name}"), &text);
                true
            }
            Err(TrySendError::Disconnected(_)) => false,
        }
    }
}

impl LaneState {
    fn most_per_s(&self) -> f64 {
        match self.lane.is_bus {
            true => MOST_FRAMES_PER_S,
            false => MOST_PER_S,
        }
    }

    /// A bucket that fills at the highest rate.
    fn has_token(&mut self) -> bool {
        let rate = self.most_per_s();
        let now = Instant::now();
        let since_s = now.duration_since(self.filled).as_secs_f64();
        self.filled = now;
        self.tokens = (self.tokens + rate * since_s).min(rate * BURST_S);
        let has_one = self.tokens >= 1.0;
        if has_one {
            self.tokens -= 1.0;
        }
        has_one
    }
}

impl Arrivals {
    /// The next message, within this time. `Err(true)` when no network is left.
    ///
    /// # Errors
    /// None came; `true`: none will come.
    pub fn next(&self, longest: Duration) -> Result<Arrival, bool> {
        let received = self.queue.recv_timeout(longest);
        received.map_err(|error| error == RecvTimeoutError::Disconnected)
    }

    /// The topics so far.
    #[must_use]
    pub fn lanes(&self) -> Vec<Lane> {
        lock(&self.lanes)
            .iter()
            .map(|state| state.lane.clone())
            .collect()
    }

    /// Returns the counts of the messages of each topic.
    #[must_use]
    pub fn counts(&self) -> Vec<LaneCounts> {
        lock(&self.lanes).iter().map(|state| state.counts).collect()
    }
}

/// A thread that panics while holding the lock leaves counts behind, nothing worse.
fn lock(lanes: &Mutex<Vec<LaneState>>) -> MutexGuard<'_, Vec<LaneState>> {
    lanes.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane(name: &str, is_bus: bool) -> Lane {
        Lane {
            name: name.into(),
            type_name: "t".into(),
            definition: String::new(),
            is_bus,
        }
    }

    fn arrival(lane: LaneId, data: Vec<u8>) -> Arrival {
        Arrival {
            lane,
            host_ns: 0,
            log_ns: 0,
            sent_ns: None,
            publisher: 0,
            sequence: None,
            missed: 0,
            data,
        }
    }

    #[test]
    fn a_flooded_topic_leaves_room_for_the_others_and_its_losses_are_counted() {
        let (intake, arrivals) = Intake::new(Teller::default());
        let (flood, calm) = (
            intake.lane(&lane("/flood", false)),
            intake.lane(&lane("/calm", false)),
        );
        for _ in 0..100_000 {
            assert!(intake.offer(arrival(flood, vec![0; 8])));
        }
        assert!(intake.offer(arrival(calm, vec![1])));
        let mut seen = [0_u64; 2];
        let mut missed = 0;
        while let Ok(arrival) = arrivals.next(Duration::ZERO) {
            seen[arrival.lane.0] += 1;
            missed += arrival.missed;
        }
        assert_eq!(seen[1], 1);
        assert!(seen[0] < 10_000, "{seen:?}");
        // those refused after the last one that passed are told with the next
        std::thread::sleep(Duration::from_millis(5));
        assert!(intake.offer(arrival(flood, vec![0])));
        missed += arrivals.next(Duration::ZERO).unwrap().missed;
        assert_eq!(seen[0] + 1 + missed, 100_001);
        assert_eq!(arrivals.counts()[0].flooded + seen[0] + 1, 100_001);
    }

    #[test]
    fn a_full_queue_and_huge_messages_count_as_missed() {
        let (intake, arrivals) = Intake::new(Teller::default());
        let bus = intake.lane(&lane("can0", true));
        for _ in 0..ROOM + 10 {
            assert!(intake.offer(arrival(bus, Vec::new())));
        }
        assert!(intake.offer(arrival(bus, vec![0; MOST_BYTES + 1])));
        for _ in 0..ROOM {
            assert_eq!(arrivals.next(Duration::ZERO).unwrap().missed, 0);
        }
        assert!(intake.offer(arrival(bus, Vec::new())));
        assert_eq!(arrivals.next(Duration::ZERO).unwrap().missed, 11);
        assert_eq!(arrivals.counts()[0].without_room, 10);
        drop(arrivals);
        assert!(!intake.offer(arrival(bus, Vec::new())));
    }
}

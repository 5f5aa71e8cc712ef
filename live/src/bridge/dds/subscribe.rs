//! Finds the wanted topics in the domain and reads their messages into the queue.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow};
use rustdds::mio1::{Events, Interest, Poll, Token};
use rustdds::no_key::SimpleDataReader;
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{QosPolicyBuilder, Subscriber, Timestamp};
use tipwatch_ingest::known_definition;

use super::names::{ros_topic, ros_type};
use super::participant::Participant;
use super::payload::{AsBytes, Payload};
use crate::bridge::input::{Arrival, HostClock, Intake, Lane, LaneId, Wanted};
use crate::system::clock::monotonic_ns;

/// Period at which new topics are looked for.
const LOOK: Duration = Duration::from_millis(100);
/// Messages that wait for this thread.
const DEPTH: i32 = 512;
const MOST_READERS: usize = 256;

/// Starts a thread that reads the wanted topics. `definitions` are those of types that are not built in.
///
/// # Errors
/// The thread cannot be started.
pub fn start_dds(
    participant: &Participant,
    wanted: Wanted,
    definitions: BTreeMap<String, String>,
    intake: Intake,
    clock: HostClock,
) -> Result<()> {
    let participant = participant.clone();
    let subscriber = participant
        .participant
        .create_subscriber(&QosPolicyBuilder::new().build())
        .map_err(|error| anyhow!("DDS: cannot subscribe: {error}"))?;
    let subscription = Subscription {
        participant,
        subscriber,
        wanted,
        definitions,
        intake,
        clock,
        readers: Vec::new(),
        poll: Poll::new()?,
    };
    std::thread::Builder::new()
        .name("dds".into())
        .spawn(move || subscription.run())?;
    Ok(())
}

struct Subscription {
    participant: Participant,
    subscriber: Subscriber,
    wanted: Wanted,
    definitions: BTreeMap<String, String>,
    intake: Intake,
    clock: HostClock,
    readers: Vec<Reader>,
    poll: Poll,
}

struct Reader {
    reader: SimpleDataReader<Payload, AsBytes>,
    lane: LaneId,
    name: String,
    type_name: String,
}

impl Subscription {
    fn run(mut self) {
        let mut events = Events::with_capacity(256);
        let mut looked: Option<Instant> = None;
        loop {
            if looked.is_none_or(|at| at.elapsed() >= LOOK) {
                looked = Some(Instant::now());
                self.look_for_topics();
            }
            // an error of the wait is one of the loop's wake-ups
            let _ = self.poll.poll(&mut events, Some(LOOK));
            for reader in &self.readers {
                if !reader.drain(&self.intake, &self.clock) {
                    return;
                }
            }
        }
    }

    fn look_for_topics(&mut self) {
        for writer in self.participant.participant.discovered_writers() {
            let offered = &writer.publication_topic_data;
            let Some(name) = ros_topic(&offered.topic_name) else {
                continue;
            };
            let type_name = ros_type(&offered.type_name);
            if !self.wanted.wants(&name, &type_name) {
                continue;
            }
            if let Some(expected) = self.wanted.expected_type(&name, &type_name) {
                self.intake.teller.fault(
                    &format!("type {name} {type_name}"),
                    &format!(
                        "{name}: expected publishers of {expected}, found one of {type_name}: its messages are not used"
                    ),
                );
                continue;
            }
            if let Some(known) = self.readers.iter().find(|reader| reader.name == name) {
                if known.type_name != type_name {
                    self.intake.teller.fault(
                        &format!("type {name} {type_name}"),
                        &format!(
                            "{name}: expected publishers of {}, found another one of {type_name}: its messages are \
                             not used",
                            known.type_name
                        ),
                    );
                }
                continue;
            }
            let definition = (self.definitions.get(&type_name).cloned())
                .or_else(|| known_definition(&type_name));
            let Some(definition) = definition else {
                self.intake.teller.fault(
                    &format!("definition {type_name}"),
                    &format!(
                        "{name}: expected a message type whose definition is built in or in the log of --definitions, \
                         found {type_name}: DDS does not tell it"
                    ),
                );
                continue;
            };
            let is_reliable = matches!(offered.reliability, Some(Reliability::Reliable { .. }));
            if let Err(error) = self.subscribe(&name, &type_name, definition, is_reliable) {
                let text = format!("{error:#}");
                self.intake
                    .teller
                    .fault(&format!("subscribe {name}"), &text);
            }
        }
    }

    /// Subscribes as the publisher offers: asking for more, no message would come; asking for less, losses would be
    /// more frequent.
    fn subscribe(
        &mut self,
        name: &str,
        type_name: &str,
        definition: String,
        is_reliable: bool,
    ) -> Result<()> {
        if self.readers.len() >= MOST_READERS {
            return Err(anyhow!(
                "{name}: expected no more than {MOST_READERS} topics"
            ));
        }
        let wanted = QosPolicyBuilder::new()
            .reliability(match is_reliable {
                true => Reliability::Reliable {
                    max_blocking_time: rustdds::Duration::from_millis(100),
                },
                false => Reliability::BestEffort,
            })
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth: DEPTH })
            .build();
        let topic = self.participant.topic(name, type_name, &wanted)?;
        let mut reader = self
            .subscriber
            .create_simple_datareader_no_key::<Payload, AsBytes>(&topic, Some(wanted))
            .map_err(|error| anyhow!("{name}: cannot subscribe: {error}"))?;
        self.poll.registry().register(
            &mut reader,
            Token(self.readers.len()),
            Interest::READABLE,
        )?;
        let lane = self.intake.lane(&Lane {
            name: name.into(),
            type_name: type_name.into(),
            definition,
            is_bus: type_name.ends_with("Frame"),
        });
        self.intake.teller.say(&format!(
            "{name}: {type_name}, {}",
            match is_reliable {
                true => "reliable",
                false => "best effort: messages may be lost",
            }
        ));
        self.readers.push(Reader {
            reader,
            lane,
            name: name.into(),
            type_name: type_name.into(),
        });
        Ok(())
    }
}

impl Reader {
    /// Takes all messages that wait; `false` when nobody reads them any more.
    fn drain(&self, intake: &Intake, clock: &HostClock) -> bool {
        self.reader.drain_read_notifications();
        loop {
            let taken = match self.reader.try_take_one() {
                Ok(Some(taken)) => taken,
                Ok(None) => return true,
                Err(error) => {
                    let text = format!("{}: a message cannot be read: {error}", self.name);
                    intake.teller.fault(&format!("read {}", self.name), &text);
                    return true;
                }
            };
            let host_ns = monotonic_ns();
            let sent_ns = taken.source_timestamp().and_then(nanoseconds);
            let arrival = Arrival {
                lane: self.lane,
                host_ns,
                log_ns: clock.unix_at(host_ns),
                sent_ns,
                publisher: u128::from_be_bytes(taken.writer_guid().to_bytes()),
                sequence: u64::try_from(i64::from(taken.sequence_number)).ok(),
                missed: 0,
                data: taken.into_value().0,
            };
            if !intake.offer(arrival) {
                return false;
            }
        }
    }
}

/// Unix time (ns) of a time of DDS: seconds and fractions of 2^-32 s.
fn nanoseconds(time: Timestamp) -> Option<i64> {
    if time == Timestamp::INVALID || time == Timestamp::INFINITE {
        return None;
    }
    let ns = (u128::from(time.to_ticks()) * 1_000_000_000) >> 32;
    i64::try_from(ns).ok()
}

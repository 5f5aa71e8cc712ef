//! A running session: every message becomes samples in shared memory, or is told.

use anyhow::Result;
use tipwatch_mechanics::state::{Sample, Sensor};

use super::assembly::Assembly;
use super::clock::StepWatch;
use super::publishers::{Admission, Publishers, Refused};
use crate::bridge::input::{Arrival, Lane, Teller};
use crate::node::{LiveNode, Producer};
use crate::wire::identity::new_identity;
use crate::wire::session::StampClock;
use crate::wire::topics::{WireSample, WireSession};

/// Stamps that go back further are those of a clock that was set, or of a log that begins again (ns).
const BACK_NS: i64 = 1_000_000_000;
/// A clock that has moved so far is another one (ns).
const MOVED_NS: i64 = 10_000_000_000;
/// Most sequence numbers left out for one loss: the monitor needs to see that, not to count it.
const MOST_SKIPPED: u64 = 1000;

/// Counts of the messages of a session: sent as samples, lost and refused.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SessionCounts {
    /// Messages of the topics that are used.
    pub messages: u64,
    /// Samples sent.
    pub sent: u64,
    /// Messages that never came, or for which there was no room.
    pub lost: u64,
    /// Messages that came again.
    pub repeated: u64,
    /// Messages while two publishers sent.
    pub of_two_publishers: u64,
    /// Messages that could not be decoded, or had no usable stamp.
    pub undecodable: u64,
}

impl SessionCounts {
    /// Adds those of another session.
    pub(in crate::bridge) fn add(&mut self, other: &Self) {
        self.messages += other.messages;
        self.sent += other.sent;
        self.lost += other.lost;
        self.repeated += other.repeated;
        self.of_two_publishers += other.of_two_publishers;
        self.undecodable += other.undecodable;
    }
}

/// Reason for which a session ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// The program was asked to stop.
    Interrupted,
    /// No network is left.
    SourcesEnded,
    /// Something began anew: the next session must find out what.
    Restart(String),
}

/// A running session.
#[derive(Debug)]
pub struct SessionRun {
    producer: Producer,
    assembly: Assembly,
    publishers: Vec<Publishers>,
    lanes: Vec<Lane>,
    teller: Teller,
    clock: StampClock,
    /// The latest stamp of each sensor (ns), and what its clock does.
    stamps: Vec<(Sensor, i64, StepWatch)>,
    /// Counts of the messages so far.
    pub counts: SessionCounts,
}

impl SessionRun {
    /// Announces the session.
    ///
    /// # Errors
    /// Another producer sends samples, or the shared memory fails.
    pub fn begin(
        node: &LiveNode,
        mut assembly: Assembly,
        publishers: Vec<Publishers>,
        lanes: Vec<Lane>,
        teller: Teller,
    ) -> Result<Self> {
        let session = &mut assembly.session;
        session.id = new_identity(session.machine_hash);
        let mut producer = Producer::new(node, session.id, session.machine_hash)?;
        producer.announce(&mut WireSession::try_from(&*session)?)?;
        Ok(Self {
            producer,
            clock: assembly.session.clock,
            assembly,
            publishers,
            lanes,
            teller,
            stamps: Vec::new(),
            counts: SessionCounts::default(),
        })
    }

    /// Takes a message; the session ends if something began anew.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn take(&mut self, arrival: &Arrival) -> Result<Option<Ending>> {
        let lane = arrival.lane.0;
        if !self.assembly.knows(arrival.lane) {
            return Ok(None);
        }
        self.counts.messages += 1;
        if self.publishers.len() <= lane {
            self.publishers.resize_with(lane + 1, Publishers::default);
        }
        let of_lane = self.lanes.get(lane);
        let name = of_lane.map_or("", |lane| lane.name.as_str());
        let joint_states = of_lane.filter(|lane| lane.has_joint_states());
        let publishers = &mut self.publishers[lane];
        let were_two = publishers.are_two();
        let admission = publishers.admit(
            arrival.publisher,
            joint_states.map(|_| arrival.data.as_slice()),
            arrival.sequence,
            arrival.host_ns,
        );
        match admission {
            Admission::Restarted => {
                return Ok(Some(Ending::Restart(format!(
                    "{name}: another publisher has taken the place of the one before, or the counter of its messages has begun anew"
                ))));
            }
            Admission::Refused(Refused::TwoPublishers) => {
                self.counts.of_two_publishers += 1;
                self.teller.fault(
                    &format!("two {name}"),
                    &format!(
                        "{name}: expected one publisher, found two: none of their messages is used"
                    ),
                );
                return Ok(None);
            }
            Admission::Refused(Refused::Repeated) => {
                self.counts.repeated += 1;
                return Ok(None);
            }
            Admission::Used { lost } => {
                if were_two {
                    let text = format!("{name}: one publisher again");
                    self.teller.over(&format!("two {name}"), &text);
                }
                let lost = lost + arrival.missed;
                if lost > 0 {
                    self.teller.fault(
                        &format!("lost {name}"),
                        &format!("{name}: {lost} messages lost"),
                    );
                }
                self.lose(lost);
            }
        }
        self.send(arrival)
    }

    /// Sequence numbers that never come tell the monitor of a loss.
    fn lose(&mut self, lost: u64) {
        self.counts.lost += lost;
        for _ in 0..lost.min(MOST_SKIPPED) {
            self.producer.samples().skip();
        }
    }

    fn send(&mut self, arrival: &Arrival) -> Result<Option<Ending>> {
        let Self {
            producer,
            assembly,
            stamps,
            counts,
            clock,
            ..
        } = self;
        let (mut ending, mut result) = (None, Ok(()));
        let refusals = assembly.take(arrival, &mut |sensor, stamp_ns, values| {
            if ending.is_some() || result.is_err() {
                return;
            }
            ending = began_anew(stamps, *clock, sensor, stamp_ns, arrival.host_ns);
            if ending.is_some() {
                return;
            }
            let sample = Sample::new(sensor, stamp_ns, values);
            result = WireSample::new(&sample, 0).and_then(|mut wire| producer.send(&mut wire));
            counts.sent += 1;
        });
        result?;
        let refused = refusals.map_or(0, |r| u64::from(r.undecodable + r.unstamped));
        if refused > 0 {
            counts.undecodable += 1;
            let name = self.lanes.get(arrival.lane.0);
            let name = name.map_or("", |lane| lane.name.as_str());
            self.teller.fault(
                &format!("undecodable {name}"),
                &format!("{name}: a message cannot be decoded or has no usable stamp: left out"),
            );
            self.lose(1);
        }
        Ok(ending)
    }

    /// Connects new readers and checks the buses; to be called from time to time.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn maintain(&self) -> Result<Option<Ending>> {
        self.producer.update_connections()?;
        match self.assembly.check_can() {
            Ok(()) => Ok(None),
            Err(error) => Ok(Some(Ending::Restart(format!("{error:#}")))),
        }
    }

    /// Returns the number of samples that the slowest reader lags behind, in a session that wants progress; `None` if there is no
    /// reader, or one has not reported yet.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn backlog(&mut self) -> Result<Option<u64>> {
        let backlog = self.producer.backlog()?;
        Ok(backlog.filter(|_| self.producer.readers() > 0))
    }

    /// Ends the session.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn end(mut self) -> Result<SessionCounts> {
        self.producer.send(&mut WireSample::end())?;
        Ok(self.counts)
    }
}

/// Takes a stamp of a sensor, and returns the end of the session if the sensor's clock was set or its log begins again.
fn began_anew(
    stamps: &mut Vec<(Sensor, i64, StepWatch)>,
    clock: StampClock,
    sensor: Sensor,
    stamp_ns: i64,
    host_ns: i64,
) -> Option<Ending> {
    let place = stamps.iter().position(|(of, ..)| *of == sensor);
    let place = place.unwrap_or_else(|| {
        stamps.push((sensor, stamp_ns, StepWatch::default()));
        stamps.len() - 1
    });
    let (_, latest, watch) = &mut stamps[place];
    let back_ns = latest.saturating_sub(stamp_ns).max(0);
    *latest = stamp_ns.max(*latest);
    if back_ns > BACK_NS {
        let back_s = back_ns as f64 * 1e-9;
        return Some(Ending::Restart(format!(
            "{sensor:?}: stamps go back by {back_s:.1} s"
        )));
    }
    let moved_ns = clock.measured_ns(stamp_ns, 1.0).saturating_sub(host_ns);
    if moved_ns.unsigned_abs() > MOVED_NS.unsigned_abs() {
        let moved_s = moved_ns as f64 * 1e-9;
        return Some(Ending::Restart(format!(
            "{sensor:?}: stamps are {moved_s:.1} s away from where their clock stood at the start"
        )));
    }
    let step_ns = watch.take(host_ns, moved_ns.saturating_neg(), back_ns)?;
    let (step_s, way) = (step_ns.unsigned_abs() as f64 * 1e-9, step_ns < 0);
    Some(Ending::Restart(format!(
        "{sensor:?}: the clock of the stamps was set {} by {step_s:.2} s",
        if way { "forward" } else { "back" }
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    const STAMPS_AHEAD: i64 = 1_700_000_000_000 * MS;

    /// Returns the reason and the time (ms) of the end of a session whose stamps move by `stamp_moves_ms`, and the arrivals by
    /// `host_skips_ms`, 5.5 s after its begin; `None` if the session goes on.
    fn ending(stamp_moves_ms: i64, host_skips_ms: i64) -> Option<(String, i64)> {
        let clock = StampClock {
            stamp_ns: STAMPS_AHEAD,
            host_ns: 0,
        };
        let mut stamps = Vec::new();
        (0..1500).find_map(|sample| {
            let at_ms = sample * 10;
            let moved = i64::from(at_ms >= 5500);
            let stamp = STAMPS_AHEAD + (at_ms + moved * stamp_moves_ms) * MS;
            let host = (at_ms + moved * host_skips_ms) * MS;
            let sensor = if sample % 2 == 0 {
                Sensor::Imu
            } else {
                Sensor::Odometry
            };
            match began_anew(&mut stamps, clock, sensor, stamp, host)? {
                Ending::Restart(why) => Some((why, at_ms)),
                other => panic!("{other:?}"),
            }
        })
    }

    #[test]
    fn a_set_clock_of_the_stamps_ends_the_session_when_it_is_stable() {
        for (step_ms, told) in [
            (2000, "set forward by 2.00 s"),
            (100, "set forward by 0.10 s"),
            (-100, "set back by 0.10 s"),
            (-900, "set back by 0.90 s"),
        ] {
            let (why, at_ms) = ending(step_ms, 0).unwrap();
            assert!(why.contains(told), "{step_ms} ms: {why}");
            assert!((6500..9100).contains(&at_ms), "{step_ms} ms: {at_ms} ms");
        }
        let (why, at_ms) = ending(-2000, 0).unwrap();
        assert!(why.contains("go back by 2.0 s") && at_ms == 5500, "{why}");
    }

    #[test]
    fn late_messages_are_no_reason_for_a_new_session() {
        assert_eq!(ending(0, 0), None);
        assert_eq!(ending(0, 300), None);
        // a pause of the sensor
        assert_eq!(ending(3000, 3000), None);
    }
}

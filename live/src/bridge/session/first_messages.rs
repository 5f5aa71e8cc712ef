//! Collects the first messages until the machine can be bound to them.

use anyhow::{Error, anyhow};
use tipwatch_binding::{MachineFile, Urdf};

use super::assembly::Assembly;
use super::clock::Stamps;
use super::publishers::{Admission, Publishers};
use crate::bridge::input::{Arrival, Lane, Wanted};

const SECOND_NS: i64 = 1_000_000_000;
/// Time between two attempts (ns).
const AGAIN_NS: i64 = SECOND_NS / 2;
/// Most messages and bytes that are kept; the older half goes.
const MOST_MESSAGES: usize = 50_000;
const MOST_BYTES: usize = 64 << 20;

/// The first messages.
#[derive(Debug, Default)]
pub struct FirstMessages {
    messages: Vec<Arrival>,
    bytes: usize,
    /// The publishers of each lane.
    publishers: Vec<Publishers>,
    tried_ns: i64,
}

/// Error of a machine that is not bound yet: messages are missing, or do not match it.
#[derive(Debug)]
pub struct Incomplete(pub Error);

impl FirstMessages {
    /// Takes a message.
    pub fn take(&mut self, arrival: Arrival, lanes: &[Lane]) {
        let lane = arrival.lane.0;
        if self.publishers.len() <= lane {
            self.publishers.resize_with(lane + 1, Publishers::default);
        }
        let joint_states = lanes.get(lane).filter(|lane| lane.has_joint_states());
        let admission = self.publishers[lane].admit(
            arrival.publisher,
            joint_states.map(|_| arrival.data.as_slice()),
            arrival.sequence,
            arrival.host_ns,
        );
        match admission {
            Admission::Refused(_) => return,
            Admission::Restarted => self.forget(),
            Admission::Used { .. } => {}
        }
        if self.messages.len() >= MOST_MESSAGES || self.bytes >= MOST_BYTES {
            self.messages.drain(..self.messages.len() / 2);
            self.bytes = self.messages.iter().map(|m| m.data.len()).sum();
        }
        self.bytes += arrival.data.len();
        self.messages.push(arrival);
    }

    fn forget(&mut self) {
        self.messages.clear();
        self.bytes = 0;
    }

    /// Whether it is time to try to bind: when messages have come for a second, or two if sensors are to be found by
    /// their types, and then twice a second.
    #[must_use]
    pub fn is_due(&self, wanted: &Wanted, now_ns: i64) -> bool {
        let settle_ns = match wanted.kinds.is_empty() {
            true => SECOND_NS,
            false => 2 * SECOND_NS,
        };
        // by their arrivals: after a stall many come at once, and tell nothing about the speed of their clock
        let arrivals = self.messages.first().zip(self.messages.last());
        let span_ns = arrivals.map(|(first, last)| last.host_ns.saturating_sub(first.host_ns));
        span_ns.is_some_and(|span_ns| span_ns >= settle_ns)
            && now_ns.saturating_sub(self.tried_ns) >= AGAIN_NS
    }

    /// Tries to bind the machine to the messages.
    ///
    /// # Errors
    /// Something is still missing, or does not match the machine.
    pub fn bind(
        &mut self,
        file: &MachineFile,
        urdf: &Urdf,
        lanes: &[Lane],
        stamps: Stamps,
        unix_ahead_ns: i64,
        now_ns: i64,
    ) -> Result<Assembly, Incomplete> {
        self.tried_ns = now_ns;
        let bound = Assembly::of(file, urdf, lanes, &self.messages, stamps, unix_ahead_ns);
        bound.map_err(|error| {
            let two: Vec<&str> = lanes
                .iter()
                .zip(&self.publishers)
                .filter(|(_, publishers)| publishers.are_two())
                .map(|(lane, _)| lane.name.as_str())
                .collect();
            Incomplete(match two.is_empty() {
                true => error,
                false => anyhow!(
                    "{error:#}; expected one publisher of {}, found two, so none is used",
                    two.join(", ")
                ),
            })
        })
    }

    /// The publishers of each lane.
    #[must_use]
    pub fn into_publishers(self) -> Vec<Publishers> {
        self.publishers
    }
}

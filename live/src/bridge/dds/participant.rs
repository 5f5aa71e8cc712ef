//! The part that this program takes in a DDS domain, and its writers.

use std::net::IpAddr;

use anyhow::{Result, anyhow, bail};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Duration, QosPolicies, QosPolicyBuilder,
    Timestamp, Topic, TopicKind,
};

use super::names::{dds_topic, dds_type};
use super::payload::{AsBytes, Payload};

/// Longest time that a reader may hold up a reliable writer (ms).
const HELD_UP_MS: i32 = 10;

/// A participant of a DDS domain.
#[derive(Clone)]
pub struct Participant {
    pub(super) participant: DomainParticipant,
}

impl std::fmt::Debug for Participant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Participant").finish_non_exhaustive()
    }
}

/// Writes messages that are encoded already.
pub struct RawWriter {
    writer: rustdds::no_key::DataWriter<Payload, AsBytes>,
    name: String,
}

impl std::fmt::Debug for RawWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RawWriter")
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

impl Participant {
    /// Joins a domain: `ROS_DOMAIN_ID` of the other side. With addresses of this computer, only their networks are used.
    ///
    /// # Errors
    /// The network cannot be used.
    pub fn join(domain: u16, addresses: &[IpAddr]) -> Result<Self> {
        let mut builder = DomainParticipantBuilder::new(domain);
        if !addresses.is_empty() {
            builder = builder.with_only_networks(addresses.iter().copied());
        }
        let participant = builder.build().map_err(|error| {
            anyhow!("DDS domain {domain}: expected a network to join on, found: {error}")
        })?;
        Ok(Self { participant })
    }

    /// A writer of a topic of ROS 2.
    ///
    /// # Errors
    /// The topic cannot be created.
    pub fn writer(&self, name: &str, type_name: &str, depth: i32) -> Result<RawWriter> {
        let offered = QosPolicyBuilder::new()
            .reliability(Reliability::Reliable {
                max_blocking_time: Duration::from_millis(HELD_UP_MS.into()),
            })
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth })
            .build();
        let failed =
            |error: &dyn std::fmt::Display| anyhow!("{name}: cannot be published: {error}");
        let topic = self.topic(name, type_name, &offered)?;
        let publisher = self.participant.create_publisher(&offered);
        let writer = publisher
            .map_err(|error| failed(&error))?
            .create_datawriter_no_key::<Payload, AsBytes>(&topic, Some(offered))
            .map_err(|error| failed(&error))?;
        Ok(RawWriter {
            writer,
            name: name.into(),
        })
    }

    pub(super) fn topic(&self, name: &str, type_name: &str, qos: &QosPolicies) -> Result<Topic> {
        let topic = self.participant.create_topic(
            dds_topic(name),
            dds_type(type_name),
            qos,
            TopicKind::NoKey,
        );
        topic.map_err(|error| anyhow!("{name}: cannot be a topic of DDS: {error}"))
    }
}

impl RawWriter {
    /// Writes a message: CDR, little endian, with its encapsulation.
    ///
    /// # Errors
    /// The message is encoded otherwise, or the network fails.
    pub fn write(&self, message: &[u8]) -> Result<()> {
        if !matches!(message, [0, 1, ..]) {
            bail!(
                "{}: expected a message in CDR, little endian, found one that begins with {:02x?}",
                self.name,
                message.get(..4).unwrap_or(message)
            );
        }
        let written = self
            .writer
            .write(Payload(message.to_vec()), Some(Timestamp::now()));
        written.map_err(|error| anyhow!("{}: cannot be sent: {error}", self.name))
    }
}

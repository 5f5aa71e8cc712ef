//! What reading a log finds out about a sensor.

use crate::{
    clock::{ClockFinding, Placement, StampCorrection, StampDecision, TimeBase, TopicStatistics},
    message::TopicId,
};

/// What reading a log found out about one sensor, besides its samples.
#[derive(Debug, Clone)]
pub struct SensorReading {
    /// Its topic.
    pub topic: TopicId,
    /// The time source, and why it was chosen.
    pub clock: StampDecision,
    /// How the stamps were mapped to the clock of the log.
    pub correction: StampCorrection,
    /// Findings about the clocks.
    pub findings: Vec<ClockFinding>,
    /// The common clock of all sensors of the log.
    pub time_base: TimeBase,
    /// Where samples of blocks lie on that clock: those that it does not place are to be omitted. Those of columns are placed.
    pub placement: Placement,
    /// Rates, gaps and offsets of the stamps.
    pub statistics: TopicStatistics,
    /// Samples of the blocks, or of the columns.
    pub samples: usize,
    /// Samples among them without a usable stamp; those omitted already, if the samples are placed.
    pub unstamped: u64,
    /// Messages that could not be decoded.
    pub undecodable: u64,
    /// Messages without any number of the sample, of which there is none.
    pub without_value: u64,
}

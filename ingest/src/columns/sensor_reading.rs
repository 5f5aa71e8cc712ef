//! Results of reading a log for a sensor.

use crate::{
    clock::{
        ClockFinding, Placement, StampCorrection, StampDecision, TimeBase, TopicStatistics,
        Treatment,
    },
    message::TopicId,
};

/// Result of reading a log for one sensor, besides its samples.
#[derive(Debug, Clone)]
pub struct SensorReading {
    /// Its topic.
    pub topic: TopicId,
    /// The time source, and why it was chosen.
    pub clock: StampDecision,
    /// Correction that maps the stamps to the clock of the log.
    pub correction: StampCorrection,
    /// Findings about the clocks.
    pub findings: Vec<ClockFinding>,
    /// The common clock of all sensors of the log.
    pub time_base: TimeBase,
    /// Placement of the samples of blocks on that clock: samples that it does not place are to be omitted. Samples of columns are
    /// placed already.
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

impl SensorReading {
    /// Returns the finding for which the samples cannot be put on the clock of the log, if there is one.
    #[must_use]
    pub fn refusal(&self) -> Option<&ClockFinding> {
        let is_refusal = |finding: &&ClockFinding| finding.treatment == Treatment::Refused;
        self.findings.iter().find(is_refusal)
    }
}

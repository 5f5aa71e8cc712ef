//! All samples of a log's sensors, each sensor a set of columns.

use crate::{
    clock::{ClockFinding, StampCorrection, StampDecision, TimeBase, TopicStatistics, Treatment},
    decode::NumberSample,
    message::{SensorKind, TopicId},
};

/// A sensor whose samples are wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorRequest {
    /// Its topic.
    pub topic: TopicId,
    /// What it measures.
    pub kind: SensorKind,
    /// For joint states the joints wanted, in order.
    pub joint_names: Vec<String>,
    /// The numbers that make up a sample, where the messages are not of the usual type.
    pub numbers: Option<NumberSample>,
    /// Parts of a sample that come on topics of their own; what `numbers` leaves absent.
    pub other_parts: Vec<(TopicId, NumberSample)>,
}

/// All samples of one sensor, in the order in which the file has them.
#[derive(Debug, Clone)]
pub struct SensorRecording {
    /// Its topic.
    pub topic: TopicId,
    /// Which of the stamps is used, and why.
    pub clock: StampDecision,
    /// What was done to the stamps to put them on the clock of the log.
    pub correction: StampCorrection,
    /// What is odd about the clocks.
    pub findings: Vec<ClockFinding>,
    /// The clock that all sensors of the log are on.
    pub time_base: TimeBase,
    /// When each sample was measured, by the clock of the log.
    pub stamps_ns: Vec<i64>,
    /// When the recorder received each sample.
    pub log_times_ns: Vec<i64>,
    /// The values, sample after sample: see [`SensorSample`](crate::SensorSample).
    pub values: Vec<f64>,
    /// How many values a sample has.
    pub width: usize,
    /// Rates, gaps and offsets of the stamps.
    pub statistics: TopicStatistics,
    /// Messages that could not be decoded.
    pub undecodable: u64,
    /// Messages without a stamp of that clock: left out.
    pub unstamped: u64,
    /// Messages that have none of the numbers that make up a sample: left out.
    pub without_value: u64,
    /// Place of each sample among all samples of all sensors in the file.
    pub(crate) order: Vec<u32>,
}

/// Which sample of which recording arrived when: pairs of indices, sorted by log time, in file order
/// where log times are equal. Of samples from one message that of the first recording is the last, because
/// rows are at its samples and should know what came with them.
pub fn arrival_order(recordings: &[&SensorRecording]) -> Vec<(usize, usize)> {
    let indices = |(recording, of): (usize, &&SensorRecording)| {
        (0..of.stamps_ns.len()).map(move |i| (recording, i))
    };
    let mut order: Vec<(usize, usize)> = recordings.iter().enumerate().flat_map(indices).collect();
    order.sort_by_key(|&(place, sample)| {
        let recording = &recordings[place];
        let within_message = std::cmp::Reverse(place);
        (
            recording.log_times_ns[sample],
            recording.order[sample],
            within_message,
        )
    });
    order
}

impl SensorRecording {
    /// The values of one sample.
    pub fn sample(&self, index: usize) -> &[f64] {
        &self.values[index * self.width..(index + 1) * self.width]
    }

    /// Adds to every stamp (s): what a machine file states of the topic's clock, or what was found.
    pub fn shift(&mut self, seconds: f64) {
        let shift_ns = (seconds * 1e9).round() as i64;
        for stamp in &mut self.stamps_ns {
            *stamp = stamp.saturating_add(shift_ns);
        }
    }

    /// Why the samples of this topic cannot be put on the clock of the log, if they cannot.
    pub fn refusal(&self) -> Option<&ClockFinding> {
        let is_refusal = |finding: &&ClockFinding| finding.treatment == Treatment::Refused;
        self.findings.iter().find(is_refusal)
    }
}

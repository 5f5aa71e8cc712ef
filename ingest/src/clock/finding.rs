//! What is odd about the clocks of a log, and what was done about it.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use strum::IntoStaticStr;

/// Something about the clocks of a log that a reader has to know.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ClockFinding {
    /// What kind of thing.
    pub kind: ClockFindingKind,
    /// Whether it was dealt with.
    pub treatment: Treatment,
    /// What was seen, as a part of a sentence.
    pub seen: String,
    /// What was done about it, or why nothing could be, as a part of a sentence.
    pub done: String,
}

/// Kinds of [`ClockFinding`]s.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema, IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[non_exhaustive]
pub enum ClockFindingKind {
    /// Stamps count from the start of a simulation, or of the machine.
    SimulationTime,
    /// The log was recorded from a replay, or rewritten: its log times are of another day or pace.
    ReplayedLog,
    /// Messages without a stamp, or with zero.
    ZeroStamps,
    /// The header has no stamp that can be used: publish or log time stands in.
    NoHeaderStamp,
    /// The clock of a topic started again: a restart, or a replay in a loop.
    ClockRestart,
    /// Single messages with an earlier stamp than the one before.
    DisorderedStamps,
    /// Messages with the stamp of the one before.
    RepeatedStamps,
    /// The stamps of a topic are of another epoch than those of the others.
    OtherEpoch,
    /// The clock of a topic is apart from that of the others, in the same epoch.
    ClockApart,
    /// The clock of a topic is faster or slower than that of the others.
    ClockDrift,
    /// Stamps that are neither dates nor counted from a start.
    ImpossibleStamps,
}

/// Whether a finding was dealt with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Treatment {
    /// The stamps that are used are sound.
    Handled,
    /// The samples cannot be used.
    Refused,
    /// Nothing was done; the reader has to judge.
    Reported,
}

impl ClockFindingKind {
    /// Its name, as in JSON.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

impl ClockFinding {
    pub(super) fn handled(kind: ClockFindingKind, seen: String, done: impl Into<String>) -> Self {
        Self::new(kind, Treatment::Handled, seen, done.into())
    }

    pub(super) fn refused(kind: ClockFindingKind, seen: String, done: impl Into<String>) -> Self {
        Self::new(kind, Treatment::Refused, seen, done.into())
    }

    pub(super) fn reported(kind: ClockFindingKind, seen: String, done: impl Into<String>) -> Self {
        Self::new(kind, Treatment::Reported, seen, done.into())
    }

    fn new(kind: ClockFindingKind, treatment: Treatment, seen: String, done: String) -> Self {
        Self {
            kind,
            treatment,
            seen,
            done,
        }
    }
}

impl fmt::Display for ClockFinding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}; {}", self.seen, self.done)
    }
}

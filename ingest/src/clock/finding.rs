//! Findings about the clocks of a log, and how they were treated.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;
use strum::IntoStaticStr;

/// A finding about the clocks of a log that a reader should know.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ClockFinding {
    /// The kind of finding.
    pub kind: ClockFindingKind,
    /// How it was treated.
    pub treatment: Treatment,
    /// What was found, as part of a sentence.
    pub seen: String,
    /// What was done about it, or why nothing could be done, as part of a sentence.
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
    /// Stamps count from the start of a simulation or of the machine.
    SimulationTime,
    /// The log was recorded from a replay, or rewritten: its log times are of another day or rate.
    ReplayedLog,
    /// Messages with a missing or zero stamp.
    ZeroStamps,
    /// The header has no usable stamp: publish or log time is used instead.
    NoHeaderStamp,
    /// The clock of a topic restarted, or a replay looped.
    ClockRestart,
    /// The clock of the recorder stepped back, wrapped around or was set: the log times jump.
    LogTimeJump,
    /// The stamps of a topic step while its messages keep coming: its clock was corrected.
    StampStep,
    /// Single messages with a stamp ahead of those before and after them.
    StrayStamps,
    /// Single messages with an earlier stamp than the previous one.
    DisorderedStamps,
    /// Messages that repeat the previous stamp.
    RepeatedStamps,
    /// The stamps of a topic have another epoch than those of the others.
    OtherEpoch,
    /// The clock of a topic has an offset to that of the others, in the same epoch.
    ClockApart,
    /// The clock of a topic drifts against that of the others.
    ClockDrift,
    /// Stamps that are neither dates nor counted from a start.
    ImpossibleStamps,
}

/// How a finding was treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Treatment {
    /// The stamps used are valid.
    Handled,
    /// The samples cannot be used.
    Refused,
    /// Nothing was done; the reader must judge.
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

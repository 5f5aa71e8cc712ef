//! The result of a commissioning: an answer to every question.

use std::collections::BTreeMap;
use std::fmt;

tipwatch_mechanics::named! {
    /// How a question ends.
    #[derive(strum::EnumString)]
    pub enum Status {
        /// The signals show that it is as the machine file says, and exclude the alternatives.
        Proven,
        /// A person confirmed it; the signals do not show it.
        Confirmed,
        /// It is not as the machine file says.
        Contradicted,
        /// The recording does not show it.
        NotShown,
    }
}

impl Status {
    /// The status as words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Proven => "proven",
            Self::Confirmed => "confirmed by a person",
            Self::Contradicted => "CONTRADICTED",
            Self::NotShown => "not shown",
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.into())
    }
}

/// One question and its answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Stable name, like `joint.lift.sign`.
    pub key: String,
    /// The signal.
    pub signal: String,
    /// The property of it.
    pub property: String,
    /// The answer.
    pub status: Status,
    /// The compared figure with its standard deviation and the expected value, where there is one.
    pub figure: Option<Figure>,
    /// Number of standard deviations by which the nearest alternative is excluded; only where proven.
    pub sigmas: Option<f64>,
    /// Least and greatest position at which a proven or confirmed joint was (rad or m). The signal is right between them, and may
    /// be wrong beyond.
    pub range: Option<[f64; 2]>,
    /// Least and greatest position of the joint in the recording (rad or m), of an item that states `range`.
    pub recorded: Option<[f64; 2]>,
    /// Evidence, likely correction, or the motion that is missing.
    pub text: String,
    /// The motion that shows it.
    pub motion: String,
    /// Question by which a person can confirm the property instead; `None` if there is none.
    pub asks: Option<String>,
}

/// A figure beside what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    /// Found.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Expected.
    pub expected: f64,
}

/// A motion that was recognised.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name of the motion, like "drive forward" or "move lift".
    pub what: String,
    /// Beginning and end (s after the first sample).
    pub span_s: [f64; 2],
}

/// Answers of people (`true`: confirmed), by the key of the item.
pub type Answers = BTreeMap<String, bool>;

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// All items.
    pub items: Vec<Item>,
    /// Motions recognised in the recording.
    pub steps: Vec<Step>,
    /// The faults that would explain all contradictions, as sentences; several where either could be.
    pub explanations: Vec<String>,
    /// Length of the recording (s).
    pub duration_s: f64,
}

impl Assessment {
    /// Number of items with this status.
    #[must_use]
    pub fn count(&self, status: Status) -> usize {
        self.items
            .iter()
            .filter(|item| item.status == status)
            .count()
    }

    /// Whether there are items, and all of them are proven or confirmed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        let is_good = |item: &Item| matches!(item.status, Status::Proven | Status::Confirmed);
        !self.items.is_empty() && self.items.iter().all(is_good)
    }
}

//! A question.

/// A question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// The key of the sheet that the answer becomes, such as `axles.0.load`.
    pub key: String,
    /// The question.
    pub text: String,
    /// Whether an answer must be given: an empty one does not count.
    pub is_required: bool,
    /// Key of the question without whose answer this one is not asked.
    pub after: Option<String>,
    /// Type of the answer.
    pub(super) kind: Kind,
}

/// Type of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number, perhaps with its unit.
    Number,
    /// Two numbers.
    Range,
    Text,
}

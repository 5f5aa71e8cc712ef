//! A question.

/// A question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// The key of the sheet that the answer becomes, such as `axles.0.load`.
    pub key: String,
    /// The question.
    pub text: String,
    /// Whether an empty answer is none.
    pub is_required: bool,
    /// The key without whose answer it is not asked.
    pub after: Option<String>,
    /// What an answer is.
    pub(super) kind: Kind,
}

/// What an answer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A number, perhaps with its unit.
    Number,
    /// Two numbers.
    Range,
    Text,
}

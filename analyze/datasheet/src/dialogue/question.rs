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

pub(super) fn ask(list: &mut Vec<Question>, key: impl Into<String>, text: &str, is_required: bool) {
    list.push(Question {
        key: key.into(),
        text: text.into(),
        is_required,
        after: None,
        kind: Kind::Number,
    });
}

/// A question that is asked if another one was answered; its own answer is then needed, or not.
pub(super) fn ask_after(
    list: &mut Vec<Question>,
    after: impl Into<String>,
    key: impl Into<String>,
    text: &str,
    is_required: bool,
) {
    ask(list, key, text, is_required);
    if let Some(question) = list.last_mut() {
        question.after = Some(after.into());
    }
}

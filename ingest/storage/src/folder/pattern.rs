//! Patterns of names: `*` and `?` within a name, `**` over folders, `[ab]`.

use glob::{MatchOptions, Pattern};

use crate::error::{Error, ErrorKind};

const OPTIONS: MatchOptions = MatchOptions {
    case_sensitive: true,
    require_literal_separator: true,
    require_literal_leading_dot: false,
};

/// Whether a text has wildcards.
pub(crate) fn has_wildcard(text: &str) -> bool {
    text.contains(['*', '?', '['])
}

/// The folder before the first part with a wildcard, and the rest.
pub(crate) fn split(text: &str) -> (&str, &str) {
    let first = text.find(['*', '?', '[']).unwrap_or(text.len());
    match text.get(..first).and_then(|before| before.rfind('/')) {
        Some(at) => (&text[..at], &text[at + 1..]),
        None => ("", text),
    }
}

/// A pattern of keys.
pub(crate) struct Keys(Pattern);

impl Keys {
    pub(crate) fn new(place: &str, text: &str) -> Result<Self, Error> {
        let wrong = |error: glob::PatternError| {
            let detail = format!("expected a pattern, found \"{text}\": {error}");
            Error::new(place, ErrorKind::NotAPlace, detail)
        };
        Pattern::new(text).map(Self).map_err(wrong)
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.0.matches_with(key, OPTIONS)
    }
}

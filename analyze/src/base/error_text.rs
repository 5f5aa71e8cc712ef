//! Errors as text.

use std::path::{MAIN_SEPARATOR, Path};

use tipwatch_storage::redact;

/// Returns an error with its causes, without the secrets in URLs. A cause that the message above it already ends with is not
/// repeated.
#[must_use]
pub fn error_text(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.ends_with(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    // a URL may come from a manifest or a machine file, too
    redact(&text)
}

/// A reason without the paths of the log, its files and its folder, so that the same reason of many logs
/// reads the same.
pub(crate) fn without_path(reason: &str, log: &Path) -> String {
    let mut text = reason.to_owned();
    let absolute = std::path::absolute(log).unwrap_or_else(|_| log.into());
    for path in [&absolute, log] {
        let path = path.display().to_string();
        if path.is_empty() {
            continue;
        }
        text = text.replace(&format!("{path}: "), "");
        text = text.replace(&format!("{path}{MAIN_SEPARATOR}"), "");
        text = text.replace(&path, "the log");
    }
    text
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn each_cause_is_given_once() {
        let error = anyhow!("no such file").context("log.mcap: cannot be read: no such file");
        assert_eq!(error_text(&error), "log.mcap: cannot be read: no such file");
        let error = anyhow!("no such file").context("log.mcap: cannot be read");
        assert_eq!(error_text(&error), "log.mcap: cannot be read: no such file");
    }

    #[test]
    fn a_reason_has_no_path_of_the_log() {
        let log = Path::new("/logs/a.mcap");
        assert_eq!(
            without_path("/logs/a.mcap: not a log: found \"x\"", log),
            "not a log: found \"x\""
        );
        assert_eq!(
            without_path("/logs/a.mcap/part.db3: cut; see /logs/a.mcap", log),
            "part.db3: cut; see the log"
        );
    }
}

//! Errors as text.

/// An error with its causes. A cause that the message above it already ends with is not repeated.
pub(crate) fn error_text(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.ends_with(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
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
}

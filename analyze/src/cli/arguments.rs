//! The arguments of the program, with places named as messages show them.

use std::ffi::OsString;

use tipwatch_storage::{Location, redact};

/// Arguments without what is secret in URLs: the program finds the places again by what remains. `file://` becomes a
/// path.
pub fn arguments(given: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    given.into_iter().map(argument).collect()
}

fn argument(given: OsString) -> OsString {
    let Some(text) = given.to_str().filter(|text| text.contains("://")) else {
        return given;
    };
    // --option=URL
    let (option, value) = match text.split_once('=') {
        Some((option, value)) if option.starts_with("--") => (format!("{option}="), value),
        _ => (String::new(), text),
    };
    // What is no place is refused where it is used.
    let named = match Location::parse(value) {
        Ok(place) => place.path().display().to_string(),
        Err(_) => redact(value),
    };
    format!("{option}{named}").into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_have_no_secrets() {
        let given = [
            "tipwatch",
            "https://host/a.mcap?sig=abc",
            "--out=s3://b/x",
            "--machine=file:///tmp/m%20.toml",
            "ftp://me:secret@host/x?y=1",
            "s3://logs/2026-??/*.mcap",
            "plain/log.mcap",
        ];
        let shown = arguments(given.map(OsString::from));
        let expected = [
            "tipwatch",
            "https://host/a.mcap",
            "--out=s3://b/x",
            "--machine=/tmp/m .toml",
            "ftp://[redacted]@host/x?[redacted]",
            "s3://logs/2026-??/*.mcap",
            "plain/log.mcap",
        ];
        assert_eq!(shown, expected.map(OsString::from));
    }
}

//! The arguments of a program, with places named as messages show them.

use std::ffi::OsString;

use crate::place::Location;
use crate::redact::{redact, redact_one};

/// The arguments of this process without what is secret in URLs: the program finds the places again by what remains.
/// `file://` becomes a path.
///
/// No other function of the programs reads the arguments (a test sees to it): no message or record can repeat what it
/// never had.
pub fn arguments() -> Vec<OsString> {
    without_secrets(std::env::args_os())
}

/// Removes secrets from arguments that do not come from the operating system.
pub fn without_secrets(given: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    given.into_iter().map(argument).collect()
}

/// The arguments of this process for a record: commands to be run in turn (`curl https://…`), too, are without
/// secrets.
pub fn recorded_arguments() -> Vec<String> {
    let arguments = arguments().into_iter();
    arguments
        .map(|argument| redact(&argument.to_string_lossy()))
        .collect()
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
        Err(_) => redact_one(value),
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
            "curl https://me:pw@host/alarm",
        ];
        let shown = without_secrets(given.map(OsString::from));
        let expected = [
            "tipwatch",
            "https://host/a.mcap",
            "--out=s3://b/x",
            "--machine=/tmp/m .toml",
            "ftp://[redacted]@host/x?[redacted]",
            "s3://logs/2026-??/*.mcap",
            "plain/log.mcap",
            // a command that is to be run as it stands
            "curl https://me:pw@host/alarm",
        ];
        assert_eq!(shown, expected.map(OsString::from));
    }
}

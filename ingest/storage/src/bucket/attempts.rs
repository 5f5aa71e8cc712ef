//! Repeats a request that failed for a reason that may pass.

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use object_store::Error as StoreError;
use object_store::client::{HttpError, HttpErrorKind};

use crate::counted::{Counts, counted};
use crate::error::{Error, ErrorKind};
use crate::place::Access;
use crate::redact::redact;

const LONGEST_WAIT: Duration = Duration::from_secs(20);
/// Longest part of a server's own words in a message.
const MOST_WORDS: usize = 300;

/// Why one attempt failed.
pub(crate) enum Failure {
    Store(StoreError),
    /// Fewer bytes, or others, than asked for.
    Incomplete(String),
    Other(Error),
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

/// An error and the number of attempts that were made.
pub(crate) struct Failed {
    pub(crate) error: Error,
    pub(crate) attempts: u32,
}

/// Makes a request until it succeeds, fails for good, or all attempts are used.
pub(crate) async fn attempt<T, F>(
    place: &str,
    access: &Access,
    counts: &Arc<Counts>,
    mut request: impl FnMut() -> F,
) -> Result<T, Failed>
where
    F: Future<Output = Result<T, Failure>>,
{
    let mut wait = access.first_wait;
    let mut attempts = 1;
    loop {
        // twice: a request that sends no bytes is stopped by the client's own limit
        let limit = access.timeout.saturating_mul(2);
        let (outcome, status) = counted(counts, tokio::time::timeout(limit, request())).await;
        let error = match outcome {
            Ok(Ok(value)) => return Ok(value),
            Ok(Err(failure)) => typed(place, access, failure, status),
            Err(_) => Error::timed_out(place, limit),
        };
        let may_pass = matches!(
            error.kind,
            ErrorKind::TimedOut | ErrorKind::Unavailable | ErrorKind::Incomplete
        );
        if !may_pass || attempts >= access.attempts {
            let detail = match attempts {
                1 => error.detail,
                _ => format!(
                    "{} (attempt {attempts} of {})",
                    error.detail, access.attempts
                ),
            };
            let error = Error { detail, ..error };
            return Err(Failed { error, attempts });
        }
        tokio::time::sleep(wait.min(LONGEST_WAIT)).await;
        wait = wait.saturating_mul(2);
        attempts += 1;
    }
}

fn typed(place: &str, access: &Access, failure: Failure, status: Option<u16>) -> Error {
    let error = match failure {
        Failure::Other(error) => return error,
        Failure::Incomplete(found) => return Error::new(place, ErrorKind::Incomplete, found),
        Failure::Store(error) => error,
    };
    let said = || told(&error, status);
    let kind = match (&error, status) {
        (StoreError::NotFound { .. }, _) => ErrorKind::NotFound,
        (StoreError::PermissionDenied { .. } | StoreError::Unauthenticated { .. }, _) => {
            ErrorKind::PermissionDenied
        }
        (StoreError::Precondition { .. }, _) => ErrorKind::Changed,
        // a web server that was asked for a part and sent the whole
        (StoreError::NotSupported { .. }, Some(200)) => return no_ranges(place),
        (StoreError::NotImplemented { .. } | StoreError::NotSupported { .. }, _) => {
            ErrorKind::Unsupported
        }
        (StoreError::InvalidPath { .. }, _) => ErrorKind::NotAPlace,
        (_, Some(401 | 403)) => ErrorKind::PermissionDenied,
        (_, Some(404)) => ErrorKind::NotFound,
        (_, Some(408 | 429 | 500..)) => ErrorKind::Unavailable,
        _ => match transport(&error) {
            Some(HttpErrorKind::Timeout) => return Error::timed_out(place, access.timeout),
            Some(
                HttpErrorKind::Connect
                | HttpErrorKind::Request
                | HttpErrorKind::Interrupted
                | HttpErrorKind::Unknown,
            ) => ErrorKind::Unavailable,
            Some(_) => ErrorKind::Incomplete,
            None if error.to_string().contains("non-partial response") => return no_ranges(place),
            None if error.to_string().contains("Requested ") => ErrorKind::Incomplete,
            None => ErrorKind::Refused,
        },
    };
    Error::new(place, kind, said())
}

fn no_ranges(place: &str) -> Error {
    let detail = "the server sends whole files only (--fetch-whole)";
    Error::new(place, ErrorKind::NoRanges, detail)
}

/// The failure of a connection that is behind an error.
fn transport(error: &StoreError) -> Option<HttpErrorKind> {
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(found) = cause {
        if let Some(http) = found.downcast_ref::<HttpError>() {
            return Some(http.kind());
        }
        cause = found.source();
    }
    None
}

/// What the server said: its status and the code of its answer. The rest of an answer may repeat credentials.
fn told(error: &StoreError, status: Option<u16>) -> String {
    let text = error.to_string();
    let code = between(&text, "<Code>", "</Code>");
    let region = between(&text, "<Region>", "</Region>");
    let region = match (region, status) {
        (Some(region), _) => {
            format!("; the bucket is in the region {region}: set AWS_REGION={region}")
        }
        // S3 answers so to a request in a wrong region, and may not name the right one
        (None, Some(301)) => {
            "; the bucket is in another region: set AWS_REGION to the one of the bucket".to_owned()
        }
        _ => String::new(),
    };
    match (status, code) {
        (Some(status), Some(code)) => format!("the server answered {status} {code}{region}"),
        (Some(status), None) if status >= 300 => format!("the server answered {status}{region}"),
        _ => {
            // the innermost cause says most
            let mut cause: &(dyn std::error::Error + 'static) = error;
            while let Some(next) = cause.source() {
                cause = next;
            }
            // whole words of a secret are found in the whole text only
            redact(&cause.to_string())
                .chars()
                .take(MOST_WORDS)
                .collect()
        }
    }
}

fn between<'t>(text: &'t str, start: &str, end: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(start)?;
    let (found, _) = rest.split_once(end)?;
    let is_code = |c: char| c.is_ascii_alphanumeric() || c == '-';
    (found.len() < 64 && found.chars().all(is_code)).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(body: &str, status: u16) -> String {
        let error = StoreError::Generic {
            store: "S3",
            source: body.to_owned().into(),
        };
        told(&error, Some(status))
    }

    #[test]
    fn the_region_of_a_bucket_is_told() {
        let body = "<Error><Code>AuthorizationHeaderMalformed</Code><Message>wrong</Message>\
                    <Region>eu-central-1</Region></Error>";
        let found = said(body, 400);
        assert!(
            found.contains("400 AuthorizationHeaderMalformed"),
            "{found}"
        );
        assert!(found.contains("AWS_REGION=eu-central-1"), "{found}");
        assert!(said("redirect without a place", 301).contains("AWS_REGION"));
        let odd = said(
            "<Error><Code>AccessDenied</Code><Region>a b</Region></Error>",
            403,
        );
        assert_eq!(odd, "the server answered 403 AccessDenied");
    }
}

//! Repeats a request that failed for a reason that may pass.

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use object_store::Error as StoreError;
use object_store::client::{HttpError, HttpErrorKind};

use crate::counted::{Counts, Said, counted};
use crate::error::{Error, ErrorKind};
use crate::place::Access;
use crate::redact::redact;

const LONGEST_WAIT: Duration = Duration::from_secs(20);
/// Longest part of a server's own words in a message.
const MOST_WORDS: usize = 300;

/// Reason why one attempt failed.
pub(crate) enum Failure {
    Store(StoreError),
    /// Fewer bytes than requested, or others.
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
        let (outcome, said) = counted(counts, tokio::time::timeout(limit, request())).await;
        let error = match outcome {
            Ok(Ok(value)) => return Ok(value),
            Ok(Err(failure)) => typed(place, access, failure, &said),
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

fn typed(place: &str, access: &Access, failure: Failure, said: &Said) -> Error {
    let error = match failure {
        Failure::Other(error) => return error,
        Failure::Incomplete(found) => return Error::new(place, ErrorKind::Incomplete, found),
        Failure::Store(error) => error,
    };
    let kind = match (&error, said.status) {
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
        // S3 answers 400 to credentials that are no longer valid
        (_, Some(400)) if is_expired(said) => ErrorKind::PermissionDenied,
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
    Error::new(place, kind, told(&error, said, access))
}

fn is_expired(said: &Said) -> bool {
    let codes = ["ExpiredToken", "InvalidToken", "TokenRefreshRequired"];
    said.code
        .as_deref()
        .is_some_and(|code| codes.contains(&code))
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

/// Describes the refusal of a server: its status and code, and the region to ask in.
fn told(error: &StoreError, said: &Said, access: &Access) -> String {
    let refused = |status: u16| {
        let code = said
            .code
            .as_ref()
            .map_or(String::new(), |code| format!(" {code}"));
        format!("the server answered {status}{code}{}", region(said, access))
    };
    match said.status {
        Some(status) if status >= 300 => refused(status),
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

/// The region that requests ask in, unless another one is stated.
const DEFAULT_REGION: &str = "us-east-1";

/// Describes the error in the region of the requests, with the remedy; empty if none is known.
fn region(said: &Said, access: &Access) -> String {
    let variables = access.variables_of("AWS_");
    let value = |name: &str| {
        let mut found = variables.iter().rev();
        found
            .find(|(known, _)| known == name)
            .map(|(_, value)| value.as_str())
    };
    let asked = value("AWS_REGION").or_else(|| value("AWS_DEFAULT_REGION"));
    let asked = asked.unwrap_or(DEFAULT_REGION);
    match (&said.region, said.status) {
        // S3 names it in every refusal
        (Some(region), _) if region == asked => String::new(),
        (Some(region), _) => {
            format!(
                "; the bucket is in the region {region}, asked for in {asked}: set AWS_REGION={region}"
            )
        }
        // S3 answers so to a request in a wrong region, and may not name the right one
        (None, Some(301 | 307)) => {
            format!(
                "; the bucket is in another region than {asked}: set AWS_REGION to the one of the bucket"
            )
        }
        _ => String::new(),
    }
}

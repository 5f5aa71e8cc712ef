//! Counts requests and bytes, and notes of a task's requests what the last answer said and the keys that no request can name.

use std::future::Future;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use async_trait::async_trait;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpRequest, HttpResponse, HttpService, ReqwestConnector,
};
use object_store::{ClientOptions, Result};

use crate::listing::without_unnameable;

/// Requests and bytes that reading or writing a place has taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Transfer {
    /// Requests sent, with those that failed.
    pub requests: u64,
    /// Bytes of content received or sent.
    pub bytes: u64,
}

impl std::ops::Add for Transfer {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            requests: self.requests.saturating_add(other.requests),
            bytes: self.bytes.saturating_add(other.bytes),
        }
    }
}

/// Answer of a server to a request, as far as errors need it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Said {
    /// `None` before an answer.
    pub(crate) status: Option<u16>,
    /// Its own code of what is wrong, as "SlowDown".
    pub(crate) code: Option<String>,
    /// The region that the bucket is in.
    pub(crate) region: Option<String>,
}

#[derive(Debug, Default)]
pub(crate) struct Counts {
    requests: AtomicU64,
    bytes: AtomicU64,
    /// The last refusal that came with a code.
    refused: Mutex<Said>,
}

impl Counts {
    pub(crate) fn transfer(&self) -> Transfer {
        Transfer {
            requests: self.requests.load(Ordering::Relaxed),
            bytes: self.bytes.load(Ordering::Relaxed),
        }
    }

    pub(crate) fn add_bytes(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }
}

/// The requests of one task.
#[derive(Debug, Default)]
struct Task {
    counts: Arc<Counts>,
    /// The last answer.
    said: Mutex<Said>,
    /// Keys that were listed and that no request can name.
    unnameable: Mutex<Vec<String>>,
}

tokio::task_local! {
    static TASK: Arc<Task>;
}

/// Runs a task and counts its requests; returns its result and what its last answer said.
pub(crate) async fn counted<T>(counts: &Arc<Counts>, task: impl Future<Output = T>) -> (T, Said) {
    let own = Arc::new(Task {
        counts: Arc::clone(counts),
        ..Task::default()
    });
    let result = TASK.scope(Arc::clone(&own), task).await;
    let said = lock(&own.said).clone();
    (result, said)
}

/// Takes the keys that the requests of this task have listed and that no request can name.
pub(crate) fn take_unnameable() -> Vec<String> {
    let taken = TASK.try_with(|task| std::mem::take(&mut *lock(&task.unnameable)));
    taken.unwrap_or_default()
}

fn lock<T>(noted: &Mutex<T>) -> MutexGuard<'_, T> {
    // every note is complete on its own
    noted.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes clients whose requests are counted.
#[derive(Debug)]
pub(crate) struct Connector;

impl HttpConnector for Connector {
    fn connect(&self, options: &ClientOptions) -> Result<HttpClient> {
        let client = ReqwestConnector::default().connect(options)?;
        Ok(HttpClient::new(Service(client)))
    }
}

#[derive(Debug)]
struct Service(HttpClient);

#[async_trait]
impl HttpService for Service {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let note = |said: Said| {
            // requests outside a counted task have nobody to report to
            let _ = TASK.try_with(|task| *lock(&task.said) = said);
        };
        let _ = TASK.try_with(|task| task.counts.requests.fetch_add(1, Ordering::Relaxed));
        note(Said::default());
        let lists = is_list(&request);
        let has_no_body = request.method() == "HEAD";
        let response = self.0.execute(request).await?;
        if response.status().is_success() {
            note(Said {
                status: Some(response.status().as_u16()),
                ..Said::default()
            });
            return match lists {
                true => nameable(response).await,
                false => Ok(response),
            };
        }
        let (said, response) = refusal(response).await?;
        note(match has_no_body {
            true => with_code(said),
            false => said,
        });
        Ok(response)
    }
}

/// Whether a request asks a bucket for a list of its objects.
fn is_list(request: &HttpRequest) -> bool {
    let parts = request.uri().query().unwrap_or_default().split('&');
    // S3 and Google, and Azure
    request.method() == "GET"
        && parts
            .into_iter()
            .any(|part| matches!(part, "list-type=2" | "comp=list"))
}

/// Reads an answer that is no success, and returns its statements with the answer itself: the client drops the headers, and the
/// body of some.
async fn refusal(response: HttpResponse) -> Result<(Said, HttpResponse), HttpError> {
    let (head, body) = response.into_parts();
    let bytes = body.bytes().await?;
    let text = String::from_utf8_lossy(&bytes);
    let header = |name: &str| head.headers.get(name)?.to_str().ok().filter(is_word);
    let code = between(&text, "<Code>", "</Code>").or_else(|| header("x-ms-error-code"));
    let region = between(&text, "<Region>", "</Region>").or_else(|| header("x-amz-bucket-region"));
    let said = Said {
        status: Some(head.status.as_u16()),
        code: code.map(ToOwned::to_owned),
        region: region.map(ToOwned::to_owned),
    };
    if said.code.is_some() {
        let _ = TASK.try_with(|task| *lock(&task.counts.refused) = said.clone());
    }
    Ok((said, HttpResponse::from_parts(head, bytes.into())))
}

/// An answer to HEAD, which says no more than its status: of the last refusal with this status the code.
fn with_code(said: Said) -> Said {
    let known = TASK.try_with(|task| lock(&task.counts.refused).clone());
    match known {
        Ok(known) if known.status == said.status => Said {
            code: said.code.or(known.code),
            region: said.region.or(known.region),
            ..said
        },
        _ => said,
    }
}

fn between<'t>(text: &'t str, start: &str, end: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(start)?;
    let (found, _) = rest.split_once(end)?;
    Some(found).filter(is_word)
}

/// Whether a text is a code ("SlowDown", "KMS.DisabledException") or a name: the rest of an answer may repeat credentials.
fn is_word(text: &&str) -> bool {
    let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.');
    (1..64).contains(&text.len()) && text.chars().all(is_of_word)
}

/// An answer without the keys that no request can name, which are noted for the task.
async fn nameable(response: HttpResponse) -> Result<HttpResponse, HttpError> {
    let (head, body) = response.into_parts();
    let bytes = body.bytes().await?;
    let body = match std::str::from_utf8(&bytes) {
        Ok(text) => {
            let (kept, unnameable) = without_unnameable(text);
            let _ = TASK.try_with(|task| lock(&task.unnameable).extend(unnameable));
            kept.into()
        }
        // the client says what is wrong with it
        Err(_) => bytes.into(),
    };
    Ok(HttpResponse::from_parts(head, body))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_a_refusal_are_told_and_credentials_are_not() {
        let code = |text: &str| between(text, "<Code>", "</Code>").map(ToOwned::to_owned);
        for known in ["SlowDown", "KMS.DisabledException", "KMS.NotFoundException"] {
            let answer = format!("<Error><Code>{known}</Code></Error>");
            assert_eq!(code(&answer).as_deref(), Some(known));
        }
        assert_eq!(code("<Code>x?Signature=abc</Code>"), None);
    }
}

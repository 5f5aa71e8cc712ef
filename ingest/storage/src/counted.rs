//! Counts requests and bytes, and notes of a task's requests the last status and the keys that no request can name.

use std::future::Future;
use std::sync::atomic::{AtomicU16, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use async_trait::async_trait;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpRequest, HttpResponse, HttpService, ReqwestConnector,
};
use object_store::{ClientOptions, Result};

use crate::listing::without_unnameable;

/// What reading or writing a place has cost.
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

#[derive(Debug, Default)]
pub(crate) struct Counts {
    requests: AtomicU64,
    bytes: AtomicU64,
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
    /// Zero before an answer.
    status: AtomicU16,
    /// Keys that were listed and that no request can name.
    unnameable: Mutex<Vec<String>>,
}

tokio::task_local! {
    static TASK: Arc<Task>;
}

/// Runs a task and counts its requests; returns its result and the status of its last answer.
pub(crate) async fn counted<T>(
    counts: &Arc<Counts>,
    task: impl Future<Output = T>,
) -> (T, Option<u16>) {
    let own = Arc::new(Task {
        counts: Arc::clone(counts),
        ..Task::default()
    });
    let result = TASK.scope(Arc::clone(&own), task).await;
    let status = own.status.load(Ordering::Relaxed);
    (result, (status != 0).then_some(status))
}

/// Takes the keys that the requests of this task have listed and that no request can name.
pub(crate) fn take_unnameable() -> Vec<String> {
    let taken = TASK.try_with(|task| std::mem::take(&mut *lock(&task.unnameable)));
    taken.unwrap_or_default()
}

fn lock(keys: &Mutex<Vec<String>>) -> std::sync::MutexGuard<'_, Vec<String>> {
    // every key is complete on its own
    keys.lock().unwrap_or_else(PoisonError::into_inner)
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
        let note = |status: u16| {
            // requests outside a counted task have nobody to report to
            let _ = TASK.try_with(|task| task.status.store(status, Ordering::Relaxed));
        };
        let _ = TASK.try_with(|task| task.counts.requests.fetch_add(1, Ordering::Relaxed));
        note(0);
        let lists = is_list(&request);
        let response = self.0.execute(request).await?;
        note(response.status().as_u16());
        match lists && response.status().is_success() {
            true => nameable(response).await,
            false => Ok(response),
        }
    }
}

/// Whether a request asks a bucket for its objects.
fn is_list(request: &HttpRequest) -> bool {
    let parts = request.uri().query().unwrap_or_default().split('&');
    // S3 and Google, and Azure
    request.method() == "GET"
        && parts
            .into_iter()
            .any(|part| matches!(part, "list-type=2" | "comp=list"))
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

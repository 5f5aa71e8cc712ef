//! Counts requests and bytes, and notes the last status of a task's requests.

use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU16, AtomicU64, Ordering};

use async_trait::async_trait;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpRequest, HttpResponse, HttpService, ReqwestConnector,
};
use object_store::{ClientOptions, Result};

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
        status: AtomicU16::new(0),
    });
    let result = TASK.scope(Arc::clone(&own), task).await;
    let status = own.status.load(Ordering::Relaxed);
    (result, (status != 0).then_some(status))
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
        let response = self.0.execute(request).await?;
        note(response.status().as_u16());
        Ok(response)
    }
}

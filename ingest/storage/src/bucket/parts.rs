//! Sends a large file in parts. The object is there only when all have arrived.

use std::io::Read;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use object_store::path::Path as Key;
use object_store::retry::{RetryContext, RetryFailure, RetryPolicy};
use object_store::{MultipartUpload, ObjectStore, PutMultipartOptions, PutPayload};
use tokio::sync::Mutex;

use crate::error::Error;
use crate::place::Access;

use super::attempts::{Failure, attempt};
use super::requests::{Bucket, one};

/// Sends a file in parts of this size.
pub(crate) async fn send(
    bucket: &Bucket,
    place: &str,
    key: &Key,
    file: &Path,
    part_bytes: usize,
) -> Result<(), Error> {
    let retries = Arc::new(PartRetries {
        attempts: bucket.access().attempts,
        first_wait: bucket.access().first_wait,
    });
    let begin = || async {
        let options = PutMultipartOptions::default().with_retry_policy(retries.clone());
        Ok(bucket.root.store.put_multipart_opts(key, options).await?)
    };
    let begun = attempt(place, bucket.access(), &bucket.counts, begin).await;
    let upload = Mutex::new(one(begun)?);
    let sent = parts(bucket, place, file, part_bytes, &upload).await;
    if sent.is_err() {
        // best effort: what was sent never becomes an object
        let _ = upload.lock().await.abort().await;
    }
    sent
}

async fn parts(
    bucket: &Bucket,
    place: &str,
    file: &Path,
    part_bytes: usize,
    upload: &Mutex<Box<dyn MultipartUpload>>,
) -> Result<(), Error> {
    let failed = |error: std::io::Error| Error::local(file.display().to_string(), &error);
    let mut source = std::fs::File::open(file).map_err(failed)?;
    loop {
        let mut part = Vec::new();
        let mut limited = (&mut source).take(part_bytes as u64);
        limited.read_to_end(&mut part).map_err(failed)?;
        if part.is_empty() {
            break;
        }
        let count = part.len() as u64;
        let part = bytes::Bytes::from(part);
        // one attempt: the policy of the upload makes the further ones
        let once = Access {
            attempts: 1,
            timeout: Duration::MAX,
            ..bucket.access().clone()
        };
        let send = || async {
            let payload = PutPayload::from_bytes(part.clone());
            let sending = upload.lock().await.put_part(payload);
            sending.await.map_err(Failure::from)
        };
        one(attempt(place, &once, &bucket.counts, send).await)?;
        bucket.counts.add_bytes(count);
    }
    let complete = || async {
        let mut upload = upload.lock().await;
        upload.complete().await.map(drop).map_err(Failure::from)
    };
    one(attempt(place, bucket.access(), &bucket.counts, complete).await)
}

/// Repeats a part as any other request.
#[derive(Debug)]
struct PartRetries {
    attempts: u32,
    first_wait: Duration,
}

#[async_trait]
impl RetryPolicy for PartRetries {
    async fn retry(&self, context: RetryContext) -> bool {
        let may_pass = match context.failure {
            RetryFailure::Status(status) => {
                status.is_server_error() || matches!(status.as_u16(), 408 | 429)
            }
            _ => true,
        };
        if !may_pass || context.attempt >= self.attempts as usize {
            return false;
        }
        let doubled = 1_u32
            .checked_shl(context.attempt as u32)
            .unwrap_or(u32::MAX);
        tokio::time::sleep(self.first_wait.saturating_mul(doubled / 2)).await;
        true
    }
}

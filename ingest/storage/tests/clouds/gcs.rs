//! As much of the XML API of Google Cloud Storage as programs of one bucket use:
//! <https://cloud.google.com/storage/docs/xml-api/reference-methods>.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::objects::{Objects, Tells, all_between, escaped, served};
use super::wire::{Reply, Request, SECRET, Service};

#[derive(Default)]
pub(crate) struct Gcs {
    pub(crate) bucket: String,
    pub(crate) objects: Objects,
    pub(crate) uploads: AtomicUsize,
}

impl Service for Gcs {
    fn answer(&self, request: &Request) -> Reply {
        if request.header("authorization") != Some(&format!("Bearer {SECRET}")) {
            return Reply::error(401, "AuthenticationRequired");
        }
        let (bucket, key) = request.path.split_once('/').unwrap_or((&request.path, ""));
        if bucket != self.bucket {
            return Reply::error(404, "NoSuchBucket");
        }
        match (request.method.as_str(), key) {
            ("GET", "") => self.list(request),
            ("GET" | "HEAD", key) => match self.objects.get(key) {
                Some(stored) => {
                    let reply = served(&stored, request, Tells::ALL);
                    reply.header("x-goog-generation", stored.generation)
                }
                None => Reply::error(404, "NoSuchKey"),
            },
            ("PUT", key) => self.put(request, key),
            ("POST", key) => self.post(request, key),
            ("DELETE", key) => match request.asks("uploadId").is_some() || self.objects.remove(key)
            {
                true => Reply::new(204),
                false => Reply::error(404, "NoSuchKey"),
            },
            _ => Reply::error(405, "MethodNotAllowed"),
        }
    }
}

impl Gcs {
    fn list(&self, request: &Request) -> Reply {
        assert_eq!(request.asks("list-type"), Some("2"));
        let prefix = request.asks("prefix").unwrap_or("");
        let after = request.asks("continuation-token");
        let page = self.objects.list(prefix, request.asks("delimiter"), after);
        let mut text = String::from("<?xml version='1.0' encoding='UTF-8'?><ListBucketResult>");
        for (key, stored) in &page.objects {
            text.push_str(&format!(
                "<Contents><Key>{}</Key><Generation>{}</Generation><LastModified>{}</LastModified><ETag>{}</ETag>\
                 <Size>{}</Size></Contents>",
                escaped(key),
                stored.generation,
                stored.modified(),
                stored.e_tag(),
                stored.bytes.len()
            ));
        }
        for folder in &page.folders {
            let folder = escaped(folder);
            text.push_str(&format!(
                "<CommonPrefixes><Prefix>{folder}</Prefix></CommonPrefixes>"
            ));
        }
        if let Some(next) = &page.next {
            let next = escaped(next);
            text.push_str(&format!(
                "<NextContinuationToken>{next}</NextContinuationToken>"
            ));
        }
        Reply::new(200).body((text + "</ListBucketResult>").as_bytes())
    }

    fn put(&self, request: &Request, key: &str) -> Reply {
        if let (Some(upload), Some(part)) = (request.asks("uploadId"), request.asks("partNumber")) {
            self.objects.put_part(upload, part, &request.body);
            return Reply::new(200).header("etag", format!("\"part{part}\""));
        }
        let must_be_new = request.header("x-goog-if-generation-match") == Some("0");
        match self.objects.put(key, &request.body, must_be_new) {
            Some(stored) => (Reply::new(200).header("etag", stored.e_tag()))
                .header("x-goog-generation", stored.generation),
            None => Reply::error(412, "PreconditionFailed"),
        }
    }

    fn post(&self, request: &Request, key: &str) -> Reply {
        if request.asks("uploads").is_some() {
            let id = self.uploads.fetch_add(1, Ordering::Relaxed);
            let text = format!(
                "<InitiateMultipartUploadResult><Bucket>b</Bucket><Key>{}</Key><UploadId>up{id}</UploadId>\
                 </InitiateMultipartUploadResult>",
                escaped(key)
            );
            return Reply::new(200).body(text.as_bytes());
        }
        let Some(upload) = request.asks("uploadId") else {
            return Reply::error(400, "InvalidArgument");
        };
        let text = String::from_utf8_lossy(&request.body).into_owned();
        let order = all_between(&text, "<PartNumber>", "</PartNumber>");
        let order: Vec<String> = order.into_iter().map(String::from).collect();
        match self.objects.join(key, upload, &order) {
            Some(stored) => {
                let text = format!(
                    "<CompleteMultipartUploadResult><Location>there</Location><Bucket>b</Bucket><Key>{}</Key>\
                     <ETag>{}</ETag></CompleteMultipartUploadResult>",
                    escaped(key),
                    stored.e_tag()
                );
                (Reply::new(200).body(text.as_bytes()))
                    .header("x-goog-generation", stored.generation)
            }
            None => Reply::error(400, "InvalidPart"),
        }
    }
}

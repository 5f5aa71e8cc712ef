//! An S3 server in the test's own process (s3s-fs), over a temporary folder, with faults on request.

#![allow(dead_code, reason = "two test programs use it, each in part")]
#![allow(
    clippy::unwrap_used,
    reason = "a server that cannot run fails the test"
)]

use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::{Bytes, BytesMut};
use http_body_util::{BodyExt, Full};
use hyper::body::Incoming;
use hyper::service::service_fn;
use hyper::{Request, Response};
use hyper_util::rt::TokioIo;
use s3s::auth::SimpleAuth;
use s3s::service::{S3Service, S3ServiceBuilder};
use s3s_fs::FileSystem;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::runtime::Runtime;

/// The credentials that the server knows.
pub(crate) const KEY: &str = "fleet";
pub(crate) const SECRET: &str = "do-not-show-this";

/// A request that came.
#[derive(Debug, Clone)]
pub(crate) struct Seen {
    pub(crate) method: String,
    /// Path and query.
    pub(crate) path: String,
    pub(crate) range: Option<String>,
}

/// Fault that the server shows instead of its normal behaviour.
#[derive(Debug, Clone)]
pub(crate) enum Fault {
    /// Answers with this status.
    Status(u16),
    /// Answers with this status, this code in the body, and this region in a header.
    Refusal(u16, &'static str, Option<&'static str>),
    /// Never answers.
    Hang,
    /// Sends so many bytes of the content and closes the connection.
    Cut(usize),
    /// Sends so many bytes as if they were all.
    Short(usize),
    /// Does what it should and answers nothing.
    LoseAnswer,
    /// Replaces this file of its folder by these bytes first, then does what it should.
    Replace(PathBuf, Vec<u8>),
}

struct Rule {
    left: usize,
    when: Box<dyn Fn(&Seen) -> bool + Send>,
    fault: Fault,
}

#[derive(Default)]
struct State {
    seen: Vec<Seen>,
    rules: Vec<Rule>,
}

/// The server. It stops with the value.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    folder: TempDir,
    state: Arc<Mutex<State>>,
    _runtime: Runtime,
}

impl Server {
    /// A server with one bucket.
    pub(crate) fn start(bucket: &str) -> Self {
        Self::start_for(bucket, true)
    }

    /// A server with one bucket that anybody may read, as on the web.
    pub(crate) fn start_public(bucket: &str) -> Self {
        Self::start_for(bucket, false)
    }

    fn start_for(bucket: &str, asks_for_credentials: bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(bucket)).unwrap();
        let mut builder = S3ServiceBuilder::new(FileSystem::new(folder.path()).unwrap());
        if asks_for_credentials {
            builder.set_auth(SimpleAuth::from_single(KEY, SECRET));
        }
        let service = builder.build();
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .unwrap();
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(State::default()));
        let answering = Answering {
            service,
            state: Arc::clone(&state),
            // s3s-fs looks whether an object is there and then writes it: one at a time makes it atomic
            writing: Arc::default(),
        };
        runtime.spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let answering = answering.clone();
                tokio::spawn(async move {
                    let answer = service_fn(move |request| answering.clone().answer(request));
                    let http = hyper::server::conn::http1::Builder::new();
                    // a cut connection is part of the tests
                    let _ = http.serve_connection(TokioIo::new(stream), answer).await;
                });
            }
        });
        Self {
            address,
            folder,
            state,
            _runtime: runtime,
        }
    }

    /// Returns the variables by which clients reach the server.
    pub(crate) fn variables(&self) -> Vec<(String, String)> {
        let pairs = [
            ("AWS_ENDPOINT_URL", format!("http://{}", self.address)),
            ("AWS_ACCESS_KEY_ID", KEY.into()),
            ("AWS_SECRET_ACCESS_KEY", SECRET.into()),
            ("AWS_REGION", "us-east-1".into()),
        ];
        pairs.map(|(name, value)| (name.to_owned(), value)).into()
    }

    /// The folder with the buckets.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The next `count` requests that meet a condition fail.
    pub(crate) fn inject(
        &self,
        count: usize,
        when: impl Fn(&Seen) -> bool + Send + 'static,
        fault: Fault,
    ) {
        self.state.lock().unwrap().rules.push(Rule {
            left: count,
            when: Box::new(when),
            fault,
        });
    }

    /// No further faults.
    pub(crate) fn heal(&self) {
        self.state.lock().unwrap().rules.clear();
    }

    /// The requests since the last call.
    pub(crate) fn take_seen(&self) -> Vec<Seen> {
        std::mem::take(&mut self.state.lock().unwrap().seen)
    }
}

#[derive(Clone)]
struct Answering {
    service: S3Service,
    state: Arc<Mutex<State>>,
    writing: Arc<tokio::sync::Mutex<()>>,
}

type Answer = Result<Response<Full<Bytes>>, std::io::Error>;

impl Answering {
    async fn answer(self, request: Request<Incoming>) -> Answer {
        let header = |name: &str| {
            let value = request.headers().get(name)?;
            Some(value.to_str().ok()?.to_owned())
        };
        let seen = Seen {
            method: request.method().to_string(),
            path: request.uri().to_string(),
            range: header("range"),
        };
        let fault = {
            let mut state = self.state.lock().unwrap();
            state.seen.push(seen.clone());
            let rule = state
                .rules
                .iter_mut()
                .find(|r| r.left > 0 && (r.when)(&seen));
            rule.map(|rule| {
                rule.left -= 1;
                rule.fault.clone()
            })
        };
        match &fault {
            Some(Fault::Status(status)) => {
                let text =
                    format!("<Error><Code>Injected</Code><Message>{SECRET}</Message></Error>");
                let response = Response::builder().status(*status).body(Full::from(text));
                return Ok(response.unwrap());
            }
            Some(Fault::Refusal(status, code, region)) => {
                let text = format!("<Error><Code>{code}</Code><Message>{SECRET}</Message></Error>");
                let mut response = Response::builder().status(*status);
                if let Some(region) = region {
                    response = response.header("x-amz-bucket-region", *region);
                }
                // an answer to HEAD has no body
                let text = if seen.method == "HEAD" {
                    String::new()
                } else {
                    text
                };
                return Ok(response.body(Full::from(text)).unwrap());
            }
            Some(Fault::Hang) => {
                tokio::time::sleep(Duration::from_secs(3600)).await;
            }
            Some(Fault::Replace(path, bytes)) => fs::write(path, bytes).unwrap(),
            _ => {}
        }
        let _one = match seen.method.as_str() {
            "PUT" | "POST" => Some(self.writing.lock().await),
            _ => None,
        };
        let response = self.service.call(request.map(s3s::Body::from)).await;
        let response = response.map_err(|error| std::io::Error::other(format!("{error:?}")))?;
        let (mut parts, body) = response.into_parts();
        let length = parts.headers.get("content-length");
        let length = length.and_then(|length| length.to_str().ok()?.parse().ok());
        let bytes = content(body, length).await?;
        match fault {
            Some(Fault::LoseAnswer) => Err(std::io::Error::other("lost")),
            Some(Fault::Short(count)) => {
                let bytes = bytes.slice(..count.min(bytes.len()));
                parts.headers.insert("content-length", bytes.len().into());
                Ok(Response::from_parts(parts, Full::new(bytes)))
            }
            Some(Fault::Cut(count)) => {
                parts.headers.insert("content-length", bytes.len().into());
                let bytes = bytes.slice(..count.min(bytes.len()));
                Ok(Response::from_parts(parts, Full::new(bytes)))
            }
            _ => Ok(Response::from_parts(parts, Full::new(bytes))),
        }
    }
}

/// A body, as far as its stated length: s3s-fs goes on to the end of the file, in steps of 4096 bytes.
async fn content(mut body: s3s::Body, length: Option<usize>) -> std::io::Result<Bytes> {
    let mut bytes = BytesMut::new();
    while length.is_none_or(|length| bytes.len() < length) {
        let Some(frame) = body.frame().await else {
            break;
        };
        let frame = frame.map_err(|error| std::io::Error::other(error.to_string()))?;
        if let Ok(data) = frame.into_data() {
            bytes.extend_from_slice(&data);
        }
    }
    Ok(bytes.freeze())
}

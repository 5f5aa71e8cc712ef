//! Logs in a bucket: read in parts, with the same result as a local file, and never silently less.

#[path = "object_storage/faults.rs"]
mod faults;
#[path = "object_storage/image_log.rs"]
mod image_log;
#[path = "object_storage/other_clouds.rs"]
mod other_clouds;
#[path = "object_storage/program.rs"]
mod program;
#[path = "object_storage/reading.rs"]
mod reading;
// shared with the tests of the crate that talks to them
#[path = "../ingest/storage/tests/clouds/mod.rs"]
mod clouds;
#[path = "../ingest/storage/tests/server/mod.rs"]
mod server;

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use server::Server;
use tipwatch_ingest::{Error, Log, Losses, TopicId};
use tipwatch_storage::{Access, Folder, Location, connect};

/// Starts a server; its bucket is reached with few attempts, in a time that a busy computer needs.
fn serve(bucket: &str) -> Server {
    serve_within(bucket, Duration::from_secs(30))
}

/// Serves a bucket with this timeout, within which faults may be retried.
fn serve_within(bucket: &str, timeout: Duration) -> Server {
    let server = Server::start(bucket);
    let access = Access {
        variables: server.variables(),
        timeout,
        attempts: 3,
        first_wait: Duration::from_millis(5),
        ..Access::default()
    };
    connect(&format!("s3://{bucket}"), access);
    server
}

/// Puts a file into a bucket.
fn upload(bucket: &str, key: &str, bytes: &[u8]) {
    let place = Location::parse(&format!("s3://{bucket}")).unwrap();
    Folder::open(&place).unwrap().put(key, bytes).unwrap();
}

/// A message as read: topic, log time, content.
type Message = (String, i64, Vec<u8>);

/// All messages of topics whose names begin so, in file order, and the losses.
fn messages(log: &Log, prefix: &str) -> Result<(Vec<Message>, Losses), Error> {
    let wanted = log
        .topics()
        .iter()
        .filter(|topic| topic.name.starts_with(prefix));
    let wanted: Vec<TopicId> = wanted.map(|topic| topic.id).collect();
    let mut found = Vec::new();
    let losses = log.read(&wanted, &mut |message| {
        let name = log.topics()[message.topic.index()].name.clone();
        found.push((name, message.log_time_ns, message.data.to_vec()));
        ControlFlow::Continue(())
    })?;
    Ok((found, losses))
}

fn open(place: &str) -> Result<Log, Error> {
    Log::open(Path::new(place))
}

//! A bucket for one test, and what is in it.

use std::time::Duration;

use tipwatch_storage::{Access, Error, Folder, Location, Object, connect};

use crate::server::Server;

/// Starts a server; its bucket is reached as the tests want.
pub(crate) fn serve(bucket: &str) -> Server {
    let server = Server::start(bucket);
    connect(&format!("s3://{bucket}"), access(&server));
    server
}

/// Few attempts, in a short time.
pub(crate) fn access(server: &Server) -> Access {
    Access {
        variables: server.variables(),
        timeout: Duration::from_millis(1500),
        attempts: 3,
        first_wait: Duration::from_millis(5),
        ..Access::default()
    }
}

pub(crate) fn folder(place: &str) -> Folder {
    Folder::open(&Location::parse(place).unwrap()).unwrap()
}

/// Calls that fail, all at once: each waits for its own attempts.
pub(crate) fn errors_of<const N: usize>(
    calls: [&(dyn Fn() -> Option<Error> + Sync); N],
) -> [Error; N] {
    std::thread::scope(|scope| {
        let running = calls.map(|call| scope.spawn(call));
        running.map(|call| call.join().unwrap().unwrap())
    })
}

/// Bytes that differ from place to place.
pub(crate) fn content(length: usize) -> Vec<u8> {
    (0..length as u32).map(|i| (i % 253) as u8).collect()
}

pub(crate) fn open(place: &str) -> Object {
    Object::open(&Location::parse(place).unwrap()).unwrap()
}

pub(crate) fn read(object: &Object, at: usize, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count];
    object.read_at(at as u64, &mut bytes).unwrap();
    bytes
}

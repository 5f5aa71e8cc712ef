//! A bucket for one test.

use std::time::Duration;

use tipwatch_storage::{Access, Folder, Location, connect};

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

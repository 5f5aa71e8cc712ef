//! Places over an S3 server in this process, with faults.

// The exception in clippy.toml covers test functions, not the helpers they share.
#![allow(clippy::unwrap_used)]

mod folders;
mod objects;
mod server;
mod support;

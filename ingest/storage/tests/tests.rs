//! Places over servers of S3, Google, Azure and the web in this process, with faults.

// The exception in clippy.toml covers test functions, not the helpers they share.
#![allow(clippy::unwrap_used)]

mod clouds;
mod folders;
mod objects;
mod other_clouds;
mod server;
mod support;
mod web_servers;

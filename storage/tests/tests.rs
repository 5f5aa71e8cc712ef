//! Places over an S3 server in this process, with faults.

mod folders;
mod objects;
mod server;
mod support;

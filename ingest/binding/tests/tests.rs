//! Tests of the whole crate.

#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

mod commissioning; // sensors proven from a drive made for it, and found wrong

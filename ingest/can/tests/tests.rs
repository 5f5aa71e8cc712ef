//! Tests of the crate through its public interface.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::field_reassign_with_default,
    reason = "a test fails by panicking"
)]

mod containers;
mod damage;
mod decoding;
mod fixtures;
mod fuzz;
mod support;
mod values;

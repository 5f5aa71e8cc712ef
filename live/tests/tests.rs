//! What the crate promises as a whole.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that panics has failed, helpers included; figures are printed"
)]

/// The suspension is steered, and its valves close on every fault.
mod control;
/// Processes that are killed.
mod crash;
/// Every fault of the input, injected in shared memory.
mod faults;
/// The C header is up to date.
mod header;
/// Signals that are single numbers.
mod number_signals;
/// Offline gives the same bits.
mod offline_equals_live;
/// A producer that is not written in Rust.
mod producer;
/// What the recorder leaves, and what of it can be reproduced.
mod record;
/// Nothing that is fed in makes it say "safe" wrongly.
mod safety;
/// Worlds of their own in shared memory, and the program in them.
mod support;

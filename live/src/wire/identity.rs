//! Identities of message sources: unique for every run of a program.

use crate::system::clock::unix_ns;
use crate::wire::hash::Fnv1a;

/// A new identity for this run and machine.
#[must_use]
pub fn new_identity(machine_hash: u64) -> u64 {
    Fnv1a::new()
        .number(machine_hash)
        .number(unix_ns().unsigned_abs())
        .number(std::process::id().into())
        .finish()
}

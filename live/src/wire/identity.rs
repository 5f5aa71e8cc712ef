//! Identities of sources: numbers that no two runs of a program share.

use crate::system::clock::unix_ns;
use crate::wire::hash::Fnv1a;

/// An identity for this run, of a program for this machine.
#[must_use]
pub fn new_identity(machine_hash: u64) -> u64 {
    Fnv1a::new()
        .number(machine_hash)
        .number(unix_ns().unsigned_abs())
        .number(std::process::id().into())
        .finish()
}

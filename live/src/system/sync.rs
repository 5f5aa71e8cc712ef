//! Locks and atomic numbers of the hand-overs between threads. The crate of the models compiles the same hand-overs with
//! the types of a model checker in this place.

pub use std::sync::atomic;
pub use std::sync::{Mutex, MutexGuard, PoisonError};

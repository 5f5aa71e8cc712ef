//! Hand-overs between threads in every order of their steps and with every value that the memory model allows: the
//! source files of the monitor and the recorder, compiled with the types of a model checker (loom).
//!
//! The models cover the alarm on its way to the disk, and the messages that wait for the recorder's disk. The queue of printed
//! verdicts is a crate (`rtrb`) that is modelled by its authors; its end follows the same rule as that of the recorder: look
//! whether the end was told, and only then empty the queue.

#![allow(dead_code, reason = "a model uses a part of each file")]

/// Stands in for `tipwatch_live::system`.
mod system {
    pub(crate) mod sync {
        pub(crate) use loom::sync::{Mutex, MutexGuard, atomic};
        pub(crate) use std::sync::PoisonError;
    }
}

/// Stands in for the conditions of the black box: no message of a model meets one.
mod trigger {
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub(crate) enum Trigger {}
}

#[path = "../../../live/src/alarm/exchange.rs"]
mod exchange;
#[path = "../../../live/src/record/pending.rs"]
mod pending;

#[cfg(test)]
mod alarm;
#[cfg(test)]
mod recorder;

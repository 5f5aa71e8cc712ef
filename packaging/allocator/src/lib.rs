//! Memory of the programs: kept for the next use, given back between the steps of an analysis.
//!
//! A log's columns come and go by the megabyte, and asking the system for fresh pages each time costs as much as the
//! mechanics. So freed memory is kept. Where one step of an analysis ends and the next needs memory of other sizes,
//! what is kept would only add to the peak: there it is given back.

/// The allocator of a program: `#[global_allocator] static ALLOCATOR: Allocator = Allocator;`
pub use mimalloc::MiMalloc as Allocator;

use std::ffi::{c_int, c_long};

/// `mi_option_purge_delay`.
const PURGE_DELAY: c_int = 15;
/// Delay in milliseconds: longer than between one log and the next.
const BETWEEN_TASKS_MS: c_long = 1000;

#[allow(unsafe_code, reason = "the allocator is a C library")]
// SAFETY: these are their signatures in C, and they touch no memory that is in use.
unsafe extern "C" {
    safe fn mi_collect(force: bool);
    safe fn mi_option_set(option: c_int, value: c_long);
}

/// Keeps freed memory of this process for a second before the system gets it back, instead of 10 ms: for programs that do
/// the same again and again, as with one log after the other, and would ask for the same memory at once. A sixth of their
/// time would be fresh pages. To be called before the process has other threads.
///
/// Without [`Allocator`] as the program's allocator it has no effect.
pub fn keep_between_tasks() {
    mi_option_set(PURGE_DELAY, BETWEEN_TASKS_MS);
}

/// Gives memory that is kept but not used back to the system: that of this thread, and of all threads of its [`rayon`]
/// pool, after what they are at.
///
/// Without [`Allocator`] as the program's allocator it has no effect.
pub fn give_back() {
    rayon::broadcast(|_| mi_collect(true));
    mi_collect(true);
}

//! Locks whose owner may have panicked.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Takes a lock of which a panic leaves no partial change behind.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

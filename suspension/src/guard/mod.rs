//! The load guard: no motion of the suspension takes more from a wheel than locking the rods would leave it.

mod load_guard;
mod response;

pub(crate) use load_guard::{LoadGuard, Move};

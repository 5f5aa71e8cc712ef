//! The load guard: no motion of the suspension takes more from a wheel than locking the rods would leave it.

mod by_wheel;
mod forecast;
mod load_guard;
mod margin;
mod plan;
mod steady;

pub(crate) use load_guard::{LoadGuard, Move};

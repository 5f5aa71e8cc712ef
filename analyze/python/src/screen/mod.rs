//! Whole fleets: on the threads of this process, or as tasks of an engine.

mod fleet;
mod gate;
mod screening;
mod task;

pub(crate) use fleet::Fleet;
pub(crate) use screening::screen;
pub(crate) use task::FleetTask;

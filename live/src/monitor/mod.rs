//! The monitor: samples in, verdicts out, and their printing.
//!
//! [`Monitor`] knows no shared memory; [`MonitorProgram`] joins the two.

mod contradiction;
mod ground;
mod observer;
pub mod output;
mod print_thread;
mod program;
mod session_monitor;

pub use contradiction::{Stands, overrules};
pub use observer::{Observer, ProgramObserver};
pub use program::{MonitorOptions, MonitorProgram};
pub use session_monitor::{Monitor, Publish};

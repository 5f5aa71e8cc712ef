//! For operators: a screen that shows verdicts, and the acknowledgement of alarms.

mod acknowledge;
mod screen;
mod watch;

pub use acknowledge::acknowledge;
pub use watch::watch;

//! For operators: a screen that shows verdicts, the acknowledgement of alarms, and the guided commissioning.

mod acknowledge;
mod commission;
mod screen;
mod watch;

pub use acknowledge::{acknowledge, acknowledge_signal};
pub use commission::{LiveCommissioning, commission};
pub use watch::watch;

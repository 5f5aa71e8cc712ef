//! The operating system: clocks, signals and real-time scheduling.

pub mod clock;
pub mod realtime;
pub mod signals;

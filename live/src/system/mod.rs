//! The operating system: clocks, signals, child processes, real-time scheduling and the supervisor of services.

pub mod children;
pub mod clock;
pub mod realtime;
pub mod signals;
pub mod supervisor;
pub mod sync;

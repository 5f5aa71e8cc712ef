//! Bridge: messages of ROS 2 and frames of CAN into samples, and verdicts out to them.
//!
//! ```text
//!     ROS 2 (DDS, Zenoh), CAN -> input -> session -> /samples
//!     /verdict -> output -> diagnostics, verdict message, CAN frame, command
//! ```

pub mod dds;
pub mod input;
pub mod output;
pub mod session;

mod outputs;
mod play;
mod program;

pub use outputs::{OutputOptions, Outputs};
pub use play::{PlayOptions, play};
pub use program::{BridgeCounts, BridgeOptions, bridge};

//! Bridge: messages of ROS 2 and frames of CAN into samples, and verdicts out to them.
//!
//! ```text
//!     ROS 2 (DDS, Zenoh), CAN -> input -> session -> /samples
//!     /verdict -> output -> diagnostics, verdict message, CAN frame, command
//! ```

pub mod input;
pub mod session;

mod program;

pub use program::{BridgeCounts, BridgeOptions, bridge};

//! Commissioning from a log: its evidence on signs, axes, order, scale and mounting of the sensors.

mod from_log;

pub use from_log::{LogCommissioning, from_log};

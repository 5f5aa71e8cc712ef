//! Commissioning from a log: what it shows of signs, axes, order, scale and mounting of the sensors.

mod from_log;

pub use from_log::{LogCommissioning, from_log};

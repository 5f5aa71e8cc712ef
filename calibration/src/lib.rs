//! Calibration: whether the sensors of a machine are mounted as its file says, and which parameters its measured loads show.

#![forbid(unsafe_code)]

pub mod commissioning;
pub mod identification;

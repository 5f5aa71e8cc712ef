//! Health of the sensors: the evidence of stamps and numbers alone, whatever the machine.
//!
//! One record per sensor is the row of `summary.json`, of the report and of the data set of a fleet.

mod block;
mod meter;
mod rate;
mod record;
mod sensors;

pub use self::record::{NumberHealth, RateChange, SensorHealth};
pub(crate) use self::sensors::of;

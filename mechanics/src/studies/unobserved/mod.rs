//! What unobserved motion can have done to the loads.

mod extreme;
mod loads;
mod signals;

pub use loads::{UnobservedLoads, WheelReach};

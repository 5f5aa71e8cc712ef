//! What unobserved motion can have done to the loads.

mod extreme;
mod loads;

pub use loads::{UnobservedLoads, WheelReach};

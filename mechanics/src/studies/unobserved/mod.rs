//! Effect of unobserved motion on the loads.

mod extreme;
mod loads;
mod signals;

pub use loads::{UnobservedLoads, WheelReach};

//! The state of a machine at one instant, the samples it is made of, and why a row is not valid.

mod columns;
mod machine_state;
mod reason;
mod sample;

pub use columns::StateColumns;
pub use machine_state::{
    AccelerometerBias, BaseState, ImuState, JetCovariance, Lag, SignalNoise, State, UNIT_TOLERANCE,
    resting_state,
};
pub use reason::{Reason, Reasons};
pub(crate) use sample::{Credible, measured_up, up_of};
pub use sample::{
    JointStream, JointTwice, MatchedSensors, NumberKind, OtherSensors, Sample, SampleError, Sensor,
    Sensors, StreamCounts, tilt_is_measured,
};

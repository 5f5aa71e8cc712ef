//! Bias of the accelerometer, estimated from attitude, odometry and standstill.
//!
//! ```text
//!     f = dv/dt + w x v + g u + s + noise        IMU axes
//! ```
//! Integrated over time, specific force f, angular velocity w and the measured up direction u predict the velocity
//! v, which odometry or standing wheels measure. What is left over is s, the difference between accelerometer
//! and attitude: [`difference_filter`] estimates it, [`split`] divides it between the two sensors.

mod bias_estimator;
mod difference_filter;
mod split;

pub(crate) use bias_estimator::{BiasEstimator, BiasHistory};

//! Value of a prediction: lead time, false alarms and errors of the loads ahead, compared with simulated ground truth, beside the
//! plain rate.

pub mod alarms;
pub mod followed;
pub mod stops;
pub mod tables;

//! Errors of binding a machine to a log and of reading a CAN (controller area network) signal.

mod bind;
mod can;

pub use bind::BindError;
pub use can::CanError;

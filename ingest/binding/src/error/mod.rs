//! Why a machine cannot be bound to a log, and why a CAN (controller area network) signal cannot be read.

mod bind;
mod can;

pub use bind::BindError;
pub use can::CanError;

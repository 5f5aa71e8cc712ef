//! What explains the loads: their derivatives, indicators of stability, uncertainty and causes.

pub(crate) mod attribution;
pub mod indicators;
pub(crate) mod sensitivity;
pub(crate) mod uncertainty;

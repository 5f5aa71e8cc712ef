//! Explanation of the loads: their derivatives, indicators of stability, uncertainty and load contributions.

pub(crate) mod attribution;
pub mod indicators;
pub(crate) mod sensitivity;
pub(crate) mod uncertainty;

//! Sparse logs: whether rows are static, the changes that motion between them may have made to the loads, and whether a lift
//! between them can be excluded.

mod choice;
mod exclusion;
mod motion_loads;
mod static_rows;

pub(super) use choice::{QuasiStatic, choose};
pub use exclusion::Exclusion;
pub(super) use exclusion::ExclusionPass;
pub(super) use motion_loads::MotionLoads;
pub(super) use static_rows::StaticRows;

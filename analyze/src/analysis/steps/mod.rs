//! The steps of an analysis, in their order.

mod check;
mod estimate;
mod evaluate;
mod prepare;
mod read;
mod study;

pub(super) use check::CheckedLog;
pub(super) use estimate::EstimatedLog;
pub(super) use evaluate::EvaluatedLog;
pub(super) use prepare::PreparedMachine;
pub(super) use read::ReadLog;
pub(super) use study::study;

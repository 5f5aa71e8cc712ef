//! Plausibility: what a sensor says that cannot be true.
//!
//! [`Plausibility`] looks at the raw samples one by one, before anything is made of them, remembers a
//! few numbers of each signal and allocates nothing in a step: the same checks serve a whole log and a
//! live monitor. What is found is a [`Finding`]; the machine file's policy says whether rows that rest
//! on it are invalid, widened or merely reported. [`FaultSpans`] puts the findings of a log together.
//!
//! | fault | of | found by |
//! |---|---|---|
//! | `not_finite` | every signal | NaN or infinity; a rate or attitude that was never given is absent, not at fault |
//! | `out_of_range` | vectors | length beyond what such a sensor or machine has |
//! | `joint_limit` | joints | position beyond the URDF's limits and a margin |
//! | `impossible_rate` | joints, angular velocity, odometry | change since the last credible sample too fast; measured rate too large |
//! | `frozen` | every signal | the same bits again and again: of a signal that was noisy, or while motion is seen elsewhere; a joint whose rate says that it moves |
//! | `not_unit` | attitudes | a quaternion whose length is not one |
//! | `disagreement` | joints | the change of position is not the integral of the rate |
//! | `disagreement` | attitude of the IMU | gravity as it has it is not what the specific force feels |

mod attitude;
mod checks;
mod fault;
mod freeze;
mod gravity;
mod joint;
mod notice;
mod spans;
mod treatment;
mod vector;

pub use checks::Plausibility;
pub use fault::{Amount, Component, Finding, Part};
pub(crate) use spans::SpanWalk;
pub use spans::{FaultSpan, FaultSpans};
pub use treatment::Judgement;
pub(crate) use treatment::{RowEffect, Treatment};

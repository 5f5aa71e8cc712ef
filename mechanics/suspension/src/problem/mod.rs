//! The optimisation problem of one step: its variables, their limits, and the critical step length.

mod critical_step;
mod limits;
mod step_problem;

pub use critical_step::CriticalStep;
pub(crate) use critical_step::StepFinder;
pub(crate) use limits::{Allowed, RodLimits, clamp};
pub(crate) use step_problem::{Problem, ProblemSettings, Rod, Solved};

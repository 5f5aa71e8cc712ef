//! Explanations of a rotation about an edge that the stated machine cannot explain: a load on the tool, weighed by the fall, and
//! whatever else was tried.
//!
//! Off an edge E the wheels cannot pull. While the platform rotates about E they carry nothing, so the true moment about the
//! edge is zero, and the computed one (ITOM with wheels) is the error of the model. That holds at the onset and in the whole
//! fall, posture by posture, because the Newton-Euler equations contain the measured accelerations. Before the lift the
//! platform leans on its tyres under the moment that the ground must support. With the amounts theta of an explanation, a
//! mass on the tool for instance, and its derivatives s from the same evaluation:
//! ```text
//!     onset, fall     -M_E = s theta + J nu + e
//!     lean            measured - C N(0) = C (dN/dtheta) theta + J nu + e
//! ```
//! nu are the uncertain parameters of the machine with their stated standard deviations, the same in all rows; e is noise
//! and a correlated error of the model. All of them are normally distributed, so each explanation has a marginal likelihood
//! in closed form, in which an amount that had to be fitted counts against it.

mod amounts;
mod contradicted;
mod equations;
mod explanations;
mod fall;
mod load_estimates;
mod no_return;
mod nuisances;
mod regression;
mod result;
mod rows;
mod study;
mod untested_signs;

pub(crate) use contradicted::doubt_contradicted;
pub(crate) use no_return::set_no_returns;
pub use result::{
    Agreement, EstimatedAmount, ExplainedFall, Explanation, LoadEstimates, MassEstimate,
};
pub(crate) use study::{falls, study};
pub(crate) use untested_signs::weigh_signs;

#[cfg(test)]
mod tests;

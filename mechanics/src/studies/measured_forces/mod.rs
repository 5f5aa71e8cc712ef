//! Measured forces of the arm's cylinders against those that masses and motion require: one row at a time, and, by the rows so far,
//! whether they contradict each other.
//!
//! ```text
//!     r = F_measured - F_computed
//!     s^2 = s_sample^2 + s_friction^2 + s_masses^2
//! ```
//! with the standard deviations of a sample and of the friction from the linkage in the machine file, and that of masses, centres of
//! mass and payloads ([`ForceSigma`](crate::ForceSigma)). Where |r| exceeds 5 s for two seconds on end, the force, a position of the arm,
//! a mass, or a load on the arm that nothing measures is wrong, or the arm rests on something. A cylinder at its stop says nothing, nor
//! does one that carries less than is required where the machine file says that the arm may lie on a rest. A measured force that repeats
//! bit for bit although the computed one changes by more than 5 s_sample is not measured any more.
//!
//! [`Compared`] is such a row, whoever asks: the analysis of a whole log, or a [`ForceWatch`], which knows past rows only, live and to
//! reproduce a live run offline. No load follows from these forces.

mod compared;
mod standstill;
mod watch;

pub use compared::{Compared, MOST_SIGMAS, measured_position, required_force};
pub use standstill::Standstill;
pub use watch::{ForceDoubt, ForceWatch};

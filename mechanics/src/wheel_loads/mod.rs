//! From the ground wrench to the load of every wheel.
//!
//! Equilibrium gives three equations: force along the normal and moments about two axes in the contact
//! plane. A joint without torque adds one. The split rule determines what they leave open:
//!
//! ```text
//!     sum N_i = F_n      sum y_i N_i = M_x      sum -x_i N_i = M_y
//! ```
//! Among all loads that satisfy them, wheels on springs take those of least energy: N = K A' l with
//! (A K A') l = b. Contact is unilateral: a wheel that would have to pull is lifted off the ground and the
//! remaining wheels are solved again. Joints with measured torque add information on the split
//! (`actuated`), and the measured loads of all supports on a load that nobody stated (`by_supports`). Where the centre of pressure leaves the support polygon, the machine tips about the nearest
//! edge, and only the wheels on that edge carry load.

mod actuated;
mod adjoint;
mod by_supports;
mod deviation;
mod envelope;
mod equilibrium;
mod least_energy;
mod loads;
mod measured_supports;
mod response;
mod tipping_lines;
mod unilateral;

pub(crate) use actuated::Actuation;
pub(crate) use adjoint::{LoadAdjoint, LoadAdjoints, SupportConfiguration};
pub use deviation::sigma;
pub(crate) use equilibrium::{DistalSubtrees, distal_wrenches, spin};
pub use equilibrium::{Equations, GroundForce};
pub(crate) use loads::Loads;
pub(crate) use tipping_lines::Standing;
pub use tipping_lines::TippingLine;
pub use unilateral::Solver;

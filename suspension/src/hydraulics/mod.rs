//! Hydraulics of a suspension actuator: valve flows, chamber pressures, piston force, valve law.
//!
//! (26)-(29) and (36) of the second paper, with the sign of its Q_b corrected and dead volumes added. Chamber
//! a is the piston's, b the rod's; x is the rod coordinate from its least value, outwards; pressures are
//! gauge.
//!
//! ```text
//!     H(1)  Q_a =  c_p1 v(p_s - p_a) u S(u) + c_n1 v(p_a - p_r) u S(-u)
//!     H(2)  Q_b = -c_n2 v(p_b - p_r) u S(u) - c_p2 v(p_s - p_b) u S(-u)                 (26)
//!     H(3)  dp_a/dt = beta/(V_a + A_a x) (Q_a - A_a dx/dt)                              (27)
//!     H(4)  dp_b/dt = beta/(V_b + A_b (s - x)) (Q_b + A_b dx/dt)                        (28)
//!     H(5)  f = A_a p_a - A_b p_b                                                       (29)
//!     H(6)  u = k_p (x_r - x), within -1 .. 1, changing no faster than the valve        (36)
//!     H(7)  m d2x/dt2 = f - F - d dx/dt - stops
//! ```
//! S(u) is 1 for u > 0, else 0; v(p) = sign(p) sqrt|p|. u > 0 fills a and pushes the rod out, u < 0 fills
//! b. Check valves keep the chambers from running empty, relief valves from bursting.
//!
//! Oil is stiff: pressures settle in microseconds where the rod takes a second. [`Actuator::step`] is
//! linearly implicit, so that its step is bounded by what moves, not by what is stiff.

mod actuator;
mod chambers;
mod rosenbrock;
mod valve;

pub use actuator::{Actuator, ActuatorState, Drive};
pub use chambers::{Flows, Pressures, flows, piston_force, pressure_rates};
pub use rosenbrock::StepError;
pub use valve::Valve;

//! Hydraulics of a suspension actuator: valve flows, chamber pressures, piston force, valve law.
//!
//! (26)-(29) and (36) of the second paper, with the sign of Q_b corrected and dead volumes added. Chamber a is
//! on the piston side, b on the rod side; x is the extension from the smallest stroke; pressures are gauge.
//!
//! ```text
//!     H(1)  Q_a =  c_p1 v(p_s - p_a) u S(u) + c_n1 v(p_a - p_r) u S(-u)
//!     H(2)  Q_b = -c_n2 v(p_b - p_r) u S(u) - c_p2 v(p_s - p_b) u S(-u)                 (26)
//!     H(3)  dp_a/dt = beta/(V_a + A_a x) (Q_a - A_a dx/dt)                              (27)
//!     H(4)  dp_b/dt = beta/(V_b + A_b (s - x)) (Q_b + A_b dx/dt)                        (28)
//!     H(5)  f = A_a p_a - A_b p_b                                                       (29)
//!     H(6)  u = k_p (x_r - x) + xd_r / V - k_f (f - F), within -1 .. 1, no faster than the valve   (36)
//!     H(7)  m d2x/dt2 = f - F - d dx/dt - stops
//! ```
//! S(u) is 1 for u > 0, else 0; v(p) = sign(p) sqrt|p|. u > 0 fills a and extends the rod, u < 0 fills b. Check
//! valves prevent cavitation, relief valves limit the pressure.
//!
//! Oil is stiff: pressures settle in microseconds, the rod moves within a second. [`Actuator::step`] is linearly
//! implicit, so that its step size is limited by accuracy and not by stability.

mod actuator;
mod chambers;
mod rosenbrock;
mod valve;

pub use actuator::{Actuator, ActuatorInput, ActuatorState};
pub use chambers::{Flows, Pressures, flows, piston_force, pressure_rates};
pub use rosenbrock::StepError;
pub(crate) use valve::full_velocity;
pub use valve::{Valve, ValveInput};

//! Motion of the bodies and the forces that accelerate them: kinematics and Newton-Euler.

pub mod composite;
pub(crate) mod groups;
pub mod kinematics;
pub mod newton_euler;
pub(crate) mod newton_euler_derivatives;

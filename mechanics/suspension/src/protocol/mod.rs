//! Control over lines of JSON, for simulation or hardware in the loop: states in, commands out.
//!
//! ```text
//!     in   {"protocol": 1, "joints": {"slew": 0.1, ...}}                once: the measured joints and their positions
//!     out  {"protocol": 1, "rods": ["suspension_right", ...], "step_s": 0.02, "stroke_m": [-0.2, 0.0], "valid_s": 0.1}
//!     in   {"joints": {"slew": [0.1, 0.0, 0.0], ...}, "rods": [-0.1, -0.1], "specific_force": [0, 0, 9.8],
//!           "angular_velocity": [0, 0, 0], "angular_acceleration": [0, 0, 0], "up": [0, 0, 1]}         each step
//!     out  {"status": "optimal", "hold": false, "reasons": [], "position": [...], "velocity": [...],
//!           "acceleration": [...], "opening": [...], "cost": 1.2}
//! ```
//! A state may also hold `"pressures": [[8e6, 7e6], [8e6, 7e6]]`, those of the chambers on the piston's and on the rod's side
//! (Pa): with them the valves damp the oscillation of the platform on its oil.
//!
//! Joints have position, velocity and acceleration (rad or m, s); rods have strokes (m). The remaining keys are the
//! IMU measurements in the sensor frame and the upward unit vector in base axes. `null` is an unknown number. A
//! line is a step of `step_s` after the one before, unless states carry their time, `"time_s": 12.34`: then lost, late
//! and repeated states are noticed.
//!
//! The input is checked like samples are onboard. On any doubt the answer holds, with the reasons, and the valves close;
//! so it does for a line that is not a state, which is answered by `{"error": "...", "hold": true}`, and at the end of
//! the input. After a hold, valves follow only after as many good states in a row as onboard.

mod line_control;
mod message;

pub use line_control::LineControl;
pub use message::{Answer, Opening, ProtocolError, Ready};

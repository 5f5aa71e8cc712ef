//! Replay of recorded states with another motion of the suspension.
//!
//! The rods are locked, as recorded, or controlled through simulated valves and cylinders. Arm motion, driving and
//! the path of the wheels stay as recorded. The pose of the platform, the wheel loads and the actuator forces
//! follow from the rods.

mod best_posture;
mod comparison;
mod controlled;
mod moved_state;
mod recorded;
mod track;

pub use best_posture::BestPostures;
pub use comparison::{Comparison, SuspensionMotion};
pub use moved_state::Replay;
pub use recorded::RecordedRows;
pub use track::{RodTrack, Track};

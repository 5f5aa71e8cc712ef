//! Mechanics of Tipwatch. Placeholder overview.

mod batch;
mod contact_plane;
mod coordinate;
mod evaluate;
mod kinematics;
pub mod machine;
mod newton_euler;
pub mod number;
mod outcome;
pub mod signal;
mod spatial;
mod state;
mod static_posture;
mod wheel_loads;
mod workspace;

pub use batch::{OutcomeColumns, StateColumns, evaluate_rows};
pub use coordinate::Motion;
pub use evaluate::evaluate;
pub use machine::{Machine, MachineError, MachineSpec};
pub use number::{Lanes, Real};
pub use outcome::{Outcome, Quantity};
pub use spatial::Wrench;
pub use state::{ImuState, State};
pub use static_posture::static_outcome;
pub use workspace::Workspace;

//! Mechanics of wheeled machines with an arm: from what the sensors feel to what the wheels carry.
//!
//! [`MachineSpec`] (a machine file) and a URDF are checked into an immutable [`Machine`];
//! [`signal`] turns sensor samples into [`State`]s; [`evaluate`] turns a state into an [`Outcome`]:
//! wheel loads, their envelope, and how far the machine is from tipping. [`evaluate`] remembers
//! nothing, allocates nothing and is generic over the number: [`evaluate_rows`] does four samples
//! side by side and gives the same bits.
//!
//! Frames, signs and equations stand in `THEORY.md`. The crate opens no file and starts no thread.
//!
//! ```
//! use tipwatch_mechanics::machine::LogFacts;
//! use tipwatch_mechanics::{MachineSpec, State, Workspace, evaluate};
//!
//! let spec = MachineSpec::from_toml(include_str!("../tests/data/rigid.toml"), "rigid.toml")?;
//! let machine = spec.check(include_str!("../tests/data/rigid.urdf"), "rigid.urdf", LogFacts::default())?;
//! let mut workspace = Workspace::new(&machine);
//! let mut state = State::<f64>::zero(&machine);
//! // lift and tilt of the arm, and an IMU that feels gravity: a machine at rest on level ground
//! state.joints[0].position = -1.3;
//! state.joints[1].position = -1.4;
//! state.imu.specific_force.z = machine.gravity();
//! let outcome = evaluate(&machine, &state, &mut workspace);
//! let weight = machine.mass() * machine.gravity();
//! assert!((outcome.load.iter().sum::<f64>() - weight).abs() < 0.001 * weight);
//! # Ok::<(), tipwatch_mechanics::MachineError>(())
//! ```

#![forbid(unsafe_code)]
mod batch;
pub mod closed_form;
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

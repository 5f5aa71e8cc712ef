//! Mechanics of wheeled machines with an arm: from sensor signals to wheel loads and stability.
//!
//! [`MachineSpec`] (a machine file) and a URDF are checked into an immutable [`Machine`];
//! [`signal`] turns sensor samples into [`State`]s; [`evaluate`] turns a state into an [`Outcome`]: wheel loads,
//! their envelope, and the margins to tipping. [`evaluate`] has no memory, does not allocate and is generic over
//! the number type: [`evaluate_rows`] evaluates four samples at once and gives the same bits.
//!
//! `THEORY.md` defines frames, signs and equations. The crate opens no file and starts no thread.
//!
//! ```
//! use tipwatch_mechanics::machine::LogFacts;
//! use tipwatch_mechanics::{MachineSpec, State, Workspace, evaluate};
//!
//! let spec = MachineSpec::from_toml(include_str!("../tests/data/rigid.toml"), "rigid.toml")?;
//! let machine = spec.check(include_str!("../tests/data/rigid.urdf"), "rigid.urdf", LogFacts::default())?;
//! let mut workspace = Workspace::new(&machine);
//! let mut state = State::<f64>::zero(&machine);
//! // lift and tilt of the arm, and an IMU that measures gravity: a machine at rest on level ground
//! state.joints[0].position = -1.3;
//! state.joints[1].position = -1.4;
//! state.imu.specific_force.z = machine.gravity();
//! let outcome = evaluate(&machine, &state, &mut workspace);
//! let weight = machine.mass() * machine.gravity();
//! assert!((outcome.load.iter().sum::<f64>() - weight).abs() < 0.001 * weight);
//! # Ok::<(), tipwatch_mechanics::MachineError>(())
//! ```

#![forbid(unsafe_code)]
mod actuator_force;
mod attribution;
mod batch;
pub mod closed_form;
mod composite;
mod contact_plane;
mod contact_plane_derivatives;
mod coordinate;
mod evaluate;
mod explain;
mod groups;
mod indicators;
mod kinematics;
pub mod machine;
mod model;
pub mod monte_carlo;
mod newton_euler;
mod newton_euler_derivatives;
pub mod number;
mod outcome;
mod payload_estimate;
mod placement;
pub mod plausibility;
mod scope;
mod sensitivity;
pub mod signal;
mod spatial;
mod standing;
mod state;
mod static_posture;
pub mod suspension;
mod uncertainty;
pub mod verdict;
mod wheel_loads;
mod workspace;

pub use actuator_force::{actuator_force, carries_payload};
pub use attribution::{Cause, Causes};
pub use batch::{OutcomeColumns, StateColumns, evaluate_rows};
pub use coordinate::Motion;
pub use evaluate::evaluate;
pub use indicators::{Indicators, Travel, VelocityGradient};
pub use machine::{Machine, MachineError, MachineSpec};
pub use model::{ClosedForm, Model};
pub use number::{Dual, Gradient, Jet, Lanes, Real};
pub use outcome::{Outcome, Place, Quantity};
pub use payload_estimate::{ForceQuality, MeasuredForce, PayloadEstimate, estimate_payload};
pub use placement::Placement;
pub use scope::Scope;
pub use sensitivity::{Axis, InertiaElement, Parameter, Sensitivity, SensitivitySums};
pub use spatial::Wrench;
pub use standing::{MassShare, Standing};
pub use state::{BaseState, ImuState, JetCovariance, SignalNoise, State};
pub use static_posture::{reference_posture, static_outcome};
pub use uncertainty::{Uncertainty, combination_sigma};
pub use workspace::Workspace;

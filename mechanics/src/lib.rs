//! Mechanics of wheeled machines with an arm: from sensor signals to wheel loads and stability.
//!
//! [`MachineSpec`] (a machine file) and a URDF are checked into an immutable [`Machine`];
//! [`estimation`] turns sensor samples into [`State`]s; [`evaluate`] turns a state into an [`Outcome`]: wheel loads,
//! their envelope, and the margins to tipping. [`evaluate`] has no memory, does not allocate and is generic over
//! the number type: [`evaluate_rows`] evaluates four samples at once and gives the same bits.
//!
//! `book/src/theory.md` defines frames, signs and equations. The crate opens no file and starts no thread.
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
#[macro_use]
mod named;

pub mod closed_form;
pub mod dynamics;
pub mod estimation;
mod evaluate;
pub mod explain;
pub mod geometry;
pub mod machine;
pub mod number;
pub mod prediction;
pub mod state;
pub mod studies;
pub mod verdict;
pub mod wheel_loads;

pub use evaluate::batch::{
    BatchEvaluator, BatchWorkspace, OutcomeColumns, evaluate_into, evaluate_rows, ground_forces,
    ground_wrenches,
};
pub use evaluate::evaluation::{evaluate, evaluate_one};
pub use evaluate::model::{ClosedForm, Model};
pub use evaluate::outcome::Outcome;
pub use evaluate::quantities::{Quantity, RowColumn};
pub use evaluate::quantity::{ColumnNames, GroundPoint, QuantityGroup, QuantityKind, When};
pub use evaluate::scope::Scope;
pub use evaluate::workspace::Workspace;
pub use explain::attribution::{Contribution, Contributions};
pub use explain::indicators::{Indicators, VelocityGradient};
pub use explain::sensitivity::{Sensitivity, SensitivitySums};
pub use explain::uncertainty::{Uncertainty, largest_utilisation};
pub use geometry::coordinate::Motion;
pub use geometry::spatial::Wrench;
pub use machine::{
    Axis, BaseMotion, InertiaElement, Machine, MachineError, MachineSpec, Parameter,
};
pub use number::{Dual, Gradient, Jet, Lanes, Real};
pub use state::{
    AccelerometerBias, BaseState, ImuState, JetCovariance, Lag, SignalNoise, State, StateColumns,
    resting_state,
};
pub use studies::actuator_force::{actuator_force, carries_payload};
pub use studies::actuator_force_sigma::{ForceSigma, actuator_force_sigma};
pub use studies::combination_sigma::{combination_sigma, signal_errors};
pub use studies::forces_by_rule::ForcesByRule;
pub use studies::payload_estimate::{
    ForceQuality, MeasuredForce, PayloadEstimate, estimate_payload,
};
pub use studies::placement::Placement;
pub use studies::self_equilibrated::self_equilibrated_loads;
pub use studies::standing::{MassShare, RestingMachine};
pub use studies::static_posture::{
    ReferenceLoadError, resting_on_slope, standing_posture, static_outcome,
};

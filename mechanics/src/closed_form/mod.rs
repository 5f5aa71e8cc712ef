//! Analytic model of the first paper: four wheels, a rigid platform, the arm as a wrench on it.
//!
//! G. Petrović and J. Mattila, "Analytic Solutions for Wheeled Mobile Manipulator Supporting Forces",
//! IEEE Access 10, 2022, (8)-(31), (48)-(58), (61)-(111), with its printing errors corrected. Every wheel's
//! load is a sum of eleven terms; `book/src/theory.md` lists the equations by number, C(1) to C(20).
//!
//! Frame {B_C}, "platform axes": origin C, the centre of mass of the platform without arm and wheels; x
//! forward, y left, z along the contact plane's normal. Arrays of four are in the order of [`Corner`]:
//! FL FR RR RL.
//!
//! ```
//! use nalgebra::Vector3;
//! use tipwatch_mechanics::Wrench;
//! use tipwatch_mechanics::closed_form::{DemandContributions, PlanarMotion, Platform};
//!
//! let wheel_mass = 4.0 * 60.0;
//! let platform = Platform {
//!     gravity: 9.8066,
//!     mass: 2200.0,
//!     com_height: 0.45,
//!     to_rear: 1.15,
//!     to_front: 1.15,
//!     half_track_left: 0.875,
//!     half_track_right: 0.875,
//!     wheel_mass,
//!     wheel_moment: Vector3::new(0.0, 0.0, 0.35 * wheel_mass),
//!     roll_moment_distribution: 0.5,
//!     arm_base: Vector3::new(0.5, 0.0, 0.25),
//!     ..Platform::zero()
//! };
//! let contributions = DemandContributions::of_motion(&platform, &Vector3::z(), &PlanarMotion::zero(), &Wrench::zero());
//! for load in contributions.terms(&platform).loads() {
//!     assert!((load - 5982.026_f64).abs() < 1e-6);
//! }
//! ```

mod contributions;
mod demand;
mod error;
mod moments;
mod parts;
mod placed;
mod planar_motion;
mod platform;
mod solution;
mod terms;

pub use contributions::{DemandContributions, MeasuredMotion};
pub use demand::Demand;
pub use error::ClosedFormError;
pub use moments::{Counted, EdgeMoments};
pub use parts::PlatformParts;
pub use placed::PlacedPlatform;
pub use planar_motion::{
    LEAST_SPEED, PlanarMotion, PointVelocity, Velocities, axle_heading, heading_of_spin_axis,
};
pub use platform::{Corner, Platform, PlatformPose};
pub(crate) use solution::Moving;
pub use solution::{ClosedFormInput, ClosedFormOutcome, GroundMotion};
pub use terms::Terms;

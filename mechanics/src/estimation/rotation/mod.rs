//! Rotation of the platform about an edge of its support polygon, by gyro and attitude alone.
//!
//! Neither masses nor loads are used: what is measured directly holds whatever they say. Two sources follow the up
//! direction in base axes, each for itself: the integrated angular velocity, levelled by the specific force where nothing
//! else acts on it, and the attitude. Each is compared with its reference, the up direction with all wheels on the
//! ground. The reference follows what tyres, suspension and ground may do; the rotation from it about an edge, outwards
//! positive, is
//! ```text
//!     angle = -axis . (r x u) / |r x u| angle(r, u),    r, u: reference and up direction
//!     sigma^2 = tyres^2 + ground^2 (1 - exp(-2 d / L)) + source^2,    d: distance travelled since the reference
//! ```
//! A spell begins where a source rotates farther than this explains, unless the other source and the specific force both
//! contradict it. It stands until the platform is back.

mod attitude;
mod edges;
mod gyro;
mod outward;
mod reference;
mod speed;
mod spell;
mod suspension;
#[cfg(test)]
mod tests;
mod watch;

pub use outward::{OutwardTurn, ShownUp};
pub use spell::{RotationSpell, RotationWitness};
pub use watch::PlatformRotation;

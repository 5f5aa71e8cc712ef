//! The motion of the machine by its wheels: by how fast they turn, and by how they are steered.
//!
//! A wheel at (x, y) with the rolling direction h and the axle e (unit vectors on the ground) rolls without slip where
//! ```text
//!     h . (vx - w y, vy + w x) = R spin       along
//!     e . (vx - w y, vy + w x) = 0            across
//! ```
//! The speeds of the wheels give vx and w by least squares of the first with vy = 0; where wheels are steered, the second
//! with this vx gives vy and w.

use nalgebra::{Matrix2, Vector2};

use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::spatial::z_axis;
use crate::machine::{Body, JointCoupling, Machine};

/// Smallest distance between left and right wheels, and between axles, that shows a turn (m).
const SPREAD: f64 = 0.1;

/// The wheels that a log contains.
#[derive(Debug, Clone)]
pub(in super::super) struct Rolling {
    wheels: Vec<RollingWheel>,
    is_steered: bool,
}

#[derive(Debug, Clone)]
struct RollingWheel {
    joint: usize,
    body: usize,
    radius: f64,
}

/// Motion by the wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Rolled {
    /// Velocity forward (m/s).
    pub(in super::super) speed: f64,
    /// Angular velocity about the vertical by the speeds of the wheels (rad/s).
    pub(in super::super) by_speeds: Option<f64>,
    /// Angular velocity about the vertical by the steering of the wheels (rad/s).
    pub(in super::super) by_steering: Option<f64>,
    /// Contradiction between the speeds of the wheels (m/s): a wheel slips, spins in the air or stands still.
    pub(in super::super) slip: f64,
    /// Circumferential speed of the fastest wheel (m/s).
    pub(in super::super) fastest: f64,
}

impl Rolling {
    pub(super) fn new(machine: &Machine) -> Self {
        let spin = |(body, it): (usize, &Body)| {
            let JointCoupling::Measured(joint) = it.coupling else {
                return None;
            };
            let measured = &machine.joints()[joint];
            let wheel = measured
                .spins_wheel
                // a raised wheel turns without the machine moving
                .filter(|_| measured.logged && !machine.supports().vary())?;
            let radius = machine.wheels()[wheel].radius;
            Some(RollingWheel {
                joint,
                body,
                radius,
            })
        };
        let wheels: Vec<_> = machine.bodies.iter().enumerate().filter_map(spin).collect();
        let is_steered = wheels.iter().any(|wheel| machine.is_steered(wheel.body));
        Self { wheels, is_steered }
    }

    /// The motion with the `motions` of all bodies and the velocities of all joints; `None` without enough wheels.
    pub(super) fn motion(
        &self,
        motions: &[BodyMotion<f64>],
        rate: impl Fn(usize) -> f64,
    ) -> Option<Rolled> {
        let (mut along, mut along_right) = (Matrix2::zeros(), Vector2::zeros());
        let (mut least, mut greatest) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for wheel in &self.wheels {
            let (place, axle) = placed(&motions[wheel.body])?;
            let direction = Vector2::new(axle.y, -axle.x);
            // unknown (vx, w)
            let row = Vector2::new(direction.x, direction.y * place.x - direction.x * place.y);
            let rolled = wheel.radius * rate(wheel.joint);
            along += row * row.transpose();
            along_right += row * rolled;
            least = least.inf(&place);
            greatest = greatest.sup(&place);
        }
        let spread = greatest - least;
        let count = self.wheels.len() as f64;
        let by_speeds = (spread.y > SPREAD).then(|| along.try_inverse()).flatten();
        let by_speeds = by_speeds.map(|inverse| inverse * along_right);
        // Wheels in one track show the speed alone.
        let speed = by_speeds.map_or(along_right.x / count, |solved| solved.x);
        let turning = by_speeds.map_or(0.0, |solved| solved.y);
        let (mut slip, mut fastest) = (0.0_f64, 0.0_f64);
        for wheel in &self.wheels {
            let (place, axle) = placed(&motions[wheel.body])?;
            let direction = Vector2::new(axle.y, -axle.x);
            let across = direction.y * place.x - direction.x * place.y;
            let rolled = wheel.radius * rate(wheel.joint);
            slip = slip.max((rolled - direction.x * speed - across * turning).abs());
            fastest = fastest.max(rolled.abs());
        }
        let by_steering = (self.is_steered && spread.x > SPREAD)
            .then(|| self.by_steering(motions, speed))
            .flatten();
        speed.is_finite().then_some(Rolled {
            speed,
            by_speeds: by_speeds.map(|solved| solved.y),
            by_steering,
            slip,
            fastest,
        })
    }

    fn by_steering(&self, motions: &[BodyMotion<f64>], speed: f64) -> Option<f64> {
        let (mut across, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for wheel in &self.wheels {
            let (place, axle) = placed(&motions[wheel.body])?;
            // unknown (vy, w)
            let row = Vector2::new(axle.y, axle.y * place.x - axle.x * place.y);
            across += row * row.transpose();
            right -= row * (axle.x * speed);
        }
        Some((across.try_inverse()? * right).y)
    }
}

/// Place and axle of a wheel on the ground (base axes).
fn placed(motion: &BodyMotion<f64>) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let axle = z_axis(&motion.rotation);
    let axle = axle.xy().try_normalize(0.1)?;
    Some((motion.origin.xy(), axle))
}

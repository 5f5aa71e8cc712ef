//! The motion of the machine by its wheels: by how fast they turn, and by how they are steered.
//!
//! A wheel at (x, y) with the rolling direction h and the axle e (unit vectors on the ground) rolls without slip where
//! ```text
//!     h . (vx - w y, vy + w x) = R spin       along
//!     e . (vx - w y, vy + w x) = 0            across
//! ```
//! The speeds of the wheels give vx and w by least squares of the first with vy = 0; where wheels are steered, the second
//! with this vx gives vy and w. The velocity (vx, vy) of a machine whose wheels are steered is that of all equations: in crab
//! steering it goes sideways, too.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

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
    /// Velocity of the base on the ground (m/s); `None` where wheels are steered and do not show it across.
    pub(in super::super) velocity: Option<Vector2<f64>>,
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
        let velocity = match self.is_steered {
            false => Some(Vector2::new(speed, 0.0)),
            true if spread.x > SPREAD => self.velocity(motions, &rate),
            true => None,
        };
        speed.is_finite().then_some(Rolled {
            speed,
            velocity,
            by_speeds: by_speeds.map(|solved| solved.y),
            by_steering,
            slip,
            fastest,
        })
    }

    /// The velocity by all equations of all wheels.
    fn velocity(
        &self,
        motions: &[BodyMotion<f64>],
        rate: impl Fn(usize) -> f64,
    ) -> Option<Vector2<f64>> {
        let (mut both, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for wheel in &self.wheels {
            let (place, axle) = placed(&motions[wheel.body])?;
            let rolled = wheel.radius * rate(wheel.joint);
            for (way, shown) in [(Vector2::new(axle.y, -axle.x), rolled), (axle, 0.0)] {
                // unknown (vx, vy, w)
                let row = Vector3::new(way.x, way.y, way.y * place.x - way.x * place.y);
                both += row * row.transpose();
                right += row * shown;
            }
        }
        Some((both.try_inverse()? * right).xy())
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

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    #[test]
    fn wheels_that_are_all_steered_alike_go_sideways() {
        let (radius, angle, speed) = (0.4, 0.6_f64, 2.0);
        // the axle of a wheel is its z axis
        let axle_left = Rotation3::from_axis_angle(&Vector3::x_axis(), -0.5 * std::f64::consts::PI);
        let steered = Rotation3::from_axis_angle(&Vector3::z_axis(), angle) * axle_left;
        let at = |[x, y]: [f64; 2]| BodyMotion {
            rotation: steered.into_inner(),
            origin: Vector3::new(x, y, 0.0),
            ..BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros())
        };
        let motions = [[1.0, 0.8], [1.0, -0.8], [-1.2, 0.8], [-1.2, -0.8]].map(at);
        let wheel = |index: usize| RollingWheel {
            joint: index,
            body: index,
            radius,
        };
        let rolling = Rolling {
            wheels: (0..motions.len()).map(wheel).collect(),
            is_steered: true,
        };
        let rolled = rolling.motion(&motions, |_| speed / radius).unwrap();
        let expected = Vector2::new(angle.cos(), angle.sin()) * speed;
        assert!((rolled.velocity.unwrap() - expected).norm() < 1e-9);
        assert!(rolled.by_steering.unwrap().abs() < 1e-9);
    }
}

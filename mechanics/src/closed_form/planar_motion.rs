//! Planar motion of the platform and its wheels: (12)-(31).

use nalgebra::{Vector2, Vector3};

use super::Platform;
use crate::number::Real;

/// Below this speed (m/s) the direction of motion is dominated by noise and therefore unknown.
pub const LEAST_SPEED: f64 = 0.05;

/// Motion of the platform over the ground, in platform axes. Roll and pitch rates are neglected, as in (11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarMotion<T> {
    /// v_x, forward velocity of C (m/s).
    pub v_x: T,
    /// v_y, leftward velocity of C (m/s).
    pub v_y: T,
    /// Time derivative of the component v_x (m/s^2), which is not the acceleration of C.
    pub vdot_x: T,
    /// Time derivative of the component v_y (m/s^2).
    pub vdot_y: T,
    /// Psidot, counter-clockwise (rad/s).
    pub yaw_rate: T,
    /// Psiddot (rad/s^2).
    pub yaw_acceleration: T,
}

/// Velocity of a point in platform axes, forward and left (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointVelocity<T>(pub Vector2<T>);

/// Velocities of points of the platform, in platform axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocities<T> {
    /// Velocity of C.
    pub centre: PointVelocity<T>,
    /// Velocity of the point on the front axle ahead of C.
    pub front: PointVelocity<T>,
    /// Velocity of the point on the rear axle behind C.
    pub rear: PointVelocity<T>,
    /// Velocities of the wheels, by [`Corner`](super::Corner).
    pub wheels: [PointVelocity<T>; 4],
}

impl<T: Real> PlanarMotion<T> {
    /// Standstill.
    #[must_use]
    pub fn zero() -> Self {
        let zero = T::zero();
        Self {
            v_x: zero,
            v_y: zero,
            vdot_x: zero,
            vdot_y: zero,
            yaw_rate: zero,
            yaw_acceleration: zero,
        }
    }

    /// Acceleration of C in platform axes (m/s^2): the components' derivatives plus the term due to the rotation
    /// of the axes, (51) and (52).
    #[must_use]
    pub fn acceleration(&self) -> Vector2<T> {
        Vector2::new(
            self.vdot_x - self.v_y * self.yaw_rate,
            self.vdot_y + self.v_x * self.yaw_rate,
        )
    }

    /// Velocity of the point (x, y) of the platform, relative to C (m): v_x - y Psidot, v_y + x Psidot.
    #[must_use]
    pub fn velocity_at(&self, point: &Vector2<T>) -> PointVelocity<T> {
        PointVelocity(Vector2::new(
            self.v_x - point.y * self.yaw_rate,
            self.v_y + point.x * self.yaw_rate,
        ))
    }

    /// (12)-(24): velocities of C, the axles and the wheels.
    #[must_use]
    pub fn velocities(&self, platform: &Platform<T>) -> Velocities<T> {
        let on_centre_line = |x| self.velocity_at(&Vector2::new(x, T::zero()));
        Velocities {
            centre: on_centre_line(T::zero()),
            front: on_centre_line(platform.to_front),
            rear: on_centre_line(-platform.to_rear),
            wheels: platform
                .contacts()
                .map(|contact| self.velocity_at(&contact)),
        }
    }
}

impl<T: Real> PointVelocity<T> {
    /// V, its magnitude (m/s).
    #[must_use]
    pub fn speed(&self) -> T {
        (self.0.x * self.0.x + self.0.y * self.0.y).sqrt()
    }

    /// beta of (25)-(30): direction from forward, counter-clockwise (rad), -pi to pi; pi in reverse. NaN below
    /// [`LEAST_SPEED`].
    #[must_use]
    pub fn direction(&self) -> T {
        self.sideslip(&Vector2::new(T::one(), T::zero()))
    }

    /// alpha = beta - delta of (31): angle from the heading of a wheel or axle to its direction of motion,
    /// counter-clockwise (rad), -pi to pi. NaN below [`LEAST_SPEED`].
    #[must_use]
    pub fn sideslip(&self, heading: &Vector2<T>) -> T {
        let across = heading.x * self.0.y - heading.y * self.0.x;
        let along = heading.x * self.0.x + heading.y * self.0.y;
        let stands = self.speed().lt(T::constant(LEAST_SPEED));
        T::select(stands, T::constant(f64::NAN), across.atan2(along))
    }
}

/// Heading of a wheel, a unit vector in platform axes, from the direction of its spin axis there:
/// perpendicular to the axis and forward, whichever side the axis points to. Camber has no effect.
#[must_use]
pub fn heading_of_spin_axis<T: Real>(axis: &Vector3<T>) -> Vector2<T> {
    let length = (axis.x * axis.x + axis.y * axis.y).sqrt();
    let ahead = T::select(axis.y.lt(T::zero()), -T::one(), T::one()) / length;
    Vector2::new(axis.y * ahead, -(axis.x * ahead))
}

/// Heading of an axle: the bisector of its wheels' headings, not normalised.
#[must_use]
pub fn axle_heading<T: Real>(left: &Vector2<T>, right: &Vector2<T>) -> Vector2<T> {
    left + right
}

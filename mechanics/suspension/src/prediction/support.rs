//! The contact plane under the platform, and the platform's motion relative to it due to the suspension.
//!
//! The wheels stay on the ground and do not slide because of the suspension: the frame of the contact plane, with
//! its origin C at the mean of the contact points, moves independently of the suspension, which moves the
//! platform relative to it. With e the axes of the plane in base axes and c, R the wheels'
//! centres and radii,
//! ```text
//!     S(3)   C = mean c - n mean R
//!     S(4)   Omega = 1/2 sum e x e',   Omega' = 1/2 sum e x e''       ' along the suspension's motion
//! ```
//! where C, C', C'', Omega, Omega' are treated as the pose and motion of a sensor fixed to the ground: the
//! base's motion follows as for an IMU on a moving body.

use nalgebra::{Matrix3, Vector3};

use tipwatch_mechanics::dynamics::kinematics::SensorFrame;
use tipwatch_mechanics::geometry::contact_plane::{Axes, ContactPlane};
use tipwatch_mechanics::geometry::spatial::{cross, zero};
use tipwatch_mechanics::number::{Jet, Real};

/// The contact plane, and its frame as a sensor frame relative to the base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Support<T: Real> {
    pub(crate) plane: ContactPlane<T>,
    pub(crate) sensor_frame: SensorFrame<T>,
}

impl<T: Real> Support<T> {
    /// Returns the support by wheels at rest relative to the base.
    pub(crate) fn at_rest(centres: &[Vector3<T>], radii: &[T], radii_differ: bool) -> Self {
        let plane = ContactPlane::through(centres, radii, radii_differ);
        let none = zero();
        Self {
            plane,
            sensor_frame: SensorFrame {
                rotation: Matrix3::from_columns(&[plane.forward, plane.left, plane.normal]),
                position: origin(&plane.normal, centres, radii),
                velocity: none,
                acceleration: none,
                angular_velocity: none,
                angular_acceleration: none,
            },
        }
    }

    /// Returns the support by wheels that move relative to the base; `centres` and `radii` are their present values.
    pub(crate) fn moving(
        moving_centres: &[Vector3<Jet<T>>],
        moving_radii: &[Jet<T>],
        centres: &[Vector3<T>],
        radii: &[T],
        radii_differ: bool,
    ) -> Self {
        let slope = ContactPlane::slope_through(moving_centres, moving_radii, radii_differ);
        let Axes {
            forward,
            left,
            normal,
        } = Axes::of(&slope);
        let axes = [forward, left, normal];
        let position = origin(&normal, moving_centres, moving_radii);
        let turning = |later: fn(&Jet<T>) -> T| {
            let turned = axes.map(|axis| cross(&value(&axis), &axis.map(|x| later(&x))));
            (turned[0] + turned[1] + turned[2]).map(|x| x.scaled(0.5))
        };
        let still = Axes {
            forward: value(&forward),
            left: value(&left),
            normal: value(&normal),
        };
        let rotation = Matrix3::from_columns(&[still.forward, still.left, still.normal]);
        let slope = slope.map(|x| x.value);
        Self {
            plane: ContactPlane::with_axes(slope, still, centres, radii),
            sensor_frame: SensorFrame {
                rotation,
                position: value(&position),
                velocity: position.map(|x| x.first),
                acceleration: position.map(|x| x.second),
                angular_velocity: turning(|x| x.first),
                angular_acceleration: turning(|x| x.second),
            },
        }
    }
}

fn value<T: Real>(moving: &Vector3<Jet<T>>) -> Vector3<T> {
    moving.map(|x| x.value)
}

/// S(3)
fn origin<T: Real>(normal: &Vector3<T>, centres: &[Vector3<T>], radii: &[T]) -> Vector3<T> {
    let (mut centre, mut radius) = (zero(), T::zero());
    for (c, &r) in centres.iter().zip(radii) {
        centre += c;
        radius += r;
    }
    let share = 1.0 / centres.len() as f64;
    (centre - normal * radius).map(|x| x.scaled(share))
}

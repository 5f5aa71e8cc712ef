//! Forward kinematics: pose and motion of every body from the motion of the joints and the base, all
//! vectors in base axes.
//!
//! Accelerations are specific forces: gravity is treated as an upward acceleration of the base, so that the
//! inertial force of a body includes its weight.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::coordinate::Coordinate;
use crate::geometry::spatial::{
    compose, constant, cross, identity, rotate_back, rotate_constant, z_axis, zero,
};
use crate::machine::{Body, JointCoupling, JointKind, Linkage, LinkageMotion, Machine};
use crate::number::Real;
use crate::state::{ImuState, State};

/// Pose and motion of a body, in base axes; positions and velocities relative to the origin of the base
/// frame.
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion<T> {
    /// Orientation: base from body.
    pub rotation: Matrix3<T>,
    /// Position of the body frame's origin (m).
    pub origin: Vector3<T>,
    /// Velocity of that origin relative to the base origin (m/s).
    pub velocity: Vector3<T>,
    /// Specific force at that origin (m/s^2).
    pub specific_force: Vector3<T>,
    /// Angular velocity (rad/s).
    pub angular_velocity: Vector3<T>,
    /// Angular acceleration (rad/s^2).
    pub angular_acceleration: Vector3<T>,
}

impl<T: Real> BodyMotion<T> {
    /// The base body, at the origin of its own axes.
    pub fn base(
        specific_force: Vector3<T>,
        angular_velocity: Vector3<T>,
        angular_acceleration: Vector3<T>,
    ) -> Self {
        Self {
            rotation: identity(),
            origin: zero(),
            velocity: zero(),
            specific_force,
            angular_velocity,
            angular_acceleration,
        }
    }

    /// Motion of the child `body` whose joint has this `coordinate`.
    #[inline(always)]
    pub fn carry(&self, body: &Body, coordinate: &Coordinate<T>) -> Self {
        let joint_rotation = compose(&self.rotation, &body.parent_from_joint);
        let z = z_axis(&joint_rotation);
        let mut arm = rotate_constant(&self.rotation, &body.joint_in_parent);
        if body.kind == JointKind::Prismatic {
            arm += z * coordinate.displacement;
        }
        let (w, alpha) = (&self.angular_velocity, &self.angular_acceleration);
        let swept = cross(w, &arm);
        let mut moved = Self {
            rotation: joint_rotation,
            origin: self.origin + arm,
            velocity: self.velocity + swept,
            specific_force: self.specific_force + cross(alpha, &arm) + cross(w, &swept),
            angular_velocity: *w,
            angular_acceleration: *alpha,
        };
        let joint_velocity = z * coordinate.rate;
        match body.kind {
            JointKind::Revolute => {
                moved.rotation = turned_about_z(&joint_rotation, coordinate.cos, coordinate.sin);
                moved.angular_velocity += joint_velocity;
                moved.angular_acceleration +=
                    z * coordinate.acceleration + cross(w, &joint_velocity);
            }
            JointKind::Prismatic => {
                moved.velocity += joint_velocity;
                moved.specific_force +=
                    z * coordinate.acceleration + cross(w, &joint_velocity) * T::constant(2.0);
            }
        }
        moved
    }

    /// The result of [`Self::carry`] on a base at rest with zero specific force.
    #[inline(always)]
    pub fn on_resting_base(body: &Body, coordinate: &Coordinate<T>) -> Self {
        let joint = &body.parent_from_joint;
        let along = |x: T, k: usize| {
            Vector3::new(
                x.scaled(joint[(0, k)]),
                x.scaled(joint[(1, k)]),
                x.scaled(joint[(2, k)]),
            )
        };
        let none = zero();
        let mut moved = Self {
            rotation: joint.map(T::constant),
            origin: constant(&body.joint_in_parent),
            velocity: none,
            specific_force: none,
            angular_velocity: none,
            angular_acceleration: none,
        };
        match body.kind {
            JointKind::Revolute => {
                let (cos, sin) = (coordinate.cos, coordinate.sin);
                moved.rotation = Matrix3::from_columns(&[
                    along(cos, 0) + along(sin, 1),
                    along(cos, 1) - along(sin, 0),
                    z_axis(&moved.rotation),
                ]);
                moved.angular_velocity = along(coordinate.rate, 2);
                moved.angular_acceleration = along(coordinate.acceleration, 2);
            }
            JointKind::Prismatic => {
                moved.origin += along(coordinate.displacement, 2);
                moved.velocity = along(coordinate.rate, 2);
                moved.specific_force = along(coordinate.acceleration, 2);
            }
        }
        moved
    }

    /// The result of [`Self::carry`] without accelerations, which then are not computed.
    #[inline(always)]
    pub fn carry_velocity(&self, body: &Body, coordinate: &Coordinate<T>) -> Self {
        Self {
            specific_force: zero(),
            angular_acceleration: zero(),
            ..self.carry(body, coordinate)
        }
    }

    /// The pose from [`Self::carry`], without motion.
    #[inline(always)]
    pub fn carry_at_rest(&self, body: &Body, coordinate: &Coordinate<T>) -> Self {
        Self {
            velocity: zero(),
            angular_velocity: zero(),
            ..self.carry_velocity(body, coordinate)
        }
    }

    /// Returns the motion in another number type.
    pub fn map<U: Real>(&self, convert: impl Fn(T) -> U) -> BodyMotion<U> {
        BodyMotion {
            rotation: self.rotation.map(&convert),
            origin: self.origin.map(&convert),
            velocity: self.velocity.map(&convert),
            specific_force: self.specific_force.map(&convert),
            angular_velocity: self.angular_velocity.map(&convert),
            angular_acceleration: self.angular_acceleration.map(&convert),
        }
    }

    /// A point fixed to the body, given in its frame, relative to the base origin (m).
    #[inline]
    pub fn point(&self, in_body: &Vector3<f64>) -> Vector3<T> {
        self.origin + rotate_constant(&self.rotation, in_body)
    }
}

/// R * Rz(angle)
#[inline(always)]
fn turned_about_z<T: Real>(rotation: &Matrix3<T>, cos: T, sin: T) -> Matrix3<T> {
    let (x, y) = (rotation.column(0), rotation.column(1));
    Matrix3::from_columns(&[x * cos + y * sin, y * cos - x * sin, z_axis(rotation)])
}

/// Computes the coordinates of all joints, by body. Returns the smallest closure of the linkages, negative
/// where one cannot close.
pub fn coordinates<T: Real>(
    machine: &Machine,
    state: &State<T>,
    coordinates: &mut [Coordinate<T>],
) -> T {
    let solve = |linkage: &Linkage| linkage.solve(&state.joints[linkage.measured_joint]);
    coordinates_by(machine, state, coordinates, solve)
}

/// The bodies of a machine, placed without motion.
#[derive(Debug, Clone)]
pub struct RestingBodies {
    coordinates: Vec<Coordinate<f64>>,
    /// By body.
    pub motions: Vec<BodyMotion<f64>>,
}

impl RestingBodies {
    /// Room for the bodies of this machine.
    #[must_use]
    pub fn new(machine: &Machine) -> Self {
        let rest = BodyMotion::base(zero(), zero(), zero());
        Self {
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            motions: vec![rest; machine.bodies.len()],
        }
    }

    /// Places the bodies with the joints of a state; returns the smallest closure of the linkages, see [`coordinates`].
    pub fn place(&mut self, machine: &Machine, state: &State<f64>) -> f64 {
        let closure = coordinates(machine, state, &mut self.coordinates);
        for (i, body) in machine.bodies.iter().enumerate().skip(1) {
            self.motions[i] = self.motions[body.parent].carry_at_rest(body, &self.coordinates[i]);
        }
        closure
    }
}

/// Computes the coordinates as [`coordinates`] does, with the motion of each linkage's joints from `solve`.
pub(crate) fn coordinates_by<T: Real>(
    machine: &Machine,
    state: &State<T>,
    coordinates: &mut [Coordinate<T>],
    mut solve: impl FnMut(&Linkage) -> LinkageMotion<T>,
) -> T {
    let mut closure = T::one();
    for linkage in &machine.linkages {
        let solved = solve(linkage);
        coordinates[linkage.bodies.pivot] = solved.pivot;
        coordinates[linkage.bodies.cylinder] = solved.cylinder;
        coordinates[linkage.bodies.rod] = solved.rod;
        closure = closure.min(solved.closure);
    }
    for (body, coordinate) in machine.bodies.iter().zip(coordinates.iter_mut()) {
        let motion = match body.coupling {
            JointCoupling::Measured(joint) => state.joints[joint],
            JointCoupling::Mimic {
                joint,
                multiplier,
                offset,
            } => state.joints[joint].scaled(multiplier, offset),
            JointCoupling::Root
            | JointCoupling::Pivot(_)
            | JointCoupling::Cylinder(_)
            | JointCoupling::Rod(_) => continue,
        };
        *coordinate = match body.kind {
            JointKind::Revolute => {
                let (sin, cos) = motion.position.sin_cos();
                Coordinate::turned(cos, sin, motion.rate, motion.acceleration)
            }
            JointKind::Prismatic => {
                Coordinate::slid(motion.position, motion.rate, motion.acceleration)
            }
        };
    }
    closure
}

/// Pose of the IMU and its motion relative to a base at rest, in base axes.
#[derive(Debug, Clone, Copy)]
pub struct SensorFrame<T> {
    /// Orientation: base from IMU.
    pub rotation: Matrix3<T>,
    /// Position (m).
    pub position: Vector3<T>,
    /// Velocity (m/s).
    pub velocity: Vector3<T>,
    /// Acceleration (m/s^2).
    pub acceleration: Vector3<T>,
    /// Angular velocity (rad/s).
    pub angular_velocity: Vector3<T>,
    /// Angular acceleration (rad/s^2).
    pub angular_acceleration: Vector3<T>,
}

impl<T: Real> SensorFrame<T> {
    /// Returns the frame of the IMU with the joints at these coordinates.
    pub fn of(machine: &Machine, coordinates: &[Coordinate<T>]) -> Self {
        let mount = &machine.imu;
        let carrier = BodyMotion::base(zero(), zero(), zero());
        let carrier = carry_along(machine, mount.body, coordinates, carrier);
        let arm = carrier.rotation * mount.body_from_mount.translation.vector.map(T::constant);
        let (w, alpha) = (&carrier.angular_velocity, &carrier.angular_acceleration);
        let swept = w.cross(&arm);
        Self {
            rotation: carrier.rotation * mount.rotation_in_body().map(T::constant),
            position: carrier.origin + arm,
            velocity: carrier.velocity + swept,
            acceleration: carrier.specific_force + alpha.cross(&arm) + w.cross(&swept),
            angular_velocity: *w,
            angular_acceleration: *alpha,
        }
    }
}

/// Motion of the base frame from the IMU's measurement: see [`SensorFrame::base_motion`].
pub fn base_motion<T: Real>(
    machine: &Machine,
    sensor_frame: &SensorFrame<T>,
    imu: &ImuState<T>,
) -> BodyMotion<T> {
    sensor_frame.base_motion(imu, machine.imu.body != 0)
}

impl<T: Real> SensorFrame<T> {
    /// Motion of the base frame from the IMU's measurement.
    ///
    /// On the root body only the lever arm matters. On a body that `moves`, the motion of the sensor relative
    /// to a base at rest is subtracted first: with its position p, velocity v, acceleration a, angular velocity
    /// w and angular acceleration alpha relative to the base,
    /// ```text
    ///     w_base     = w_imu - w
    ///     alpha_base = alpha_imu - alpha - w_base x w
    ///     f_base     = f_imu - a - 2 w_base x v - alpha_base x p - w_base x (w_base x p)
    /// ```
    pub fn base_motion(&self, imu: &ImuState<T>, moves: bool) -> BodyMotion<T> {
        let angular_velocity = self.rotation * imu.angular_velocity - self.angular_velocity;
        let angular_acceleration = self.rotation * imu.angular_acceleration
            - self.angular_acceleration
            - angular_velocity.cross(&self.angular_velocity);
        let mut specific_force = self.rotation * imu.specific_force
            - angular_acceleration.cross(&self.position)
            - angular_velocity.cross(&angular_velocity.cross(&self.position));
        if moves {
            specific_force -= self.acceleration;
            specific_force -= angular_velocity.cross(&self.velocity) * T::constant(2.0);
        }
        BodyMotion::base(specific_force, angular_velocity, angular_acceleration)
    }

    /// The IMU's measurement, in its own axes, for a given base motion: the inverse of [`Self::base_motion`].
    pub fn measured(&self, base: &BodyMotion<T>) -> ImuState<T> {
        let (w, alpha) = (&base.angular_velocity, &base.angular_acceleration);
        let force = base.specific_force
            + self.acceleration
            + cross(w, &self.velocity) * T::constant(2.0)
            + cross(alpha, &self.position)
            + cross(w, &cross(w, &self.position));
        let turning = alpha + self.angular_acceleration + cross(w, &self.angular_velocity);
        ImuState {
            specific_force: rotate_back(&self.rotation, &force),
            angular_velocity: rotate_back(&self.rotation, &(w + self.angular_velocity)),
            angular_acceleration: rotate_back(&self.rotation, &turning),
        }
    }
}

/// Motion of `body`, propagated from that of the root.
fn carry_along<T: Real>(
    machine: &Machine,
    body: usize,
    coordinates: &[Coordinate<T>],
    root: BodyMotion<T>,
) -> BodyMotion<T> {
    if body == 0 {
        return root;
    }
    let parent = carry_along(machine, machine.bodies[body].parent, coordinates, root);
    parent.carry(&machine.bodies[body], &coordinates[body])
}

//! The platform of the analytic model: its parameters and the pose of its frame.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::{ClosedFormError, PlatformParts};
use crate::geometry::spatial::{Wrench, constant, cross, rotate, rotate_back};
use crate::machine::Machine;
use crate::number::Real;

/// Position of a wheel; its value is the index in arrays of four wheels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corner {
    /// FL
    FrontLeft,
    /// FR
    FrontRight,
    /// RR
    RearRight,
    /// RL
    RearLeft,
}

/// Parameters of the platform (Table 1 of the first paper), in platform axes; the paper's four equal wheels on equal half
/// tracks are a special case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Platform<T> {
    /// g, gravitational acceleration (m/s^2).
    pub gravity: T,
    /// m_BC, mass without arm and wheels (kg).
    pub mass: T,
    /// z_C, height of C above the contact plane (m).
    pub com_height: T,
    /// l1, distance from C back to the rear axle (m).
    pub to_rear: T,
    /// l2, distance from C forward to the front axle (m).
    pub to_front: T,
    /// w_L, distance from C to the left wheels (m).
    pub half_track_left: T,
    /// w_R, distance from C to the right wheels (m).
    pub half_track_right: T,
    /// Sum of m_w,i, the wheels' masses (kg); 4 m_w in the paper.
    pub wheel_mass: T,
    /// Sum of m_w,i (x_i, y_i, R_i), the wheels' centres relative to the point of the contact plane below C
    /// (kg m); in the paper (2 (l2 - l1) m_w, 2 (w_L - w_R) m_w, 4 m_w R_w).
    pub wheel_moment: Vector3<T>,
    /// I_xz, element of the platform's inertia tensor about C (kg m^2); the product of inertia has the opposite
    /// sign.
    pub inertia_xz: T,
    /// I_yz, likewise (kg m^2).
    pub inertia_yz: T,
    /// Roll moment distribution D of (54): the front axle's share of the lateral load difference, 0 to 1.
    pub roll_moment_distribution: T,
    /// (x_CA, y_CA, z_CA) of (60), the root of the arm relative to C (m).
    pub arm_base: Vector3<T>,
}

impl<T: Real> Platform<T> {
    /// All parameters zero, as a starting point.
    #[must_use]
    pub fn zero() -> Self {
        let zero = T::zero();
        Self {
            gravity: zero,
            mass: zero,
            com_height: zero,
            to_rear: zero,
            to_front: zero,
            half_track_left: zero,
            half_track_right: zero,
            wheel_mass: zero,
            wheel_moment: Vector3::zeros(),
            inertia_xz: zero,
            inertia_yz: zero,
            roll_moment_distribution: zero,
            arm_base: Vector3::zeros(),
        }
    }

    /// Returns the platform as a constant for every sample.
    #[must_use]
    pub fn constant(platform: &Platform<f64>) -> Self {
        let c = T::constant;
        Self {
            gravity: c(platform.gravity),
            mass: c(platform.mass),
            com_height: c(platform.com_height),
            to_rear: c(platform.to_rear),
            to_front: c(platform.to_front),
            half_track_left: c(platform.half_track_left),
            half_track_right: c(platform.half_track_right),
            wheel_mass: c(platform.wheel_mass),
            wheel_moment: constant(&platform.wheel_moment),
            inertia_xz: c(platform.inertia_xz),
            inertia_yz: c(platform.inertia_yz),
            roll_moment_distribution: c(platform.roll_moment_distribution),
            arm_base: constant(&platform.arm_base),
        }
    }

    /// L = l1 + l2 (m).
    #[must_use]
    pub fn wheelbase(&self) -> T {
        self.to_rear + self.to_front
    }

    /// w_L + w_R (m).
    #[must_use]
    pub fn track(&self) -> T {
        self.half_track_left + self.half_track_right
    }

    /// Contact points of the wheels, in platform axes from C (m), by [`Corner`].
    #[must_use]
    pub fn contacts(&self) -> [Vector2<T>; 4] {
        let (front, rear) = (self.to_front, -self.to_rear);
        let (left, right) = (self.half_track_left, -self.half_track_right);
        [(front, left), (front, right), (rear, right), (rear, left)]
            .map(|(x, y)| Vector2::new(x, y))
    }
}

impl Platform<f64> {
    /// The platform of `machine` at these joint positions (rad or m), in the order of [`Machine::joints`]; see
    /// [`PlatformParts::place`].
    ///
    /// # Errors
    /// [`ClosedFormError`]: the analytic model does not apply to the machine.
    pub fn of(machine: &Machine, joint_positions: &[f64]) -> Result<Self, ClosedFormError> {
        let placed = PlatformParts::of(machine)?.place(machine, joint_positions)?;
        Ok(placed.platform)
    }
}

/// Pose of {B_C} in the base frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformPose<T> {
    /// Maps base axes to platform axes.
    pub platform_from_base: Matrix3<T>,
    /// C in base axes (m).
    pub centre: Vector3<T>,
}

impl<T: Real> PlatformPose<T> {
    /// Transforms a direction from base axes to platform axes.
    #[must_use]
    pub fn direction(&self, in_base: &Vector3<T>) -> Vector3<T> {
        rotate(&self.platform_from_base, in_base)
    }

    /// Transforms a point from the base frame to platform axes, relative to C (m).
    #[must_use]
    pub fn point(&self, in_base: &Vector3<T>) -> Vector3<T> {
        self.direction(&(in_base - self.centre))
    }

    /// The specific force at C in platform axes, from the specific force at the base origin and the base's angular
    /// velocity and acceleration, all in base axes (m/s^2, rad/s, rad/s^2):
    ///
    /// s_C = s + alpha x c + w x (w x c)
    #[must_use]
    pub fn specific_force_at_centre(
        &self,
        specific_force: &Vector3<T>,
        angular_velocity: &Vector3<T>,
        angular_acceleration: &Vector3<T>,
    ) -> Vector3<T> {
        let swept = cross(angular_velocity, &self.centre);
        let measured = specific_force
            + cross(angular_acceleration, &self.centre)
            + cross(angular_velocity, &swept);
        self.direction(&measured)
    }

    /// Transforms a wrench about the base origin in base axes to a wrench about `point` (platform axes, from C)
    /// in platform axes (N, N m).
    #[must_use]
    pub fn wrench_at(&self, about_base: &Wrench<T>, point: &Vector3<T>) -> Wrench<T> {
        let point_in_base = self.centre + rotate_back(&self.platform_from_base, point);
        let moved = about_base.about(&point_in_base);
        Wrench {
            force: self.direction(&moved.force),
            moment: self.direction(&moved.moment),
        }
    }
}

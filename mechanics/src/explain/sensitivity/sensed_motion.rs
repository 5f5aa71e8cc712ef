//! Inputs of the derivatives from an evaluation.

use nalgebra::Vector3;

use crate::dynamics::groups::Groups;
use crate::dynamics::kinematics::{BodyMotion, SensorFrame};
use crate::geometry::coordinate::Coordinate;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;
use crate::state::State;
use crate::wheel_loads::Actuation;

/// The results of an evaluation that the derivatives use.
pub(crate) struct SensedMotion<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) sensor_frame: &'a SensorFrame<T>,
    pub(crate) coordinates: &'a [Coordinate<T>],
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Wrench of every body including its payloads.
    pub(crate) wrenches: &'a [Wrench<T>],
    pub(crate) groups: &'a Groups<T>,
    pub(crate) actuations: &'a [Actuation<T>],
    pub(crate) tool_wrench: &'a Wrench<T>,
    pub(crate) centres: &'a [Vector3<T>],
}

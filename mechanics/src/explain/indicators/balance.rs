//! Inputs of the indicators from an evaluation.

use nalgebra::Vector2;

use crate::dynamics::groups::Parts;
use crate::dynamics::kinematics::BodyMotion;
use crate::explain::sensitivity::Sensitivity;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::Wrench;
use crate::machine::Machine;
use crate::number::Real;
use crate::state::State;
use crate::wheel_loads::TippingLine;

/// The results of an evaluation that the indicators use.
pub(crate) struct Balance<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) state: &'a State<T>,
    pub(crate) plane: &'a ContactPlane<T>,
    /// The contact points in the plane.
    pub(crate) contacts: &'a [Vector2<T>],
    /// The lines about which the machine tips, by edge; none where these are the edges.
    pub(crate) tipping_lines: &'a [TippingLine<T>],
    pub(crate) whole: &'a Parts<T>,
    pub(crate) motions: &'a [BodyMotion<T>],
    /// Force and moment of the ground, about the base origin.
    pub(crate) ground_wrench: &'a Wrench<T>,
    /// Loads with all wheels held to the ground, by wheel.
    pub(crate) otf: &'a [T],
    /// Loads, by wheel.
    pub(crate) load: &'a [T],
    /// The derivatives, if computed.
    pub(crate) sensitivity: Option<&'a Sensitivity<T>>,
}

//! The machine: bodies, joints, closed chains, wheels and sensors, validated once and then immutable.
//!
//! [`MachineSpec`] is the machine file as written; [`MachineSpec::check`] combines it with a URDF and a log's
//! joint names into a [`Machine`], or explains what is wrong.

mod actuated_joint;
mod body;
mod changed;
mod check;
mod checked;
mod contact;
mod error;
mod fault_kind;
mod hydraulics;
mod inertia;
mod linkage;
mod motion_bounds;
mod nominal;
mod outline;
mod parameter;
mod plausibility_spec;
mod quasi_static;
mod reference;
mod sampled;
mod signals;
mod spec;
mod split;
mod stated_sigma;
mod static_transform;
mod support_polygon;
mod suspension;
mod suspension_control;
mod travel;
mod tree;
mod urdf;
#[cfg(test)]
mod val_suspension_triangle;
mod warp;
mod weighed;
mod wheel;

pub use actuated_joint::{ActuatedJoint, ActuatorSignal, TorqueJoint};
pub(crate) use body::rotation_in_body;
pub use body::{
    Body, JointCoupling, JointKind, Link, LinkGroup, MeasuredJoint, Mount, Mounting, Payload,
};
pub use check::{IMU_CONFLICT, LogFacts, UNCONFIRMED};
pub use checked::Machine;
pub use contact::Contact;
pub use error::MachineError;
pub use fault_kind::FaultKind;
pub use hydraulics::{HydraulicParameters, HydraulicsSpec};
pub use inertia::{Inertia, MassMoments};
pub use linkage::{Linkage, LinkageBodies, LinkageInput, LinkageMotion};
pub use motion_bounds::JointBounds;
pub use outline::{JointMotion, Outline, OutlineJoint, OutlineLink, Shape};
pub(crate) use parameter::links_with_mass;
pub use parameter::{Axis, InertiaElement, Parameter};
pub use plausibility_spec::{PlausibilitySpec, Policy};
pub use quasi_static::{JointMotionSpec, QuasiStaticMode, QuasiStaticSpec};
pub use reference::{Reference, ReferencePosture};
pub(crate) use sampled::ParameterSampler;
pub use signals::{
    FieldSpec, ImuFields, JointFields, NumberSpec, OdometryFields, OneOrMany, SignalSpec,
    SignalsSpec, WrenchFields,
};
pub use spec::{
    ArmSpec, ContactSpec, EstimatorSpec, Ground, ImuSpec, LimitsSpec, LinkageSpec, MachineSpec,
    PayloadMass, PayloadSpec, PointSpec, PressureSpec, Stiffness, SuspensionSpec, UncertaintySpec,
    WheelSpec,
};
pub use split::Split;
pub use static_transform::StaticTransform;
pub use support_polygon::{Edge, SupportPolygon};
pub use suspension::Suspension;
pub use suspension_control::{ControlMode, ControlWeights, PairWeight, SuspensionControl};
pub use travel::BaseMotion;
pub use warp::Warp;
pub use weighed::{WeighedSpec, WeighedSum, WeighedUnit};
pub use wheel::{MAX_WHEELS, Wheel};

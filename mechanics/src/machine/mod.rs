//! The machine: bodies, joints, closed chains, wheels and sensors, validated once and then immutable.
//!
//! [`MachineSpec`] is the machine file as written; [`MachineSpec::check`] combines it with a URDF and a log's
//! joint names into a [`Machine`], or explains what is wrong.

#[macro_use]
mod table;

mod actuated_joint;
mod add_supports;
mod arm_force;
mod axles_astride;
mod body;
mod changed;
mod check;
mod checked;
mod contact;
mod error;
mod exactly;
mod fault_kind;
mod hydraulics;
mod identified;
mod identified_machine;
mod impossible_inertia;
mod inertia;
mod joint_command;
mod link_box;
mod link_sigma;
mod linkage;
mod load_on_tool;
mod load_sensor;
mod motion_bounds;
mod nominal;
mod note;
#[cfg(test)]
pub(crate) mod of_tests;
mod one_of;
mod outline;
mod parameter;
mod parameters_of;
mod payload_signal;
mod plausibility_spec;
mod prediction_spec;
mod proofs;
mod quasi_static;
mod reference;
mod sampled;
mod sensor_places;
mod signals;
mod spec;
mod split;
mod stated_sigma;
mod static_transform;
mod steering;
mod structure;
mod support_id;
mod support_polygon;
mod support_set;
mod support_spec;
mod support_switch;
mod supports;
mod suspension;
mod suspension_control;
mod toml_error;
mod travel;
mod tree;
mod unknown;
mod unknowns_of;
mod urdf;
mod urdf_text;
#[cfg(test)]
mod val_suspension_triangle;
mod warp;
mod weighed;
mod weighed_supports;
mod wheel;

pub use actuated_joint::{ActuatedJoint, ActuatorSignal, ForceSource, TorqueJoint};
pub use arm_force::{ArmForce, ForceSignal};
pub use body::{
    Body, JointCoupling, JointKind, Link, LinkGroup, MeasuredJoint, Mount, MountSource, Mounting,
    Payload,
};
pub use check::LogFacts;
pub use checked::{MOST_MASSES, Machine};
pub use contact::Contact;
pub use error::MachineError;
pub use exactly::{exactly, exactly_if_any};
pub use fault_kind::FaultKind;
pub use hydraulics::{HydraulicParameters, HydraulicsSpec};
pub use identified::{Identified, IdentifiedDirection, IdentifiedSpec};
pub use impossible_inertia::{ImpossibleInertia, InertiaFault, Replacement};
pub use inertia::{Inertia, MassMoments};
pub use joint_command::JointCommand;
pub use link_sigma::LinkSigma;
pub use linkage::{Linkage, LinkageBodies, LinkageInput, LinkageMotion};
pub use load_on_tool::LoadOnTool;
pub use load_sensor::LoadSensor;
pub use motion_bounds::JointBounds;
pub use note::{Note, NoteKind};
pub use one_of::{OneOf, one_of};
pub use outline::{JointMotion, Outline, OutlineJoint, OutlineLink, Shape};
pub use parameter::{Axis, InertiaElement, Parameter};
pub(crate) use parameters_of::links_with_mass;
pub use payload_signal::{Lift, PayloadQuantity, PayloadSignal};
pub use plausibility_spec::{PlausibilitySpec, Policy};
pub use prediction_spec::{JointStopSpec, PredictionSpec};
pub use proofs::{Commissioned, Proof, Proofs, SessionProofs};
pub use quasi_static::{JointMotionSpec, QuasiStaticMode, QuasiStaticSpec};
pub use reference::{Reference, ReferencePosture};
pub(crate) use sampled::ParameterSampler;
pub use signals::{
    CanMessageSpec, CanSpec, FieldSpec, ImuFields, JointFields, LoadSumFields, NumberSpec,
    OdometryFields, OneOrMany, SignalSpec, SignalsSpec, WheelFields, WrenchFields, can_signals,
    number_topics,
};
pub use spec::{
    ArmSpec, ContactSpec, EstimatorSpec, Ground, ImuSpec, LimitsSpec, LinkageSpec, MachineSpec,
    MassSignal, PayloadMass, PayloadSpec, PointSpec, PressureSpec, Stiffness, SuspensionSpec,
    UncertaintySpec, WheelSpec,
};
pub use split::Split;
pub use static_transform::StaticTransform;
pub use support_id::SupportId;
pub use support_polygon::{EDGES_OF_FOUR, Edge, SupportPolygon};
pub use support_set::SupportSetError;
pub use support_spec::{
    MeasuredLoad, PresenceSpec, SupportKind, SupportOrigin, SupportSpec, SwitchSpec, TrackSpec,
};
pub use support_switch::SupportSwitch;
pub use supports::{Presence, Supports};
pub use suspension::Suspension;
pub use suspension_control::{ControlMode, ControlWeights, PairWeight, SuspensionControl};
pub use toml_error::explained;
pub use travel::BaseMotion;
pub use unknown::Unknown;
pub use warp::Warp;
pub use weighed::{WeighedPosture, WeighedSpec, WeighedSum, WeighedUnit};
pub use wheel::{MAX_WHEELS, Wheel};

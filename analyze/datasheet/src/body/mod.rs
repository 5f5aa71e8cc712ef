//! The bodies of a machine: links, joints, shapes and wheels, and where they are in a posture.

mod arm;
mod build;
mod cylinder;
mod ground;
mod machine;
mod pose;
mod reach;

pub(crate) use build::build;
pub use machine::{Joint, JointKind, Link, Machine, Shape, Solid, Wheel};
pub(crate) use machine::{Outrigger, PadSet, Role};
pub(crate) use pose::{poses, sheet_poses};

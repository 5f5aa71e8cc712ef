//! From a machine file as written, a URDF and what a log offers to a [`Machine`](super::Machine), or the first thing
//! that is wrong with it.

mod actuated_joints;
mod arm_forces;
mod checker;
mod contact;
mod doubts;
mod driving;
mod identified;
mod implausible_masses;
mod implausible_units;
mod implausible_wheels;
mod imu_mount;
mod inertias;
mod link_sigmas;
mod load_sensors;
mod payloads;
mod prediction;
mod reference;
mod signals;
mod supports;
mod suspension;
mod suspension_control;
mod weighed;
mod wheel_side;
mod wheels;
mod wrench_mount;

pub use checker::LogFacts;

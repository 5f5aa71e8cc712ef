//! What a checked machine file says, as JSON.

use nalgebra::Vector3;
use serde::Serialize;
use tipwatch_mechanics::machine::{Machine, MeasuredJoint};

use crate::base::number::known;

/// Version of the JSON document.
pub(super) const SCHEMA: u32 = 1;

/// What a machine file describes.
#[derive(Debug, Serialize)]
pub struct MachineCheck {
    pub(super) schema: u32,
    pub(super) name: String,
    pub(super) machine_file: String,
    /// The frame of every position.
    pub(super) base_link: String,
    pub(super) gravity_m_s2: f64,
    pub(super) masses: Vec<PartMass>,
    /// Between the first and the last axle; null of one axle.
    pub(super) wheelbase_m: Option<f64>,
    pub(super) axles: Vec<Axle>,
    /// Where the joints are: of the log's first valid row, else zero.
    pub(super) posture: Posture,
    pub(super) wheels: Vec<WheelCheck>,
    /// Of axles, sides and the whole machine.
    pub(super) sums: Vec<SumCheck>,
    pub(super) imu_mounting: String,
    /// Beside `[weighed]` of the machine file.
    pub(super) weighed: Option<Weighed>,
    pub(super) notes: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct PartMass {
    pub(super) part: &'static str,
    pub(super) mass_kg: f64,
    /// In `base_link`; null without mass.
    pub(super) centre_of_mass_m: Option<[f64; 3]>,
}

#[derive(Debug, Serialize)]
pub(super) struct Axle {
    pub(super) wheels: Vec<String>,
    /// Forward of the base frame's origin.
    pub(super) x_m: f64,
    /// Between its outermost wheels; null of one wheel.
    pub(super) track_m: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct Posture {
    pub(super) source: String,
    pub(super) joints: Vec<JointPosition>,
}

#[derive(Debug, Serialize)]
pub(super) struct JointPosition {
    pub(super) joint: String,
    /// Radians, or metres of a sliding joint.
    pub(super) position: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct WheelCheck {
    pub(super) wheel: String,
    pub(super) centre_m: [f64; 3],
    pub(super) radius_m: f64,
    pub(super) static_load_n: Option<f64>,
    /// Standard deviation of the load by `[uncertainty]` of the machine file.
    pub(super) sigma_n: Option<f64>,
    /// As a share of the weight.
    pub(super) share: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct SumCheck {
    pub(super) name: String,
    pub(super) wheels: Vec<String>,
    pub(super) static_load_n: Option<f64>,
    pub(super) sigma_n: Option<f64>,
    pub(super) share: Option<f64>,
}

/// `[weighed]` beside the model.
#[derive(Debug, Serialize)]
pub(super) struct Weighed {
    pub(super) posture: Posture,
    pub(super) readings: Vec<Reading>,
}

/// What one scale said.
#[derive(Debug, Serialize)]
pub(super) struct Reading {
    pub(super) name: String,
    pub(super) wheels: Vec<String>,
    pub(super) weighed_n: f64,
    /// Standard deviation that the machine file states of the scale.
    pub(super) weighed_sigma_n: f64,
    pub(super) model_n: Option<f64>,
    /// Standard deviation by `[uncertainty]` of the machine file.
    pub(super) model_sigma_n: Option<f64>,
    /// Model less weighed.
    pub(super) difference_n: Option<f64>,
    /// Of what was weighed.
    pub(super) difference_percent: Option<f64>,
    /// The difference by the standard deviation of model and scale together.
    pub(super) sigmas: Option<f64>,
    /// Whether the difference is no more than two of them; null where that is unknown.
    pub(super) is_within: Option<bool>,
}

pub(super) fn posture(machine: &Machine, positions: &[f64], source: String) -> Posture {
    let joints = machine.joints().iter().zip(positions);
    let joints = joints.filter(|(joint, _)| joint.spins_wheel.is_none());
    let position = |(joint, &position): (&MeasuredJoint, &f64)| JointPosition {
        joint: joint.name.clone(),
        position: known(position),
    };
    Posture {
        source,
        joints: joints.map(position).collect(),
    }
}

pub(super) fn names(machine: &Machine, wheels: &[usize]) -> Vec<String> {
    let name = |&wheel: &usize| machine.wheels()[wheel].name.clone();
    wheels.iter().map(name).collect()
}

pub(super) fn triple(vector: &Vector3<f64>) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

//! The checked machine as a JSON document.

use nalgebra::Vector3;
use serde::Serialize;
use tipwatch_binding::{Commissioning, CommissioningItem};
use tipwatch_mechanics::machine::{Machine, MeasuredJoint};

use crate::base::number::known;
use crate::setup::identify::AgreementRow;

/// Version of the JSON document.
pub(super) const SCHEMA: u32 = 1;

/// The machine that a file describes.
#[derive(Debug, Serialize)]
pub struct MachineCheck {
    pub(super) schema: u32,
    pub(super) name: String,
    pub(super) machine_file: String,
    /// The frame of every position.
    pub(super) base_link: String,
    pub(super) gravity_m_s2: f64,
    pub(super) masses: Vec<PartMass>,
    /// Distance between the first and the last axle; null for one axle.
    pub(super) wheelbase_m: Option<f64>,
    pub(super) axles: Vec<Axle>,
    /// Joint positions: those of the log's first valid row, else the reference posture.
    pub(super) posture: Posture,
    pub(super) wheels: Vec<WheelCheck>,
    /// Sums over axles, sides and all wheels.
    pub(super) sums: Vec<SumCheck>,
    pub(super) imu_mounting: String,
    /// Comparison with `[weighed]` of the machine file.
    pub(super) weighed: Option<Weighed>,
    /// Comparison with the postures of `[[weighed.postures]]`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) weighings: Vec<Weighed>,
    /// The weighings against each other, whatever the machine weighs; null if no reading is redundant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) agreement: Option<AgreementRow>,
    pub(super) notes: Vec<String>,
    /// Evidence of the log on signs, axes, order, scale and mounting of the sensors; null without a log.
    pub(super) commissioning: Option<Commissioned>,
}

/// Evidence of a log on its sensors. The time is in the file of the commissioning only, so that the same log gives the same
/// bytes.
#[derive(Debug, Serialize)]
pub(super) struct Commissioned {
    pub(super) items: Vec<CommissioningItem>,
    /// Faults that would explain the contradictions.
    pub(super) explanations: Vec<String>,
}

#[derive(Debug, Serialize)]
pub(super) struct PartMass {
    pub(super) part: &'static str,
    pub(super) mass_kg: f64,
    /// Centre of mass in base axes (m); null without mass.
    pub(super) centre_of_mass_m: Option<[f64; 3]>,
}

#[derive(Debug, Serialize)]
pub(super) struct Axle {
    pub(super) wheels: Vec<String>,
    /// Forward of the base frame's origin.
    pub(super) x_m: f64,
    /// Distance between its outermost wheels; null for one wheel.
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
    /// Position in radians, or metres for a sliding joint.
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
    /// Share of the weight.
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

/// Weighed loads compared with the model.
#[derive(Debug, Serialize)]
pub(super) struct Weighed {
    pub(super) posture: Posture,
    pub(super) readings: Vec<Reading>,
}

/// One weighed load.
#[derive(Debug, Serialize)]
pub(super) struct Reading {
    pub(super) name: String,
    pub(super) wheels: Vec<String>,
    pub(super) weighed_n: f64,
    /// Standard deviation of the scale, from the machine file.
    pub(super) weighed_sigma_n: f64,
    pub(super) model_n: Option<f64>,
    /// Standard deviation by `[uncertainty]` of the machine file.
    pub(super) model_sigma_n: Option<f64>,
    /// Model minus weighed load.
    pub(super) difference_n: Option<f64>,
    /// Difference as a percentage of the weighed load.
    pub(super) difference_percent: Option<f64>,
    /// The difference divided by the combined standard deviation of model and scale.
    pub(super) sigmas: Option<f64>,
    /// Whether the difference is within two standard deviations; null if unknown.
    pub(super) is_within: Option<bool>,
}

/// Standard deviations from which on a weighing contradicts the machine.
const CONTRADICTS_SIGMAS: f64 = 3.0;

impl MachineCheck {
    /// Whether a weighing contradicts the machine, or cannot be compared with it: which of the two is wrong is open.
    #[must_use]
    pub fn leaves_a_weighing_open(&self) -> bool {
        let weighings = self.weighed.iter().chain(&self.weighings);
        let mut readings = weighings.flat_map(|weighed| &weighed.readings);
        readings.any(|reading| {
            reading
                .sigmas
                .is_none_or(|sigmas| sigmas.abs() > CONTRADICTS_SIGMAS)
        })
    }

    /// Whether the weighings contradict each other.
    #[must_use]
    pub fn is_contradicted(&self) -> bool {
        (self.agreement.as_ref()).is_some_and(|agreement| agreement.contradict_each_other)
    }

    /// Adds the result of a commissioning, and a note on its motion.
    #[must_use]
    pub fn with_commissioning(mut self, result: &Commissioning, note: Option<String>) -> Self {
        self.notes.extend(note);
        self.commissioning = Some(Commissioned {
            items: result.items.clone(),
            explanations: result.explanations.clone(),
        });
        self
    }
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

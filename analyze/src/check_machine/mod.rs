//! `check-machine`: what a model weighs, where its centre of mass is and what its wheels carry, beside
//! what scales said.

mod geometry;
mod print;
mod readings;

use std::path::Path;

use anyhow::{Result, ensure};
use nalgebra::Vector3;
use serde::Serialize;
use tipwatch_binding::MachineFile;
use tipwatch_mechanics::machine::{Machine, MeasuredJoint, Wheel};
use tipwatch_mechanics::{MassShare, Standing};

use crate::run::posture_in_log;

use geometry::{axles, sums, wheelbase};
use readings::Weighed;

pub use print::print;

/// Version of the JSON document.
const SCHEMA: u32 = 1;

/// What a machine file describes.
#[derive(Debug, Serialize)]
pub struct MachineCheck {
    schema: u32,
    name: String,
    machine_file: String,
    /// The frame of every position.
    base_link: String,
    gravity_m_s2: f64,
    masses: Vec<PartMass>,
    /// Between the first and the last axle; null of one axle.
    wheelbase_m: Option<f64>,
    axles: Vec<Axle>,
    /// Where the joints are: of the log's first valid row, else zero.
    posture: Posture,
    wheels: Vec<WheelCheck>,
    /// Of axles, sides and the whole machine.
    sums: Vec<SumCheck>,
    imu_mounting: String,
    /// Beside `[weighed]` of the machine file.
    weighed: Option<Weighed>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct PartMass {
    part: &'static str,
    mass_kg: f64,
    /// In `base_link`; null without mass.
    centre_of_mass_m: Option<[f64; 3]>,
}

#[derive(Debug, Serialize)]
struct Axle {
    wheels: Vec<String>,
    /// Forward of the base frame's origin.
    x_m: f64,
    /// Between its outermost wheels; null of one wheel.
    track_m: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Posture {
    source: String,
    joints: Vec<JointPosition>,
}

#[derive(Debug, Serialize)]
struct JointPosition {
    joint: String,
    /// Radians, or metres of a sliding joint.
    position: Option<f64>,
}

#[derive(Debug, Serialize)]
struct WheelCheck {
    wheel: String,
    centre_m: [f64; 3],
    radius_m: f64,
    static_load_n: Option<f64>,
    /// Standard deviation of the load by `[uncertainty]` of the machine file.
    sigma_n: Option<f64>,
    /// As a share of the weight.
    share: Option<f64>,
}

#[derive(Debug, Serialize)]
struct SumCheck {
    name: String,
    wheels: Vec<String>,
    static_load_n: Option<f64>,
    sigma_n: Option<f64>,
    share: Option<f64>,
}

/// Checks a machine file, in the posture of a log's first valid row where there is a log.
///
/// # Errors
/// The machine file does not describe a machine, or the log does not fit it.
pub fn check(file: &MachineFile, log: Option<&Path>) -> Result<MachineCheck> {
    let (machine, positions, source) = match log {
        Some(log) => {
            let (machine, positions) = posture_in_log(log, file)?;
            ensure!(
                positions.iter().all(|p| p.is_finite()),
                "{}: expected a row with the positions of all joints, found none",
                log.display()
            );
            let source = format!("the first valid row of {}", log.display());
            (machine, positions, source)
        }
        None => {
            let machine = file.check_alone()?;
            let zero = vec![0.0; machine.joints().len()];
            (machine, zero, "all joints at zero".into())
        }
    };
    let standing = Standing::new(&machine, &positions);
    let posture = posture(&machine, &positions, source);
    let mut notes = machine.notes().to_vec();
    notes.extend(oddities(&machine, &standing));
    let weighed = file.spec.weighed.as_ref();
    Ok(MachineCheck {
        schema: SCHEMA,
        name: machine.name().into(),
        machine_file: file.path.display().to_string(),
        base_link: machine.base_link().into(),
        gravity_m_s2: machine.gravity(),
        masses: masses(&standing),
        wheelbase_m: wheelbase(&standing),
        axles: axles(&machine, &standing),
        wheels: wheels(&machine, &standing),
        sums: sums(&machine, &standing),
        imu_mounting: imu_mounting(&machine, log.is_some()),
        weighed: weighed.map(|weighed| readings::compare(&machine, weighed, &positions, &posture)),
        posture,
        notes,
    })
}

/// Without a log nothing is known of what the messages name.
fn imu_mounting(machine: &Machine, has_log: bool) -> String {
    let source = &machine.imu().source;
    if has_log || !source.starts_with("assumed") {
        return source.clone();
    }
    "not in the machine file: the log's frame_id tells".into()
}

fn posture(machine: &Machine, positions: &[f64], source: String) -> Posture {
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

fn masses(standing: &Standing) -> Vec<PartMass> {
    let parts = [
        ("platform", standing.chassis),
        ("wheels", standing.wheels),
        ("arm", standing.arm),
        ("payloads", standing.payloads),
        ("whole", standing.whole()),
    ];
    let part = |(part, share): (_, MassShare)| PartMass {
        part,
        mass_kg: share.mass,
        centre_of_mass_m: Some(triple(&share.com)).filter(|com| com.iter().all(|c| c.is_finite())),
    };
    parts.into_iter().map(part).collect()
}

fn wheels(machine: &Machine, standing: &Standing) -> Vec<WheelCheck> {
    let wheel = |(i, wheel): (usize, &Wheel)| {
        let (load, sigma) = standing.load_of(&[i]);
        WheelCheck {
            wheel: wheel.name.clone(),
            centre_m: triple(&standing.wheel_centres[i]),
            radius_m: wheel.radius,
            static_load_n: known(load),
            sigma_n: known(sigma),
            share: known(load / standing.outcome().normal_force),
        }
    };
    machine.wheels().iter().enumerate().map(wheel).collect()
}

/// What a reader should know of a static posture.
fn oddities(machine: &Machine, standing: &Standing) -> Vec<String> {
    let mut notes = Vec::new();
    let loads = &standing.outcome().load;
    if loads.iter().any(|load| !load.is_finite()) {
        notes.push(
            "The static loads cannot be computed in this posture: a linkage cannot close there. Give a log, or a posture."
                .into(),
        );
    }
    let names = machine.wheels().iter().map(|wheel| &wheel.name);
    for (name, _) in names.zip(loads).filter(|(_, load)| **load <= 0.0) {
        notes.push(format!(
            "Wheel {name} carries nothing in this posture: the centre of mass is outside, or the model is wrong."
        ));
    }
    let estimated = machine.payloads().iter().enumerate();
    for (i, _) in estimated.filter(|(_, payload)| payload.is_estimated) {
        notes.push(format!(
            "Payload {}: its mass is estimated from a log; here it counts as nothing.",
            i + 1
        ));
    }
    notes
}

fn names(machine: &Machine, wheels: &[usize]) -> Vec<String> {
    let name = |&wheel: &usize| machine.wheels()[wheel].name.clone();
    wheels.iter().map(name).collect()
}

fn known(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

fn triple(vector: &Vector3<f64>) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

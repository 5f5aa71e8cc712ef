//! Which bodies the suspension moves against each other: the machine as few rigid carriers, each with
//! all that sits on it.
//!
//! A carrier is the base, a body of a suspension's linkage, or a body between those. Every other body
//! (arm, wheels, steering) is counted to the carrier it sits on, with its own motion on it.

use crate::coordinate::Coordinate;
use crate::machine::{Drive, Machine};
use crate::number::Real;

/// A body that carries others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Carrier {
    /// Index of the body.
    pub(super) body: usize,
    /// Index of the carrier that it sits on; the base's is 0, itself.
    pub(super) parent: usize,
    /// What moves it on its parent.
    pub(super) drive: CarrierDrive,
}

/// What moves a carrier on the one it sits on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CarrierDrive {
    /// Nothing that the suspension does.
    Fixed,
    /// The pivot of the actuator of this index.
    Pivot(usize),
    /// The cylinder's hinge of the actuator of this index.
    Cylinder(usize),
    /// The rod of the actuator of this index.
    Rod(usize),
}

/// The carriers of a machine, parents first, the base first.
#[derive(Debug, Clone)]
pub(super) struct Carriers {
    pub(super) carriers: Vec<Carrier>,
    /// The carrier of every body.
    pub(super) of_body: Vec<usize>,
    /// Whether the suspension's rods alone move them against each other.
    pub(super) by_rods_alone: bool,
}

impl Carriers {
    /// `linkages` are those of the suspension, by actuator.
    pub(super) fn of(machine: &Machine, linkages: &[usize]) -> Self {
        let actuator = |linkage: usize| linkages.iter().position(|&l| l == linkage);
        let drives: Vec<CarrierDrive> = machine
            .bodies
            .iter()
            .map(|body| match body.drive {
                Drive::Pivot(l) => actuator(l).map(CarrierDrive::Pivot),
                Drive::Cylinder(l) => actuator(l).map(CarrierDrive::Cylinder),
                Drive::Rod(l) => actuator(l).map(CarrierDrive::Rod),
                Drive::Root | Drive::Measured(_) | Drive::Mimic { .. } => None,
            })
            .map(|drive| drive.unwrap_or(CarrierDrive::Fixed))
            .collect();
        let moved = |body: usize| drives[body] != CarrierDrive::Fixed;
        let bodies = 0..machine.bodies.len();
        let carries = |body: usize| {
            body == 0
                || moved(body)
                || bodies
                    .clone()
                    .any(|other| moved(other) && machine.is_carried_by(other, body))
        };
        let mut found = Self {
            carriers: Vec::new(),
            of_body: Vec::new(),
            by_rods_alone: true,
        };
        for (body, spec) in machine.bodies.iter().enumerate() {
            let below = found.of_body.get(spec.parent).copied().unwrap_or(0);
            if carries(body) {
                found.by_rods_alone &= body == 0 || moved(body);
                found.of_body.push(found.carriers.len());
                found.carriers.push(Carrier {
                    body,
                    parent: below,
                    drive: drives[body],
                });
            } else {
                found.of_body.push(below);
            }
        }
        found
    }
}

/// Coordinates of the joints that an actuator moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActuatorCoordinates<T> {
    pub(super) pivot: Coordinate<T>,
    pub(super) cylinder: Coordinate<T>,
    pub(super) rod: Coordinate<T>,
}

impl CarrierDrive {
    /// The coordinate of a carrier's joint; `fixed` is that of one that no actuator moves.
    pub(super) fn coordinate<T: Real>(
        self,
        actuators: &[ActuatorCoordinates<T>],
        fixed: &Coordinate<f64>,
    ) -> Coordinate<T> {
        match self {
            Self::Fixed => fixed.map(T::constant),
            Self::Pivot(actuator) => actuators[actuator].pivot,
            Self::Cylinder(actuator) => actuators[actuator].cylinder,
            Self::Rod(actuator) => actuators[actuator].rod,
        }
    }
}

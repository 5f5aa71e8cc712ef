//! The machine as a few rigid carriers that the suspension moves relative to each other, each with everything
//! it carries.
//!
//! A carrier is the base, a body of a suspension's linkage, or a body between those. Every other body (arm,
//! wheels, steering) is assigned to the carrier that supports it and moves relative to it.

use tipwatch_mechanics::geometry::coordinate::Coordinate;
use tipwatch_mechanics::machine::{Body, JointCoupling, Machine};
use tipwatch_mechanics::number::Real;

/// A body that supports others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier {
    /// Index of the body.
    pub(crate) body: usize,
    /// Index of the carrier that supports it; the base is its own parent (0).
    pub(crate) parent: usize,
    /// Source of its motion relative to its parent.
    pub(crate) coupling: CarrierCoupling,
    /// The actuator that moves it relative to the base, directly or through its parents; the last one of several.
    pub(crate) actuator: Option<usize>,
}

/// Source of a carrier's motion relative to its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CarrierCoupling {
    /// Not moved by the suspension.
    Fixed,
    /// The pivot of the actuator with this index.
    Pivot(usize),
    /// The cylinder's hinge of the actuator with this index.
    Cylinder(usize),
    /// The rod of the actuator with this index.
    Rod(usize),
}

impl CarrierCoupling {
    fn actuator(self) -> Option<usize> {
        match self {
            Self::Fixed => None,
            Self::Pivot(actuator) | Self::Cylinder(actuator) | Self::Rod(actuator) => {
                Some(actuator)
            }
        }
    }
}

/// The carriers of a machine, parents first, the base first.
#[derive(Debug, Clone)]
pub(crate) struct Carriers {
    pub(crate) carriers: Vec<Carrier>,
    /// The carrier of every body.
    pub(crate) of_body: Vec<usize>,
    /// Whether only the suspension's actuators move the carriers relative to each other.
    pub(crate) by_rods_alone: bool,
    /// Whether no actuator supports another.
    pub(crate) apart: bool,
}

impl Carriers {
    /// `linkages` are the suspension's, by actuator.
    pub(crate) fn of(machine: &Machine, linkages: &[usize]) -> Self {
        let actuator = |linkage: usize| linkages.iter().position(|&l| l == linkage);
        let coupling = |body: &Body| match body.coupling {
            JointCoupling::Pivot(l) => actuator(l).map(CarrierCoupling::Pivot),
            JointCoupling::Cylinder(l) => actuator(l).map(CarrierCoupling::Cylinder),
            JointCoupling::Rod(l) => actuator(l).map(CarrierCoupling::Rod),
            JointCoupling::Root | JointCoupling::Measured(_) | JointCoupling::Mimic { .. } => None,
        };
        let couplings = machine.bodies().iter().map(coupling);
        let couplings: Vec<_> = couplings
            .map(|d| d.unwrap_or(CarrierCoupling::Fixed))
            .collect();
        let moved = |body: usize| couplings[body] != CarrierCoupling::Fixed;
        let carries = |body: usize| {
            let mut others = 0..machine.bodies().len();
            body == 0 || others.any(|other| moved(other) && machine.is_carried_by(other, body))
        };
        let mut found = Self {
            carriers: Vec::new(),
            of_body: Vec::new(),
            by_rods_alone: true,
            apart: true,
        };
        for (body, spec) in machine.bodies().iter().enumerate() {
            let parent = found.of_body.get(spec.parent).copied().unwrap_or(0);
            if !carries(body) {
                found.of_body.push(parent);
                continue;
            }
            let below = found.carriers.get(parent).and_then(|c| c.actuator);
            let own = couplings[body].actuator();
            found.by_rods_alone &= body == 0 || own.is_some();
            found.apart &= own.is_none() || below.is_none() || own == below;
            found.of_body.push(found.carriers.len());
            found.carriers.push(Carrier {
                body,
                parent,
                coupling: couplings[body],
                actuator: own.or(below),
            });
        }
        found
    }
}

/// Coordinates of the joints that one actuator moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActuatorCoordinates<T> {
    pub(crate) pivot: Coordinate<T>,
    pub(crate) cylinder: Coordinate<T>,
    pub(crate) rod: Coordinate<T>,
}

impl CarrierCoupling {
    /// The coordinate of a carrier's joint; `fixed` is that of a joint that no actuator moves.
    pub(crate) fn coordinate<T: Real>(
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

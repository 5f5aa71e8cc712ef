//! The instant that prospects are of: the state of the machine less what its suspension does.

use nalgebra::Vector3;

use super::condensed::Condensed;
use super::prospect::{Prospect, SuspendedMachine};
use crate::coordinate::{Coordinate, Motion};
use crate::kinematics::{self, ImuSeat};
use crate::spatial::rotate_back;
use crate::state::{ImuState, State};

/// All that does not depend on how the rods move.
#[derive(Debug)]
pub(super) struct Instant {
    pub(super) condensed: Condensed,
    /// Coordinates of all joints.
    pub(super) coordinates: Vec<Coordinate<f64>>,
    /// What is felt at the origin of the contact plane's frame, in its axes.
    pub(super) on_ground: ImuState<f64>,
    /// Unit vector against gravity in the same axes; NaN where it is unknown.
    pub(super) up_on_ground: Vector3<f64>,
}

impl Instant {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let none = Vector3::zeros();
        Self {
            condensed: Condensed::new(machine, &suspended.carriers),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            on_ground: ImuState {
                specific_force: none,
                angular_velocity: none,
                angular_acceleration: none,
            },
            up_on_ground: none,
        }
    }

    /// The instant of a state in which the rods move so.
    pub(super) fn fill(
        &mut self,
        suspended: &SuspendedMachine,
        state: &State<f64>,
        rods: &[Motion<f64>],
        scratch: &mut Prospect<f64>,
    ) {
        let machine = &suspended.machine;
        kinematics::coordinates(machine, state, &mut self.coordinates);
        for (rod, &linkage) in rods.iter().zip(&suspended.linkages) {
            let linkage = &machine.linkages[linkage];
            let solved = linkage.solve_by_rod(rod);
            self.coordinates[linkage.bodies.pivot] = solved.pivot;
            self.coordinates[linkage.bodies.cylinder] = solved.cylinder;
            self.coordinates[linkage.bodies.rod] = solved.rod;
        }
        self.condensed
            .fill(machine, &suspended.carriers, state, &self.coordinates);
        let support = scratch.observe(suspended, &self.condensed, &self.coordinates, rods);
        let seat = ImuSeat::of(machine, &self.coordinates);
        let base = kinematics::base_motion(machine, &seat, &state.imu);
        self.on_ground = support.seat.felt(&base);
        self.up_on_ground = rotate_back(&support.seat.rotation, &state.base.up);
    }
}

//! The machine's state at one instant without the motion of its suspension, the basis of predicted states.

use nalgebra::Vector3;

use super::condensed::{Condensed, Whole};
use super::prospect::{Prospect, SuspendedMachine};
use crate::coordinate::{Coordinate, Motion};
use crate::kinematics::{self, BodyMotion, ImuSeat};
use crate::spatial::rotate_back;
use crate::state::{ImuState, State};

/// Everything that does not depend on the motion of the rods.
#[derive(Debug)]
pub(super) struct Instant {
    pub(super) condensed: Condensed,
    /// Motion of the carriers that no actuator moves, relative to a base at rest; by carrier.
    pub(super) fixed_motions: Vec<BodyMotion<f64>>,
    /// Moments and wrench of what they carry.
    pub(super) fixed: Whole<f64>,
    /// Coordinates of all joints.
    pub(super) coordinates: Vec<Coordinate<f64>>,
    /// Specific force and angular motion at the origin of the contact plane's frame, in its axes.
    pub(super) on_ground: ImuState<f64>,
    /// Unit vector pointing up in the same axes; NaN where unknown.
    pub(super) up_on_ground: Vector3<f64>,
}

impl Instant {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let none = Vector3::zeros();
        Self {
            condensed: Condensed::new(machine, &suspended.carriers),
            fixed_motions: vec![
                BodyMotion::base(none, none, none);
                suspended.carriers.carriers.len()
            ],
            fixed: Whole::nothing(),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies.len()],
            on_ground: ImuState {
                specific_force: none,
                angular_velocity: none,
                angular_acceleration: none,
            },
            up_on_ground: none,
        }
    }

    /// Fills it from a state with the given motion of the rods.
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
        self.move_fixed(suspended);
        let support = scratch.observe(suspended, self, rods);
        let seat = ImuSeat::of(machine, &self.coordinates);
        let base = kinematics::base_motion(machine, &seat, &state.imu);
        self.on_ground = support.seat.felt(&base);
        self.up_on_ground = rotate_back(&support.seat.rotation, &state.base.up);
    }

    /// Computes the motion of the carriers that no actuator moves, the base first.
    fn move_fixed(&mut self, suspended: &SuspendedMachine) {
        self.fixed = Whole::nothing();
        for (i, carrier) in suspended.carriers.carriers.iter().enumerate() {
            if carrier.actuator.is_some() {
                continue;
            }
            if i > 0 {
                let body = &suspended.machine.bodies[carrier.body];
                let coordinate = &self.coordinates[carrier.body];
                self.fixed_motions[i] = self.fixed_motions[carrier.parent].carry(body, coordinate);
            }
            self.condensed.carried[i].add_moving(&self.fixed_motions[i], &mut self.fixed);
        }
    }
}

//! The machine's state at one instant without the motion of its suspension, the basis of predicted states.

use nalgebra::Vector3;

use super::condensed_machine::{Condensed, Whole};
use super::suspended_machine::SuspendedMachine;
use tipwatch_mechanics::dynamics::kinematics::BodyMotion;
use tipwatch_mechanics::geometry::coordinate::Coordinate;
use tipwatch_mechanics::state::ImuState;

/// Everything that does not depend on the motion of the rods.
#[derive(Debug)]
pub(crate) struct Instant {
    pub(crate) condensed: Condensed,
    /// Motion of the carriers that no actuator moves, relative to a base at rest; by carrier.
    pub(crate) fixed_motions: Vec<BodyMotion<f64>>,
    /// Moments and wrench of the bodies that they carry.
    pub(crate) fixed: Whole<f64>,
    /// Coordinates of all joints.
    pub(crate) coordinates: Vec<Coordinate<f64>>,
    /// Specific force and angular motion at the origin of the contact plane's frame, in its axes.
    pub(crate) on_ground: ImuState<f64>,
    /// Unit vector pointing up in the same axes; NaN where unknown.
    pub(crate) up_on_ground: Vector3<f64>,
}

impl Instant {
    pub(crate) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let none = Vector3::zeros();
        Self {
            condensed: Condensed::new(machine, &suspended.carriers),
            fixed_motions: vec![
                BodyMotion::base(none, none, none);
                suspended.carriers.carriers.len()
            ],
            fixed: Whole::nothing(),
            coordinates: vec![Coordinate::slid(0.0, 0.0, 0.0); machine.bodies().len()],
            on_ground: ImuState {
                specific_force: none,
                angular_velocity: none,
                angular_acceleration: none,
            },
            up_on_ground: none,
        }
    }

    /// Computes the motion of the carriers that no actuator moves, the base first.
    pub(crate) fn move_fixed(&mut self, suspended: &SuspendedMachine) {
        self.fixed = Whole::nothing();
        for (i, carrier) in suspended.carriers.carriers.iter().enumerate() {
            if carrier.actuator.is_some() {
                continue;
            }
            if i > 0 {
                let body = &suspended.machine.bodies()[carrier.body];
                let coordinate = &self.coordinates[carrier.body];
                self.fixed_motions[i] = self.fixed_motions[carrier.parent].carry(body, coordinate);
            }
            self.condensed.carried[i].add_moving(&self.fixed_motions[i], &mut self.fixed);
        }
    }
}

//! What the wheels would carry, and how far the machine would be from tipping, if the rods moved so.

use nalgebra::{Vector2, Vector3};

use super::carriers::{ActuatorCoordinates, Carriers};
use super::condensed::{Condensed, Whole};
use super::instant::Instant;
use super::support::Support;
use crate::composite::Composite;
use crate::contact_plane::ContactPlane;
use crate::coordinate::{Coordinate, Motion};
use crate::indicators::Standing;
use crate::kinematics::BodyMotion;
use crate::machine::Machine;
use crate::number::{Real, SecondOrder};
use crate::spatial::{Wrench, constant, cross, rotate};
use crate::state::ImuState;
use crate::wheel_loads::{Equations, GroundForce, Solver};

/// Whether a prospect counts the inertia of the rods' own motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Own {
    /// At rest: rates and accelerations of the rods are left out.
    AtRest,
    /// In motion.
    InMotion,
}

/// Loads and stability angles for one motion of the rods, and the scratch to find them.
#[derive(Debug)]
pub(super) struct Prospect<T: Real> {
    /// Signed loads, OTF, by wheel (N).
    pub(super) otf: Vec<T>,
    /// Stability angles by edge (rad).
    pub(super) angle: Vec<T>,
    /// How the base moves.
    pub(super) base: BodyMotion<T>,
    /// Closure of the linkages: below zero where one cannot close.
    pub(super) closure: T,
    actuators: Vec<ActuatorCoordinates<T>>,
    motions: Vec<BodyMotion<T>>,
    centres: Vec<Vector3<T>>,
    moving_centres: Vec<Vector3<SecondOrder<T, 1>>>,
    radii: Vec<T>,
    moving_radii: Vec<SecondOrder<T, 1>>,
    contacts: Vec<Vector2<T>>,
    equations: Equations<T>,
    solver: Solver<T>,
}

/// A machine and which of its linkages are the suspension's.
#[derive(Debug, Clone)]
pub(super) struct SuspendedMachine {
    pub(super) machine: Machine,
    /// Indices of the linkages, by actuator.
    pub(super) linkages: Vec<usize>,
    pub(super) carriers: Carriers,
}

impl<T: Real> Prospect<T> {
    pub(super) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let (wheels, o) = (machine.wheels.len(), T::zero());
        let none = Vector3::new(o, o, o);
        let rest = Coordinate::slid(o, o, o);
        let radius = |wheel: &crate::machine::Wheel| T::constant(wheel.radius);
        let radii: Vec<T> = machine.wheels.iter().map(radius).collect();
        Self {
            otf: vec![o; wheels],
            angle: vec![o; machine.polygon.edges.len()],
            base: BodyMotion::base(none, none, none),
            closure: o,
            actuators: vec![
                ActuatorCoordinates {
                    pivot: rest,
                    cylinder: rest,
                    rod: rest
                };
                suspended.linkages.len()
            ],
            motions: vec![BodyMotion::base(none, none, none); suspended.carriers.carriers.len()],
            centres: vec![none; wheels],
            moving_centres: vec![none.map(SecondOrder::fixed); wheels],
            moving_radii: radii.iter().map(|&r| SecondOrder::fixed(r)).collect(),
            radii,
            contacts: vec![Vector2::new(o, o); wheels],
            equations: Equations::new(machine),
            solver: Solver::new(machine, false),
        }
    }

    /// The contact plane of an instant with the rods moving so, as they do.
    pub(super) fn observe(
        &mut self,
        suspended: &SuspendedMachine,
        condensed: &Condensed,
        coordinates: &[Coordinate<f64>],
        rods: &[Motion<T>],
    ) -> Support<T> {
        self.move_carriers(suspended, condensed, coordinates, rods, Own::InMotion);
        self.support(suspended, condensed, Own::InMotion)
    }

    /// Fills in what comes of the rods moving so. Angles only where `with_angles`.
    pub(super) fn fill(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rods: &[Motion<T>],
        own: Own,
        with_angles: bool,
    ) {
        let machine = &suspended.machine;
        let whole = self.move_carriers(
            suspended,
            &instant.condensed,
            &instant.coordinates,
            rods,
            own,
        );
        let support = self.support(suspended, &instant.condensed, own);
        let felt = ImuState {
            specific_force: constant(&instant.on_ground.specific_force),
            angular_velocity: constant(&instant.on_ground.angular_velocity),
            angular_acceleration: constant(&instant.on_ground.angular_acceleration),
        };
        self.base = support.seat.base_motion(&felt, own == Own::InMotion);
        let ground = whole.moved(&self.base);
        let plane = self.load_wheels(machine, support.plane, &ground);
        if with_angles {
            let up = rotate(&support.seat.rotation, &constant(&instant.up_on_ground));
            self.stability_angles(machine, &plane, &whole.moments, &up);
        }
    }

    /// Poses, and unless `own` is at rest motions, of the carriers relative to a base at rest.
    fn move_carriers(
        &mut self,
        suspended: &SuspendedMachine,
        condensed: &Condensed,
        coordinates: &[Coordinate<f64>],
        rods: &[Motion<T>],
        own: Own,
    ) -> Whole<T> {
        let machine = &suspended.machine;
        self.closure = T::one();
        for ((rod, &linkage), moved) in rods
            .iter()
            .zip(&suspended.linkages)
            .zip(&mut self.actuators)
        {
            let solved = machine.linkages[linkage].solve_by_rod(rod);
            self.closure = self.closure.min(solved.closure);
            *moved = ActuatorCoordinates {
                pivot: solved.pivot,
                cylinder: solved.cylinder,
                rod: solved.rod,
            };
        }
        let mut whole = Whole {
            moments: Composite::zero(),
            wrench: Wrench::zero(),
        };
        for (i, carrier) in suspended.carriers.carriers.iter().enumerate() {
            if i > 0 {
                let fixed = &coordinates[carrier.body];
                let coordinate = carrier.drive.coordinate(&self.actuators, fixed);
                let body = &machine.bodies[carrier.body];
                self.motions[i] = self.motions[carrier.parent].carry(body, &coordinate);
            }
            let carried = &condensed.carried[i];
            // with the rods at rest nothing moves the carriers but joints between them
            if own == Own::AtRest && suspended.carriers.by_rods_alone {
                carried.add_resting(&self.motions[i], &mut whole);
            } else {
                carried.add_moving(&self.motions[i], &mut whole);
            }
        }
        whole
    }

    /// The contact plane where the carriers are, and unless `own` is at rest how it moves.
    fn support(
        &mut self,
        suspended: &SuspendedMachine,
        condensed: &Condensed,
        own: Own,
    ) -> Support<T> {
        let machine = &suspended.machine;
        for (wheel, spec) in machine.wheels.iter().enumerate() {
            self.radii[wheel] = T::constant(spec.radius);
            let motion = &self.motions[suspended.carriers.of_body[spec.body]];
            let arm = rotate(&motion.rotation, &constant(&condensed.wheel_centres[wheel]));
            self.centres[wheel] = motion.origin + arm;
            if own == Own::InMotion {
                let (w, alpha) = (&motion.angular_velocity, &motion.angular_acceleration);
                let swept = cross(w, &arm);
                let velocity = motion.velocity + swept;
                let acceleration = motion.specific_force + cross(alpha, &arm) + cross(w, &swept);
                let place = &self.centres[wheel];
                let jet = |k: usize| SecondOrder::motion(place[k], velocity[k], acceleration[k]);
                self.moving_centres[wheel] = Vector3::new(jet(0), jet(1), jet(2));
            }
        }
        let differ = machine.contact.radii_differ;
        match own {
            Own::AtRest => Support::at_rest(&self.centres, &self.radii, differ),
            Own::InMotion => Support::moving(&self.moving_centres, &self.moving_radii, differ),
        }
    }

    /// The signed loads, all wheels held to the ground; tyres that deflect are solved for twice, as in
    /// [`evaluate`](crate::evaluate). Gives the plane that the wheels stand on.
    fn load_wheels(
        &mut self,
        machine: &Machine,
        plane: ContactPlane<T>,
        ground: &Wrench<T>,
    ) -> ContactPlane<T> {
        self.hold_down(machine, &plane, ground);
        if !machine.contact.tyres_deflect {
            return plane;
        }
        for (wheel, spec) in machine.wheels.iter().enumerate() {
            let compliance = spec.stiffness.map_or(0.0, |stiffness| 1.0 / stiffness);
            self.radii[wheel] -= self.otf[wheel] * T::constant(compliance);
        }
        let plane = ContactPlane::through(&self.centres, &self.radii, true);
        self.hold_down(machine, &plane, ground);
        plane
    }

    fn hold_down(&mut self, machine: &Machine, plane: &ContactPlane<T>, ground: &Wrench<T>) {
        for (contact, centre) in self.contacts.iter_mut().zip(&self.centres) {
            *contact = plane.coordinates(centre);
        }
        let force = GroundForce::in_plane(ground, plane);
        self.equations.set_equilibrium(&force, &self.contacts);
        self.equations.set_offsets(machine, plane, &self.centres);
        self.solver
            .hold_down(machine, &self.equations, &mut self.otf);
    }

    fn stability_angles(
        &mut self,
        machine: &Machine,
        plane: &ContactPlane<T>,
        moments: &Composite<T>,
        up: &Vector3<T>,
    ) {
        let com = moments.first * (T::one() / moments.mass);
        let standing = Standing::over(plane, &self.contacts, &com);
        let resting = Wrench {
            force: up * T::constant(machine.gravity),
            ..Wrench::zero()
        };
        for (angle, edge) in self.angle.iter_mut().zip(&machine.polygon.edges) {
            *angle = standing.angle(edge, &resting);
        }
    }
}

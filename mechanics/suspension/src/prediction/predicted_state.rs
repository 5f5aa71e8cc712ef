//! Predicted state: loads and stability angles for a candidate motion of the rods.

use nalgebra::{Vector2, Vector3};

use super::actuator_number::FromActuator;
use super::support::Support;
use crate::condensed::ActuatorCoordinates;
use crate::condensed::Instant;
use crate::condensed::SuspendedMachine;
use crate::condensed::Whole;
use tipwatch_mechanics::dynamics::composite::Composite;
use tipwatch_mechanics::dynamics::kinematics::{self, BodyMotion, SensorFrame};
use tipwatch_mechanics::explain::indicators::TippingAngles;
use tipwatch_mechanics::geometry::contact_plane::ContactPlane;
use tipwatch_mechanics::geometry::coordinate::{Coordinate, Motion};
use tipwatch_mechanics::geometry::spatial::{
    Wrench, constant, cross, rotate_back, rotate_constant,
};
use tipwatch_mechanics::machine::Machine;
use tipwatch_mechanics::number::{Jet, Real};
use tipwatch_mechanics::state::{ImuState, State};
use tipwatch_mechanics::wheel_loads::{Equations, GroundForce, Solver};

/// Whether a prediction includes the inertia forces of the rods' motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RodMotion {
    /// No: velocities and accelerations of the rods are zero.
    AtRest,
    /// Yes.
    InMotion,
}

/// Loads and stability angles for one motion of the rods, with scratch memory.
#[derive(Debug)]
pub(crate) struct PredictedState<T: Real, A: Real = T> {
    /// Signed loads, OTF, by wheel (N).
    pub(crate) otf: Vec<T>,
    /// Stability angles by edge (rad).
    pub(crate) angle: Vec<T>,
    /// Centre of mass of the whole machine in base axes (m), if angles are computed.
    pub(crate) com: Vector3<T>,
    /// Motion of the base.
    pub(crate) base: BodyMotion<T>,
    /// Coordinates of each actuator.
    actuators: Vec<ActuatorCoordinates<A>>,
    /// Motion of each carrier that an actuator moves, relative to a base at rest.
    motions: Vec<BodyMotion<A>>,
    /// Moments and wrenches of the moved parts, by actuator.
    parts: Vec<Whole<A>>,
    centres: Vec<Vector3<T>>,
    moving_centres: Vec<Vector3<Jet<T>>>,
    radii: Vec<T>,
    moving_radii: Vec<Jet<T>>,
    pub(crate) contacts: Vec<Vector2<T>>,
    equations: Equations<T>,
    solver: Solver<T>,
}

impl<T: FromActuator<A>, A: Real> PredictedState<T, A> {
    pub(crate) fn new(suspended: &SuspendedMachine) -> Self {
        let machine = &suspended.machine;
        let (wheels, actuators) = (machine.wheels().len(), suspended.linkages.len());
        let still = BodyMotion::base(Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let rest = Coordinate::slid(0.0, 0.0, 0.0).map(A::constant);
        let none = constant::<T>(&Vector3::zeros());
        let radius = |wheel: &tipwatch_mechanics::machine::Wheel| T::constant(wheel.radius);
        let radii: Vec<T> = machine.wheels().iter().map(radius).collect();
        let at_rest = ActuatorCoordinates {
            pivot: rest,
            cylinder: rest,
            rod: rest,
        };
        Self {
            otf: vec![T::zero(); wheels],
            angle: vec![T::zero(); machine.polygon().edges().len()],
            com: none,
            base: still.map(T::constant),
            actuators: vec![at_rest; actuators],
            motions: vec![still.map(A::constant); suspended.carriers.carriers.len()],
            parts: vec![Whole::nothing(); actuators],
            centres: vec![none; wheels],
            moving_centres: vec![none.map(Jet::fixed); wheels],
            moving_radii: radii.iter().map(|&r| Jet::fixed(r)).collect(),
            radii,
            contacts: vec![Vector2::new(T::zero(), T::zero()); wheels],
            equations: Equations::new(machine),
            solver: Solver::new(machine, false),
        }
    }

    /// The contact plane of an instant for a motion of the rods.
    pub(crate) fn observe(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rods: &[Motion<A>],
    ) -> Support<T> {
        self.move_carriers(suspended, instant, rods, RodMotion::InMotion);
        self.support(suspended, instant, RodMotion::InMotion)
    }

    /// Computes the predicted state for a motion of the rods; angles only if `with_angles`.
    pub(crate) fn fill(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rods: &[Motion<A>],
        rod_motion: RodMotion,
        with_angles: bool,
    ) {
        let machine = &suspended.machine;
        self.move_carriers(suspended, instant, rods, rod_motion);
        let whole = self.sum_moments(suspended, instant, rod_motion);
        let support = self.support(suspended, instant, rod_motion);
        let measured = ImuState {
            specific_force: constant(&instant.on_ground.specific_force),
            angular_velocity: constant(&instant.on_ground.angular_velocity),
            angular_acceleration: constant(&instant.on_ground.angular_acceleration),
        };
        self.base = support
            .sensor_frame
            .base_motion(&measured, rod_motion == RodMotion::InMotion);
        let ground = whole.moved(&self.base);
        let plane = self.load_wheels(machine, support.plane, &ground);
        if with_angles {
            let up = rotate_constant(&support.sensor_frame.rotation, &instant.up_on_ground);
            self.stability_angles(machine, &plane, &whole.moments, &up);
        }
    }

    /// Poses of the carriers relative to a base at rest, and their motion unless `rod_motion` is at rest.
    fn move_carriers(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rods: &[Motion<A>],
        rod_motion: RodMotion,
    ) {
        let (machine, carriers) = (&suspended.machine, &suspended.carriers);
        for ((rod, &linkage), moved) in rods
            .iter()
            .zip(&suspended.linkages)
            .zip(&mut self.actuators)
        {
            let solved = machine.linkages()[linkage].solve_by_rod(rod);
            *moved = ActuatorCoordinates {
                pivot: solved.pivot,
                cylinder: solved.cylinder,
                rod: solved.rod,
            };
        }
        let at_rest = rod_motion == RodMotion::AtRest && carriers.by_rods_alone;
        for (i, carrier) in carriers.carriers.iter().enumerate() {
            if carrier.actuator.is_none() {
                continue;
            }
            let body = &machine.bodies()[carrier.body];
            let fixed = &instant.coordinates[carrier.body];
            let coordinate = carrier.coupling.coordinate(&self.actuators, fixed);
            let parent = &carriers.carriers[carrier.parent];
            self.motions[i] = if carrier.parent == 0 {
                BodyMotion::on_resting_base(body, &coordinate)
            } else if parent.actuator.is_none() {
                let parent = instant.fixed_motions[carrier.parent].map(A::constant);
                parent.carry(body, &coordinate)
            } else if at_rest {
                self.motions[carrier.parent].carry_at_rest(body, &coordinate)
            } else {
                self.motions[carrier.parent].carry(body, &coordinate)
            };
        }
    }

    /// Moments and wrench of the whole machine.
    fn sum_moments(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rod_motion: RodMotion,
    ) -> Whole<T> {
        let carriers = &suspended.carriers;
        let at_rest = rod_motion == RodMotion::AtRest && carriers.by_rods_alone;
        self.parts.fill(Whole::nothing());
        for (i, carrier) in carriers.carriers.iter().enumerate() {
            let Some(actuator) = carrier.actuator else {
                continue;
            };
            let carried = &instant.condensed.carried[i];
            let part = &mut self.parts[actuator];
            if at_rest {
                carried.add_resting(&self.motions[i], part);
            } else {
                carried.add_moving(&self.motions[i], part);
            }
        }
        let mut whole = Whole::nothing();
        whole.add(&instant.fixed, T::constant);
        for (actuator, part) in self.parts.iter().enumerate() {
            whole.add(part, |alone| T::from_actuator(alone, actuator));
        }
        whole
    }

    /// The contact plane at the carriers' poses, and its motion unless `rod_motion` is at rest.
    fn support(
        &mut self,
        suspended: &SuspendedMachine,
        instant: &Instant,
        rod_motion: RodMotion,
    ) -> Support<T> {
        let machine = &suspended.machine;
        for (wheel, spec) in machine.wheels().iter().enumerate() {
            self.radii[wheel] = T::constant(spec.radius);
            let carrier = suspended.carriers.of_body[spec.body];
            let centre = &instant.condensed.wheel_centres[wheel];
            let Some(actuator) = suspended.carriers.carriers[carrier].actuator else {
                let [place, velocity, acceleration] =
                    point_motion(&instant.fixed_motions[carrier], centre);
                let constant = |x: f64| T::constant(x);
                self.centres[wheel] = place.map(constant);
                self.moving_centres[wheel] = jet(&place, &velocity, &acceleration, constant);
                continue;
            };
            let motion = &self.motions[carrier];
            let among = |alone| T::from_actuator(alone, actuator);
            match rod_motion {
                RodMotion::AtRest => self.centres[wheel] = motion.point(centre).map(among),
                RodMotion::InMotion => {
                    let [place, velocity, acceleration] = point_motion(motion, centre);
                    self.centres[wheel] = place.map(among);
                    self.moving_centres[wheel] = jet(&place, &velocity, &acceleration, among);
                }
            }
        }
        let differ = machine.contact().radii_differ;
        match rod_motion {
            RodMotion::AtRest => Support::at_rest(&self.centres, &self.radii, differ),
            RodMotion::InMotion => Support::moving(
                &self.moving_centres,
                &self.moving_radii,
                &self.centres,
                &self.radii,
                differ,
            ),
        }
    }

    /// Signed loads with all wheels held to the ground; deflecting tyres are solved for twice, as in
    /// [`evaluate`](tipwatch_mechanics::evaluate). Returns the contact plane.
    fn load_wheels(
        &mut self,
        machine: &Machine,
        plane: ContactPlane<T>,
        ground: &Wrench<T>,
    ) -> ContactPlane<T> {
        self.hold_down(machine, &plane, ground);
        if !machine.contact().tyres_deflect {
            return plane;
        }
        for (wheel, spec) in machine.wheels().iter().enumerate() {
            let compliance = spec.stiffness.map_or(0.0, |stiffness| 1.0 / stiffness);
            self.radii[wheel] -= self.otf[wheel].scaled(compliance);
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
        self.com = moments.first * (T::one() / moments.mass);
        let angles = TippingAngles::over(plane, &self.contacts, &self.com);
        let resting = Wrench {
            force: up.map(|x| x.scaled(machine.gravity())),
            ..Wrench::zero()
        };
        for (angle, edge) in self.angle.iter_mut().zip(machine.polygon().edges()) {
            *angle = angles.angle(edge, &resting);
        }
    }
}

impl Instant {
    /// Fills the instant from a state with the given motion of the rods.
    pub(crate) fn fill(
        &mut self,
        suspended: &SuspendedMachine,
        state: &State<f64>,
        rods: &[Motion<f64>],
        scratch: &mut PredictedState<f64>,
    ) {
        let machine = &suspended.machine;
        kinematics::coordinates(machine, state, &mut self.coordinates);
        for (rod, &linkage) in rods.iter().zip(&suspended.linkages) {
            let linkage = &machine.linkages()[linkage];
            let solved = linkage.solve_by_rod(rod);
            self.coordinates[linkage.bodies.pivot] = solved.pivot;
            self.coordinates[linkage.bodies.cylinder] = solved.cylinder;
            self.coordinates[linkage.bodies.rod] = solved.rod;
        }
        self.condensed
            .fill(machine, &suspended.carriers, state, &self.coordinates);
        self.move_fixed(suspended);
        let support = scratch.observe(suspended, self, rods);
        let sensor_frame = SensorFrame::of(machine, &self.coordinates);
        let base = kinematics::base_motion(machine, &sensor_frame, &state.imu);
        self.on_ground = support.sensor_frame.measured(&base);
        self.up_on_ground = rotate_back(&support.sensor_frame.rotation, &state.base.up);
    }
}

/// Position, velocity and acceleration of a point of a body.
fn point_motion<U: Real>(motion: &BodyMotion<U>, point: &Vector3<f64>) -> [Vector3<U>; 3] {
    let arm = rotate_constant(&motion.rotation, point);
    let (w, alpha) = (&motion.angular_velocity, &motion.angular_acceleration);
    let swept = cross(w, &arm);
    [
        motion.origin + arm,
        motion.velocity + swept,
        motion.specific_force + cross(alpha, &arm) + cross(w, &swept),
    ]
}

fn jet<U: Real, T: Real>(
    place: &Vector3<U>,
    velocity: &Vector3<U>,
    acceleration: &Vector3<U>,
    convert: impl Fn(U) -> T,
) -> Vector3<Jet<T>> {
    let of = |k: usize| Jet {
        value: convert(place[k]),
        first: convert(velocity[k]),
        second: convert(acceleration[k]),
    };
    Vector3::new(of(0), of(1), of(2))
}

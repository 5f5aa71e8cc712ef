//! The analytic model applied to a state: eleven terms, motion of the wheels, and the ground wrench.

use nalgebra::Vector2;

use super::{
    Counted, DemandContributions, EdgeMoments, MeasuredMotion, PlacedPlatform, PlanarMotion,
    PlatformParts, PlatformPose, PointVelocity, Terms, axle_heading, heading_of_spin_axis,
};
use crate::dynamics::kinematics::BodyMotion;
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::{Wrench, cross, z_axis};
use crate::machine::Machine;
use crate::number::Real;
use crate::state::BaseState;

/// Source of the platform's acceleration in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosedFormInput {
    /// Velocities and their derivatives, as in the paper.
    Velocity,
    /// The accelerometer: no velocity needs to be known or differentiated. Terms 7 and 8 then include term 9 of
    /// the paper.
    Accelerometer,
}

/// Results of the analytic model besides the loads.
#[derive(Debug, Clone)]
pub struct ClosedFormOutcome<T> {
    /// The terms of each wheel (61)-(108), by index of the machine's wheels (N). The ninth is NaN with the
    /// accelerometer as input: it is included in the seventh and eighth.
    pub terms: Vec<[T; 11]>,
    /// Motion of each wheel, by index of the machine's wheels.
    pub wheels: Vec<GroundMotion<T>>,
    /// Motion of the front and of the rear axle.
    pub axles: [GroundMotion<T>; 2],
}

/// Motion of a wheel or an axle, (12)-(31).
#[derive(Debug, Clone, Copy)]
pub struct GroundMotion<T> {
    /// Speed (m/s).
    pub speed: T,
    /// Direction from forward, counter-clockwise (rad); NaN at standstill.
    pub direction: T,
    /// Sideslip angle from heading to direction of motion, counter-clockwise (rad); NaN at standstill.
    pub sideslip: T,
}

/// The motion of the machine, as input of the model.
pub(crate) struct Moving<'a, T: Real> {
    pub(crate) machine: &'a Machine,
    pub(crate) motions: &'a [BodyMotion<T>],
    pub(crate) known: &'a BaseState<T>,
    /// Wrench of the arm on the platform about the base origin, base axes: the negative of the wrench that
    /// accelerates the arm, plus the tool wrench.
    pub(crate) arm: &'a Wrench<T>,
}

/// Load that the ground must support, in platform axes: its normal force, and its moments about the base origin projected on to
/// the ground.
pub(crate) struct Held<T> {
    /// (N)
    pub(crate) normal: T,
    /// (N m)
    pub(crate) moment: Vector2<T>,
    /// MHS-type, TOM and ITOM.
    pub(crate) edge_moments: [EdgeMoments<T>; 3],
}

impl<T: Real> GroundMotion<T> {
    fn of(velocity: &PointVelocity<T>, heading: &Vector2<T>) -> Self {
        Self {
            speed: velocity.speed(),
            direction: velocity.direction(),
            sideslip: velocity.sideslip(heading),
        }
    }

    fn unknown() -> Self {
        let unknown = T::constant(f64::NAN);
        Self {
            speed: unknown,
            direction: unknown,
            sideslip: unknown,
        }
    }
}

impl<T: Real> ClosedFormOutcome<T> {
    pub(crate) fn blank(machine: &Machine) -> Self {
        let wheels = machine.wheels.len();
        Self {
            terms: vec![[T::constant(f64::NAN); 11]; wheels],
            wheels: vec![GroundMotion::unknown(); wheels],
            axles: [GroundMotion::unknown(); 2],
        }
    }

    /// Fills the solution; returns the load that the ground must support.
    pub(crate) fn fill(
        &mut self,
        parts: &PlatformParts,
        placed: &PlacedPlatform<T>,
        input: ClosedFormInput,
        moving: &Moving<'_, T>,
    ) -> Held<T> {
        let (platform, pose) = (&placed.platform, &placed.pose);
        let up = pose.direction(&moving.known.up);
        let arm = pose.wrench_at(moving.arm, &platform.arm_base);
        let planar = planar_motion(pose, moving);
        let contributions = match input {
            ClosedFormInput::Velocity => {
                DemandContributions::of_motion(platform, &up, &planar, &arm)
            }
            ClosedFormInput::Accelerometer => {
                let measured = measured_motion(pose, moving);
                DemandContributions::of_measured(platform, &up, &measured, &arm)
            }
        };
        self.fill_terms(parts, &contributions.terms(platform), input);
        self.fill_travel(parts, placed, &planar, moving);
        let b = contributions.sum();
        // Move the reference from the point below C to the projected base origin.
        let centre = pose.direction(&pose.centre);
        Held {
            normal: b.b3,
            moment: Vector2::new(b.b1 + centre.y * b.b3, b.b2 - centre.x * b.b3),
            edge_moments: [Counted::MHS, Counted::TOM, Counted::ITOM]
                .map(|counted| contributions.edge_moments(platform, counted)),
        }
    }

    fn fill_terms(&mut self, parts: &PlatformParts, terms: &Terms<T>, input: ClosedFormInput) {
        for (&wheel, terms) in parts.wheels().iter().zip(&terms.wheel) {
            self.terms[wheel] = *terms;
            if input == ClosedFormInput::Accelerometer {
                self.terms[wheel][8] = T::constant(f64::NAN);
            }
        }
    }

    fn fill_travel(
        &mut self,
        parts: &PlatformParts,
        placed: &PlacedPlatform<T>,
        planar: &PlanarMotion<T>,
        moving: &Moving<'_, T>,
    ) {
        let velocities = planar.velocities(&placed.platform);
        let headings = parts.wheels().map(|wheel| {
            let body = moving.machine.wheels[wheel].body;
            let axis = z_axis(&moving.motions[body].rotation);
            heading_of_spin_axis(&placed.pose.direction(&axis))
        });
        for (corner, &wheel) in parts.wheels().iter().enumerate() {
            self.wheels[wheel] = GroundMotion::of(&velocities.wheels[corner], &headings[corner]);
        }
        let [fl, fr, rr, rl] = &headings;
        self.axles = [
            GroundMotion::of(&velocities.front, &axle_heading(fl, fr)),
            GroundMotion::of(&velocities.rear, &axle_heading(rl, rr)),
        ];
    }
}

/// Velocity of C = v + w x c, the derivative of its components vdot + alpha x c; yaw about the normal.
fn planar_motion<T: Real>(pose: &PlatformPose<T>, moving: &Moving<'_, T>) -> PlanarMotion<T> {
    let base = &moving.motions[0];
    let (w, alpha) = (&base.angular_velocity, &base.angular_acceleration);
    let velocity = pose.direction(&(moving.known.velocity + cross(w, &pose.centre)));
    let rate = pose.direction(&(moving.known.velocity_rate + cross(alpha, &pose.centre)));
    PlanarMotion {
        v_x: velocity.x,
        v_y: velocity.y,
        vdot_x: rate.x,
        vdot_y: rate.y,
        yaw_rate: pose.direction(w).z,
        yaw_acceleration: pose.direction(alpha).z,
    }
}

fn measured_motion<T: Real>(pose: &PlatformPose<T>, moving: &Moving<'_, T>) -> MeasuredMotion<T> {
    let base = &moving.motions[0];
    let (w, alpha) = (&base.angular_velocity, &base.angular_acceleration);
    MeasuredMotion {
        specific_force: pose.specific_force_at_centre(&base.specific_force, w, alpha),
        yaw_rate: pose.direction(w).z,
        yaw_acceleration: pose.direction(alpha).z,
    }
}

impl<T: Real> PlacedPlatform<T> {
    /// The contact plane under the platform.
    pub(crate) fn contact_plane(&self) -> ContactPlane<T> {
        let [forward, left, normal] = [0, 1, 2].map(|row| {
            let row = self.pose.platform_from_base.row(row);
            row.transpose().into_owned()
        });
        ContactPlane {
            forward,
            left,
            normal,
            height: normal.dot(&self.pose.centre) - self.platform.com_height,
            slope: Vector2::new(-normal.x / normal.z, -normal.y / normal.z),
        }
    }

    /// Returns the platform as a constant for every sample.
    pub(crate) fn constant(placed: &PlacedPlatform<f64>) -> Self {
        let c = T::constant;
        Self {
            platform: super::Platform::constant(&placed.platform),
            pose: PlatformPose {
                platform_from_base: placed.pose.platform_from_base.map(c),
                centre: placed.pose.centre.map(c),
            },
            inertia: placed.inertia.map(c),
            contacts: placed.contacts.map(|contact| contact.map(c)),
        }
    }
}

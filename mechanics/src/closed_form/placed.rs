//! The platform of a machine in a posture: its parameters and the pose of its frame.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::{ClosedFormError, Platform, PlatformParts, PlatformPose};
use crate::dynamics::composite::{Composite, InertialParameters};
use crate::dynamics::kinematics::{BodyMotion, RestingBodies};
use crate::geometry::contact_plane::ContactPlane;
use crate::geometry::spatial::rotate;
use crate::machine::Machine;
use crate::number::Real;
use crate::state::resting_state;

/// Deviation of the wheels from the model's rectangle allowed, as a fraction of wheelbase or track.
const OFF_RECTANGLE_SHARE: f64 = 0.02;

/// A platform and its pose.
#[derive(Debug, Clone, Copy)]
pub struct PlacedPlatform<T> {
    /// Its parameters.
    pub platform: Platform<T>,
    /// Its frame in the base frame.
    pub pose: PlatformPose<T>,
    /// Its inertia tensor about C in platform axes (kg m^2); the loads need I_xz and I_yz only.
    pub inertia: Matrix3<T>,
    /// Contact points of the wheels, in platform axes from C (m), by [`Corner`](super::Corner); the platform uses
    /// the means of each axle and side.
    pub contacts: [Vector2<T>; 4],
}

impl PlatformParts {
    /// The platform at these joint positions (rad or m), in the order of [`Machine::joints`], for the `machine`
    /// whose parts these are. Tyres have their unloaded radius; without an arm, the arm's attachment point is C.
    ///
    /// # Errors
    /// [`ClosedFormError`]: the posture does not exist, or its wheels do not form a rectangle.
    pub fn place(
        &self,
        machine: &Machine,
        joint_positions: &[f64],
    ) -> Result<PlacedPlatform<f64>, ClosedFormError> {
        let motions = posture(machine, joint_positions)?;
        let placed = self.placed(machine, &motions);
        check_rectangle(&placed)?;
        Ok(placed)
    }

    /// The platform at a given pose of all bodies, without allocation or checks: wheels that do not form a
    /// rectangle are replaced by the means of their axle and side.
    pub(crate) fn placed<T: Real>(
        &self,
        machine: &Machine,
        motions: &[BodyMotion<T>],
    ) -> PlacedPlatform<T> {
        let InertialParameters {
            mass,
            centre,
            tensor,
        } = self.composite(motions);
        let wheels = self.wheels.map(|wheel| &machine.wheels[wheel]);
        let centres = wheels.map(|wheel| motions[wheel.body].point(&wheel.centre_in_body));
        let radii = wheels.map(|wheel| T::constant(wheel.radius));
        let plane = ContactPlane::through(&centres, &radii, machine.contact.radii_differ);
        let axes = [plane.forward, plane.left, plane.normal].map(|axis| axis.transpose());
        let pose = PlatformPose {
            platform_from_base: Matrix3::from_rows(&axes),
            centre,
        };
        let contacts = centres.map(|wheel| pose.point(&wheel).xy());
        let com_height = plane.normal.dot(&centre) - plane.height;
        let (wheel_mass, wheel_moment) = self.wheel_moment(machine, motions, &pose, com_height);
        let inertia = in_axes(&pose.platform_from_base, &tensor);
        let rectangle = Platform {
            gravity: T::constant(machine.gravity),
            mass,
            com_height,
            wheel_mass,
            wheel_moment,
            inertia_xz: inertia.m13,
            inertia_yz: inertia.m23,
            roll_moment_distribution: T::constant(self.roll_moment_distribution),
            arm_base: self.arm_base_from_centre(motions, &pose),
            ..Platform::zero()
        };
        PlacedPlatform {
            platform: on_mean_rectangle(rectangle, &contacts),
            pose,
            inertia,
            contacts,
        }
    }

    /// The platform's bodies treated as one, about the base origin in base axes: (21) of the second paper over
    /// everything other than arm and wheels.
    fn composite<T: Real>(&self, motions: &[BodyMotion<T>]) -> InertialParameters<T> {
        let mut sum = Composite::zero();
        for (body, part) in &self.chassis {
            sum.add(&Composite::at_rest(part, &motions[*body]));
        }
        sum.inertial_parameters()
    }

    /// Mass of the wheels (kg) and their first moment from the point of the plane below C (kg m).
    fn wheel_moment<T: Real>(
        &self,
        machine: &Machine,
        motions: &[BodyMotion<T>],
        pose: &PlatformPose<T>,
        com_height: T,
    ) -> (T, Vector3<T>) {
        let below = Vector3::new(T::zero(), T::zero(), com_height);
        let (mut mass, mut moment) = (T::zero(), Vector3::zeros());
        for wheel in self.wheels {
            let body = machine.wheels[wheel].body;
            let inertia = &machine.bodies[body].inertia;
            let com = pose.point(&motions[body].point(&inertia.com)) + below;
            mass += T::constant(inertia.mass);
            moment += com * T::constant(inertia.mass);
        }
        (mass, moment)
    }

    fn arm_base_from_centre<T: Real>(
        &self,
        motions: &[BodyMotion<T>],
        pose: &PlatformPose<T>,
    ) -> Vector3<T> {
        self.arm_base.map_or(Vector3::zeros(), |(body, point)| {
            pose.point(&motions[body].point(&point))
        })
    }
}

/// A tensor in rotated axes: R I R'.
fn in_axes<T: Real>(rotation: &Matrix3<T>, tensor: &Matrix3<T>) -> Matrix3<T> {
    let rows = [0, 1, 2].map(|row| -> Vector3<T> { rotation.row(row).transpose().into_owned() });
    let columns = rows.map(|row| rotate(tensor, &row));
    let at = |i: usize, j: usize| rows[i].dot(&columns[j]);
    let (xy, xz, yz) = (at(0, 1), at(0, 2), at(1, 2));
    Matrix3::new(at(0, 0), xy, xz, xy, at(1, 1), yz, xz, yz, at(2, 2))
}

/// The platform with its wheels at the mean positions of each axle and side.
fn on_mean_rectangle<T: Real>(platform: Platform<T>, contacts: &[Vector2<T>; 4]) -> Platform<T> {
    let [fl, fr, rr, rl] = contacts;
    let half = T::constant(0.5);
    Platform {
        to_rear: -((rl.x + rr.x) * half),
        to_front: (fl.x + fr.x) * half,
        half_track_left: (fl.y + rl.y) * half,
        half_track_right: -((fr.y + rr.y) * half),
        ..platform
    }
}

fn check_rectangle(placed: &PlacedPlatform<f64>) -> Result<(), ClosedFormError> {
    let [fl, fr, rr, rl] = &placed.contacts;
    let allowed = OFF_RECTANGLE_SHARE * placed.platform.wheelbase();
    for (axle, found) in [("front", fl.x - fr.x), ("rear", rl.x - rr.x)] {
        let found = found.abs();
        if !(found <= allowed) {
            return Err(ClosedFormError::Axle {
                axle,
                allowed,
                found,
            });
        }
    }
    let allowed = OFF_RECTANGLE_SHARE * placed.platform.track();
    for (side, found) in [("left", fl.y - rl.y), ("right", fr.y - rr.y)] {
        let found = found.abs();
        if !(found <= allowed) {
            return Err(ClosedFormError::HalfTrack {
                side,
                allowed,
                found,
            });
        }
    }
    Ok(())
}

/// Poses of all bodies at rest at these joint positions.
fn posture(
    machine: &Machine,
    joint_positions: &[f64],
) -> Result<Vec<BodyMotion<f64>>, ClosedFormError> {
    let (expected, found) = (machine.joints.len(), joint_positions.len());
    if expected != found {
        return Err(ClosedFormError::JointPositions { expected, found });
    }
    let state = resting_state(machine, joint_positions);
    let mut placed = RestingBodies::new(machine);
    let closure = placed.place(machine, &state);
    let finite = joint_positions.iter().all(|position| position.is_finite());
    if !(finite && closure >= 0.0) {
        return Err(ClosedFormError::Posture);
    }
    Ok(placed.motions)
}

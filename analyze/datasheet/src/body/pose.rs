//! Poses of the links.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::machine::{JointKind, Link};

/// Poses of all links in the base frame, with the joints at these positions (rad or m), one for each link; the
/// base's is not used. Positions of joints that follow others must be given too.
pub(crate) fn poses(links: &[Link], positions: &[f64]) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(links.len());
    for (link, &position) in links.iter().zip(positions) {
        let Some(joint) = &link.joint else {
            poses.push(Isometry3::identity());
            continue;
        };
        let [x, y, z] = joint.xyz;
        let origin = Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(0.0, joint.pitch, 0.0),
        );
        let axis = Vector3::from(joint.axis);
        let motion = match joint.kind {
            JointKind::Fixed => Isometry3::identity(),
            JointKind::Prismatic => {
                Isometry3::translation(axis.x * position, axis.y * position, axis.z * position)
            }
            JointKind::Revolute | JointKind::Continuous => Isometry3::from_parts(
                Translation3::identity(),
                UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), position),
            ),
        };
        poses.push(poses[joint.parent] * origin * motion);
    }
    poses
}

/// Poses of all links in the posture of the sheet.
pub(crate) fn sheet_poses(links: &[Link]) -> Vec<Isometry3<f64>> {
    poses(links, &sheet_positions(links))
}

/// Positions of all joints in the posture of the sheet.
pub(super) fn sheet_positions(links: &[Link]) -> Vec<f64> {
    let at = |link: &Link| link.joint.as_ref().map_or(0.0, |joint| joint.at);
    links.iter().map(at).collect()
}

//! Reach of the arm.

use super::machine::{JointKind, Link, Role};
use super::pose::{poses, sheet_positions};

/// Largest horizontal distance of a link's origin from a vertical axis at x (m), over the arm's joints within their
/// limits, straight ahead. A search along one joint at a time, which suits arms in one plane.
pub(crate) fn reach(links: &[Link], tip: usize, point: [f64; 3], axis_x: f64) -> f64 {
    let mut positions = sheet_positions(links);
    let free: Vec<usize> = (0..links.len())
        .filter(|&link| {
            let joint = links[link].joint.as_ref();
            joint.is_some_and(|joint| {
                let is_upright = joint.axis[2] != 0.0 && joint.kind != JointKind::Prismatic;
                joint.role == Role::Arm && !is_upright && joint.limits.is_some()
            })
        })
        .collect();
    for (link, position) in links.iter().zip(&mut positions) {
        let joint = link.joint.as_ref().filter(|joint| joint.role == Role::Arm);
        if let Some(joint) = joint {
            let [least, most] = joint.limits.unwrap_or([0.0, 0.0]);
            *position = 0.0_f64.max(least).min(most);
        }
    }
    let distance = |positions: &mut Vec<f64>| {
        follow(links, positions);
        let at = poses(links, positions)[tip] * nalgebra::Point3::from(point);
        (at.x - axis_x).hypot(at.y)
    };
    let mut best = distance(&mut positions);
    let mut step = 1.0;
    // halving the step ends at 1e-9 of a range
    for _ in 0..30 {
        for &link in &free {
            let Some([least, most]) = links[link].joint.as_ref().and_then(|j| j.limits) else {
                continue;
            };
            for direction in [-1.0, 1.0] {
                let mut tried = positions.clone();
                let moved = tried[link] + direction * step * (most - least);
                tried[link] = moved.clamp(least, most);
                let found = distance(&mut tried);
                if found > best {
                    (best, positions) = (found, tried);
                }
            }
        }
        step *= 0.5;
    }
    best
}

/// Sets the joints that follow others.
pub(crate) fn follow(links: &[Link], positions: &mut [f64]) {
    for index in 0..links.len() {
        let mimic = links[index]
            .joint
            .as_ref()
            .and_then(|joint| joint.mimic.as_ref());
        let Some((leader, factor)) = mimic else {
            continue;
        };
        let is_leader = |link: &Link| link.joint.as_ref().is_some_and(|j| j.name == *leader);
        if let Some(leader) = links.iter().position(is_leader) {
            positions[index] = factor * positions[leader];
        }
    }
}

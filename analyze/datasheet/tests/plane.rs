//! Machines whose arm moves in one plane: places of their parts.

use tipwatch_datasheet::{JointKind, Machine, Sheet};

/// A machine from a text of the sheet.
pub(crate) fn built(text: &str) -> Machine {
    let sheet = Sheet::from_toml(text, "sheet").unwrap_or_else(|e| panic!("{e}\n{text}"));
    sheet.machine().unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The text with one place changed.
pub(crate) fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from}\n{text}");
    text.replace(from, to)
}

/// A point `ahead` of a link's origin along its x axis, in the base frame, for arms in one plane: (x, z).
pub(crate) fn tip(
    machine: &Machine,
    link: &str,
    ahead: f64,
    positions: &[(&str, f64)],
) -> (f64, f64) {
    place(
        machine,
        machine.link(link).unwrap(),
        (ahead, 0.0),
        positions,
    )
}

/// A point (x, z) of a link in the base frame, for arms in one plane. Joints at these positions, others at zero, and
/// those that follow others with them (rad or m).
pub(crate) fn place(
    machine: &Machine,
    link: usize,
    point: (f64, f64),
    positions: &[(&str, f64)],
) -> (f64, f64) {
    let position = |name: &str| {
        let found = positions.iter().find(|(joint, _)| *joint == name);
        found.map_or(0.0, |(_, position)| *position)
    };
    let (mut x, mut z) = point;
    let mut next = Some(link);
    while let Some(joint) = next.and_then(|link| machine.links[link].joint.as_ref()) {
        let at = match &joint.mimic {
            Some((leader, factor)) => factor * position(leader),
            None => position(&joint.name),
        };
        match joint.kind {
            JointKind::Fixed | JointKind::Continuous => {}
            JointKind::Prismatic => {
                x += joint.axis[0] * at;
                z += joint.axis[2] * at;
            }
            JointKind::Revolute => {
                // positive angles lift
                let angle = -joint.axis[1] * at;
                (x, z) = (
                    x * angle.cos() - z * angle.sin(),
                    x * angle.sin() + z * angle.cos(),
                );
            }
        }
        x += joint.xyz[0];
        z += joint.xyz[2];
        next = Some(joint.parent);
    }
    (x, z)
}

/// Limits of a joint (rad or m).
pub(crate) fn limits(machine: &Machine, joint: &str) -> [f64; 2] {
    let joints = machine.links.iter().filter_map(|link| link.joint.as_ref());
    let found = joints.into_iter().find(|j| j.name == joint);
    found.and_then(|j| j.limits).unwrap()
}

/// Distance of a machine's front wheels ahead of its base frame (m).
pub(crate) fn front(machine: &Machine) -> f64 {
    let mut wheel = machine.wheels[0].link;
    let mut x = 0.0;
    while let Some(joint) = &machine.links[wheel].joint {
        x += joint.xyz[0];
        wheel = joint.parent;
    }
    x
}

/// Distance of a link's origin to the left of the middle (m).
pub(crate) fn across(machine: &Machine, link: usize) -> f64 {
    let joint = machine.links[link].joint.as_ref();
    joint.map_or(0.0, |joint| joint.xyz[1] + across(machine, joint.parent))
}

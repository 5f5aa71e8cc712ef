//! Cylinders whose pins the sheet states: they close a triangle with the joint that they turn.

use std::f64::consts::PI;

use super::arm::Tip;
use super::build::{Build, GREY};
use super::machine::{Joint, JointKind, Linkage, Role, Solid};
use crate::error::SheetError;
use crate::prior::STEEL;
use crate::sheet::{Segment, SegmentKind};

impl Build<'_> {
    /// Adds the cylinder that turns a segment; returns its mass, which is part of the segment's (kg).
    pub(super) fn cylinder(
        &mut self,
        segment: &Segment,
        link: usize,
        before: &Tip,
        mass: f64,
    ) -> Result<f64, SheetError> {
        let Some(cylinder) = &segment.cylinder else {
            return Ok(0.0);
        };
        let place = format!("the cylinder of {}", segment.name);
        if segment.kind != SegmentKind::Lift {
            let expected = "a segment that lifts";
            return Err(self.sheet.wrong(place, expected, "another kind", ""));
        }
        let Some(joint) = self.machine.links[link].joint.clone() else {
            return Ok(0.0);
        };
        let [base, eye] = [cylinder.base, cylinder.eye].map(|pin| pin.map(|length| length.si));
        // from the pin on the carrier to the eye, in the plane of the arm, at a joint angle
        let to_eye = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let at = [cos * eye[0] - sin * eye[1], sin * eye[0] + cos * eye[1]];
            [at[0] - base[0], at[1] - base[1]]
        };
        let length = |angle: f64| {
            let [x, z] = to_eye(angle);
            x.hypot(z)
        };
        let (closed, stroke) = (cylinder.closed.si, cylinder.stroke.si);
        let [least, most] = joint.limits.unwrap_or([joint.at, joint.at]);
        for step in 0..=20 {
            let angle = least + (most - least) * f64::from(step) / 20.0;
            let needed = length(angle);
            if !(closed * 0.98..=(closed + stroke) * 1.02).contains(&needed) {
                return Err(self.sheet.wrong(
                    place,
                    format!(
                        "a length of {needed:.3} m between its pins at {:.1} degrees of {}",
                        angle.to_degrees(),
                        segment.name
                    ),
                    format!("{closed} to {} m (closed, and closed plus stroke)", closed + stroke),
                    "Check the pins, the range of the joint, and whether `closed` is from pin to pin",
                ));
            }
        }
        let barrel = STEEL * PI * 0.12 * cylinder.bore.si.powi(2) * closed;
        let rod = STEEL * PI / 4.0 * cylinder.rod.si.powi(2) * closed;
        let own = barrel + rod;
        if own > 0.7 * mass {
            let expected = format!("a cylinder lighter than its segment of {mass:.1} kg");
            let likely = "Check the unit of bore and rod: \"120 mm\"";
            return Err(self
                .sheet
                .wrong(place, expected, format!("{own:.1} kg"), likely));
        }
        self.assumed.add(
            format!(
                "mass of the cylinder of {} {own:.0} kg, part of the segment's",
                segment.name
            ),
            "that is steel of its bore, rod and length",
        );
        let name = format!("{}_cylinder", segment.name);
        let rod_name = format!("{}_rod", segment.name);
        let zero = to_eye(0.0);
        let now = to_eye(joint.at);
        let angle_of = |[x, z]: [f64; 2]| z.atan2(x);
        let mut turned = angle_of(now) - angle_of(zero);
        turned -= 2.0 * PI * (turned / (2.0 * PI)).round();
        let hinge = Joint {
            name: name.clone(),
            kind: JointKind::Revolute,
            parent: before.link,
            xyz: [
                before.point[0] + base[0],
                before.point[1],
                before.point[2] + base[1],
            ],
            // pitch turns x downwards
            pitch: -angle_of(zero),
            axis: [0.0, -1.0, 0.0],
            limits: Some([-PI, PI]),
            mimic: None,
            at: turned,
            role: Role::Follows,
        };
        let origin = self.origins[link];
        let cylinder_link = self.add(&format!("{name}_link"), Some(hinge), origin);
        let slide = Joint {
            name: rod_name.clone(),
            kind: JointKind::Prismatic,
            parent: cylinder_link,
            xyz: [0.0; 3],
            pitch: 0.0,
            axis: [1.0, 0.0, 0.0],
            limits: Some([0.0, stroke]),
            mimic: None,
            at: length(joint.at) - closed,
            role: Role::Follows,
        };
        let rod_link = self.add(&format!("{rod_name}_link"), Some(slide), origin);
        for (link, mass, thickness) in [
            (cylinder_link, barrel, cylinder.bore.si),
            (rod_link, rod, cylinder.rod.si),
        ] {
            let extent = [0.9 * closed, thickness, thickness];
            self.draw(
                link,
                Solid::Box(extent),
                [origin[0] + 0.5 * closed, origin[1], origin[2]],
                GREY,
            );
            let described = &mut self.machine.links[link];
            (described.mass, described.extent) = (mass, extent);
            described.com = [0.5 * closed, 0.0, 0.0];
        }
        let piston_area = PI / 4.0 * cylinder.bore.si.powi(2);
        self.machine.linkages.push(Linkage {
            name: segment.name.clone(),
            pivot: segment.name.clone(),
            cylinder: name,
            rod: rod_name.clone(),
            rod_link: format!("{rod_name}_link"),
            rod_end: [closed, 0.0, 0.0],
            pivot_link: format!("{}_link", segment.name),
            anchor: [eye[0], 0.0, eye[1]],
            piston_area,
            rod_area: piston_area - PI / 4.0 * cylinder.rod.si.powi(2),
        });
        Ok(own)
    }
}

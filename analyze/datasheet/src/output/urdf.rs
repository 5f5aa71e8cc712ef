//! The URDF, with masses, inertias and shapes.

use std::fmt::Write;

use super::text::escaped;
use crate::body::{Joint, JointKind, Link, Machine, Shape, Solid};

/// Limits of URDF joints that bound nothing here, which viewers want to see.
const EFFORT: &str = "1e6";
/// Largest velocity of an arm's joint (rad/s or m/s): above any hydraulic arm's.
const VELOCITY: &str = "10";

impl Machine {
    /// Returns the URDF. Numbers are exact: the machine has the mass of the sheet.
    #[must_use]
    pub fn urdf(&self) -> String {
        let mut out = String::from("<?xml version=\"1.0\"?>\n");
        let name = escaped(&self.name);
        // a comment must not contain two hyphens
        let source = self.sources.join("; ").replace("--", "- -");
        let _ = writeln!(
            out,
            "<!-- {}, from its data sheet. {} -->",
            name.replace("--", "- -"),
            escaped(&source)
        );
        let _ = writeln!(out, "<robot name=\"{name}\">");
        for link in &self.links {
            write_link(&mut out, link);
            if let Some(joint) = &link.joint {
                write_joint(&mut out, joint, &link.name, &self.links[joint.parent].name);
            }
        }
        out.push_str("</robot>\n");
        out
    }
}

fn triple([x, y, z]: [f64; 3]) -> String {
    // no negative zero
    let [x, y, z] = [x + 0.0, y + 0.0, z + 0.0];
    format!("{x} {y} {z}")
}

fn write_link(out: &mut String, link: &Link) {
    let _ = writeln!(out, "  <link name=\"{}\">", link.name);
    if link.mass > 0.0 {
        let [xx, yy, zz] = link.inertia;
        let _ = writeln!(
            out,
            "    <inertial><origin xyz=\"{}\" rpy=\"0 0 0\"/><mass value=\"{}\"/><inertia ixx=\"{xx}\" ixy=\"0\" ixz=\"0\" \
             iyy=\"{yy}\" iyz=\"0\" izz=\"{zz}\"/></inertial>",
            triple(link.com),
            link.mass
        );
    }
    for (index, shape) in link.shapes.iter().enumerate() {
        let geometry = geometry(shape);
        let [r, g, b] = shape.colour;
        let _ = writeln!(
            out,
            "    <visual>{geometry}<material name=\"{}_{index}\"><color rgba=\"{r} {g} {b} 1\"/></material></visual>",
            link.name
        );
        if index == 0 {
            let _ = writeln!(out, "    <collision>{geometry}</collision>");
        }
    }
    let _ = writeln!(out, "  </link>");
}

fn geometry(shape: &Shape) -> String {
    let origin = triple(shape.xyz);
    match shape.solid {
        Solid::Box(size) => format!(
            "<origin xyz=\"{origin}\" rpy=\"0 0 0\"/><geometry><box size=\"{}\"/></geometry>",
            triple(size)
        ),
        // a URDF cylinder is about z
        Solid::CylinderY { radius, length } => format!(
            "<origin xyz=\"{origin}\" rpy=\"1.5707963267948966 0 0\"/><geometry><cylinder radius=\"{radius}\" \
             length=\"{length}\"/></geometry>"
        ),
    }
}

fn write_joint(out: &mut String, joint: &Joint, child: &str, parent: &str) {
    let kind = match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Revolute => "revolute",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
    };
    let _ = write!(
        out,
        "  <joint name=\"{}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"{}\" \
         rpy=\"0 {} 0\"/>",
        joint.name,
        triple(joint.xyz),
        joint.pitch + 0.0
    );
    if joint.kind != JointKind::Fixed {
        let _ = write!(out, "<axis xyz=\"{}\"/>", triple(joint.axis));
    }
    if let Some([least, most]) = joint.limits {
        let _ = write!(
            out,
            "<limit lower=\"{least}\" upper=\"{most}\" effort=\"{EFFORT}\" velocity=\"{VELOCITY}\"/>"
        );
    }
    if let Some((leader, factor)) = &joint.mimic {
        let _ = write!(
            out,
            "<mimic joint=\"{leader}\" multiplier=\"{factor}\" offset=\"0\"/>"
        );
    }
    out.push_str("</joint>\n");
}

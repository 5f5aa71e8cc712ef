//! The URDF: read by the tree's own reader and by independent ones.

use std::fs;
use std::process::Command;

use strum::IntoEnumIterator;
use tempfile::TempDir;
use tipwatch_datasheet::{Sheet, Template};
use tipwatch_mechanics::machine::Outline;

fn urdf(template: Template) -> String {
    let sheet = Sheet::from_toml(template.example(), "example").unwrap();
    sheet.machine().unwrap().urdf()
}

#[test]
fn every_part_with_mass_has_a_shape() {
    for template in Template::iter() {
        let text = urdf(template);
        let outline = Outline::read(&text, "machine.urdf").unwrap();
        for link in &outline.links {
            assert!(
                link.mass == 0.0 || !link.shapes.is_empty(),
                "{template}: {}",
                link.name
            );
        }
        let mass: f64 = outline.links.iter().map(|link| link.mass).sum();
        assert!(mass > 10.0, "{template}: {mass}");
    }
}

#[test]
fn names_of_people_do_not_break_the_files() {
    let text = Template::WheelLoader.example();
    let odd = "name = \"a <b> & \\\"c\\\" -- 'd'\\nx\"";
    let text = text.replacen("name = \"Wheel loader, 15 t\"", odd, 1);
    let machine = Sheet::from_toml(&text, "x").unwrap().machine().unwrap();
    Outline::read(&machine.urdf(), "machine.urdf").unwrap();
    let spec = tipwatch_mechanics::MachineSpec::from_toml(
        &machine.machine_file("machine.urdf", None),
        "m",
    )
    .unwrap();
    assert_eq!(spec.name, "a <b> & \"c\" -- 'd'\nx");
    assert!(!machine.picture().contains("<b>"));
}

mod needs_pinocchio {
    use super::*;

    /// Masses and centres of mass in the posture of the sheet by Pinocchio, shapes and joints by yourdfpy.
    const SCRIPT: &str = r"
import sys, json
import numpy as np, pinocchio as pin, yourdfpy
path, posture, mass, com = sys.argv[1], json.loads(sys.argv[2]), float(sys.argv[3]), json.loads(sys.argv[4])
# a fixed base would lose the mass of the root link
model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer())
data = model.createData()
q = pin.neutral(model)
for name, value in posture.items():
    joint = model.getJointId(name)
    assert joint < model.njoints, name
    at = model.joints[joint].idx_q
    if model.joints[joint].nq == 2:
        q[at:at + 2] = np.cos(value), np.sin(value)
    else:
        q[at] = value
found = pin.centerOfMass(model, data, q)
total = pin.computeTotalMass(model)
assert abs(total / mass - 1) < 1e-9, (total, mass)
assert np.abs(found - np.array(com)).max() < 1e-6, (found, com)
for inertia in model.inertias:
    values = np.linalg.eigvalsh(inertia.inertia)
    assert inertia.mass == 0 or (values.min() > 0 and values.sum() >= 2 * values.max() * (1 - 1e-9)), values
robot = yourdfpy.URDF.load(path, load_meshes=False)
assert robot.validate(), robot.errors
assert all(link.visuals for link in robot.robot.links if link.inertial is not None)
";

    #[test]
    #[ignore = "needs python3 with pinocchio and yourdfpy"]
    fn independent_parsers_find_the_same_masses() {
        let python = std::env::var("TIPWATCH_PYTHON").unwrap_or("python3".into());
        let folder = TempDir::new().unwrap();
        for template in Template::iter() {
            let sheet = Sheet::from_toml(template.example(), "example").unwrap();
            let machine = sheet.machine().unwrap();
            let path = folder.path().join(format!("{template}.urdf"));
            fs::write(&path, machine.urdf()).unwrap();
            // joints that follow others move with them
            let joints = machine.links.iter().filter_map(|link| link.joint.as_ref());
            let moved = joints.filter(|joint| joint.at != 0.0);
            let posture: Vec<String> = moved
                .map(|joint| format!("\"{}\": {}", joint.name, joint.at))
                .collect();
            let output = Command::new(&python)
                .args(["-c", SCRIPT])
                .arg(&path)
                .arg(format!("{{{}}}", posture.join(", ")))
                .arg(machine.mass.to_string())
                .arg(format!("{:?}", machine.centre_of_mass))
                .output()
                .unwrap();
            assert!(
                output.status.success(),
                "{template}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
    }
}

//! Positions of the parts: at rest, the centre of pressure is below the centre of mass.

use std::path::Path;

use nalgebra::Vector3;
use tipwatch_mechanics::machine::LogFacts;
use tipwatch_mechanics::{MachineSpec, Placement, State, Workspace, evaluate};

use crate::support::{machine, set_joint};

/// At rest the ZMP is the projection of the centre of mass along gravity, however the machine leans.
#[test]
fn zmp_at_rest_is_below_centre_of_mass() {
    for (name, lift, tilt) in [("rigid", -1.3, -1.4), ("rigid", -0.7, -1.0)] {
        let machine = machine(name);
        let mut state = State::<f64>::zero(&machine);
        set_joint(&machine, &mut state, "lift", [lift, 0.0, 0.0]);
        set_joint(&machine, &mut state, "tilt", [tilt, 0.0, 0.0]);
        let up = Vector3::new(0.1, -0.15, 1.0).normalize();
        state.imu.specific_force = up * machine.gravity();
        let mut placement = Placement::new(&machine);
        placement.place(&state);
        let mut workspace = Workspace::new(&machine);
        let outcome = evaluate(&machine, &state, &mut workspace);
        // down from the centre of mass to the plane n . p = h
        let height = placement.normal.dot(&placement.contacts[0]);
        let com = placement.centre_of_mass;
        let below = com - up * ((placement.normal.dot(&com) - height) / placement.normal.dot(&up));
        let pressed = placement.on_plane(&below);
        let zmp = nalgebra::Vector2::new(outcome.zmp_x, outcome.zmp_y);
        assert!((pressed - zmp).norm() < 1e-9, "{name}: {pressed} {zmp}");
        assert!((placement.from_plane(&pressed) - below).norm() < 1e-9);
    }
}

#[test]
fn unknown_joint_makes_its_positions_unknown() {
    let machine = machine("rigid");
    let mut state = State::<f64>::zero(&machine);
    state.imu.specific_force.z = machine.gravity();
    state.joints[0].position = f64::NAN;
    let mut placement = Placement::new(&machine);
    placement.place(&state);
    assert!(placement.centre_of_mass.x.is_nan());
    assert!(
        placement
            .arm_segments
            .iter()
            .flatten()
            .any(|p| p.x.is_nan())
    );
}

/// The fork was one short stroke that floated beside nothing.
#[test]
fn what_slides_along_the_platform_is_joined_to_it() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/forklift");
    let text = |extension: &str| std::fs::read_to_string(data.with_extension(extension)).unwrap();
    let spec = MachineSpec::from_toml(&text("toml"), "machine.toml").unwrap();
    let machine = spec.check(&text("urdf"), "machine.urdf", LogFacts::default());
    let machine = machine.unwrap();
    let mut state = State::<f64>::zero(&machine);
    set_joint(&machine, &mut state, "lift", [1.5, 0.0, 0.0]);
    state.imu.specific_force.z = machine.gravity();
    let mut placement = Placement::new(&machine);
    placement.place(&state);
    let points = [
        [0.0; 3],
        [0.45, 0.0, 0.0],
        [0.45, 0.0, 1.5],
        [0.95, 0.0, 1.95],
    ];
    let points = points.map(Vector3::<f64>::from);
    assert_eq!(placement.arm_segments.len(), 3);
    for (segment, ends) in placement.arm_segments.iter().zip(points.windows(2)) {
        let apart = (segment[0] - ends[0]).norm() + (segment[1] - ends[1]).norm();
        assert!(apart < 1e-9, "{segment:?} {ends:?}");
    }
}

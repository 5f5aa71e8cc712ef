//! The lines about which a machine tips: the edges of its polygon, or lines to the pivot of an axle.

use std::fmt::Write as _;

use nalgebra::{Rotation3, Vector3};
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{Machine, Placement, Scope, State, Workspace, evaluate};

const RADIUS: f64 = 0.3;
const PIVOT_HEIGHT: f64 = 0.2;
const WHEELS: [(&str, &str, [f64; 3]); 4] = [
    ("FL", "base_link", [0.0, 0.5, 0.0]),
    ("FR", "base_link", [0.0, -0.5, 0.0]),
    ("RL", "axle", [0.0, 0.45, -PIVOT_HEIGHT]),
    ("RR", "axle", [0.0, -0.45, -PIVOT_HEIGHT]),
];

/// A truck whose rear axle, which weighs next to nothing, swings about a pivot above it.
fn truck() -> Machine {
    let light = r#"<inertial><mass value="0.01"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let mut urdf = format!(
        r#"<robot name="truck"><link name="base_link"><inertial><origin xyz="-0.7 0.03 0.5"/><mass value="3000"/>
        <inertia ixx="500" iyy="1200" izz="1200" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="axle">{light}</link>
        <joint name="pendulum" type="revolute"><parent link="base_link"/><child link="axle"/><origin xyz="-1.6 0 {PIVOT_HEIGHT}"/>
        <axis xyz="1 0 0"/><limit lower="-0.1" upper="0.1" effort="1" velocity="1"/></joint>"#
    );
    let mut file = String::from(
        "name = \"truck\"\n[imu]\nlink = \"base_link\"\n[contact]\nfree_joints = [\"pendulum\"]\n",
    );
    for (name, parent, [x, y, z]) in WHEELS {
        let _ = write!(
            urdf,
            r#"<link name="{name}">{light}</link><joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{name}"/>
            <origin xyz="{x} {y} {z}"/><axis xyz="0 1 0"/></joint>"#
        );
        let _ = writeln!(
            file,
            "[wheels.{name}]\nlink = \"{name}\"\nradius = {RADIUS}"
        );
    }
    let spec = MachineSpec::from_toml(&file, "truck.toml").unwrap();
    (spec.check(&(urdf + "</robot>"), "truck.urdf", LogFacts::default())).unwrap()
}

/// Returns the state at rest on a slope that falls to the right.
fn on_slope(machine: &Machine, angle: f64) -> State<f64> {
    let mut state = State::zero(machine);
    let up = Rotation3::from_euler_angles(angle, 0.0, 0.0).inverse() * Vector3::z();
    state.base.up = up;
    state.imu.specific_force = up * machine.gravity();
    state
}

/// Side forces that turn the machine act below the pivot: how the axles share them divides the loads of each axle.
#[test]
fn the_bands_of_an_axle_with_a_pivot_know_how_side_forces_may_be_shared() {
    let machine = truck();
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let mut sigmas = |turning: f64| {
        let mut state = on_slope(&machine, 0.0);
        state.imu.angular_acceleration.z = turning;
        let outcome = evaluate(&machine, &state, &mut workspace);
        outcome.uncertainty.otf.clone()
    };
    let (rests, turns) = (sigmas(0.0), sigmas(3.0));
    // the moment of inertia about the centre of mass, by side forces 1.6 m apart, at the height of the pivot over the ground
    let torque = 1200.0 * 3.0 / 1.6 * (PIVOT_HEIGHT + RADIUS);
    for (wheel, track) in [(0, 1.0), (1, 1.0), (2, 0.9), (3, 0.9)] {
        let added = (turns[wheel].powi(2) - rests[wheel].powi(2)).sqrt();
        let expected = torque / track;
        assert!((added / expected - 1.0).abs() < 0.1, "{added} {expected}");
    }
}

/// On the slope on which the uphill front wheel carries nothing, every indicator says that the machine tips to its side: the
/// resultant of the rear wheels passes through the pivot, at the height at which it is.
#[test]
fn indicators_are_zero_where_the_wheel_off_the_line_to_the_pivot_lifts() {
    let machine = truck();
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let mut otf = |angle: f64| {
        let state = on_slope(&machine, angle);
        evaluate(&machine, &state, &mut workspace).otf[0]
    };
    let (mut low, mut high) = (0.0, 0.6);
    assert!(otf(low) > 1000.0 && otf(high) < -1000.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match otf(middle) > 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    let state = on_slope(&machine, low);
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let outcome = evaluate(&machine, &state, &mut workspace);
    let right = machine.edge_named("right").unwrap();
    let weight = machine.mass() * machine.gravity();
    assert!(
        outcome.itom_full[right].abs() < 1e-6 * weight,
        "{outcome:?}"
    );
    assert!(outcome.zmp_margin.abs() < 1e-6, "{}", outcome.zmp_margin);
    let indicators = &outcome.indicators;
    for angle in [&indicators.stability_angle, &indicators.force_angle] {
        assert!(angle[right].abs() < 1e-4, "{angle:?}");
    }
    // the line goes through the pivot itself, and what the axle carries meets the ground to the lower side of it
    let mut placement = Placement::new(&machine);
    placement.place(&state);
    let line = placement.tipping_line(right);
    let at_pivot = line.through.iter().map(|at| at.z).fold(f64::MIN, f64::max);
    assert!((at_pivot - PIVOT_HEIGHT).abs() < 1e-9, "{line:?}");
    let rear = line.on_ground.iter().min_by(|a, b| a.x.total_cmp(&b.x));
    let shift = (PIVOT_HEIGHT + RADIUS) * low.tan();
    assert!((rear.unwrap().y + shift).abs() < 0.01, "{line:?} {shift}");
}

/// Of a machine that stands, the moment about each line is that of the wheels that come up.
#[test]
fn the_moment_about_a_line_is_that_of_the_wheels_that_come_up() {
    let machine = truck();
    let state = on_slope(&machine, 0.1);
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    let outcome = evaluate(&machine, &state, &mut workspace);
    let mut placement = Placement::new(&machine);
    placement.place(&state);
    for (edge, spec) in machine.polygon().edges().iter().enumerate() {
        let [from, to] = placement.tipping_line(edge).on_ground;
        let along = (to - from).normalize();
        let stays = machine.stays_on_ground(spec);
        let wheels = (0..stays.len()).filter(|&wheel| !stays[wheel]);
        let moment: f64 = wheels
            .map(|wheel| {
                let at = placement.on_plane(&placement.contacts[wheel]);
                along.perp(&(at - from)) * outcome.otf[wheel]
            })
            .sum();
        let found = outcome.itom_full[edge];
        assert!(
            (found + moment).abs() < 1e-6 * moment.abs(),
            "{}: {found} {moment}",
            spec.name
        );
    }
    let sides = ["left", "right"].map(|name| machine.edge_named(name).unwrap());
    for (edge, spec) in machine.polygon().edges().iter().enumerate() {
        let is_astride = machine.axles_astride(spec).next().is_some();
        assert_eq!(is_astride, sides.contains(&edge), "{}", spec.name);
    }
}

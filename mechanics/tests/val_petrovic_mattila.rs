//! Validation: reference values of the first paper's machine from two independent computations (g = 9.8066).

use crate::support;
use crate::support::{machine, set_joint, wheel};
use nalgebra::Vector3;
use tipwatch_mechanics::{
    Contribution, Machine, Outcome, Scope, State, Workspace, actuator_force, evaluate,
};

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Offset of the arm's geometry and its derivatives: q1 = Theta1 - pi/2 - beta1 - beta2,
/// q2 = Theta2 - beta3 - beta4.
fn arm_offsets() -> (f64, f64) {
    let (b1, b2) = ((374.261_f64 / 935.0).atan(), (45.757_f64 / 373.313).atan());
    let (b3, b4) = ((139.50_f64 / 1132.19).atan(), (88.061_f64 / 296.198).atan());
    (-std::f64::consts::FRAC_PI_2 - b1 - b2, -b3 - b4)
}

/// The platform at rest on level ground with the arm moving, gamma = 45 degrees.
fn outcome(machine: &Machine, theta1: [f64; 3], theta2: [f64; 3], x3: [f64; 3]) -> Outcome<f64> {
    let (q1, q2) = arm_offsets();
    let mut state = State::<f64>::zero(machine);
    set_joint(machine, &mut state, "slew", [45.0 * DEGREE, 0.0, 0.0]);
    set_joint(
        machine,
        &mut state,
        "lift",
        [
            theta1[0] * DEGREE + q1,
            theta1[1] * DEGREE,
            theta1[2] * DEGREE,
        ],
    );
    set_joint(
        machine,
        &mut state,
        "tilt",
        [
            theta2[0] * DEGREE + q2,
            theta2[1] * DEGREE,
            theta2[2] * DEGREE,
        ],
    );
    set_joint(machine, &mut state, "extension", x3);
    // At rest the sensor measures gravity, wherever it is mounted.
    state.imu.specific_force = Vector3::z() * machine.gravity();
    state.base.up = Vector3::z();
    state.base.velocity = Vector3::zeros();
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    evaluate(machine, &state, &mut workspace).clone()
}

/// Loads FL FR RR RL in the same state.
fn loads(machine: &Machine, theta1: [f64; 3], theta2: [f64; 3], x3: [f64; 3]) -> [f64; 4] {
    let load = outcome(machine, theta1, theta2, x3).otf;
    ["FL", "FR", "RR", "RL"].map(|name| load[wheel(machine, name)])
}

fn assert_loads(found: [f64; 4], expected: [f64; 4], relative: f64) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!(
            (found - expected).abs() <= relative * expected,
            "{found}, expected {expected}"
        );
    }
}

#[test]
fn val_example_s_arm_at_rest() {
    let machine = machine("petrovic_mattila");
    let found = loads(
        &machine,
        [20.0, 0.0, 0.0],
        [-70.0, 0.0, 0.0],
        [0.3, 0.0, 0.0],
    );
    assert_loads(found, [15790.936, 8881.726, 1385.004, 8294.214], 1e-6);
}

/// All other indicators in example S; edges front, left, rear, right.
#[test]
fn val_example_s_indicators() {
    let machine = machine("petrovic_mattila");
    let found = outcome(
        &machine,
        [20.0, 0.0, 0.0],
        [-70.0, 0.0, 0.0],
        [0.3, 0.0, 0.0],
    );
    let near = |found: f64, expected: f64, relative: f64| {
        assert!(
            (found - expected).abs() <= relative * expected.abs(),
            "{found}, expected {expected}"
        );
    };
    near(found.zmp_x, 0.501_936, 2e-6);
    near(found.zmp_y, 0.351_978, 2e-6);
    near(found.zmp_margin, 0.523_022, 2e-6);
    let it = &found.indicators;
    let edges = [
        (&it.mhs, [5255.12, 2970.31, -29229.80, -21211.92]),
        (&it.tom, [-19555.58, -15907.39, -54040.50, -40089.63]),
        (&it.itom, [-19555.58, -15907.39, -54040.50, -40089.63]),
        (
            &found.itom_full,
            [-22262.20, -17966.78, -56747.12, -42149.01],
        ),
    ];
    for (found, expected) in edges {
        found
            .iter()
            .zip(expected)
            .for_each(|(&found, expected)| near(found, expected, 3e-6));
    }
    for angles in [&it.force_angle, &it.stability_angle] {
        for (&angle, degrees) in angles.iter().zip([44.8869, 38.7948, 68.5026, 62.0644]) {
            near(angle / DEGREE, degrees, 2e-6);
        }
    }
    near(it.load_transfer_ratio, -0.402_26, 1e-5);
    let arm = &it.arm_wrench;
    for (found, expected) in [
        (arm.force.z, -10423.7773),
        (arm.moment.x, -12091.1179),
        (arm.moment.y, 12030.5718),
    ] {
        near(found, expected, 1e-6);
    }
    assert!(arm.force.xy().norm() < 1e-6 && arm.moment.z.abs() < 1e-6);
    // zeta_1 of Table 1: chassis and wheel weights
    for contributions in &found.contributions {
        let weights = contributions[Contribution::ChassisWeight as usize]
            + contributions[Contribution::WheelWeight as usize];
        near(weights, 5982.026, 1e-6);
    }
}

/// Cylinder forces in example S, from virtual work of the pivots.
#[test]
fn val_cylinder_forces() {
    let machine = machine("petrovic_mattila");
    let mut state = State::<f64>::zero(&machine);
    let (q1, q2) = arm_offsets();
    set_joint(&machine, &mut state, "slew", [45.0 * DEGREE, 0.0, 0.0]);
    set_joint(&machine, &mut state, "lift", [20.0 * DEGREE + q1, 0.0, 0.0]);
    set_joint(
        &machine,
        &mut state,
        "tilt",
        [-70.0 * DEGREE + q2, 0.0, 0.0],
    );
    set_joint(&machine, &mut state, "extension", [0.3, 0.0, 0.0]);
    state.imu.specific_force = Vector3::z() * machine.gravity();
    let mut workspace = Workspace::new(&machine);
    evaluate(&machine, &state, &mut workspace);
    for (name, expected) in [("lift", 50288.14), ("tilt", 28809.81)] {
        let linkages = machine.linkages().iter();
        let linkage = linkages
            .map(|l| l.name.as_str())
            .position(|n| n == name)
            .unwrap();
        let force = actuator_force(&machine, &state, &workspace, linkage);
        assert!(
            (force - expected).abs() < 1e-6 * expected,
            "{name}: {force}"
        );
    }
}

#[test]
fn val_moving_arm() {
    let machine = machine("petrovic_mattila");
    // Theta1 = 20 + 10 sin t, Theta2 = -70 + 15 sin 2t [deg], x3 = 0.3 + 0.2 sin t [m]
    let at = |t: f64| {
        let (s, c) = t.sin_cos();
        let (s2, c2) = (2.0 * t).sin_cos();
        loads(
            &machine,
            [20.0 + 10.0 * s, 10.0 * c, -10.0 * s],
            [-70.0 + 15.0 * s2, 30.0 * c2, -60.0 * s2],
            [0.3 + 0.2 * s, 0.2 * c, -0.2 * s],
        )
    };
    assert_loads(at(0.0), [16627.36, 8984.34, 815.77, 8458.79], 1e-5);
    assert_loads(at(1.0), [14948.29, 8399.25, 1490.17, 8039.21], 1e-5);
    assert_loads(at(2.5), [15800.33, 9144.36, 1701.77, 8357.73], 1e-5);
}

#[test]
fn val_no_arm_level_at_rest() {
    let bodies_without_arm = |text: String| {
        let (before, _) = text.split_once(" <link name='arm_slew'>").unwrap();
        format!("{before}</robot>")
    };
    let spec = support::data("petrovic_mattila.toml");
    let spec = spec.split("[arm]").next().unwrap();
    let spec = tipwatch_mechanics::MachineSpec::from_toml(spec, "machine.toml").unwrap();
    let urdf = bodies_without_arm(support::data("petrovic_mattila.urdf"));
    let machine = spec
        .check(
            &urdf,
            "machine.urdf",
            tipwatch_mechanics::machine::LogFacts::default(),
        )
        .unwrap();
    let positions = vec![0.0; machine.joints().len()];
    for load in tipwatch_mechanics::static_outcome(&machine, &positions).load {
        assert!((load - 5982.026).abs() < 1e-6 * load, "{load}");
    }
}

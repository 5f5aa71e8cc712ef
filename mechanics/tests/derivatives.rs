//! Verifies sensitivities against dual numbers through the same equations, and against differences.

use crate::support::{bogie_by_rods, edited, machine, moving, set_joint, six_wheels};
use nalgebra::{Matrix3, Vector3};
use tipwatch_mechanics::{
    BaseMotion, Dual, Machine, Parameter, Real, Scope, State, Workspace, evaluate,
};

/// Machines of every kind: rigid with deflecting tyres, an IMU on the arm, payloads and a tool force, actuated
/// bogies, six wheels on springs, free bogies.
fn machines() -> Vec<(&'static str, Machine)> {
    let on_boom = |text: String| {
        text.replace("link = \"base_link\"", "link = \"lift_boom\"")
            + "\n[[payload]]\nlink = \"tool\"\nmass = 80.0\ncom = [0.1, 0.2, -0.3]\ninertia = [4.0, 5.0, 6.0, 0.1, 0.2, 0.3]\n"
    };
    let plane = |text: String| text.replace("[contact]", "[contact]\nground = \"plane\"");
    let welded = |text: String| text.replace("free_joints = [\"bogie_left\", \"bogie_right\"]", "");
    vec![
        ("rigid", machine("rigid")),
        ("IMU on the boom", edited("rigid", on_boom).unwrap()),
        ("bogie", machine("bogie")),
        ("bogie on a plane", edited("bogie", plane).unwrap()),
        ("rigid on a plane", edited("rigid", plane).unwrap()),
        ("free bogies", six_wheels(|text| text)),
        ("welded bogies", six_wheels(welded)),
        ("welded on a plane", six_wheels(|text| plane(welded(text)))),
        ("free on a plane", six_wheels(plane)),
        ("bogie by rods", bogie_by_rods(|text| text)),
        ("measured torques", measured(|text| text)),
        ("measured torques on a plane", measured(plane)),
        (
            "measured torques by pivots",
            edited("bogie", with_forces).unwrap(),
        ),
    ]
}

/// Nearly contradicting torque measurements lose digits: factor on the tolerance.
fn rounding(machine: &Machine) -> f64 {
    if machine.contact().actuated_joints.is_empty() {
        1.0
    } else {
        50.0
    }
}

/// A machine file with known forces of the suspension's actuators. Analytic derivatives hold the weight of
/// these measurements in the solution constant, so it must depend on the rods alone here.
fn with_forces(text: String) -> String {
    ["suspension_right", "suspension_left"].into_iter().fold(
        text.replace("[contact]", "[contact]\ntraction_share = 0.0"),
        |text, rod| {
            let name = format!("name = \"{rod}\"\n");
            let force = format!(
                "{name}force = {{ topic = \"/f\", field = \"f\" }}\nfriction_share = 0.0\n"
            );
            text.replacen(&name, &force, 1)
        },
    )
}

fn measured(edit: impl Fn(String) -> String) -> Machine {
    bogie_by_rods(|text| edit(with_forces(text)))
}

/// States with the arm in motion, the machine leaning, turning and braking: moderate, and with a lifted wheel.
fn states(machine: &Machine) -> Vec<State<f64>> {
    [
        (0.3, 0.9, -0.7),
        (7.9, -0.5, 0.8),
        (42.0, -2.2, -1.6),
        (42.0, -1.2, -2.0),
    ]
    .map(|(seed, x, y)| state_of(machine, seed, Vector3::new(x, y, 9.7)))
    .to_vec()
}

fn state_of(machine: &Machine, seed: f64, lean: Vector3<f64>) -> State<f64> {
    let mut state = moving(
        machine,
        seed,
        Vector3::zeros(),
        Vector3::new(0.12, -0.2, 0.35),
    );
    for (k, name) in ["suspension_right", "suspension_left"]
        .into_iter()
        .enumerate()
    {
        if machine.joints().iter().any(|joint| joint.name == name) {
            let phase = seed + k as f64;
            let rod = [
                -0.1 + 0.06 * phase.sin(),
                0.05 * phase.cos(),
                -0.2 * phase.sin(),
            ];
            set_joint(machine, &mut state, name, rod);
        }
    }
    for (k, force) in state.actuator_force.iter_mut().enumerate() {
        *force = -4e3 - 3e3 * k as f64;
    }
    state.tool_wrench.force = Vector3::new(150.0, -90.0, 220.0);
    state.tool_wrench.moment = Vector3::new(30.0, 40.0, -20.0);
    state.imu.specific_force = imu_measurement(machine, &state, lean * machine.mass());
    state
}

/// The IMU's measurement for a given ground force, which is linear in it.
fn imu_measurement(machine: &Machine, state: &State<f64>, ground: Vector3<f64>) -> Vector3<f64> {
    let force = |imu_measurement: Vector3<f64>| {
        let mut state = state.clone();
        state.imu.specific_force = imu_measurement;
        evaluate(machine, &state, &mut Workspace::new(machine))
            .ground_wrench
            .force
    };
    let still = force(Vector3::zeros());
    let by_felt = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| force(axis) - still);
    let rotation = Matrix3::from_columns(&by_felt);
    rotation.try_inverse().unwrap() * (ground - still)
}

fn loads(machine: &Machine, state: &State<f64>) -> [Vec<f64>; 2] {
    let mut workspace = Workspace::new(machine);
    let outcome = evaluate(machine, state, &mut workspace);
    [outcome.otf.clone(), outcome.load.clone()]
}

/// Derivatives of OTF and load of all wheels with respect to a signal, in dual numbers.
fn by_dual(machine: &Machine, state: &State<f64>, signal: Parameter) -> [Vec<f64>; 2] {
    let mut workspace = Workspace::<Dual<f64>>::new(machine);
    let mut dual = state.map(Dual::fixed);
    dual.change(
        signal,
        Dual {
            value: 0.0,
            slope: 1.0,
        },
    );
    let outcome = evaluate(machine, &dual, &mut workspace);
    let slopes = |loads: &[Dual<f64>]| loads.iter().map(|load| load.slope).collect();
    [slopes(&outcome.otf), slopes(&outcome.load)]
}

/// Returns the derivatives by central differences, with respect to signals and parameters.
fn by_difference(machine: &Machine, state: &State<f64>, parameter: Parameter) -> [Vec<f64>; 2] {
    let step = 1e-5 * rounding(machine);
    let at = |amount: f64| {
        let mut state = state.clone();
        state.change(parameter, amount);
        loads(&machine.changed(&[(parameter, amount)]), &state)
    };
    let (ahead, behind) = (at(step), at(-step));
    std::array::from_fn(|k| {
        let pairs = ahead[k].iter().zip(&behind[k]);
        pairs.map(|(a, b)| (a - b) / (2.0 * step)).collect()
    })
}

struct Compared {
    largest: f64,
    identical: usize,
    lifted: bool,
}

fn compare(
    name: &str,
    machine: &Machine,
    state: &State<f64>,
    share: f64,
    other: impl Fn(Parameter) -> Option<[Vec<f64>; 2]>,
) -> Compared {
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    let outcome = evaluate(machine, state, &mut workspace);
    let tips = outcome.zmp_margin < 0.0;
    // Rounding error of a difference of loads of this size.
    let lost = 1e-10
        * outcome
            .otf
            .iter()
            .fold(0.0_f64, |s, load| s.max(load.abs()));
    let lifted = outcome.load.contains(&0.0);
    let sensitivity = workspace.sensitivity();
    let mut compared = Compared {
        largest: 0.0,
        identical: 0,
        lifted: lifted && !tips,
    };
    for (i, parameter) in Parameter::all(machine).into_iter().enumerate() {
        let Some(others) = other(parameter) else {
            continue;
        };
        for wheel in 0..machine.wheels().len() {
            let found = [sensitivity.otf(wheel)[i], sensitivity.load(wheel)[i]];
            let scale = others.iter().flatten().fold(1.0_f64, |s, v| s.max(v.abs()));
            for (kind, (found, others)) in found.iter().zip(&others).enumerate() {
                if tips && kind == 1 {
                    assert!(found.is_nan());
                    continue;
                }
                let truth = others[wheel];
                // The weight of the measured torques depends on the masses, which the derivative neglects.
                let is_held = !parameter.is_signal() && rounding(machine) > 1.0;
                let share = if is_held { share.max(5e-3) } else { share };
                assert!(
                    (found - truth).abs() <= share * scale + lost,
                    "{name}: {} of wheel {wheel} ({kind}): {found} against {truth}",
                    parameter.name(machine)
                );
                compared.largest = compared.largest.max(found.abs());
                compared.identical += usize::from(*found == truth && truth != 0.0);
            }
        }
    }
    compared
}

#[test]
fn derivatives_by_signal_equal_dual_numbers() {
    for (name, machine) in machines() {
        for state in states(&machine) {
            let compared = compare(name, &machine, &state, 1e-9 * rounding(&machine), |p| {
                (p.is_signal() && !is_travel(p)).then(|| by_dual(&machine, &state, p))
            });
            assert!(compared.largest > 10.0, "{name}");
        }
    }
}

#[test]
fn derivatives_equal_central_differences() {
    let mut lifted = 0;
    for (name, machine) in machines() {
        for state in states(&machine) {
            let compared = compare(name, &machine, &state, 2e-6 * rounding(&machine), |p| {
                let weighs = |joint: usize| {
                    let actuated = &machine.contact().actuated_joints;
                    let linkages = actuated
                        .iter()
                        .filter_map(|a| Some(&machine.linkages()[a.linkage()?]));
                    linkages
                        .into_iter()
                        .any(|linkage| linkage.measured_joint == joint)
                };
                let held = matches!(p, Parameter::JointPosition(joint) if weighs(joint));
                // The stiffness also determines the weight of the torques.
                let decides = rounding(&machine) > 1.0 && p.name(&machine).contains("stiffness");
                (!is_travel(p) && !held && !decides).then(|| by_difference(&machine, &state, p))
            });
            assert!(compared.largest > 10.0, "{name}");
            assert!(compared.identical < 20, "{name}: {}", compared.identical);
            lifted += usize::from(compared.lifted);
        }
    }
    assert!(lifted > 0, "no state with a wheel in the air");
}

fn is_travel(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::BaseMotion(_))
}

/// Measurement of an IMU at the base origin for a motion of the base: f = vdot + w x v + g up.
fn travelling<T: Real>(machine: &Machine, state: &State<f64>, change: [T; 6]) -> State<T> {
    let [v_x, v_y, yaw, v_x_dot, v_y_dot, yaw_dot] = change;
    let mut state = state.map(T::constant);
    let fixed = |x: f64, y: f64, z: f64| Vector3::new(x, y, z).map(T::constant);
    let velocity = fixed(1.4, 0.2, -0.1) + Vector3::new(v_x, v_y, T::zero());
    let rate = fixed(-0.9, 0.4, 0.1) + Vector3::new(v_x_dot, v_y_dot, T::zero());
    state.imu.angular_velocity.z += yaw;
    state.imu.angular_acceleration.z += yaw_dot;
    let up = fixed(0.05, -0.08, 0.995) * T::constant(machine.gravity());
    state.imu.specific_force = rate + state.imu.angular_velocity.cross(&velocity) + up;
    state.base.velocity = velocity;
    state
}

#[test]
fn derivatives_by_base_motion_equal_dual_numbers() {
    let at_origin = |text: String| text.replace("xyz = [0.1, 0, 0.05]", "xyz = [0, 0, 0]");
    let machine = edited("rigid", at_origin).unwrap();
    let still = moving(
        &machine,
        5.0,
        Vector3::zeros(),
        Vector3::new(0.1, -0.05, 0.4),
    );
    let state = travelling(&machine, &still, [0.0; 6]);
    let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
    evaluate(&machine, &state, &mut workspace);
    let parameters = Parameter::all(&machine);
    for (k, travel) in BaseMotion::ALL.into_iter().enumerate() {
        let place = parameters
            .iter()
            .position(|&p| p == Parameter::BaseMotion(travel))
            .unwrap();
        let mut change = [Dual::fixed(0.0); 6];
        change[k] = Dual::variable(0.0);
        let mut dual = Workspace::<Dual<f64>>::new(&machine);
        let outcome = evaluate(&machine, &travelling(&machine, &still, change), &mut dual);
        for wheel in 0..4 {
            let (found, truth) = (
                workspace.sensitivity().otf(wheel)[place],
                outcome.otf[wheel].slope,
            );
            assert!(
                (found - truth).abs() < 1e-8 * (1.0 + truth.abs()),
                "{travel:?}: {found} {truth}"
            );
            assert!(truth.abs() > 1.0, "{travel:?}");
        }
    }
}

//! The predicted lean against the wheel loads of the evaluation, and against the momentum of the arm.

use nalgebra::{Vector2, Vector3};

use super::super::lean_model::{Footing, LeanModel};
use super::{bogies, checked, joint, posture, rigid_with, steered};
use crate::evaluate::evaluation::evaluate;
use crate::evaluate::scope::Scope;
use crate::machine::Machine;
use crate::studies::static_posture::{at_rest, static_outcome};

const STIFFNESS: f64 = 8e5;

fn up() -> Vector3<f64> {
    Vector3::z() * 9.8066
}

fn set_posture(model: &mut LeanModel, positions: &[f64]) {
    for (joint, &position) in positions.iter().enumerate() {
        model.set(joint, position, 0.0);
    }
}

/// Lean of the plane through the deflected tyres (rad) under the static loads of the evaluation.
fn lean_by_loads(machine: &Machine, positions: &[f64]) -> Vector2<f64> {
    let outcome = static_outcome(machine, positions);
    let (mut roll, mut pitch, mut squares) = (0.0, 0.0, Vector2::zeros());
    for (wheel, load) in machine.wheels().iter().zip(&outcome.load) {
        let at = wheel.centre_at_zero;
        let sunk = load / STIFFNESS;
        roll -= at.y * sunk;
        pitch += at.x * sunk;
        squares += Vector2::new(at.y * at.y, at.x * at.x);
    }
    Vector2::new(roll, pitch).component_div(&squares)
}

#[test]
fn lean_is_that_of_the_tyres_under_the_wheel_loads() {
    let machine = steered();
    let mut model = LeanModel::new(&machine).unwrap();
    let mut lean = |slew: f64| {
        let positions = posture(&machine, slew);
        set_posture(&mut model, &positions);
        [
            model.posture_lean(&up()),
            lean_by_loads(&machine, &positions),
        ]
    };
    let [ahead, by_loads_ahead] = lean(0.0);
    for slew in [-2.4, -1.5, -0.6, 0.7, 1.6, 3.0] {
        let [turned, by_loads] = lean(slew);
        let (change, expected) = (turned - ahead, by_loads - by_loads_ahead);
        assert!(expected.norm() > 2e-4, "{slew}: hardly any lean");
        let off = (change - expected).norm() / expected.norm();
        assert!(off < 0.02, "{slew}: {change} instead of {expected}");
    }
}

/// Balance of tyres that push by `k max(0, p0 + p1 x + p2 y)`, with p0 found by bisection.
#[test]
fn a_platform_that_has_left_a_wheel_leans_on_the_others() {
    let machine = steered();
    let mut model = LeanModel::new(&machine).unwrap();
    set_posture(&mut model, &posture(&machine, 0.8));
    let weight = machine.mass() * machine.gravity();
    let wheels = machine.wheels();
    let mean = |of: &dyn Fn(&Vector3<f64>) -> f64| {
        let all = wheels.iter().map(|wheel| of(&wheel.centre_at_zero));
        all.sum::<f64>() / wheels.len() as f64
    };
    let (x, y) = (mean(&|at| at.x), mean(&|at| at.y));
    let mut footings = Vec::new();
    for share in [0.0, 0.3, 0.6, 0.8, 1.4] {
        // beside the centre of the tyres, across and forwards
        let moment = Vector2::new(y, -x) * weight + Vector2::new(0.8, 1.0) * (share * weight);
        let tilted = model.lean_of(&Vector3::new(weight, -moment.y, moment.x));
        footings.push(tilted.on);
        if tilted.on == Footing::Tips {
            continue;
        }
        let (p1, p2) = (tilted.angle.y, -tilted.angle.x);
        let pushed = |p0: f64| -> Vec<(f64, Vector2<f64>)> {
            let of = |wheel: &crate::machine::Wheel| {
                let at = wheel.centre_at_zero.xy();
                (STIFFNESS * (p0 + p1 * at.x + p2 * at.y).max(0.0), at)
            };
            wheels.iter().map(of).collect()
        };
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            let sum: f64 = pushed(middle).iter().map(|(load, _)| load).sum();
            match sum < weight {
                true => low = middle,
                false => high = middle,
            }
        }
        let balance = pushed(low)
            .iter()
            .fold(Vector2::zeros(), |sum, (load, at)| {
                sum + Vector2::new(at.y, -at.x) * *load
            });
        assert!(
            (balance - moment).norm() < 1e-6 * weight,
            "{share}: {balance} {moment}"
        );
    }
    let [all, fewer, tips] = [Footing::AllWheels, Footing::FewerWheels, Footing::Tips];
    assert_eq!(footings[0], all);
    assert!(footings.contains(&fewer), "{footings:?}");
    assert_eq!(footings[4], tips);
}

/// Limits of the URDF are those of the axle's stops; the zero of its encoder is known to 0.005 rad.
#[test]
fn an_axle_at_its_stop_is_beyond_the_model() {
    let urdf = include_str!("../../../../../tests/data/six_wheels.urdf").replacen(
        "<joint name='bogie_left' type='revolute'>",
        "<joint name='bogie_left' type='revolute'><limit lower='-0.2' upper='0.3' effort='1' velocity='1'/>",
        1,
    );
    let spec = include_str!("../../../../../tests/data/six_wheels.toml");
    let machine = checked(spec, &urdf);
    let [left, right] = ["bogie_left", "bogie_right"].map(|name| joint(&machine, name));
    let mut model = LeanModel::new(&machine).unwrap();
    let mut is_beyond_model = |bogie: usize, angle: f64| {
        let mut positions = posture(&machine, 0.0);
        positions[bogie] = angle;
        set_posture(&mut model, &positions);
        model.lean(0.0, &up()).unwrap().is_beyond_model
    };
    for swings in [-0.15, 0.0, 0.25] {
        assert!(!is_beyond_model(left, swings), "{swings}");
    }
    for stopped in [-0.21, -0.19, 0.299, 0.31] {
        assert!(is_beyond_model(left, stopped), "{stopped}");
        // one whose stops nobody states
        assert!(!is_beyond_model(right, stopped), "{stopped}");
    }
}

#[test]
fn lean_of_a_machine_at_rest_settles_at_that_of_its_posture() {
    let machine = steered();
    let mut model = LeanModel::new(&machine).unwrap();
    set_posture(&mut model, &posture(&machine, 0.4));
    model.lean(0.0, &up()).unwrap();
    set_posture(&mut model, &posture(&machine, 1.4));
    let mut last = Vector2::zeros();
    for _ in 0..300 {
        last = model.lean(0.01, &up()).unwrap().angle;
    }
    let settled = model.posture_lean(&up());
    assert!((last - settled).norm() < 1e-9, "{last} {settled}");
}

/// The derivative of the momentum of an arm whose velocity grows is that of the velocity: the momentum is linear in it.
#[test]
fn reaction_of_an_accelerating_arm_leans_the_platform() {
    let machine = steered();
    let lift = joint(&machine, "lift");
    let positions = posture(&machine, 0.8);
    let per_rate = {
        let mut model = LeanModel::new(&machine).unwrap();
        set_posture(&mut model, &positions);
        let at_rest = model.weigh_bodies().momentum;
        model.set(lift, positions[lift], 1.0);
        model.weigh_bodies().momentum - at_rest
    };
    let acceleration = 0.7;
    let mut model = LeanModel::new(&machine).unwrap();
    set_posture(&mut model, &positions);
    let mut angle = Vector2::zeros();
    for step in 0..200 {
        model.set(lift, positions[lift], acceleration * 0.01 * f64::from(step));
        angle = model.lean(0.01, &up()).unwrap().angle;
    }
    let reaction = angle - model.posture_lean(&up());
    let expected = model.lean_on_all_wheels(&(per_rate * acceleration));
    assert!(expected.norm() > 1e-4);
    let off = (reaction - expected).norm() / expected.norm();
    assert!(off < 0.06, "{reaction} instead of {expected}");
}

/// With a payload for a time on its base and a load that hangs on the tool, and wheels that are not about the origin of the base.
#[test]
fn tyres_carry_what_comes_and_goes_wherever_the_origin_is() {
    let payload = "[[payload]]\nlink = \"base_link\"\nmass = 1500.0\ncom = [-0.1, 0.2, 0.3]\nfrom = 2.0\nto = 9.0\n";
    let machine = rigid_with(
        |file| format!("{file}\n{payload}"),
        |urdf| (urdf.replace("'1.15 ", "'1.65 ")).replace("'-1.15 ", "'-0.65 "),
    );
    let positions = posture(&machine, 1.2);
    let mut model = LeanModel::new(&machine).unwrap();
    set_posture(&mut model, &positions);
    let mut rest = at_rest(&machine, &positions, Scope::LOADS);
    for [share, newton] in [[0.0, 0.0], [1.0, 0.0], [1.0, 4000.0]] {
        rest.state.payload_share = vec![share];
        rest.state.tool_wrench.force = Vector3::new(0.2, 0.1, -1.0) * newton;
        let outcome = evaluate(&rest.machine, &rest.state, &mut rest.workspace);
        let (ground, loads) = (outcome.ground_wrench, outcome.load.clone());
        model.carry(&rest.state);
        let load = model.posture_load(&up());
        let off = load.x / ground.force.z - 1.0;
        assert!(off.abs() < 1e-4, "{load} {ground:?}");
        let mean_load = machine.mass() * machine.gravity() / 4.0;
        let least = loads.into_iter().fold(f64::INFINITY, f64::min);
        let by_model = model.least_load(&load, &Vector2::zeros()) * mean_load;
        assert!(
            (by_model - least).abs() < 0.01 * mean_load,
            "{by_model} {least}"
        );
    }
    model.attach(5.0);
    let with = model.posture_load(&up()).x;
    model.attach(10.0);
    let without = model.posture_load(&up()).x;
    assert!((with - without - 1500.0 * up().z).abs() < 1e-6);
}

#[test]
fn force_on_the_tool_leans_the_platform_in_the_direction_of_a_load() {
    let machine = steered();
    let mut model = LeanModel::new(&machine).unwrap();
    set_posture(&mut model, &posture(&machine, 1.2));
    let without = model.lean(0.0, &up()).unwrap();
    let down = |newton: f64| {
        let mut loaded = LeanModel::new(&machine).unwrap();
        set_posture(&mut loaded, &posture(&machine, 1.2));
        loaded.lean(0.0, &up()).unwrap();
        let tool = machine.tool().unwrap();
        let mount = tool.body_from_mount.rotation.to_rotation_matrix();
        let turned = loaded.motions[tool.body].rotation * mount.matrix();
        let force = turned.transpose() * Vector3::z() * -newton;
        loaded.reset();
        set_posture(&mut loaded, &posture(&machine, 1.2));
        loaded.tool_wrench = [force, Vector3::zeros()];
        loaded.lean(0.0, &up()).unwrap()
    };
    let lean = down(500.0).angle - without.angle;
    assert!(
        lean.normalize().dot(&without.by_load.normalize()) > 0.98,
        "{lean}"
    );
    assert!(!down(500.0).is_beyond_model);
    // So much tips the machine over.
    assert!(down(20_000.0).is_beyond_model);
}

#[test]
fn nothing_is_predicted_while_a_joint_is_unknown() {
    for machine in [steered(), bogies()] {
        let mut model = LeanModel::new(&machine).unwrap();
        let positions = posture(&machine, 0.3);
        for (joint, &position) in positions.iter().enumerate().skip(1) {
            model.set(joint, position, 0.0);
        }
        assert!(model.lean(0.01, &up()).is_none());
        model.set(0, positions[0], 0.0);
        assert!(model.lean(0.01, &up()).is_some());
        // A position that is no number predicts nothing either, and is forgotten with the filters.
        model.set(0, f64::NAN, 0.0);
        assert!(model.lean(0.01, &up()).is_none());
        model.reset();
        set_posture(&mut model, &positions);
        assert!(model.lean(0.01, &up()).is_some());
    }
}

#[test]
fn a_suspension_leans_the_platform_by_the_plane_of_its_wheels() {
    let machine = bogies();
    let mut model = LeanModel::new(&machine).unwrap();
    let left = joint(&machine, "bogie_left");
    let positions = posture(&machine, 0.0);
    set_posture(&mut model, &positions);
    let before = model.posture_lean(&up());
    // A longer rod pushes the left wheels to another height: the platform rolls.
    model.set(left, positions[left] + 0.02, 0.0);
    let change = model.posture_lean(&up()) - before;
    assert!(change.x.abs() > 2e-3, "{change}");
}

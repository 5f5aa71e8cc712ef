//! Measured joint torques determine the load split that equilibrium leaves open.

use crate::support;
use crate::support::{assert_lanes_equal_scalar, bogie_by_rods, moving, set_joint, wheel};
use nalgebra::Vector3;
use proptest::prelude::*;
use tipwatch_mechanics::{
    Contribution, Machine, Outcome, Quantity, Scope, State, Workspace, actuator_force, evaluate,
};

const RODS: [&str; 2] = ["suspension_right", "suspension_left"];

/// The machine on actuated bogies, with forces of both actuators known to this accuracy, if at all.
fn bogie(quality: Option<&str>) -> Machine {
    bogie_by_rods(|text| {
        let Some(quality) = quality else { return text };
        let mut text = text.replace("[contact]", "[contact]\ntraction_share = 0.0");
        for rod in RODS {
            let name = format!("name = \"{rod}\"\n");
            let force =
                format!("{name}force = {{ topic = \"/f\", field = \"{rod}\" }}\n{quality}\n");
            text = text.replacen(&name, &force, 1);
        }
        text
    })
}

/// Accurately known forces.
const SURE: &str = "force_sigma = 30.0\nfriction_share = 0.0";

/// Returns the state at rest on level ground with the cylinders at mid-stroke, where the bogies' pivots are at zero.
fn resting(machine: &Machine, slew: f64, forces: [f64; 2]) -> State<f64> {
    let mut state = State::zero(machine);
    for (name, position) in [
        ("lift", -1.3),
        ("tilt", -1.4),
        ("slew", slew),
        ("extension", 0.4),
        (RODS[0], -0.1),
        (RODS[1], -0.1),
    ] {
        set_joint(machine, &mut state, name, [position, 0.0, 0.0]);
    }
    state.imu.specific_force.z = machine.gravity();
    state
        .actuator_force
        .iter_mut()
        .zip(forces)
        .for_each(|(to, force)| *to = force);
    state
}

fn outcome(machine: &Machine, state: &State<f64>) -> Outcome<f64> {
    let mut workspace = Workspace::with_scope(machine, Scope::ALL);
    evaluate(machine, state, &mut workspace).clone()
}

/// The left force that is consistent with a given right one.
fn agreeing(machine: &Machine, slew: f64, right: f64) -> [f64; 2] {
    let off =
        |left: f64| outcome(machine, &resting(machine, slew, [right, left])).torque_residual[0];
    let (at_none, at_many) = (off(0.0), off(1e4));
    [right, -at_none / (at_many - at_none) * 1e4]
}

#[test]
fn val_forces_and_loads_obey_the_lever_law() {
    let machine = bogie(Some(SURE));
    let mut by_motion: [Option<f64>; 2] = [None; 2];
    for right in [-8e3, -5.5e3, -3e3] {
        let forces = agreeing(&machine, 2.9, right);
        let state = resting(&machine, 2.9, forces);
        let mut workspace = Workspace::new(&machine);
        let out = evaluate(&machine, &state, &mut workspace).clone();
        assert_eq!(out.measured_torques, 2.0);
        // X, the sides L_a, L_b and the angle q of the triangle at rod -0.1: dx/dtheta = L_a L_b |sin q| / X
        let (l_a, l_b, x) = (0.75_f64.hypot(0.02), 0.50_f64.hypot(0.55), 0.586_f64);
        let cos = (x * x - l_a * l_a - l_b * l_b) / (2.0 * l_a * l_b);
        let by_angle = l_a * l_b * (1.0 - cos * cos).sqrt() / x;
        for (joint, [front, rear]) in [["FR", "RR"], ["FL", "RL"]].into_iter().enumerate() {
            let [front, rear] = [front, rear].map(|name| out.load[wheel(&machine, name)]);
            let whole = actuator_force(&machine, &state, &workspace, joint);
            assert!(
                (forces[joint] - whole).abs() < 40.0,
                "{} {whole}",
                forces[joint]
            );
            // The ground turns the bogie through the wheels' lever arms, 1.5 m ahead of and 0.8 m behind the pivot.
            let by_ground = (1.5 * front - 0.8 * rear) / by_angle;
            // The rest moves and supports the bogie, independent of the ground forces.
            let left = forces[joint] - by_ground;
            let first = *by_motion[joint].get_or_insert(left);
            assert!((left - first).abs() < 40.0, "{left} {first}");
            assert!(
                out.torque_residual[joint].abs() < 5.0,
                "{:?}",
                out.torque_residual
            );
        }
    }
}

#[test]
fn torques_change_only_the_diagonal_load_split() {
    let (machine, unbound) = (bogie(Some(SURE)), bogie(None));
    let by_rule = outcome(&unbound, &resting(&unbound, 2.9, [0.0; 2]));
    let mut warps = Vec::new();
    for right in [-8e3, -5.5e3, -3e3] {
        let state = resting(&machine, 2.9, agreeing(&machine, 2.9, right));
        let out = outcome(&machine, &state);
        let of = |out: &Outcome<f64>, names: [&str; 2]| -> f64 {
            names
                .iter()
                .map(|name| out.otf[wheel(&machine, name)])
                .sum()
        };
        for sum in [["FL", "FR"], ["RL", "RR"], ["FL", "RL"], ["FR", "RR"]] {
            // The tyres' deflection depends on the loads, so the plane leans slightly.
            assert!((of(&out, sum) - of(&by_rule, sum)).abs() < 30.0, "{sum:?}");
        }
        let warp = of(&out, ["FL", "RR"]) - of(&by_rule, ["FL", "RR"]);
        warps.push(warp);
        for wheel in 0..4 {
            let (least, largest) = (out.load_least[wheel], out.load_largest[wheel]);
            assert!(least <= out.load[wheel] && out.load[wheel] <= largest);
            let narrow =
                largest - least < 0.02 * (by_rule.load_largest[wheel] - by_rule.load_least[wheel]);
            assert!(narrow, "{least} {largest}");
            let sum: f64 = Contribution::ALL
                .map(|c| out.contributions[wheel][c as usize])
                .iter()
                .filter(|v| v.is_finite())
                .sum();
            assert!(
                (sum - out.load[wheel]).abs() < 1e-6,
                "{sum} {}",
                out.load[wheel]
            );
            let contribution = out.contributions[wheel][Contribution::Warp as usize];
            assert!(
                (contribution.abs() - 0.5 * warp.abs()).abs() < 30.0,
                "{contribution} {warp}"
            );
        }
    }
    assert!((warps[2] - warps[0]).abs() > 2000.0, "{warps:?}");
}

#[test]
fn unknown_forces_do_not_change_loads_vague_ones_little() {
    let unbound = bogie(None);
    let by_rule = outcome(&unbound, &resting(&unbound, 2.4, [0.0; 2]));
    let machine = bogie(Some(SURE));
    let unknown = outcome(&machine, &resting(&machine, 2.4, [f64::NAN; 2]));
    let vague = bogie(Some("force_sigma = 1e9"));
    let vague = outcome(&vague, &resting(&vague, 2.4, [2e4, 5e3]));
    assert_eq!(
        (unknown.measured_torques, vague.measured_torques),
        (0.0, 2.0)
    );
    for &quantity in &Quantity::all(&unbound, Scope::ALL) {
        let (a, b) = (by_rule.get(quantity), unknown.get(quantity));
        let same = match quantity {
            // Zeros are added to the terms of the derivatives.
            Quantity::LoadSigma(_) | Quantity::OtfSigma(_) | Quantity::Utilisation => {
                (a - b).abs() < 1e-9 * b.abs() || (a.is_nan() && b.is_nan())
            }
            _ => a == b || (a.is_nan() && b.is_nan()),
        };
        assert!(same, "{quantity:?}: {a} {b}");
    }
    for wheel in 0..4 {
        assert!((vague.load[wheel] - by_rule.load[wheel]).abs() < 1e-3 * by_rule.normal_force);
        assert!(
            unknown
                .torque_residual
                .iter()
                .all(|residual| residual.is_nan())
        );
    }
}

/// An error of half the weight in the other side's force appears in the residuals.
#[test]
fn contradicting_forces_appear_in_residuals() {
    let machine = bogie(Some(SURE));
    let [right, left] = agreeing(&machine, 2.9, -5e3);
    let out = outcome(&machine, &resting(&machine, 2.9, [right, left + 4000.0]));
    assert!(
        out.torque_residual
            .iter()
            .all(|residual| residual.abs() > 400.0),
        "{:?}",
        out.torque_residual
    );
}

proptest! {
    #![proptest_config(support::cases(60))]

    #[test]
    fn lanes_equal_scalar(
        seeds in prop::array::uniform5(0.0..50.0_f64),
        forces in prop::array::uniform10(prop_oneof![3 => -1e4..4e4_f64, 1 => Just(f64::NAN), 1 => Just(1e300)]),
    ) {
        let machine = bogie(Some("force_sigma = 300.0"));
        let measured = Vector3::new(1.5, -1.0, 9.7);
        let mut states: Vec<_> = seeds.iter().map(|&s| moving(&machine, s, measured, Vector3::new(0.1, 0.05, 0.2))).collect();
        for (row, state) in states.iter_mut().enumerate() {
            for (k, name) in RODS.into_iter().enumerate() {
                set_joint(&machine, state, name, [-0.1 + 0.05 * seeds[row].sin(), 0.02, -0.1]);
                state.actuator_force[k] = forces[2 * row + k];
            }
        }
        let scope = Scope { parts: true, ..Scope::ALL };
        let model = std::sync::Arc::new(tipwatch_mechanics::Model::WholeBody);
        assert_lanes_equal_scalar(&machine, &mut states, scope, &model);
    }
}

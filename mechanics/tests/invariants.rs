//! Physical invariants of every result.

use crate::support;
use crate::support::{edited, machine, moving, set_joint, six_wheels, upright, wheel};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use tipwatch_mechanics::machine::{LogFacts, MachineSpec};
use tipwatch_mechanics::{
    Contribution, Machine, Outcome, Scope, State, Workspace, evaluate, static_outcome,
};

fn outcome(machine: &Machine, state: &State<f64>) -> Outcome<f64> {
    let mut workspace = Workspace::new(machine);
    evaluate(machine, state, &mut workspace).clone()
}

fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-range..range).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(support::cases(300))]

    #[test]
    fn loads_are_non_negative_and_sum_to_normal_force(
        seed in 0.0..100.0_f64, tilt in vector(7.0), spin in vector(0.5)
    ) {
        for machine in [machine("rigid"), six_wheels(|text| text)] {
            let force = upright(&machine, Vector3::new(tilt.x, tilt.y, 9.8));
            let found = outcome(&machine, &moving(&machine, seed, force, spin));
            let sum: f64 = found.load.iter().sum();
            prop_assert!((sum - found.normal_force).abs() < 1e-6 * found.normal_force, "{found:?}");
            prop_assert!(found.load.iter().all(|&load| load >= 0.0));
            let signed: f64 = found.otf.iter().sum();
            prop_assert!((signed - found.normal_force).abs() < 1e-6 * found.normal_force);
        }
    }

    #[test]
    fn itom_and_zmp_follow_from_signed_loads(seed in 0.0..100.0_f64, tilt in vector(6.0), spin in vector(0.5)) {
        let machine = edited("rigid", |text| text.replace("tyre_stiffness = 8.0e5\n", "")).unwrap();
        let found = outcome(&machine, &moving(&machine, seed, Vector3::new(tilt.x, tilt.y, 9.8), spin));
        let [fl, fr, rl, rr] = ["FL", "FR", "RL", "RR"].map(|name| found.otf[wheel(&machine, name)]);
        let (length, width) = (2.3, 1.75);
        let expected = [-length * (rr + rl), -width * (fr + rr), -length * (fl + fr), -width * (fl + rl)];
        for ((found, expected), name) in found.itom_full.iter().zip(expected).zip(["front", "left", "rear", "right"]) {
            prop_assert!((found - expected).abs() < 1e-6 * 35_000.0, "{name}: {found} {expected}");
        }
        let margin = found.itom_full.iter().map(|m| -m / found.normal_force).fold(f64::INFINITY, f64::min);
        prop_assert!((found.zmp_margin - margin).abs() < 1e-9);
        let tips = found.itom_full.iter().any(|&m| m > 0.0);
        prop_assert_eq!(tips, found.zmp_margin < 0.0);
    }

    #[test]
    fn loads_lie_in_envelope_independent_of_split_rule(
        seed in 0.0..100.0_f64, tilt in vector(4.0), share in 0.0..1.0_f64
    ) {
        let split = |share: f64| edited("rigid", |text| {
            text.replace("tyre_stiffness = 8.0e5\n", "").replace("roll_moment_distribution = 0.5", &format!("roll_moment_distribution = {share}"))
        }).unwrap();
        let machines = [split(share), split(0.5)];
        let state = moving(&machines[0], seed, Vector3::new(tilt.x, tilt.y, 9.8), Vector3::zeros());
        let [one, half] = [outcome(&machines[0], &state), outcome(&machines[1], &state)];
        for wheel in 0..4 {
            let slack = 1e-6 * one.normal_force;
            prop_assert!(one.load[wheel] > one.load_least[wheel] - slack && one.load[wheel] < one.load_largest[wheel] + slack);
            prop_assert!((one.load_least[wheel] - half.load_least[wheel]).abs() < slack);
            prop_assert!((one.load_largest[wheel] - half.load_largest[wheel]).abs() < slack);
        }
    }

    #[test]
    fn loads_do_not_depend_on_base_frame(seed in 0.0..100.0_f64, tilt in vector(5.0), spin in vector(0.5)) {
        // The same machine with the base frame at its rear axle, rigidly connected to the original base link.
        let moved_urdf = support::data("rigid.urdf").replace("base_link", "chassis").replace(
            "<robot name='hdmm_rigid'>",
            "<robot name='moved'><link name='base_link'/><joint name='moved' type='fixed'><parent link='base_link'/>\
             <child link='chassis'/><origin xyz='1.15 0 0.1' rpy='0 0 0'/></joint>",
        );
        let file = support::data("rigid.toml").replace("link = \"base_link\"", "link = \"chassis\"");
        let spec = MachineSpec::from_toml(&file, "moved.toml").unwrap();
        let moved = spec.check(&moved_urdf, "moved.urdf", LogFacts::default()).unwrap();
        let original = machine("rigid");
        let state = |machine: &Machine| moving(machine, seed, Vector3::new(tilt.x, tilt.y, 9.8), spin);
        let (a, b) = (outcome(&original, &state(&original)), outcome(&moved, &state(&moved)));
        for (a, b) in a.load.iter().zip(&b.load) {
            prop_assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        prop_assert!((a.zmp_x + 1.15 - b.zmp_x).abs() < 1e-2, "{} {}", a.zmp_x, b.zmp_x);
    }
}

#[test]
fn imu_on_slewing_arm_equals_imu_on_chassis() {
    let chassis = machine("rigid");
    let on_arm = edited("rigid", |text| {
        text.replace(
            "link = \"base_link\"\nxyz = [0.1, 0, 0.05]",
            "link = \"arm_slew\"\nxyz = [0.7, 0, 0.3]",
        )
    })
    .unwrap();
    let (rate, acceleration, angle) = (0.6, 0.4, 0.8);
    let pose = |machine: &Machine| {
        let mut state = State::zero(machine);
        set_joint(machine, &mut state, "slew", [angle, rate, acceleration]);
        set_joint(machine, &mut state, "lift", [-1.3, 0.0, 0.0]);
        set_joint(machine, &mut state, "tilt", [-1.4, 0.0, 0.0]);
        state
    };
    let gravity = Vector3::z() * chassis.gravity();
    let mut still = pose(&chassis);
    still.imu.specific_force = gravity;
    let mut turning = pose(&on_arm);
    turning.imu.specific_force =
        gravity + Vector3::new(-rate * rate * 0.7, acceleration * 0.7, 0.0);
    turning.imu.angular_velocity = Vector3::z() * rate;
    turning.imu.angular_acceleration = Vector3::z() * acceleration;
    for (a, b) in outcome(&chassis, &still)
        .load
        .iter()
        .zip(&outcome(&on_arm, &turning).load)
    {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn free_bogies_load_their_wheels_equally_at_rest() {
    let machine = six_wheels(|text| text);
    let positions = vec![0.0; machine.joints().len()];
    let load = static_outcome(&machine, &positions).load;
    for side in ["L", "R"] {
        let (middle, rear) = (
            load[wheel(&machine, &format!("{side}2"))],
            load[wheel(&machine, &format!("{side}3"))],
        );
        assert!(
            (middle - rear).abs() < 1e-2 * middle,
            "{side}: {middle} {rear}"
        );
    }
    assert!(
        (load.iter().sum::<f64>() - machine.mass() * machine.gravity()).abs()
            < 1e-6 * machine.mass() * machine.gravity()
    );
}

#[test]
fn machine_on_its_side_has_no_loads() {
    let machine = machine("rigid");
    let mut state = moving(
        &machine,
        1.0,
        Vector3::new(0.0, 0.0, -3.0),
        Vector3::zeros(),
    );
    let found = outcome(&machine, &state);
    assert!(
        found.normal_force < 0.0
            && found.load.iter().all(|&load| load == 0.0)
            && found.zmp_x.is_nan()
    );
    state.imu.specific_force.x = f64::NAN;
    assert!(
        outcome(&machine, &state)
            .load
            .iter()
            .all(|load| load.is_nan())
    );
}

#[test]
fn tipping_puts_all_load_on_the_tipping_edge() {
    let machine = machine("rigid");
    let tilted = Rotation3::from_euler_angles(-60.0_f64.to_radians(), 0.0, 0.0)
        * Vector3::z()
        * machine.gravity();
    let mut state = moving(&machine, 0.0, tilted, Vector3::zeros());
    state
        .joints
        .iter_mut()
        .for_each(|joint| (joint.rate, joint.acceleration) = (0.0, 0.0));
    let found = outcome(&machine, &state);
    let sides: Vec<(f64, f64)> = ["F", "R"]
        .iter()
        .map(|end| {
            (
                found.load[wheel(&machine, &format!("{end}L"))],
                found.load[wheel(&machine, &format!("{end}R"))],
            )
        })
        .collect();
    assert!(
        sides
            .iter()
            .all(|(left, right)| (*left == 0.0) != (*right == 0.0)),
        "{found:?}"
    );
    assert!(
        (found.load.iter().sum::<f64>() - found.normal_force).abs() < 1e-6 * found.normal_force
    );
}

/// A machine with three wheels: the rear right one removed.
fn three_wheels() -> Machine {
    let off = |text: String| {
        let at = text.find("[wheels.RR]").unwrap();
        let end = at + text[at..].find("[arm]").unwrap();
        format!("{}{}", &text[..at], &text[end..]).replace("roll_moment_distribution = 0.5", "")
    };
    edited("rigid", off).unwrap()
}

proptest! {
    #![proptest_config(support::cases(200))]

    /// At rest, Force-Angle, stability angle, overturning moments and centre of pressure agree on the stability of
    /// the machine, on any polygon, with and without a lifted wheel.
    #[test]
    fn stability_measures_agree_at_rest_on_any_polygon(
        slew in -3.1..3.1_f64, lift in -1.6..-0.9_f64, tilt in -1.6..-0.6_f64, lean in vector(0.35)
    ) {
        for machine in [machine("rigid"), three_wheels(), six_wheels(|text| text)] {
            let mut state = State::zero(&machine);
            set_joint(&machine, &mut state, "slew", [slew, 0.0, 0.0]);
            set_joint(&machine, &mut state, "lift", [lift, 0.0, 0.0]);
            set_joint(&machine, &mut state, "tilt", [tilt, 0.0, 0.0]);
            let up = Vector3::new(lean.x, lean.y, 1.0).normalize();
            state.base.up = up;
            state.base.velocity = Vector3::zeros();
            state.imu.specific_force = upright(&machine, up * machine.gravity());
            let mut workspace = Workspace::with_scope(&machine, Scope::ALL);
            let found = evaluate(&machine, &state, &mut workspace);
            let it = &found.indicators;
            for edge in 0..machine.polygon().edges().len() {
                let (force, still) = (it.force_angle[edge], it.stability_angle[edge]);
                prop_assert!((force - still).abs() < 1e-9, "{force} {still}");
                prop_assert_eq!(force > 0.0, found.itom_full[edge] < 0.0);
            }
            let worst = found.itom_full.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!((worst + found.normal_force * found.zmp_margin).abs() < 1e-6 * found.normal_force);
            prop_assert!(it.load_transfer_ratio.abs() <= 1.0 + 1e-9 && it.spread >= 0.0);
            // At rest there are no contributions except weights, slope and lift-off.
            for contributions in &found.contributions {
                for cause in [Contribution::ArmMotion, Contribution::PlatformAcceleration, Contribution::Cornering, Contribution::ToolForce] {
                    prop_assert!(contributions[cause as usize].abs() < 1e-6 * found.normal_force);
                }
            }
        }
    }
}

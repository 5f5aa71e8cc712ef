//! Validation: reference values of the analytic model from two independent computations (g = 9.8066).

use crate::support;
use crate::support::attitude::Attitude;
use crate::support::closed_form::{
    ITOM_WITH_WHEELS, assert_all_close, assert_close, measured_terms, table_1, wrench,
};
use crate::support::velocity_gradient::{LoadGradient, sigma_gradient};
use nalgebra::Vector3;
use tipwatch_mechanics::Wrench;
use tipwatch_mechanics::closed_form::{
    Counted, DemandContributions, EdgeMoments, MeasuredMotion, PlanarMotion, Platform,
    PlatformParts,
};
use tipwatch_mechanics::wheel_loads::sigma;

/// Precision of the reference values as written.
const ROUNDED: f64 = 6e-7;

fn at_rest(arm: &Wrench<f64>) -> (Platform<f64>, DemandContributions<f64>) {
    let platform = table_1(0.0, 0.0);
    let contributions =
        DemandContributions::of_motion(&platform, &Vector3::z(), &PlanarMotion::zero(), arm);
    (platform, contributions)
}

fn moments(
    contributions: &DemandContributions<f64>,
    platform: &Platform<f64>,
    counted: Counted,
) -> [f64; 4] {
    let EdgeMoments {
        front,
        left,
        rear,
        right,
    } = contributions.edge_moments(platform, counted);
    [front, rear, left, right]
}

#[test]
fn val_example_0_all_wheels_carry_the_same() {
    let (platform, contributions) = at_rest(&Wrench::zero());
    assert_all_close(contributions.terms(&platform).loads(), [5982.026; 4], 1e-6);
}

#[test]
fn val_example_s_arm_at_rest() {
    let arm = wrench([0.0, 0.0, -10423.7773, -12091.1179, 12030.5718, 0.0]);
    let (platform, contributions) = at_rest(&arm);
    let b = contributions.sum();
    assert_all_close([b.b1, b.b2, b.b3], [12091.118, -17242.460, 34351.881], 1e-3);
    let terms = contributions.terms(&platform);
    let loads = [15790.936, 8881.726, 1385.004, 8294.214];
    assert_all_close(terms.loads(), loads, 1e-3);
    let [fl, fr, rr, rl] = terms.wheel;
    assert_all_close([fl[0], fr[0], rr[0], rl[0]], [5982.026; 4], 1e-3);
    let of_weight = [3738.964, 3738.964, 1472.925, 1472.925];
    assert_all_close([fl[3], fr[3], rr[3], rl[3]], of_weight, 1e-3);
    let of_m_x = [3454.605, -3454.605, -3454.605, 3454.605];
    assert_all_close([fl[4], fr[4], rr[4], rl[4]], of_m_x, 1e-3);
    let of_m_y = [2615.342, 2615.342, -2615.342, -2615.342];
    assert_all_close([fl[5], fr[5], rr[5], rl[5]], of_m_y, 1e-3);
}

#[test]
fn val_example_s_moments() {
    let arm = wrench([0.0, 0.0, -10423.7773, -12091.1179, 12030.5718, 0.0]);
    let (platform, contributions) = at_rest(&arm);
    let of = |counted| moments(&contributions, &platform, counted);
    let mhs = [5255.12, -29229.80, 2970.31, -21211.92];
    let tom = [-19555.58, -54040.50, -15907.39, -40089.63];
    let with_wheels = [-22262.20, -56747.12, -17966.78, -42149.01];
    assert_all_close(of(Counted::MHS), mhs, 1e-2);
    assert_all_close(of(Counted::TOM), tom, 1e-2);
    assert_all_close(of(Counted::ITOM), tom, 1e-2);
    assert_all_close(of(ITOM_WITH_WHEELS), with_wheels, 1e-2);
    let largest = contributions
        .edge_moments(&platform, Counted::TOM)
        .largest();
    assert_close(largest, -15907.39, 1e-2);
}

#[test]
fn val_moving_arm() {
    let samples = [
        (
            [240.370, 240.370, -10958.153, -13207.028, 13140.383, -2.590],
            [16627.36, 8984.34, 815.77, 8458.79],
        ),
        (
            [456.845, 456.845, -8948.825, -11141.029, 11096.684, -5.374],
            [14948.29, 8399.25, 1490.17, 8039.21],
        ),
        (
            [-693.13, -693.13, -11076.08, -12133.14, 12065.12, 7.77],
            [15800.33, 9144.36, 1701.77, 8357.73],
        ),
    ];
    for (arm, loads) in samples {
        let (platform, contributions) = at_rest(&wrench(arm));
        assert_all_close(contributions.terms(&platform).loads(), loads, 2e-2);
    }
}

/// Example R, in which no term is zero.
fn example_r() -> (Platform<f64>, Vector3<f64>, PlanarMotion<f64>, Wrench<f64>) {
    let attitude = Attitude {
        theta: -8.0_f64.to_radians(),
        phi: 5.0_f64.to_radians(),
        psi: 30.0_f64.to_radians(),
    };
    let motion = PlanarMotion {
        v_x: 1.2,
        v_y: 0.1,
        vdot_x: -0.8,
        vdot_y: 0.3,
        yaw_rate: 0.4,
        yaw_acceleration: 0.25,
    };
    let arm = wrench([500.0, -300.0, -10000.0, -900.0, 7000.0, 250.0]);
    (table_1(15.0, -8.0), attitude.up(), motion, arm)
}

const EXAMPLE_R_TERMS: [[f64; 11]; 4] = [
    [
        5510.976849,
        76.086957,
        -60.0,
        3586.956522,
        257.142857,
        1521.739130,
        172.173913,
        -84.857143,
        -127.162733,
        -0.156025,
        1.506211,
    ],
    [
        5542.019894,
        76.086957,
        60.0,
        3586.956522,
        -257.142857,
        1521.739130,
        172.173913,
        84.857143,
        144.380124,
        -0.887453,
        -0.636646,
    ],
    [
        6291.558053,
        -76.086957,
        60.0,
        1413.043478,
        -257.142857,
        -1521.739130,
        -172.173913,
        84.857143,
        127.162733,
        0.156025,
        -1.506211,
    ],
    [
        6260.515009,
        -76.086957,
        -60.0,
        1413.043478,
        257.142857,
        -1521.739130,
        -172.173913,
        -84.857143,
        -144.380124,
        0.887453,
        0.636646,
    ],
];

const EXAMPLE_R_LOADS: [f64; 4] = [10854.406539, 10929.546726, 5948.128364, 5872.988176];

#[test]
fn val_example_r_every_term_of_every_wheel() {
    let (platform, up, motion, arm) = example_r();
    assert_all_close([up.x, up.y, up.z], [0.1637, 0.0052, 0.9865], 1e-4);
    let contributions = DemandContributions::of_motion(&platform, &up, &motion, &arm);
    let b = contributions.sum();
    let expected = [-131.495328, -11457.262233, 33605.069805];
    assert_all_close([b.b1, b.b2, b.b3], expected, ROUNDED);
    let terms = contributions.terms(&platform);
    for (found, expected) in terms.wheel.into_iter().zip(EXAMPLE_R_TERMS) {
        assert_all_close(found, expected, ROUNDED);
    }
    assert_all_close(terms.loads(), EXAMPLE_R_LOADS, ROUNDED);
}

#[test]
fn val_example_r_other_roll_moment_distributions() {
    let (platform, up, motion, arm) = example_r();
    let loads = |roll_moment_distribution| {
        let platform = Platform {
            roll_moment_distribution,
            ..platform
        };
        let contributions = DemandContributions::of_motion(&platform, &up, &motion, &arm);
        contributions.terms(&platform).loads()
    };
    let less = [10861.9206, 10922.0327, 5955.6424, 5865.4742];
    let more = [10846.8925, 10937.0607, 5940.6143, 5880.5022];
    assert_all_close(loads(0.4), less, 6e-5);
    assert_all_close(loads(0.6), more, 6e-5);
}

#[test]
fn val_example_r_moments() {
    let (platform, up, motion, arm) = example_r();
    let contributions = DemandContributions::of_motion(&platform, &up, &motion, &arm);
    let of = |counted| moments(&contributions, &platform, counted);
    let mhs = [850.0, -23850.0, -8060.0, -9440.0];
    let tom = [-25214.853, -46736.644, -26732.929, -28012.776];
    let itom = [-24383.653, -47567.844, -27500.099, -27245.606];
    let with_wheels = [-27188.568, -50103.093, -29535.931, -29272.941];
    assert_all_close(of(Counted::MHS), mhs, 1e-6);
    assert_all_close(of(Counted::TOM), tom, 6e-4);
    assert_all_close(of(Counted::ITOM), itom, 6e-4);
    assert_all_close(of(ITOM_WITH_WHEELS), with_wheels, 6e-4);
}

#[test]
fn val_example_r_sigma_and_its_gradient() {
    let (platform, up, motion, arm) = example_r();
    let loads = DemandContributions::of_motion(&platform, &up, &motion, &arm)
        .terms(&platform)
        .loads();
    let optimal = [8000.0, 8000.0, 6000.0, 6000.0];
    let found = sigma(loads.into_iter(), optimal.into_iter());
    assert_close(found, 8_374_351.69, 6e-3);
    let gradient = LoadGradient::of(&platform, &motion).by_velocity;
    let found = sigma_gradient(&loads, &optimal, &gradient);
    assert_all_close(found, [17003.151, 513322.466, 163510.045], 6e-4);
}

#[test]
fn val_example_r_with_accelerometer_input() {
    let (platform, up, motion, arm) = example_r();
    let acceleration = motion.acceleration();
    let measured = MeasuredMotion {
        specific_force: acceleration.push(0.0) + up * platform.gravity,
        yaw_rate: motion.yaw_rate,
        yaw_acceleration: motion.yaw_acceleration,
    };
    let contributions = DemandContributions::of_measured(&platform, &up, &measured, &arm);
    let terms = measured_terms(&contributions, &platform);
    let loads = terms.map(|terms| terms.into_iter().sum());
    assert_all_close(loads, EXAMPLE_R_LOADS, ROUNDED);
    for (found, all) in terms.into_iter().zip(EXAMPLE_R_TERMS) {
        // Weight and acceleration of C are separated differently; their sum is the same.
        let merged = all[0] + all[6] + all[7] + all[8];
        assert_close(found[0] + found[6], merged, 4.0 * ROUNDED);
        assert_all_close([found[7], found[8]], [all[9], all[10]], ROUNDED);
    }
}

#[test]
fn val_table_1_from_the_machine_file() {
    let machine = support::machine("petrovic_mattila");
    let positions: Vec<f64> = machine.joints().iter().map(in_reach).collect();
    let found = Platform::of(&machine, &positions).unwrap();
    let expected = table_1(12.0, 6.0);
    let numbers = |p: &Platform<f64>| {
        [
            p.gravity,
            p.mass,
            p.com_height,
            p.to_rear,
            p.to_front,
            p.half_track_left,
            p.half_track_right,
            p.wheel_mass,
            p.wheel_moment.x,
            p.wheel_moment.y,
            p.wheel_moment.z,
            p.inertia_xz,
            p.inertia_yz,
            p.roll_moment_distribution,
            p.arm_base.x,
            p.arm_base.y,
            p.arm_base.z,
        ]
    };
    assert_all_close(numbers(&found), numbers(&expected), 1e-9);
    let parts = PlatformParts::of(&machine).unwrap();
    let names = parts.wheels().map(|w| machine.wheels()[w].name.clone());
    assert_eq!(names, ["FL", "FR", "RR", "RL"]);
}

/// Positions at which the arm's triangles close.
fn in_reach(joint: &tipwatch_mechanics::machine::MeasuredJoint) -> f64 {
    match joint.name.as_str() {
        "lift" => -1.3,
        "tilt" => -1.4,
        _ => 0.0,
    }
}

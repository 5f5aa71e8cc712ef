//! The first paper's platform, for the tests of the analytic model.

use nalgebra::Vector3;
use tipwatch_mechanics::closed_form::{
    Counted, Demand, DemandContributions, PlanarMotion, Platform,
};
use tipwatch_mechanics::{Real, Wrench};

/// Table 1, with these products of the inertia tensor.
pub(crate) fn table_1(inertia_xz: f64, inertia_yz: f64) -> Platform<f64> {
    let platform = Platform {
        gravity: 9.8066,
        mass: 2200.0,
        com_height: 0.45,
        to_rear: 1.15,
        to_front: 1.15,
        half_track_left: 0.875,
        half_track_right: 0.875,
        inertia_xz,
        inertia_yz,
        roll_moment_distribution: 0.5,
        arm_base: Vector3::new(0.5, 0.0, 0.25),
        ..Platform::zero()
    };
    with_equal_wheels(platform, 60.0, 0.35)
}

/// The platform on the four equal wheels of the paper's assumption 6, of this mass m_w (kg) and radius R_w (m).
fn with_equal_wheels(platform: Platform<f64>, mass: f64, radius: f64) -> Platform<f64> {
    Platform {
        wheel_mass: 4.0 * mass,
        wheel_moment: Vector3::new(
            2.0 * mass * (platform.to_front - platform.to_rear),
            2.0 * mass * (platform.half_track_left - platform.half_track_right),
            4.0 * mass * radius,
        ),
        ..platform
    }
}

/// A platform from numbers in -1..1.
pub(crate) fn platform(u: &[f64]) -> Platform<f64> {
    let platform = Platform {
        gravity: 9.81,
        mass: 3000.0 + 2000.0 * u[2],
        com_height: 0.8 + 0.4 * u[3],
        to_rear: 1.4 + 0.6 * u[4],
        to_front: 1.4 + 0.6 * u[5],
        half_track_left: 0.9 + 0.3 * u[6],
        half_track_right: 0.9 + 0.3 * u[7],
        inertia_xz: 100.0 * u[8],
        inertia_yz: 100.0 * u[9],
        roll_moment_distribution: 0.5 + 0.5 * u[10],
        arm_base: Vector3::new(u[11], 0.5 * u[12], 0.5 * u[13]),
        ..Platform::zero()
    };
    with_equal_wheels(platform, 80.0 + 40.0 * u[0], 0.5 + 0.2 * u[1])
}

/// A motion from numbers in -1..1.
pub(crate) fn motion(u: &[f64]) -> PlanarMotion<f64> {
    PlanarMotion {
        v_x: 4.0 * u[0],
        v_y: u[1],
        vdot_x: 3.0 * u[2],
        vdot_y: u[3],
        yaw_rate: u[4],
        yaw_acceleration: u[5],
    }
}

/// B_M F = (f_x, f_y, f_z, m_x, m_y, m_z)
pub(crate) fn wrench(f: [f64; 6]) -> Wrench<f64> {
    Wrench {
        force: Vector3::new(f[0], f[1], f[2]),
        moment: Vector3::new(f[3], f[4], f[5]),
    }
}

/// ITOM with the weight of the wheels: zero where the two wheels off the edge carry no load.
pub(crate) const ITOM_WITH_WHEELS: Counted = Counted {
    wheel_weights: true,
    ..Counted::ITOM
};

/// The terms of each wheel that an accelerometer can separate (N): wheel weights, a part of zeta_1; zeta_2 to zeta_6; chassis
/// weight and acceleration, the rest of zeta_1 with zeta_7 to zeta_9; zeta_10; zeta_11. Those of a motion given by velocities
/// are merged in the same way.
pub(crate) fn measured_terms<T: Real>(
    contributions: &DemandContributions<T>,
    platform: &Platform<T>,
) -> [[T; 9]; 4] {
    let acceleration = Demand::sum(&contributions.acceleration);
    let chassis = contributions.chassis_weight.plus(&acceleration);
    let [f_x, f_y, f_z, m_x, m_y] = contributions.arm;
    let [rate, turning] = contributions.yaw;
    let wheels = contributions.wheel_weights;
    let demands = [wheels, f_x, f_y, f_z, m_x, m_y, chassis, rate, turning];
    let loads = demands.map(|demand| demand.loads(platform));
    std::array::from_fn(|wheel| loads.map(|loads| loads[wheel]))
}

pub(crate) fn assert_close(found: f64, expected: f64, allowed: f64) {
    let error = (found - expected).abs();
    assert!(error <= allowed, "{found}, expected {expected}");
}

pub(crate) fn assert_all_close<const N: usize>(found: [f64; N], expected: [f64; N], allowed: f64) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert_close(found, expected, allowed);
    }
}
